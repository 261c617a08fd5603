#!/usr/bin/env python3
"""Protects the action session/exercise in a running session: it begins the exercise in its scene, tells how it goes, refuses with one
sentence, and vest_score finds the same score in the recording to the bit. What a teacher does marks the result."""
import json
import os
import shutil
import subprocess
import sys
import unittest

import actionlib
import rosgraph
import rospkg
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from std_srvs.srv import Trigger
from vest_msgs.msg import ExerciseAction, ExerciseGoal, ParameterEdit, SessionState, StringStamped

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import patient  # noqa: E402

PATIENCE = rospy.Duration(100)


class ExerciseLive(unittest.TestCase):
    def setUp(self):
        self.output = rospy.get_param("~output")
        shipped = os.path.join(rospkg.RosPack().get_path("vest_bringup"), "exercises", "lift_tube")
        self.short = os.path.join(self.output, "short")
        shutil.copytree(shipped, self.short)
        file = os.path.join(self.short, "exercise.yaml")
        with open(file, encoding="utf-8") as read:
            text = read.read()
        with open(file, "w", encoding="utf-8") as write:
            text = text.replace("limit_s: 60", "limit_s: 2").replace("proficient_s: 12", "proficient_s: 1").replace("least_s: 2", "least_s: 0")
            # Wherever the strokes are when it is asked for, its clock starts.
            write.write(text.replace("below: 20}", "below: 500}"))
        self.feedback = []
        self.client = actionlib.SimpleActionClient("/vest/session/exercise", ExerciseAction)
        self.assertTrue(self.client.wait_for_server(PATIENCE))

    def tool(self, *words):
        return subprocess.run(["rosrun", "vest_bringup", *words], capture_output=True, text=True, timeout=100)

    def all_listen(self, publisher):
        """Whether every node that wants the topic is connected: what is published before is lost to the others."""
        nodes = next((nodes for topic, nodes in rosgraph.Master("/test").getSystemState()[1] if topic == publisher.resolved_name), [])
        return 0 < len(nodes) <= publisher.get_num_connections()

    def ended(self, **goal):
        self.client.send_goal(ExerciseGoal(**goal), feedback_cb=self.feedback.append)
        self.assertTrue(self.client.wait_for_result(PATIENCE))
        return self.client.get_state(), self.client.get_goal_status_text(), self.client.get_result()

    def test_a_session(self):
        rospy.wait_for_message("/vest/step_inputs", rospy.AnyMsg, 60)
        seen = 0  # the recorder has kept the State that it begins with before it says twice what it has recorded
        while seen < 2:
            seen += rospy.wait_for_message("/vest/session/recording", SessionState, 60).recorded_messages > 0
        for goal, said in (({"exercise": "weather"}, "exercise 'weather': unknown (allowed: "), ({"exercise": "lift_tube", "trainee": "nobody"}, "nobody"),
                           ({"exercise": "lift_tube", "time_limit": -1}, "time_limit")):
            state, text, _ = self.ended(**goal)
            self.assertEqual(state, GoalStatus.ABORTED)
            self.assertIn(said, text)
        self.assertEqual(self.feedback, [])

        self.assertEqual(self.tool("vest_trainee", "add", "anna").returncode, 0)
        with open(os.path.join(self.output, "reference_lift_tube.json"), "w", encoding="utf-8") as damaged:
            damaged.write('{"vest_reference": 1, "exer')
        file = os.path.join(self.short, "exercise.yaml")
        told = []
        results = rospy.Subscriber("/vest/session/result", StringStamped, told.append)
        state, text, result = self.ended(exercise=file, trainee="anna")
        self.assertEqual(state, GoalStatus.SUCCEEDED)
        self.assertTrue(text.startswith("the result is kept, but not compared: "), text)
        self.assertIn("reference_lift_tube.json", text)
        self.assertTrue(result.score.finished)
        self.assertFalse(result.score.passed)
        self.assertIn("Not done: Lay it back and open the jaws.", result.score.failed_by)
        self.assertEqual(result.directory, self.output)
        first = next(f for f in self.feedback if f.score.phase)
        self.assertEqual((first.score.exercise, first.score.phase, first.score.phase_number, first.score.phases), ("lift_tube", "grasp", 1, 3))
        hints = {f.hint for f in self.feedback}
        self.assertIn("Take the tube in its middle between the jaws and close them gently.", hints)
        self.assertEqual((first.score.limit, len(first.score.items)), (2, 5))
        self.assertLess(first.score.elapsed, self.feedback[-1].score.elapsed)

        # Again, with a teacher who helps. This one counts: it is the last.
        edits = rospy.Publisher("/vest/parameter_edit", ParameterEdit, queue_size=1)
        notes = rospy.Publisher("/vest/session/notes", StringStamped, queue_size=1)
        for publisher in (edits, notes):
            self.assertTrue(patient(lambda: self.all_listen(publisher)), publisher.name)  # noqa: B023
        del self.feedback[:]
        self.client.send_goal(ExerciseGoal(exercise=file), feedback_cb=self.feedback.append)
        while not self.feedback:
            self.assertFalse(self.client.wait_for_result(rospy.Duration(0.02)), self.client.get_goal_status_text())
        edits.publish("exercise", "assisted", 1)
        note = StringStamped(string="Slower <now>")
        note.header.stamp = rospy.Time.now()
        notes.publish(note)
        self.assertTrue(self.client.wait_for_result(PATIENCE))
        self.assertIn("assisted", self.client.get_result().score.flags)
        rospy.sleep(0.5)
        results.unregister()
        live = json.loads(told[-1].string)

        stop = rospy.ServiceProxy("/vest/session/stop", Trigger)()
        self.assertTrue(stop.success, stop.message)
        scored = self.tool("vest_score", "--json", "--report", self.output)
        self.assertEqual(scored.returncode, 0, scored.stderr)
        again = json.loads(scored.stdout)
        for one in (live, again):  # only who has the stamps knows the pace
            one["flags"] = [word for word in one["flags"] if word != "practice"]
        self.assertEqual(again, live)
        self.assertEqual(again["flags"], ["assisted"])
        with open(os.path.join(self.output, "report.html"), encoding="utf-8") as read:
            self.assertIn("Teacher: Slower &lt;now&gt;", read.read())
        shown = self.tool("vest_trainee", "show", "anna").stdout
        self.assertIn("lift_tube  not passed", shown)
        self.assertIn("other version", shown, "marks of one's own count for no learning curve")


if __name__ == "__main__":
    rospy.init_node("test_exercise_live")
    rostest.rosrun("vest_bringup", "exercise_live", ExerciseLive)
