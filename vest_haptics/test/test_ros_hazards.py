#!/usr/bin/python3
"""Protects a running device from what ROS around it does: the master dies and is started anew, a topic is flooded, a subscriber
stops, the system clock is set. Named in docs/HAZARDS.md."""
import glob
import math
import os
import re
import signal
import struct
import subprocess
import tempfile
import threading
import time
import unittest
from io import BytesIO

from ros_support import Node, master, own_port, patient

FULL = "VEST_FULL" in os.environ
PORT = own_port()

import rospy  # noqa: E402  (reads the environment)
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped, WrenchStamped  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from vest_msgs.msg import HapticState, InstrumentStates, OperatingState, StringStamped  # noqa: E402
from vest_msgs.srv import TriggerOperatingState  # noqa: E402


OPTIONS = {"motion": "circle", "seconds": "2"}
BAD = ("Hangs", "ResetHangs", "NotNumbers", "Throws", "Boundless")


def package_of_devices(folder, package, names):
    """A package that declares devices of these names; its library lies in the devel space. @return environment to find it"""
    classes = "".join(f'<class name="{name}" type="vest_bad_devices::{name.split("/")[-1]}" '
                      'base_class_type="vest::haptics::Device"/>' for name in names)
    files = {"package.xml": f'<package format="2"><name>{package}</name><version>0.0.1</version><description>-</description>'
                            '<maintainer email="lab@example.org">-</maintainer><license>BSD</license><depend>vest_haptics</depend>'
                            '<export><vest_haptics plugin="${prefix}/plugins.xml"/></export></package>',
             "plugins.xml": f'<library path="libvest_bad_devices">{classes}</library>'}
    os.makedirs(os.path.join(folder, package))
    for name, text in files.items():
        with open(os.path.join(folder, package, name), "w", encoding="utf-8") as f:
            f.write(text)
    return {"ROS_PACKAGE_PATH": folder + ":" + os.environ.get("ROS_PACKAGE_PATH", "")}


