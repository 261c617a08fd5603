#!/usr/bin/env python3
"""Protects whoever asks a program what it is: every program that rosrun can start answers --help, without a ROS master and without
doing anything else."""
import glob
import os
import re
import subprocess
import sys
import tempfile
import unittest

BUILD = sys.argv.pop(1)


def installed():
    """What is installed for rosrun, as the build knows it: {name: file}."""
    found = {}
    for name in glob.glob(os.path.join(BUILD, "**", "cmake_install.cmake"), recursive=True):
        with open(name, encoding="utf-8") as file:
            text = file.read()
        for files in re.findall(r'DESTINATION "\$\{CMAKE_INSTALL_PREFIX\}/lib/vest_\w+" TYPE (?:EXECUTABLE|PROGRAM) FILES ([^)]*)\)', text):
            for path in re.findall(r'"([^"]+)"', files):
                found[os.path.basename(path)] = path
    return found


class Help(unittest.TestCase):
    def test_every_program_says_what_it_is_without_a_master(self):
        programs = installed()
        for name in ("recorder", "keep_running", "one_session", "when_recording", "with_trajectory", "vest_check_session",
                     "haptics", "start_devices", "phantom_box", "tissue_node", "vest_render"):
            self.assertIn(name, programs)
        nowhere = dict(os.environ, ROS_MASTER_URI="http://localhost:1")
        for name, program in sorted(programs.items()):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                done = subprocess.run([program, "--help"], capture_output=True, text=True, timeout=120, env=nowhere, cwd=folder,
                                      stdin=subprocess.DEVNULL, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertRegex(done.stdout, r"(?i)usage|\boptions\b|--help")
                self.assertNotIn("/usr/bin/", done.stdout, "the first line of a script is no help")
                self.assertEqual(done.stderr, "")
                self.assertEqual(os.listdir(folder), [], "nothing is written")


if __name__ == "__main__":
    unittest.main()
