#!/usr/bin/python3
"""Protects load_scene and exchange_tool of a session: each takes what users expect, and what it refuses it refuses with one sentence
that says what is allowed; the session goes on as it was."""
import math
import os
import sys
import tempfile
import unittest

import rospkg
import rospy
import rostest
from vest_msgs.msg import InstrumentState, InstrumentStates, SessionState
from vest_msgs.srv import ExchangeOptic, ExchangeTool, LoadScene

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import patient  # noqa: E402

SCENES = os.path.join(rospkg.RosPack().get_path("vest_tissue"), "scenes")


class Services(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_services", anonymous=True)
        cls.newest = {}
        rospy.Subscriber("/vest/session/state", SessionState, lambda m: cls.newest.update(session=m))
        rospy.Subscriber("/vest/instruments", InstrumentStates, lambda m: cls.newest.update({i.name: i for i in m.instruments}))
        cls.load, cls.exchange = (rospy.ServiceProxy("/vest/" + name, kind)
                                  for name, kind in (("tissue/load_scene", LoadScene), ("exchange_tool", ExchangeTool)))
        for service in (cls.load, cls.exchange):
            service.wait_for_service(60)
        assert patient(lambda: {"session", "right"} <= set(cls.newest))

    def goes_on_as(self, scene):
        step = self.newest["session"].step
        self.assertTrue(patient(lambda: self.newest["session"].step > step and self.newest["session"].scene == scene), self.newest["session"])

    def test_1_a_scene_is_loaded_by_name_and_by_path(self):
        by_name = self.load("cut_tube")
        self.assertTrue(by_name.success, by_name.message)
        self.assertEqual(by_name.message, "loaded cut_tube")
        self.goes_on_as("cut_tube")
        by_path = self.load(os.path.join(SCENES, "hook_strip", "hook_strip.yaml"))
        self.assertTrue(by_path.success, by_path.message)
        self.assertNotEqual(by_path.scene_hash, by_name.scene_hash)
        self.goes_on_as("hook_strip")

    def test_2_a_scene_that_is_not_there_or_wrong_is_refused_and_the_present_one_goes_on(self):
        self.assertTrue(self.load("grasp_tube").success)
        self.goes_on_as("grasp_tube")
        with tempfile.TemporaryDirectory() as folder:
            garbage = os.path.join(folder, "garbage.yaml")
            with open(garbage, "w", encoding="utf-8") as f:
                f.write("vest_scene: 1\nname: garbage\nobjects: 3\n")
            for scene, words in (("nosuch", ("'nosuch'", "allowed:", "cut_tube", "gynaecology", "path of a scene file")),
                                 ("", ("allowed:", "cut_tube")), ("/nowhere/mine.yaml", ("/nowhere/mine.yaml",)),
                                 ("mine.yaml", ("mine.yaml",)), (garbage, (garbage, "objects"))):
                with self.subTest(scene):
                    done = self.load(scene)
                    self.assertFalse(done.success)
                    self.assertNotIn("\n", done.message)
                    for word in words:
                        self.assertIn(word, done.message)
                    self.goes_on_as("grasp_tube")

    def test_3_a_tool_is_exchanged_and_one_that_is_none_is_refused_with_those_that_are(self):
        done = self.exchange("right", InstrumentState.TOOL_SCISSORS)
        self.assertTrue(done.success, done.message)
        self.assertTrue(patient(lambda: self.newest["right"].tool == InstrumentState.TOOL_SCISSORS))
        for instrument, tool, words in (("right", 99, ("tool 99", "allowed:", "scissors", "clip_applier")),
                                        ("right", InstrumentState.TOOL_ENDOSCOPE, ("allowed:", "scissors")),
                                        ("endoscope", InstrumentState.TOOL_SCISSORS, ("'endoscope'", "left, right, third")),
                                        ("foot", InstrumentState.TOOL_SCISSORS, ("'foot'", "left, right, third"))):
            with self.subTest(instrument=instrument, tool=tool):
                done = self.exchange(instrument, tool)
                self.assertFalse(done.success)
                for word in words:
                    self.assertIn(word, done.message)
                self.assertEqual(self.newest["right"].tool, InstrumentState.TOOL_SCISSORS)

    def test_4_an_endoscope_with_another_optic_is_handed_over(self):
        optic = rospy.ServiceProxy("/vest/exchange_optic", ExchangeOptic)
        optic.wait_for_service(60)
        for angle in (0.0, math.pi / 4):
            done = optic(angle)
            self.assertTrue(done.success, done.message)
            self.assertTrue(patient(lambda: abs(self.newest["endoscope"].sight[2] - math.cos(angle)) < 1e-6), self.newest["endoscope"].sight)
        for angle in (-0.1, 2.0, math.nan):
            done = optic(angle)
            self.assertFalse(done.success)
            self.assertIn("allowed: 0 to 1.6 rad", done.message)
        self.assertAlmostEqual(self.newest["endoscope"].sight[2], math.cos(math.pi / 4))


if __name__ == "__main__":
    rostest.rosrun("vest_bringup", "services", Services, sys.argv)
