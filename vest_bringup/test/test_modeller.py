#!/usr/bin/python3
"""Protects drawing in a session: edits come by a service and go out as messages, a late subscriber is told all of them, what is drawn
runs in the session, and a bag of the edits ends at the same source and the same scene."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import rosbag
import rospy
import rostest
from vest_msgs.msg import ModelEdit, SessionState, TissueTopology
from vest_msgs.srv import EditModel

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import end, patient  # noqa: E402

TREE = ("{name: tree, organ: artery, material: artery, support: 25, tree: {root: [-0.02, 0.02, 0.055], direction: [0.5, 0.8, 0], "
        "plane: [1, 0, 0], radius: 0.0015, axiom: 'F[F][F]', supply: uterine_branches_left}, fixed: [{rings: [0, 1]}]}")


class Modeller(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_modeller", anonymous=True)
        cls.folder = tempfile.mkdtemp(prefix="vest_modeller_")
        cls.source = os.path.join(cls.folder, "drawn", "source.yaml")
        os.mkdir(os.path.dirname(cls.source))
        cls.node = subprocess.Popen(["rosrun", "vest_tissue", "model_node", "_source:=" + cls.source, "__ns:=/vest"])
        cls.newest = {}
        rospy.Subscriber("/vest/model/topology", TissueTopology, lambda m: cls.newest.update(topology=m))
        rospy.Subscriber("/vest/session/state", SessionState, lambda m: cls.newest.update(session=m))
        cls.edit = rospy.ServiceProxy("/vest/model/edit", EditModel)
        cls.edit.wait_for_service(60)
        assert patient(lambda: {"topology", "session"} <= set(cls.newest))

    @classmethod
    def tearDownClass(cls):
        end(cls.node)
        shutil.rmtree(cls.folder, ignore_errors=True)

    def done(self, *edit):
        answer = self.edit(*edit)
        self.assertTrue(answer.success, answer.message)
        return answer

    def test_a_drawing_is_seen_refused_in_one_line_recorded_run_saved_and_replayed(self):
        self.done("insert", "/objects/-", TREE)
        self.done("set", "/objects/tree/tree/radius", "0.0014")
        self.assertTrue(patient(lambda: any(o.name == "tree_3" for o in self.newest["topology"].objects)))
        seq = self.done("undo", "", "").seq
        refused = self.edit("set", "/objects/tree/tree/radius", "wide")
        self.assertFalse(refused.success)
        self.assertEqual(refused.seq, seq)
        self.assertIn("must be a number from", refused.message)
        self.assertNotIn("\n", refused.message)

        late = []
        rospy.Subscriber("/vest/model/edits", ModelEdit, late.append)
        self.assertTrue(patient(lambda: len(late) == 4), [m.op for m in late])
        self.assertEqual([m.op for m in late], ["open", "insert", "set", "undo"])
        self.assertEqual(late[-1].hash, late[1].hash)
        self.assertEqual([m.seq for m in late], [0, 1, 2, 3])

        ran = self.done("run", "", "")
        self.assertTrue(patient(lambda: self.newest["session"].scene == "drawn"), self.newest["session"].scene)
        self.assertEqual(ran.message, "runs in the session; 1 objects went on", "the hollow of the session's scene")
        drawn = len(self.newest["topology"].objects)
        session = self.newest["session"].step
        self.done("insert", "/objects/-", TREE.replace("name: tree", "name: bush").replace("-0.02, 0.02", "0.02, 0.02"))
        again = self.done("run", "", "")
        self.assertEqual(again.message, "runs in the session; %d objects went on" % drawn)
        self.assertTrue(patient(lambda: self.newest["session"].step > session), "steps are counted on")
        self.done("undo", "", "")
        ran = self.done("run", "", "")
        self.assertEqual(ran.message, again.message)
        saved = self.done("save", "", "")
        self.assertEqual(saved.scene_hash, ran.scene_hash)
        with open(self.source, encoding="utf-8") as f:
            self.assertIn("name: tree", f.read())

        self.assertTrue(patient(lambda: len(late) == 6), [m.op for m in late])

        bag = os.path.join(self.folder, "edits.bag")
        with rosbag.Bag(bag, "w") as file:
            for message in late[1:2] + late + late:  # a recorder that came while an edit went out, and again later
                file.write("/vest/model/edits", message)
        again = os.path.join(self.folder, "again")
        replay = subprocess.run(["rosrun", "vest_bringup", "vest_replay_model", bag, "-o", again], capture_output=True, text=True, check=False)
        self.assertEqual(replay.returncode, 0, replay.stderr)
        self.assertIn("5 edits, document " + late[-1].hash, replay.stdout)
        self.assertIn("scene " + saved.scene_hash, replay.stdout)
        for messages, why in ((late[:1] + late[2:], "edits are missing"), (late[1:], "no open before it"), (late[2:3] + late[:2], "no open before it")):
            with rosbag.Bag(bag, "w") as file:
                for message in messages:
                    file.write("/vest/model/edits", message)
            replay = subprocess.run(["rosrun", "vest_bringup", "vest_replay_model", bag], capture_output=True, text=True, check=False)
            self.assertEqual(replay.returncode, 1)
            self.assertIn(why, replay.stderr)


if __name__ == "__main__":
    rostest.rosrun("vest_bringup", "modeller", Modeller, sys.argv)