class RosHazards(unittest.TestCase):
    # In the order of their names: after test_c the master knows no subscriber of this process any more.
    @classmethod
    def setUpClass(cls):
        cls.master = master(PORT)
        rospy.init_node("test_ros_hazards", anonymous=True, disable_rosout=True)
        rospy.set_param("/haptics/options", OPTIONS)
        cls.poses, cls.states, cls.instruments, cls.diagnostics, cls.operating = [], [], [], [], []
        cls.subscribers = [rospy.Subscriber("haptics/left/measured_cp", PoseStamped, cls.poses.append),
                           rospy.Subscriber("haptics/left/state", HapticState, cls.states.append),
                           rospy.Subscriber("haptics/left/operating_state", OperatingState, cls.operating.append),
                           rospy.Subscriber("instruments", InstrumentStates, cls.instruments.append),
                           rospy.Subscriber("/diagnostics", DiagnosticArray, cls.diagnostics.append)]

    @classmethod
    def tearDownClass(cls):
        cls.master.kill()
        cls.master.wait()

    def bad(self, name):
        """Starts a bad device beside whatever else there is, with the options that it knows: none."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        rospy.set_param("/haptics/options", {})
        rospy.set_param("/haptics/device", f"vest_bad_devices/{name}")
        self.addCleanup(rospy.set_param, "/haptics/device", "sim")
        self.addCleanup(rospy.set_param, "/haptics/options", OPTIONS)
        for kept in (self.poses, self.states, self.diagnostics, self.operating):
            kept.clear()
        return Node("vest_haptics", "haptics", **package_of_devices(folder.name, "vest_bad_devices", [f"vest_bad_devices/{bad}" for bad in BAD]))

    def device(self, *words, **environment):
        for kept in (self.poses, self.states, self.instruments, self.diagnostics, self.operating):
            kept.clear()
        node = Node("vest_haptics", "haptics", *words, **environment)
        self.addCleanup(node.end)
        self.assertTrue(patient(lambda: len(self.poses) > 200), node.text())
        return node

    def shows(self, servo, axis, newton):
        """A client's force of 1 N along an axis, as it is shown once that is so much; None: it never is. Where the machine keeps this
        client waiting for longer than a force lives the gate closes: it is let go of, and begun again."""
        message = WrenchStamped()

        def push(force, until, seconds):
            setattr(message.wrench.force, axis, force)
            end_of_patience = time.monotonic() + seconds
            while time.monotonic() < end_of_patience:  # patient() would wait for longer than a force stays whole, 20 ms
                servo.publish(message)
                if until():
                    return True
                time.sleep(0.003)
            return False

        for _ in range(20):
            had = len(self.states)
            self.assertTrue(push(0.0, lambda: len(self.states) > had + 100, 60.0), "out of everything first")
            had = len(self.states)
            shown = lambda: [s.force_rendered for s in self.states[had:] if getattr(s.force_rendered, axis) > newton]
            if push(1.0, shown, 5.0):
                return shown()[0]
        return None

    def goes_on(self, messages, count=300):
        had = len(messages)
        self.assertTrue(patient(lambda: len(messages) > had + count), "nothing comes any more")

    def test_a_flood_and_a_subscriber_that_stands_still_cost_no_memory_and_no_tick(self):
        node = self.device()
        still = subprocess.Popen(["rostopic", "hz", "/haptics/left/measured_cp"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(still.wait)
        self.addCleanup(still.kill)
        publisher = rospy.Publisher("haptics/left/servo_cf", WrenchStamped, queue_size=10)
        self.assertTrue(patient(lambda: publisher.get_num_connections() == 1))
        time.sleep(2.0)
        still.send_signal(signal.SIGSTOP)
        before, sent, seconds = node.memory(), 0, 60.0 if FULL else 4.0
        print(f"count: {seconds:.0f} of 60 seconds of flood (RosHazards.{self._testMethodName})", flush=True)
        begin = time.monotonic()
        had = len(self.states)
        while sent < 20000 * seconds:  # a busy machine takes longer for as much
            # Two hundred whole messages in one write: what a client in a tight loop sends.
            one = BytesIO()
            message = WrenchStamped()
            message.header.stamp = rospy.Time.now()
            message.serialize(one)
            frame = struct.pack("<I", len(one.getvalue())) + one.getvalue()
            for connection in publisher.impl.connections:
                connection.write_data(frame * 200)
            sent += 200
            time.sleep(max(0.0, begin + sent / 60000.0 - time.monotonic()))
        rate, seconds = sent / (time.monotonic() - begin), time.monotonic() - begin
        self.goes_on(self.poses)
        grown = node.memory() - before
        print(f"{rate:.0f} messages a second for {seconds:.0f} s: {grown / 1e6:.1f} MB more")
        self.assertLess(grown, 20e6)
        self.assertGreater(len(self.states) - had, 50 * seconds, "the loop reports at 200 Hz, of which half may be lost on the way")
        self.assertEqual(self.operating[-1].state, "ENABLED")

    def test_b_when_the_system_clock_is_set_back_by_an_hour_forces_go_by_the_steady_clock(self):
        library = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
        self.assertTrue(library, "libfaketime is missing: apt-get install libfaketime")
        with tempfile.NamedTemporaryFile("w", suffix=".time") as clock:
            clock.write("+0")
            clock.flush()
            node = self.device(LD_PRELOAD=library[0], FAKETIME_TIMESTAMP_FILE=clock.name, FAKETIME_NO_CACHE="1",
                               FAKETIME_DONT_FAKE_MONOTONIC="1", FAKETIME_DONT_RESET="1")
            before = self.poses[-1].header.stamp.to_sec()
            clock.seek(0)
            clock.write("-3600")
            clock.flush()
            self.assertTrue(patient(lambda: self.poses[-1].header.stamp.to_sec() < before - 3000.0), "the clock was set: stamps follow")
            self.goes_on(self.poses)
            # Between its readings of the two clocks the machine may have paused.
            self.assertTrue(patient(lambda: re.search(r"the system clock was set by -3(599|600)\.", node.text())), node.text())
            self.assertEqual(self.operating[-1].state, "ENABLED")
            self.assertEqual(node.text().count("FAULT"), 0)

    def test_a_second_process_of_the_same_name_does_not_end_the_first(self):
        self.device()
        second = Node("vest_haptics", "haptics")
        try:
            self.assertEqual(second.process.wait(60), 2)
            self.assertEqual(second.text().count("haptics/left of this session already runs in another process"), 1, second.text())
        finally:
            second.said.close()
        self.goes_on(self.poses)
        self.assertEqual(self.operating[-1].state, "ENABLED")

    def test_a_device_that_hangs_is_told_and_the_process_still_ends(self):
        node = self.bad("Hangs")
        self.addCleanup(node.said.close)
        self.assertTrue(patient(lambda: "the loop stands still: a call of the device has not come back" in node.text()), node.text())
        self.assertIn("has no watchdog and may keep its last force", node.text())
        self.assertTrue(patient(lambda: any(s.level == 2 and "the loop stands still" in s.message
                                            for m in list(self.diagnostics) for s in m.status)))
        node.process.send_signal(signal.SIGINT)
        self.assertEqual(node.process.wait(60), 3)
        self.assertIn("ended without it", node.text())
        rospy.set_param("/haptics/device", "sim")
        rospy.set_param("/haptics/options", OPTIONS)
        self.comes_back_without_force()

    def commands(self):
        """Of a client that keeps the order of its words. @return function that sends them in one packet"""
        publisher = rospy.Publisher("haptics/left/state_command", StringStamped, queue_size=10)
        self.addCleanup(publisher.unregister)
        self.assertTrue(patient(lambda: publisher.get_num_connections() > 0))

        def send(*words):
            packet = b""
            for word in words:
                one = BytesIO()
                StringStamped(string=word).serialize(one)
                packet += struct.pack("<I", len(one.getvalue())) + one.getvalue()
            publisher.impl.connections[0].write_data(packet)
        return send

    def test_a_device_whose_reset_hangs_is_disabled_all_the_same(self):
        node = self.bad("ResetHangs")
        self.addCleanup(node.end)
        self.assertTrue(patient(lambda: self.operating and self.operating[-1].state == "ENABLED"), node.text())
        self.commands()("disable")
        self.assertTrue(patient(lambda: self.operating[-1].state == "DISABLED", 20), node.text())
        node.process.send_signal(signal.SIGINT)
        self.assertEqual(node.process.wait(60), 3)
        rospy.set_param("/haptics/device", "sim")
        rospy.set_param("/haptics/options", OPTIONS)
        self.comes_back_without_force()

    def test_a_packet_of_commands_is_taken_whole_and_each_that_does_not_fit_is_told(self):
        node = self.device()
        said = []
        error = rospy.Subscriber("haptics/left/error", String, lambda m: said.append(m.data))
        self.addCleanup(error.unregister)
        servo = rospy.Publisher("haptics/left/servo_cf", WrenchStamped, queue_size=10)
        self.addCleanup(servo.unregister)
        self.assertTrue(patient(lambda: servo.get_num_connections() and error.get_num_connections()))
        send = self.commands()
        becomes = lambda state: self.assertTrue(patient(lambda: self.operating[-1].state == state, 20), f"{state}: {node.text()}")
        told = lambda *words: self.assertTrue(patient(lambda: any(all(w in text for w in words) for text in said), 20), said)
        becomes("ENABLED")
        send("resume")
        told("'resume' refused", "not PAUSED")
        send("disable", "resume")
        becomes("DISABLED")
        send("pause")
        told("'pause' refused", "not ENABLED")
        send("enable")
        becomes("ENABLED")
        no_number = WrenchStamped()
        no_number.wrench.force.x = float("nan")
        servo.publish(no_number)
        becomes("FAULT")
        send("enable")
        told("'enable' refused", "FAULT", "'disable' comes first")
        said.clear()
        self.goes_on(self.states, 40)  # until what is no number is too old to count
        send("disable", "enable")
        becomes("ENABLED")
        # A client that floods is told once in a while.
        send(*["explode"] * 500)
        told("'explode' refused")
        self.goes_on(self.states, 20)
        self.assertLess(len(said), 5, said)

    def comes_back_without_force(self):
        """After a process that did not end in order, the next has no force until a person enables it."""
        # Ten times what a hand of the device would be shown, all the time: it must not matter.
        servo = rospy.Publisher("haptics/left/servo_cf", WrenchStamped, queue_size=1)
        self.addCleanup(servo.unregister)
        pushing = threading.Event()

        def push():
            while not pushing.wait(0.005):
                message = WrenchStamped()
                message.header.stamp = rospy.Time.now()
                message.wrench.force.z = 1.0
                servo.publish(message)

        pusher = threading.Thread(target=push)
        pusher.start()
        self.addCleanup(pusher.join)
        self.addCleanup(pushing.set)
        node = self.device()
        self.assertTrue(patient(lambda: servo.get_num_connections() > 0))
        self.assertEqual(node.text().count("the process before this one was killed or crashed: DISABLED"), 1, node.text())
        self.goes_on(self.states, 100)
        self.assertEqual({s.state for s in self.operating}, {"DISABLED"})
        self.assertEqual({f for s in self.states for f in (s.force_rendered.x, s.force_rendered.y, s.force_rendered.z)}, {0.0})
        self.assertTrue(patient(lambda: any(s.level == 1 and "killed or crashed" in s.message
                                            for m in list(self.diagnostics) for s in m.status)))
        # That it was ended in order settles nothing: nobody has looked at the device.
        node.end()
        node = self.device()
        self.goes_on(self.states, 20)
        self.assertEqual(self.operating[-1].state, "DISABLED")
        command = rospy.Publisher("haptics/left/state_command", StringStamped, queue_size=1)
        self.addCleanup(command.unregister)
        self.assertTrue(patient(lambda: command.get_num_connections() > 0))
        message = StringStamped(string="enable")
        message.header.stamp = rospy.Time.now()
        command.publish(message)
        self.assertTrue(patient(lambda: self.operating[-1].state == "ENABLED"), node.text())
        # The force that was asked for all the time begins with nothing: the hand must be let go of first.
        self.goes_on(self.states, 100)
        self.assertEqual(max(s.force_rendered.z for s in self.states), 0.0, "more than a small force at the moment of enabling")
        pushing.set()
        node.end()
        self.device()
        self.assertTrue(patient(lambda: self.operating and self.operating[-1].state == "ENABLED"), "it is settled")

    def test_a_released_client_is_heard_and_old_commands_are_refused_in_words(self):
        # crtk_python_client up to 1.4.0 stamps no command.
        node = self.device()
        said = []
        publishers = {name: rospy.Publisher("haptics/left/" + name, kind, queue_size=10)
                      for name, kind in (("state_command", StringStamped), ("servo_cf", WrenchStamped))}
        error = rospy.Subscriber("haptics/left/error", String, lambda m: said.append(m.data))
        for client in (*publishers.values(), error):
            self.addCleanup(client.unregister)
        self.assertTrue(patient(lambda: all(p.get_num_connections() for p in publishers.values()) and error.get_num_connections()))
        self.assertTrue(patient(lambda: self.operating and self.operating[-1].state == "ENABLED"))

        def command(word, age=None):
            message = StringStamped(string=word)
            if age is not None:
                message.header.stamp = rospy.Time.now() - rospy.Duration(age)
            publishers["state_command"].publish(message)

        def becomes(state):
            self.assertTrue(patient(lambda: self.operating[-1].state == state), f"{state}: {node.text()}")

        query = rospy.ServiceProxy("haptics/left/operating_state", TriggerOperatingState)
        self.assertTrue(patient(lambda: query().operating_state.state == "ENABLED" and query().operating_state.is_homed))
        command("pause")
        becomes("PAUSED")
        self.assertTrue(patient(lambda: query().operating_state.state == "PAUSED"))
        command("resume", age=5.0)
        self.assertTrue(patient(lambda: any("'resume' refused: its stamp is 5" in text for text in said)), said)
        self.assertEqual(self.operating[-1].state, "PAUSED")
        command("resume")
        becomes("ENABLED")
        command("disable", age=3600.0)  # what stops is never too late
        becomes("DISABLED")
        command("enable")
        becomes("ENABLED")

        self.assertTrue(self.shows(publishers["servo_cf"], "x", 0.9), node.text())
        self.assertTrue(patient(lambda: abs(self.states[-1].force_rendered.x) < 0.2), "a client that falls silent")
        had = len(self.states)
        refused = lambda: len(self.states) > had + 20 and any("servo_cf refused: its stamp is 5" in text for text in said)
        old = WrenchStamped()
        old.wrench.force.x = 1.0
        old.header.stamp = rospy.Time.now() - rospy.Duration(5.0)
        self.assertTrue(patient(lambda: publishers["servo_cf"].publish(old) or time.sleep(0.005) or refused()), said)
        self.assertLess(max(abs(s.force_rendered.x) for s in self.states[had:]), 0.2, "old forces are none")

    def test_a_device_process_that_was_put_aside_goes_on_without_force_and_blames_no_master(self):
        node = self.device()
        servo = rospy.Publisher("haptics/left/servo_cf", WrenchStamped, queue_size=10)
        self.addCleanup(servo.unregister)
        self.assertTrue(patient(lambda: servo.get_num_connections() > 0))
        message = WrenchStamped()  # without a stamp: what waited in the queue is not told apart from what is new

        def push(until):
            return patient(lambda: servo.publish(message) or time.sleep(0.005) or until())

        self.assertTrue(self.shows(servo, "x", 0.9), node.text())
        message.wrench.force.x = 1.0
        node.signal(signal.SIGSTOP)
        begin = time.monotonic()
        push(lambda: time.monotonic() - begin > 3.0)
        had = len(self.states)
        node.signal(signal.SIGCONT)
        self.assertTrue(push(lambda: len(self.states) > had + 200), node.text())
        self.assertEqual({s.force_rendered.x for s in self.states[had + 2:]}, {0.0}, "the hand must be let go of first")
        self.assertNotIn("ROS master lost", node.text())

    def test_absurd_numbers_of_a_device_are_one_message_each_and_no_force(self):
        engine = {"device": "impulse_engine", "options": {"port": "/nowhere"}}
        for parameters, words in (({"force_gain": -1.0}, ("force_gain", "0.1")), ({"force_gain": math.nan}, ("force_gain", "0.1")),
                                  ({"scale": 1e9}, ("scale", "10")), ({"hand_damping": -1}, ("hand_damping", "20")),
                                  ({"damping": math.inf}, ("damping", "20")), ({"force_limit": -3.0}, ("force_limit", "1000")),
                                  ({"force_limit": "much"}, ("force_limit", "wrong type")), ({"tilt": [math.nan, 0.0]}, ("tilt", "0.8")),
                                  ({"options": {"maximum_force": 1e9}}, ("maximum_force", "100")),
                                  ({"options": {"seconds": math.nan}}, ("seconds", "1000")),
                                  ({"options": {"friction": -1.0}}, ("friction", "5")), ({"options": [1, 2]}, ("options", "a map of words")),
                                  ({**engine, "options": {"counts": [1, 1, math.nan, 1, 1]}}, ("counts", "five numbers")),
                                  ({**engine, "options": {"counts": [0, 1, 1, 1, 1]}}, ("counts", "not 0")),
                                  # A list of YAML is five numbers.
                                  ({**engine, "options": {"port": "/nowhere", "counts": [1, 2.5, -3, 4, 5]}}, ("/nowhere", "No such file"))):
            with self.subTest(parameters):
                rospy.set_param("/absurd", parameters)
                node = Node("vest_haptics", "haptics", "__name:=absurd")
                self.addCleanup(node.end)
                self.assertEqual(node.process.wait(60), 2, node.text())
                said = [line for line in node.text().splitlines() if line.strip()]
                self.assertEqual(len(said), 1, said)
                for word in words:
                    self.assertIn(word, said[0])
                rospy.delete_param("/absurd")

    def test_a_box_is_tilted_as_the_instruments_say(self):
        rospy.set_param("/instruments/tilt", [0.3, 0.0])
        self.addCleanup(rospy.delete_param, "/instruments")
        node = self.device()
        servo = rospy.Publisher("haptics/left/servo_cf", WrenchStamped, queue_size=10)
        self.addCleanup(servo.unregister)
        self.assertTrue(patient(lambda: servo.get_num_connections() > 0))
        force = self.shows(servo, "z", 0.6)  # in the device's frame, which is the box's
        self.assertTrue(force, node.text())
        self.assertAlmostEqual(force.y / force.z, -math.tan(0.3), delta=0.05)
        node.end()
        rospy.set_param("/haptics/tilt", [0.2, 0.0])
        self.addCleanup(rospy.delete_param, "/haptics/tilt")
        other = Node("vest_haptics", "haptics")
        self.assertEqual(other.process.wait(60), 2)
        self.assertEqual(other.text().count("parameter '/haptics/tilt' is not '/instruments/tilt'; allowed: "), 1, other.text())
        other.said.close()

    def test_a_device_process_that_was_killed_comes_back_disabled_and_without_force(self):
        node = self.device()
        self.assertTrue(patient(lambda: self.operating and self.operating[-1].state == "ENABLED"))
        node.signal(signal.SIGKILL)
        node.process.wait()
        self.comes_back_without_force()

    def test_two_plug_ins_of_one_name_are_one_message(self):
        for name, declared in (("vest_haptics/Simulated", "vest_haptics/Simulated"), ("sim", "vest_haptics/Simulated"),
                               ("phantom", "phantom")):
            with tempfile.TemporaryDirectory() as folder:
                found = package_of_devices(folder, "vest_twin_devices", [declared])
                node = Node("vest_haptics", "haptics", "_device:=" + name, **found)
                self.assertEqual(node.process.wait(60), 2, node.text())
                said = [line for line in node.text().splitlines() if line.strip()]
                self.assertEqual(len(said), 1, node.text())
                self.assertIn(f"device '{name}' is declared 2 times, in ", said[0])
                self.assertIn("vest_haptics/device_plugins.xml", said[0])
                self.assertIn(os.path.join(folder, "vest_twin_devices/plugins.xml"), said[0])
                node.said.close()
                check = subprocess.run(["rosrun", "vest_haptics", "check_device", name], capture_output=True, text=True, timeout=60,
                                       check=False, env={**os.environ, **found})
                self.assertEqual(check.returncode, 2, check.stderr)
                self.assertEqual(check.stderr.count("is declared 2 times"), 1, check.stderr)

    def test_a_device_without_numbers_is_a_fault(self):
        node = self.bad("NotNumbers")
        self.addCleanup(node.end)
        self.assertTrue(patient(lambda: bool(self.operating) and self.operating[-1].state == "FAULT"), node.text())
        self.assertTrue(patient(lambda: "readings are not finite or jump" in node.text()), node.text())

    def test_a_device_that_throws_or_is_boundless_is_one_message(self):
        for name, what in (("Throws", "threw something"), ("Boundless", "maximum = inf; allowed: ")):
            node = self.bad(name)
            self.assertEqual(node.process.wait(60), 2, node.text())
            self.assertEqual(node.text().count(what), 1, node.text())
            node.said.close()

    def test_c_when_the_master_dies_the_session_goes_on_says_so_and_admits_no_second(self):
        rospy.set_param("/instruments/sources", {"left": "haptic", "right": "none", "third": "none", "endoscope": "none"})
        instruments = Node("vest_instruments", "instruments_node", "__name:=instruments")
        self.addCleanup(instruments.end)
        node = self.device()
        self.assertTrue(patient(lambda: len(self.instruments) > 100), instruments.text())
        self.master.kill()  # SIGKILL
        self.master.wait()
        killed = time.monotonic()
        self.assertTrue(patient(lambda: "ROS master lost" in node.text()), node.text())
        self.assertLess(time.monotonic() - killed, 2.0, "docs/HAZARDS.md: told in 2 s")
        self.assertTrue(patient(lambda: any("ROS master lost" in s.message for m in list(self.diagnostics) for s in m.status)))
        self.goes_on(self.poses)
        self.goes_on(self.instruments)
        type(self).master = master(PORT)
        self.assertTrue(patient(lambda: "a ROS master answers again" in node.text()), node.text())
        self.goes_on(self.poses)
        # The new master knows nothing of it: who starts again is told.
        second = Node("vest_haptics", "haptics", "__name:=haptics")
        try:
            self.assertEqual(second.process.wait(30), 2)
            self.assertIn("haptics/left of this session already runs in another process", second.text())
        finally:
            second.said.close()
        self.goes_on(self.poses)
        self.assertEqual(self.operating[-1].state, "ENABLED")


if __name__ == "__main__":
    unittest.main(verbosity=2, warnings="ignore")
