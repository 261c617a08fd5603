#!/usr/bin/python3
"""Protects a running device from what ROS around it does: the master dies and is started anew, a topic is flooded, a subscriber
stops, the system clock is set. Named in docs/HAZARDS.md."""
import glob
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from io import BytesIO

FULL = "VEST_FULL" in os.environ
with socket.socket() as free:
    free.bind(("localhost", 0))
    PORT = free.getsockname()[1]
os.environ.update(ROS_MASTER_URI=f"http://localhost:{PORT}", ROS_HOSTNAME="localhost")

import rospy  # noqa: E402  (reads the environment)
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped, WrenchStamped  # noqa: E402
from vest_msgs.msg import HapticState, InstrumentStates, OperatingState  # noqa: E402


def patient(condition, seconds=30.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return condition()


OPTIONS = {"motion": "circle", "seconds": "2"}
BAD = ("Hangs", "NotNumbers", "Throws", "Boundless")


def bad_devices(folder):
    """A package of plug-ins that do what they must not; its library lies in the devel space. @return environment to find it"""
    classes = "".join(f'<class name="vest_bad_devices/{name}" type="vest_bad_devices::{name}" '
                      'base_class_type="vest::haptics::Device"/>' for name in BAD)
    files = {"package.xml": '<package format="2"><name>vest_bad_devices</name><version>0.0.1</version><description>-</description>'
                            '<maintainer email="lab@example.org">-</maintainer><license>BSD</license><depend>vest_haptics</depend>'
                            '<export><vest_haptics plugin="${prefix}/plugins.xml"/></export></package>',
             "plugins.xml": f'<library path="libvest_bad_devices">{classes}</library>'}
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as f:
            f.write(text)
    return {"ROS_PACKAGE_PATH": folder + ":" + os.environ.get("ROS_PACKAGE_PATH", "")}


def master():
    process = subprocess.Popen(["rosmaster", "--core", "-p", str(PORT)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def answers():
        with socket.socket() as s:
            return s.connect_ex(("localhost", PORT)) == 0

    assert patient(answers), "no master"
    return process


class Node:
    """A node, and what it says."""

    def __init__(self, package, name, *words, **environment):
        self.said = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(["rosrun", package, name, *words], stdout=self.said, stderr=subprocess.STDOUT,
                                        env={**os.environ, **environment})

    def text(self):
        self.said.seek(0)
        return self.said.read()

    def memory(self):
        """Bytes in use."""
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as f:
            return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def end(self):
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(15)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.said.close()


class RosHazards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.master = master()
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
        return Node("vest_haptics", "haptics", **bad_devices(folder.name))

    def device(self, **environment):
        for kept in (self.poses, self.states, self.instruments, self.diagnostics, self.operating):
            kept.clear()
        node = Node("vest_haptics", "haptics", **environment)
        self.addCleanup(node.end)
        self.assertTrue(patient(lambda: len(self.poses) > 200), node.text())
        return node

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
        while time.monotonic() - begin < seconds:
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
        rate = sent / (time.monotonic() - begin)
        self.goes_on(self.poses)
        grown = node.memory() - before
        print(f"{rate:.0f} messages a second for {seconds:.0f} s: {grown / 1e6:.1f} MB more")
        self.assertGreater(rate, 20000.0, "a flood")
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
        self.assertLess(time.monotonic() - killed, 2.0, "safety.md: told in 2 s")
        self.assertTrue(patient(lambda: any("ROS master lost" in s.message for m in list(self.diagnostics) for s in m.status)))
        self.goes_on(self.poses)
        self.goes_on(self.instruments)
        type(self).master = master()
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
