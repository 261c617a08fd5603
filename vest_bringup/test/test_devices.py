#!/usr/bin/python3
"""Protects what clients see of haptic devices: topics and states as CRTK names them, tf, /diagnostics, for a PHANToM on the stand-in
of libHD and an Impulse Engine on the emulator of its wire; and the one message where library, device or right is missing."""
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from sensor_msgs.msg import JointState, Joy
from tf2_msgs.msg import TFMessage
from vest_msgs.msg import HapticState, OperatingState, StringStamped

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import end, patient  # noqa: E402

AXES = ["_yaw", "_pitch", "_insertion", "_roll"]


class Heard:
    """All messages of one topic, and who sends them under which name and type."""

    def __init__(self, topic, kind):
        self.messages = []
        self.topic = topic
        self.subscriber = rospy.Subscriber(topic, kind, self.messages.append, queue_size=1000)

    def come(self, count=100):
        return patient(lambda: len(self.messages) >= count)

    def last(self):
        return self.messages[-1] if self.messages else None


class Devices(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_devices", anonymous=True)
        cls.folder = tempfile.mkdtemp(prefix="vest_devices_")
        port = os.path.join(cls.folder, "engine")
        cls.emulator = subprocess.Popen(["rosrun", "vest_haptics", "impulse_engine_emulator", "--link", port, "--force-link", port + "_force"])
        assert patient(lambda: os.path.exists(port + "_force")), "the emulator does not start"
        cls.heard = {}
        for side in ("left", "right"):
            for name, kind in (("measured_cp", PoseStamped), ("measured_cv", TwistStamped), ("measured_cf", WrenchStamped),
                               ("measured_js", JointState), ("jaw/measured_js", JointState), ("buttons", Joy), ("state", HapticState),
                               ("operating_state", OperatingState)):
                cls.heard[side, name] = Heard(f"/vest/haptics/{side}/{name}", kind)
        cls.heard["tf"] = Heard("/tf", TFMessage)
        cls.heard["diagnostics"] = Heard("/diagnostics", DiagnosticArray)
        cls.session = subprocess.Popen(
            ["roslaunch", "vest_bringup", "trainer.launch", "rviz:=false", "record:=false", "scene:=tube",
             "port:=" + os.path.join(cls.folder, "box"), "left:=phantom", "left_options:={library: libvest_fake_hd.so}",
             "right:=impulse_engine", f"right_options:={{port: {port}, force: emulator, force_port: {port}_force}}"])

    @classmethod
    def tearDownClass(cls):
        end(cls.session)
        end(cls.emulator)
        shutil.rmtree(cls.folder, ignore_errors=True)

    def state(self, side):
        last = self.heard[side, "operating_state"].last()
        return last.state if last else None

    def test_1_poses_speeds_forces_and_switches_come_in_the_frame_of_the_box(self):
        for side in ("left", "right"):
            for name in ("measured_cp", "measured_cv", "measured_cf", "state", "buttons"):
                self.assertTrue(self.heard[side, name].come(), side + name)
            for name in ("measured_cp", "measured_cv", "measured_cf"):
                self.assertEqual(self.heard[side, name].last().header.frame_id, "phantom_box")
                self.assertTrue(patient(lambda s=side, n=name: not self.heard[s, n].last().header.stamp.is_zero()), "valid data have a stamp")
        state = self.heard["right", "state"].last()
        self.assertEqual(state.instrument, "right")
        self.assertIn("VEST LIE EMULATOR", state.device)

    def test_2_joints_are_those_of_a_five_axis_device_and_of_no_other(self):
        self.assertTrue(self.heard["right", "measured_js"].come())
        self.assertTrue(self.heard["right", "jaw/measured_js"].come())
        self.assertEqual(self.heard["right", "measured_js"].last().name, ["right" + a for a in AXES])
        self.assertEqual(self.heard["right", "jaw/measured_js"].last().name, ["right_jaw"])
        topics = {name for name, _ in rospy.get_published_topics("/vest/haptics")}
        self.assertNotIn("/vest/haptics/left/measured_js", topics, "a point has no joints: not advertised")
        self.assertNotIn("/vest/haptics/left/jaw/measured_js", topics)

    def test_3_tf_moves_the_instrument_with_the_device(self):
        def told():
            return [m.position[2] for m in list(self.heard["right", "measured_js"].messages)]

        def insertions():
            return [t.transform.translation.z for m in list(self.heard["tf"].messages) for t in m.transforms
                    if t.child_frame_id == "right_insertion"]

        # The emulated hand goes in and out by 20 mm.
        self.assertTrue(self.heard["right", "measured_js"].come())
        self.assertTrue(patient(lambda: len(insertions()) > 200 and max(insertions()[-200:]) - min(insertions()[-200:]) > 0.015))
        # Before the device's first message the instrument stood where it was drawn: what comes from now on is judged.
        before = len(insertions())
        self.assertTrue(patient(lambda: len(insertions()) > before + 200))
        moved = insertions()[before:]
        # A busy machine delays and loses messages, so no share of them has to agree. The device's encoder counts twentieths of a
        # millimetre: nothing else moves in such steps.
        step = 5e-5
        for z in [*moved, *told()]:
            self.assertAlmostEqual(z, round(z / step) * step, delta=1e-6, msg="a place of the device's encoder")

        def missing():
            counts = {round(z / step) for z in told()}
            return [z for z in moved if not {round(z / step) + k for k in (-1, 0, 1)} & counts]

        self.assertTrue(patient(lambda: not missing()), f"tf was where the device never was: {missing()}")
        children = {t.child_frame_id for m in list(self.heard["tf"].messages) for t in m.transforms}
        self.assertTrue({"left_tip", "right_tip"} <= children or {"left_roll", "right_roll"} <= children, children)

    def test_4_diagnostics_name_each_device_once_a_second(self):
        def statuses(side):
            return [s for m in list(self.heard["diagnostics"].messages) for s in m.status if s.name == "vest_haptics: " + side]

        for side, hardware in (("left", "fake"), ("right", "VEST LIE EMULATOR")):
            self.assertTrue(patient(lambda s=side: len(statuses(s)) >= 3), side)
            last = statuses(side)[-1]
            self.assertIn(hardware.lower(), last.hardware_id.lower())
            values = {v.key: v.value for v in last.values}
            for key in ("status", "tick rate [Hz]", "late ticks", "real-time priority", "force shown [N]", "age of contact model [s]",
                        "energy [J]", "watchdog of the device [s]"):
                self.assertIn(key, values)
            # A stand-in's thread that a busy machine keeps waiting for 20 ms is unplugged at that moment.
            self.assertTrue(patient(lambda s=side: any(v.key == "status" and v.value == "ok" for v in statuses(s)[-1].values)), values)

    def test_5_states_follow_crtk_and_a_second_publisher_is_a_fault(self):
        self.assertEqual(OperatingState._md5sum, "b1bd4021639d9d9c5fbfff78d6ff3158", "crtk_msgs on the wire")
        self.assertEqual(StringStamped._md5sum, "5e3e46086181199270f1ac3a28a5977f")
        topic = "/vest/haptics/left/state_command"
        self.assertTrue(patient(lambda: self.state("left") == "ENABLED" and self.heard["left", "operating_state"].last().is_homed))
        client = rospy.Publisher(topic, StringStamped, queue_size=10)
        self.assertTrue(patient(lambda: client.get_num_connections() > 0))

        def command(word):
            m = StringStamped()
            m.header.stamp = rospy.Time.now()
            m.string = word
            client.publish(m)

        for word, state in (("pause", "PAUSED"), ("resume", "ENABLED"), ("disable", "DISABLED"), ("enable", "ENABLED")):
            command(word)
            self.assertTrue(patient(lambda s=state: self.state("left") == s), f"{word}: {self.state('left')}")
        other = subprocess.Popen(["rostopic", "pub", "-r", "1", topic, "vest_msgs/StringStamped", "{}"], stdout=subprocess.DEVNULL)
        try:
            self.assertTrue(patient(lambda: self.state("left") == "FAULT"))
            command("enable")
            time.sleep(0.5)
            self.assertEqual(self.state("left"), "FAULT", "latched")
        finally:
            end(other)
        self.assertTrue(patient(lambda: command("disable") or time.sleep(0.3) or self.state("left") == "DISABLED"))
        self.assertTrue(patient(lambda: command("enable") or time.sleep(0.3) or self.state("left") == "ENABLED"))

    def refusal(self, device, options):
        """What the node says: a device that cannot be opened ends it with one line."""
        name = "refused_" + device
        rospy.set_param(f"/{name}", {"device": device, "options": options})
        done = subprocess.run(["rosrun", "vest_haptics", "haptics", "__name:=" + name], capture_output=True, text=True, timeout=60,
                              check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        self.assertEqual(len(lines), 1, "one message: " + done.stderr)
        return lines[0]

    def test_6_a_missing_library_says_what_to_install(self):
        self.assertIn("Install OpenHaptics", self.refusal("phantom", {"library": "libNoSuchThing.so"}))
        self.assertIn("Install the Force Dimension SDK", self.refusal("force_dimension", {"library": "libNoSuchThing.so"}))
        self.assertIn("not public", self.refusal("impulse_engine", {"port": "/dev/null", "force": "/no/such.so"}))

    def test_7_a_missing_device_says_what_to_look_at_and_whom_to_ask(self):
        text = self.refusal("phantom", {"library": "libvest_fake_hd.so", "name": "missing"})
        self.assertIn("'missing'", text)
        self.assertIn("ask whoever runs this computer", text)
        self.assertIn("No such file", self.refusal("impulse_engine", {"port": "/dev/no_such_port"}))
        self.assertIn("'nothing_like_it' is no plug-in", self.refusal("nothing_like_it", {}))

    def test_8_a_missing_right_to_real_time_is_told_once_and_the_device_works(self):
        drop = ["setpriv", "--bounding-set", "-sys_nice"] if os.geteuid() == 0 else []
        node = subprocess.Popen([*drop, "prlimit", "--rtprio=0", "rosrun", "vest_haptics", "haptics", "__name:=unprivileged",
                                 "_instrument:=third"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        heard = Heard("/haptics/third/measured_cp", PoseStamped)
        came = heard.come()
        time.sleep(2.5)
        end(node)
        text = node.stdout.read()
        node.stdout.close()
        self.assertTrue(came, text)
        self.assertEqual(text.count("rtprio 90"), 1, text)


if __name__ == "__main__":
    rostest.rosrun("vest_bringup", "devices", Devices, sys.argv)
