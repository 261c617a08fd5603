#!/usr/bin/env python3
"""Protects a user's first build from a compiler's warnings: whatever ./run compiles, this build compiles with the same words, and a warning
is an error here. Configures what ./run configures; compiles nothing.
usage: test_run_build.py SOURCE BUILD   (the build of ./test)"""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE, BUILD = (os.path.realpath(path) for path in sys.argv[1:3])
del sys.argv[1:3]


def compiled(build):
    """{object: its command}"""
    rules = subprocess.run(["ninja", "-C", build, "-t", "compdb"], check=True, capture_output=True, text=True).stdout
    return {entry["output"]: entry["command"].replace(build, "BUILD") for entry in json.loads(rules) if " -c " in entry["command"]}


class RunBuild(unittest.TestCase):
    def test_what_run_compiles_is_compiled_here_and_a_warning_is_an_error(self):
        with open(os.path.join(SOURCE, "run"), encoding="utf-8") as file:
            options = re.search(r'^configure "\$here/build/run" (.*)$', file.read(), re.MULTILINE).group(1)
        with tempfile.TemporaryDirectory() as folder:
            folder = os.path.realpath(folder)
            done = subprocess.run(["bash", "-c", '. "$1/.ci/common.sh" && configure "$2" ' + options, "-", SOURCE, folder],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            run, here = compiled(folder), compiled(BUILD)
        self.assertGreater(len(run), 100)
        for name, command in run.items():
            self.assertIn(name, here, "./run compiles it, ./test does not")
            self.assertIn(" -Werror ", here[name], name)
            self.assertEqual(command, here[name].replace(" -Werror ", " ", 1), name)


if __name__ == "__main__":
    unittest.main()
