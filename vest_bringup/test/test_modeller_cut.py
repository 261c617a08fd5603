#!/usr/bin/python3
"""Protects what drawing is for, by the messages of the panel alone: a bowel of three layers and a tree of vessels are drawn and tied in a
running session. The session's scissors cut the tree, it bleeds, and what is saved is the same scene when it is loaded and when it is replayed."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import rosbag
import rospy
import rostest
from vest_msgs.msg import HaemodynamicsState, ModelEdit, SessionState, TissueEvent
from vest_msgs.srv import EditModel, LoadScene

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import end, patient  # noqa: E402

# As in test_modeller.cpp: what the scissors of cut_again.yaml meet.
BOWEL = ("{name: bowel, organ: intestine, material: intestine, tube: {centre: [[-0.05, 0.098, 0.06], [0, 0.1, 0.06], [0.05, 0.098, 0.06]], "
         "reference: [0, 0, 1], rings: 15, around: 8, start: cap, end: cap, sections: [{at: 0, radii: [0.008]}]}, "
         "layers: [{material: peritoneum, thickness: 0.0005}, {material: intestine, thickness: 0.001}, {material: fat_soft, thickness: 0.0007}], "
         "fixed: [{rings: [0, 0]}, {rings: [-1, -1]}]}")
TREE = ("{name: tree, organ: artery, material: artery, support: 25, bulk_modulus: 200, tree: {root: [-0.0208, 0.0158, 0.055], "
        "direction: [0.0208, 0.0342, 0], plane: [1, 0, 0], radius: 0.0025, axiom: 'FFFF[F][F]', length: 7, supply: uterine_branches_left}, "
        "fixed: [{rings: [0, 1]}]}")


class ModellerCut(unittest.TestCase):
    def setUp(self):
        rospy.init_node("test_modeller_cut", anonymous=True)
        self.folder = tempfile.mkdtemp(prefix="vest_modeller_cut_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.source = os.path.join(self.folder, "drawn", "source.yaml")
        os.mkdir(os.path.dirname(self.source))
        node = subprocess.Popen(["rosrun", "vest_tissue", "model_node", "_source:=" + self.source, "__ns:=/vest"])
        self.addCleanup(end, node)
        self.newest, self.edits, self.events = {}, [], []
        rospy.Subscriber("/vest/effects/haemodynamics", HaemodynamicsState, lambda m: self.newest.update(blood=m))
        rospy.Subscriber("/vest/session/state", SessionState, lambda m: self.newest.update(session=m))
        rospy.Subscriber("/vest/model/edits", ModelEdit, self.edits.append)
        rospy.Subscriber("/vest/tissue/events", TissueEvent, self.events.append)
        self.edit = rospy.ServiceProxy("/vest/model/edit", EditModel)
        self.edit.wait_for_service(60)
        self.assertTrue(patient(lambda: {"blood", "session"} <= set(self.newest)))

    def done(self, *edit):
        answer = self.edit(*edit)
        self.assertTrue(answer.success, answer.message)
        return answer

    def cut(self, since):
        return [e for e in self.events[since:] if e.kind == TissueEvent.CUT and e.object == "tree_1"]

    def test_what_is_drawn_is_cut_in_the_session_bleeds_and_is_the_same_scene_loaded_and_replayed(self):
        self.done("insert", "/objects/-", BOWEL)
        self.done("insert", "/objects/-", TREE)
        near = self.done("propose", "tree_3", "0.012")
        self.assertIn("bowel", near.message)
        self.done("set", "/objects/tree/connect", "[{to: bowel, rings: [-2, -1], per_ring: 2, within: 0.012, stiffness: 10}]")
        before = len(self.events)
        ran = self.done("run", "", "")
        self.assertTrue(patient(lambda: self.newest["session"].scene == "drawn"), self.newest["session"].scene)
        self.assertTrue(patient(lambda: self.cut(before), 180), "the scissors cut what is drawn")
        lost = self.cut(before)[0].header.stamp
        self.assertTrue(patient(lambda: self.newest["blood"].header.stamp > lost and self.newest["blood"].blood_loss > 1e-7, 120),
                        "m3: it bleeds, and nobody entered it twice")

        saved = self.done("save", "", "")
        self.assertEqual(saved.scene_hash, ran.scene_hash)
        loaded = rospy.ServiceProxy("/vest/tissue/load_scene", LoadScene)(saved.message)
        self.assertTrue(loaded.success, loaded.message)
        self.assertEqual(loaded.scene_hash, ran.scene_hash)
        bag = os.path.join(self.folder, "edits.bag")
        # Whoever subscribes while an edit goes out has that one twice.
        self.assertTrue(patient(lambda: {m.seq for m in self.edits} == {0, 1, 2, 3}), [m.op for m in self.edits])
        with rosbag.Bag(bag, "w") as file:
            for message in self.edits:
                file.write("/vest/model/edits", message)
        replay = subprocess.run(["rosrun", "vest_bringup", "vest_replay_model", bag, "-o", os.path.join(self.folder, "again")],
                                capture_output=True, text=True, check=False)
        self.assertEqual(replay.returncode, 0, replay.stderr)
        self.assertIn("scene " + ran.scene_hash, replay.stdout)


if __name__ == "__main__":
    rostest.rosrun("vest_bringup", "modeller_cut", ModellerCut, sys.argv)
