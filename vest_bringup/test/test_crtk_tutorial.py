#!/usr/bin/python3
"""Protects docs/tutorials/crtk.md: its commands and its client, taken from the page word for word, start a session, move the arm, are
refused with the sentence that the page tells, pick the tube up and let it go."""
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from vest_msgs.msg import OperatingState, TissueEvent

HERE = os.path.dirname(os.path.abspath(__file__))
PAGE = os.path.join(HERE, "..", "..", "docs", "tutorials", "crtk.md")
sys.path.insert(0, os.path.join(HERE, "..", "..", "vest_haptics", "test"))
from ros_support import end, patient  # noqa: E402


class CrtkTutorial(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_crtk_tutorial", anonymous=True)
        cls.folder = tempfile.mkdtemp(prefix="vest_crtk_")
        with open(PAGE, encoding="utf-8") as f:
            cls.page = f.read()
        cls.events, cls.errors, cls.arm = [], [], []
        rospy.Subscriber("/vest/tissue/events", TissueEvent, cls.events.append, queue_size=1000)
        rospy.Subscriber("/vest/right/error", String, lambda m: cls.errors.append(m.data), queue_size=100)
        rospy.Subscriber("/vest/right/measured_js", JointState, lambda m: cls.arm.append(m) or cls.arm.__delitem__(slice(None, -1)))
        cls.states = []
        rospy.Subscriber("/vest/right/operating_state", OperatingState, cls.states.append, queue_size=100)
        launch = re.search(r"^    (roslaunch .*)$", cls.page, re.M).group(1)
        cls.session = subprocess.Popen(shlex.split(launch) + ["rviz:=false", "port:=" + os.path.join(cls.folder, "box")])

    @classmethod
    def tearDownClass(cls):
        end(cls.session)
        shutil.rmtree(cls.folder, ignore_errors=True)

    def commands(self, section):
        """Shell lines of a section, without what runs beside them."""
        text = re.search(rf"^## {section}\..*?(?=^## )", self.page, re.M | re.S).group(0)
        return [line.strip().split("; ")[-1] for line in re.findall(r"^    (ros\w+ .*|sleep .*)$", text, re.M) if not line.endswith("&")]

    def run_line(self, line):
        done = subprocess.run(shlex.split(line), capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(done.returncode, 0, line + "\n" + done.stderr)
        return done.stdout

    def test_1_the_arm_can_be_looked_at(self):
        self.assertTrue(patient(lambda: self.arm and self.states, 90.0), "no session")
        echo, call = self.commands(2)
        self.assertIn("right_insertion", self.run_line(echo))
        self.assertRegex(self.run_line(call), r'(?s)state: "?ENABLED.*is_homed: True.*is_busy: False')

    def test_2_it_moves_by_hand_and_says_what_it_refuses(self):
        move, jaw, beyond = self.commands(3)
        self.run_line(move)
        self.assertTrue(patient(lambda: abs(self.arm[-1].position[0] - 0.1) < 1e-6 and abs(self.arm[-1].position[2] - 0.1) < 1e-6))
        self.run_line(jaw)
        self.run_line(beyond)
        told = re.search(r"It says `(.*)`", self.page).group(1)
        self.assertTrue(patient(lambda: told in self.errors), self.errors)

    def test_3_the_client_of_the_page_picks_the_tube_up(self):
        script = os.path.join(self.folder, "pick_up.py")
        with open(script, "w", encoding="utf-8") as f:
            f.write(re.search(r"```python\n(.*?)```", self.page, re.S).group(1))
        done = subprocess.run(["/usr/bin/python3", script], capture_output=True, text=True, check=False, timeout=200)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        found = re.search(r"the tube is (\d+) mm higher and pulls with (\d+\.\d+) N", done.stdout)
        self.assertTrue(found, done.stdout)
        self.assertGreaterEqual(int(found.group(1)), 5)
        self.assertLessEqual(int(found.group(1)), 13)
        self.assertTrue(0.01 < float(found.group(2)) < 20.0, done.stdout)
        grasped = [e for e in self.events if e.kind == TissueEvent.GRASPED]
        self.assertEqual({(e.instrument, e.object) for e in grasped}, {("right", "tube")})

    def test_4_a_free_arm_is_drawn_back_and_open_jaws_let_go(self):
        free, jaw = self.commands(5)
        before = self.arm[-1].position[2]
        self.run_line(free)
        self.assertTrue(patient(lambda: self.arm[-1].position[2] > before + 0.001), "the tube draws the arm back down")
        self.run_line(jaw)
        self.assertTrue(patient(lambda: any(e.kind == TissueEvent.RELEASED for e in self.events)))


if __name__ == "__main__":
    rostest.rosrun("vest_bringup", "crtk_tutorial", CrtkTutorial, sys.argv)
