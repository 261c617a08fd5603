#!/usr/bin/env python3
"""Reaches a point beside a tube in lockstep over ROS, and says how many steps a second the service made.

    rosrun vest_bringup environment _task:=reach          # with a ROS master, in another terminal
    python3 examples/reach_ros.py [SEED]"""
import sys
import time

import numpy as np
import rospy
from vest_msgs.srv import EnvStep

rospy.wait_for_service("session/env_step", timeout=30)
env = rospy.ServiceProxy("session/env_step", EnvStep, persistent=True)  # one connection for all steps
seen = env(reset=True, seed=int(sys.argv[1]) if len(sys.argv) > 1 else 1, action=[])
total, steps, begin = 0.0, 0, time.monotonic()
while not (seen.terminated or seen.truncated):
    way = np.array(seen.observation[:3]) / 0.2  # goal minus tip, cm; an action of 1 is 2 mm
    seen = env(reset=False, seed=0, action=[*np.clip(way, -1, 1), 0, 0, 0])
    if not seen.success:
        sys.exit(seen.message)
    total, steps = total + seen.reward, steps + 1
print(f"passed {seen.passed} after {steps} steps, return {total:.3f}, {steps / (time.monotonic() - begin):.0f} steps/s")
