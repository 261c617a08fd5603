#!/usr/bin/env python3
"""Protects the launch files: each one that is shipped parses, in its shipped configurations, and names what it starts."""
import os
import subprocess
import sys
import unittest

from roslaunch.config import load_config_default

LAUNCH = sys.argv.pop(1)
CASES = [
    ("trainer.launch", [], ["manager", "instruments", "trainer", "recorder", "view", "phantom_box", "phantom_box_emulator"]),
    ("trainer.launch", ["headless:=true", "record:=false", "emulator:=false", "port:=/dev/ttyUSB0"],
     ["manager", "view", "phantom_box"]),
    ("trainer.launch", ["rviz:=false", "trajectory:=/tmp/a.csv", "loop:=true"], ["phantom_box_emulator", "recorder"]),
    ("trainer.launch", ["script:=demo"], ["phantom_box_emulator", "instruments"]),
    ("scene.launch", [], ["phantom_box_emulator", "trainer", "view"]),
    ("scene.launch", ["scene:=/tmp/mine.yaml"], ["phantom_box_emulator", "trainer"]),
    ("trainer.launch", ["left:=sim", "right:=impulse_engine"], ["haptics_left", "haptics_right"]),
    ("trainer.launch", ["inputs:=/tmp/inputs.yaml", "left:=sim"], ["input_devices", "haptic_devices"]),
    ("replay.launch", ["bag:=/tmp/session.bag"], ["play", "view"]),
]


class LaunchFiles(unittest.TestCase):
    def test_every_shipped_file_is_tried(self):
        self.assertEqual({name for name, _, _ in CASES}, set(os.listdir(LAUNCH)))

    def test_each_parses_and_names_its_nodes(self):
        for name, arguments, nodes in CASES:
            done = subprocess.run(["roslaunch", "--nodes", os.path.join(LAUNCH, name), *arguments], capture_output=True,
                                  text=True, check=False)
            self.assertEqual(done.returncode, 0, name + done.stderr)
            started = {line.rsplit("/", 1)[-1] for line in done.stdout.split()}
            self.assertTrue(set(nodes) <= started, f"{name} {arguments}: {started}")

    def test_a_haptic_process_that_died_is_never_started_again(self):
        for arguments, nodes in ((["left:=sim", "third:=phantom"], {"haptics_left", "haptics_third"}),
                                 (["left:=haptic"], set()),  # started by itself
                                 (["inputs:=/tmp/inputs.yaml"], {"haptic_devices"})):
            config = load_config_default([(os.path.join(LAUNCH, "trainer.launch"), arguments)], None, verbose=False)
            haptic = [node for node in config.nodes if node.package == "vest_haptics"]
            self.assertEqual({node.name for node in haptic}, nodes)
            for node in haptic:
                self.assertFalse(node.respawn, node.name)
                self.assertTrue(node.required, f"{node.name}: the session ends with it")
                self.assertFalse(node.launch_prefix, f"{node.name}: keep_running would start it again")

    def test_without_the_emulator_none_is_started(self):
        done = subprocess.run(["roslaunch", "--nodes", os.path.join(LAUNCH, "trainer.launch"), "emulator:=false"],
                              capture_output=True, text=True, check=False)
        self.assertNotIn("phantom_box_emulator", done.stdout)


if __name__ == "__main__":
    unittest.main()
