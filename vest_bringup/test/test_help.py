#!/usr/bin/env python3
"""Protects whoever asks a program what it is: every program that rosrun can start answers --help, without a ROS master and without
doing anything else. Numbers on its command line are numbers."""
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

    def test_no_program_takes_for_a_number_what_is_none(self):
        # A NaN is neither below nor above: an end of it never comes, and a rate of it is a whole number of no value.
        def said(*words):
            done = subprocess.run(words, capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL, check=False,
                                  env=dict(os.environ, ROS_MASTER_URI="http://localhost:1"))
            return done.returncode, done.stdout + done.stderr

        tried = 0
        for name, program in sorted(installed().items()):
            whole = said(program, "--help")[1]
            for command in [()] + [(word,) for word in re.findall(r"^  (\w+) ", whole.partition("Subcommands:\n")[2], re.M)]:
                page = said(program, *command, "--help")[1] if command else whole
                for option, count in re.findall(r"^  (?:-\w,)?(--[\w-]+) FLOAT\S*(?: in \[.*?\])?\S*(?: x (\d+))?", page, re.M):
                    for value in ("nan", "inf", "1e999"):
                        with self.subTest(name, command=command, option=option, value=value):
                            file = ("--", "nowhere") if count else ()  # else a file that is asked for takes the last number
                            code, lines = said(program, *command, option, *[value] * int(count or 1), *file)
                            self.assertNotEqual(code, 0, lines)
                            self.assertIn(f"{option}: {value} is no FLOAT in [", lines)
                            tried += 1
        self.assertGreater(tried, 60)


if __name__ == "__main__":
    unittest.main()
