#!/usr/bin/env python3
"""Protects the commands of docs/scenes.md: each scene, run live by its printed command, shows what its rehearsal shows. Judged by
the events of the tissue and by simulated time alone: a busy machine makes it slower and nothing else."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import end, master, own_port, patient  # noqa: E402

PORT = own_port()

import rospkg  # noqa: E402
import rospy  # noqa: E402  (reads the environment)
from vest_msgs.msg import SessionState, TissueEvent  # noqa: E402

PACKAGE = rospkg.RosPack().get_path("vest_bringup")
TRAJECTORIES = os.path.join(PACKAGE, "trajectories")
PAGE = sys.argv.pop(1)
SHORT = ["coagulate_slab", "clip_tube"]  # tools that are no grasper
WANTED = os.environ.get("VEST_SCENES", "").split()  # by hand: some scenes only
LOOPS = 3  # of the motion, in simulated time: where the machine is busy, the simulation lags behind the hand


def printed():
    """{scene: command} of the page."""
    with open(PAGE, encoding="utf-8") as file:
        return {scene: command.split() for command, scene in re.findall(r"^    (roslaunch vest_bringup scene\.launch scene:=(\w+))",
                                                                        file.read(), re.M)}


def rehearsed(scene):
    """What happens to the tissue, in order: {event: times, of clips; else once}, and the length of the motion (s)."""
    script = os.path.join(TRAJECTORIES, scene + ".yaml")
    said = subprocess.run(["rosrun", "vest_bringup", "vest_rehearse", script, "--scene", scene], capture_output=True, text=True,
                          check=True).stdout
    events = re.findall(r"^ *[\d.]+ s  (.+) at \[", said, re.M)
    with tempfile.NamedTemporaryFile(suffix=".csv") as csv:
        length = subprocess.run(["rosrun", "vest_instruments", "trajectory_from_waypoints", script, "--output", csv.name],
                                capture_output=True, text=True, check=True).stdout
    return {event: events.count(event) if "clipped" in event else 1 for event in events}, float(re.search(r", ([\d.]+) s", length)[1])


class ScenesLive(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.master = master(PORT)
        rospy.init_node("test_scenes_live", anonymous=True, disable_rosout=True)

    @classmethod
    def tearDownClass(cls):
        end(cls.master)

    def play(self, scene, command):
        wanted, length = rehearsed(scene)
        events, state = [], [None]
        listening = [rospy.Subscriber("/vest/tissue/events", TissueEvent, events.append, queue_size=10000),
                     rospy.Subscriber("/vest/session/state", SessionState, lambda m: state.__setitem__(0, m))]
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+") as said:
            session = subprocess.Popen([*command, "rviz:=false", "port:=" + os.path.join(folder, "box")], stdout=said,
                                       stderr=subprocess.STDOUT)

            def steps():
                return state[0].step if state[0] else 0

            def missing():
                told = [e.text for e in events]
                return [event for event, times in wanted.items() if told.count(event) < times]

            def goes_on(had):
                return steps() > had or session.poll() is not None

            try:
                while steps() < 1000 or (missing() and steps() < 1000 * LOOPS * length):
                    self.assertTrue(patient(lambda had=steps(): goes_on(had), 120), f"{scene} stands still")
                    self.assertIsNone(session.poll(), scene + " ended by itself")
            finally:
                end(session)
                for subscriber in listening:
                    subscriber.unregister()
                said.seek(0)
                text = said.read()
        first, counts = {}, {}
        for event in events:
            first.setdefault(event.text, 1e-3 * event.step)
            counts[event.text] = counts.get(event.text, 0) + 1
        print(f"{scene}: motion of {length:g} s; what the rehearsal shows, live at simulated s (times): "
              + ", ".join(f"{name} {first[name]:.1f} ({counts[name]})" if name in first else f"{name} MISSING" for name in wanted)
              + "".join(f"; beyond it {name} {t:.1f} ({counts[name]})" for name, t in first.items() if name not in wanted)
              + f"; {1e-3 * steps():.1f} s simulated, real-time factor of the last second {state[0].real_time_factor:.2f}", flush=True)
        self.assertEqual(missing(), [], f"{scene}: {text[-3000:]}")
        self.assertFalse([e.text for e in events if e.kind == TissueEvent.FAULT], scene)

    def test_every_scene_with_a_script_is_on_the_page(self):
        scripts = {os.path.splitext(name)[0] for name in os.listdir(TRAJECTORIES)} - {"demo"}
        self.assertEqual(set(printed()), scripts)

    def test_scenes_run_live_show_what_their_rehearsals_show(self):
        commands = printed()
        done = 0
        for scene in WANTED or (commands if "VEST_FULL" in os.environ else SHORT):
            with self.subTest(scene):
                self.play(scene, commands[scene])
                done += 1
        print(f"count: {done} of {len(commands)} scenes, live by the commands of docs/scenes.md "
              "(ScenesLive.test_scenes_run_live_show_what_their_rehearsals_show)", flush=True)


if __name__ == "__main__":
    unittest.main()
