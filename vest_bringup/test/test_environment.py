#!/usr/bin/env python3
"""Protects lockstep over ROS: session/env_step gives the bits of vest.make(), refuses with one sentence, and the example passes."""
import os
import subprocess
import sys
import unittest

import numpy as np
import rospy
import rostest
import vest
from vest_msgs.srv import EnvStep

EXAMPLE = os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../examples/reach_ros.py")


class Environment(unittest.TestCase):
    def setUp(self):
        rospy.wait_for_service("session/env_step", timeout=60)
        self.env = rospy.ServiceProxy("session/env_step", EnvStep, persistent=True)

    def test_a_step_has_the_bits_of_python(self):
        env = vest.make("grasp_lift")
        expected, _ = env.reset(seed=(1 << 40) + 5)
        seen = self.env(reset=True, seed=(1 << 40) + 5, action=[])
        self.assertTrue(seen.success, seen.message)
        over = False
        while not over:
            np.testing.assert_array_equal(np.float32(seen.observation), expected)
            self.assertEqual(seen.state_hash, env.hash())
            action = env.expert()
            expected, reward, terminated, truncated, info = env.step(action)
            seen = self.env(reset=False, seed=0, action=action)
            self.assertEqual((seen.reward, seen.terminated, seen.truncated, seen.passed, seen.score),
                             (reward, terminated, truncated, info["passed"], info["score"]))
            over = terminated or truncated
        self.assertTrue(seen.passed)
        done = self.env(reset=False, seed=0, action=action)
        self.assertFalse(done.success)
        self.assertIn("the episode is over", done.message)

    def test_an_exercise_has_the_bits_of_python_too(self):
        rospy.wait_for_service("exercise/session/env_step", timeout=60)
        service, env = rospy.ServiceProxy("exercise/session/env_step", EnvStep, persistent=True), vest.make("clip_cut_tube")
        expected, _ = env.reset(seed=2)
        seen = service(reset=True, seed=2, action=[])
        self.assertTrue(seen.success, seen.message)
        for _ in range(30):
            np.testing.assert_array_equal(np.float32(seen.observation), expected)
            self.assertEqual(seen.state_hash, env.hash())
            action = env.expert()
            expected = env.step(action)[0]
            seen = service(reset=False, seed=0, action=action)
        self.assertEqual(seen.score, 0)

    def test_what_is_wrong_is_told_and_moves_nothing(self):
        there = self.env(reset=True, seed=3, action=[]).state_hash
        for reset, action, text in ((False, [0] * 5, "5 numbers (allowed: 6)"), (False, [], "0 numbers"), (True, [0] * 6, "a reset has none")):
            seen = self.env(reset=reset, seed=1, action=action)
            self.assertFalse(seen.success)
            self.assertIn(text, seen.message)
        self.assertEqual(vest.make("grasp_lift").reset(seed=3)[0].shape, (21,))
        seen = self.env(reset=False, seed=0, action=[float("nan")] * 6)
        self.assertTrue(seen.success and np.isfinite(seen.observation).all())
        self.assertEqual(self.env(reset=True, seed=3, action=[]).state_hash, there)

    def test_the_example_reaches_its_goal(self):
        done = subprocess.run([sys.executable, EXAMPLE, "7"], env=dict(os.environ, ROS_NAMESPACE="other"), capture_output=True, text=True, timeout=100)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("passed True", done.stdout)


if __name__ == "__main__":
    rospy.init_node("test_environment")
    rostest.rosrun("vest_bringup", "environment", Environment)
