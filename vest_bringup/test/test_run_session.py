#!/usr/bin/env python3
"""Protects the supervision of a session by ./run: its end, its exit code and its words, whatever the launch does; and that nothing
outlives it. The launch is a few lines of shell here."""
import contextlib
import importlib.machinery
import importlib.util
import io
import os
import subprocess
import sys
import tempfile
import time
import unittest

PACKAGE = sys.argv.pop(1)
RUN = os.path.join(PACKAGE, os.pardir, "run")
LOADER = importlib.machinery.SourceFileLoader("run_session", os.path.join(PACKAGE, "scripts", "run_session"))
sys.dont_write_bytecode = True
run_session = importlib.util.module_from_spec(importlib.util.spec_from_loader("run_session", LOADER))
LOADER.exec_module(run_session)

# What a recorder leaves, and how.
RECORDED = 'sleep 0.3; echo bag > session.bag; echo \'{"ended": "%s"}\' > session.json; '


class Supervision(unittest.TestCase):
    def session(self, shell, seconds=5):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        environment = dict(os.environ, ROS_LOG_DIR=os.path.join(folder.name, "log"))
        self.folder = folder.name
        return run_session.Session(folder.name, seconds, ["bash", "-c", "cd %s; %s" % (folder.name, shell)], environment)

    def result(self, session, recorded=True):
        """(exit code, or what failed; what was printed)"""
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            try:
                code = session.result(recorded)
            except run_session.Failed as failed:
                code = str(failed)
        return code, out.getvalue()

    def test_a_session_whose_time_is_over_is_told_to_end_and_its_files_are_named(self):
        began = time.monotonic()
        code, said = self.result(self.session(RECORDED % "after the wished time" + "trap 'exit 0' INT; sleep 100 & wait"))
        self.assertEqual(code, 0, said)
        self.assertIn("session: %s (with session.bag session.json)" % self.folder, said)
        self.assertLess(time.monotonic() - began, 60, "told, not waited for")

    def test_a_launch_that_does_not_end_when_told_is_killed(self):
        code, said = self.result(self.session(RECORDED % "after the wished time" + "trap '' INT TERM; while :; do sleep 1; done"))
        self.assertEqual(code, 0, said)

    def test_a_launch_that_ends_by_itself_is_a_failure_with_its_code(self):
        code, said = self.result(self.session("exit 7"))
        self.assertIn("the launch ended by itself with code 7, see above; messages of the nodes: ", code, said)
        code, _ = self.result(self.session("true"))
        self.assertIn("nothing was recorded; messages of the nodes: ", code)
        code, _ = self.result(self.session(RECORDED % "interrupted" + "true"))
        self.assertIn("the launch ended before its time", code)

    def test_a_recording_of_before_counts_for_nothing(self):
        session = self.session("sleep 0.5")
        for name in ("session.bag", "session.json"):
            path = os.path.join(self.folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write('{"ended": "after the wished time"}')
            os.utime(path, (1, 1))
        self.assertIn("nothing was recorded", self.result(session)[0])

    def test_ctrl_c_is_a_normal_end_once_something_is_recorded_and_130_before(self):
        session = self.session("trap 'exit 0' INT; sleep 100 & wait")
        session.interrupt()
        code, said = self.result(session)
        self.assertEqual((code, said), (130, "== interrupted before the recording began\n"))
        session = self.session(RECORDED % "interrupted" + "trap 'exit 0' INT; sleep 100 & wait")
        while not session.written():
            time.sleep(0.05)
        session.interrupt()
        self.assertEqual(self.result(session)[0], 0)

    def test_what_was_not_wished_to_be_recorded_is_no_failure(self):
        self.assertEqual(self.result(self.session("true"), recorded=False), (0, "== nothing was recorded, as wished\n"))

    def test_a_recorder_that_was_killed_ends_the_session_and_its_bag_is_recovered(self):
        session = self.session("head -c 200000 /dev/zero > session.bag.active; touch -d '1 minute ago' session.bag.active; "
                               "trap 'exit 0' INT; sleep 100 & wait", seconds=0.1)
        session.started -= 10
        tools = os.path.join(self.folder, "bin")
        os.makedirs(tools)
        with open(os.path.join(tools, "rosrun"), "w", encoding="utf-8") as file:
            file.write('#!/bin/sh\necho "$@" > "%s/recovered"\n' % self.folder)
        os.chmod(os.path.join(tools, "rosrun"), 0o755)
        self.addCleanup(os.environ.__setitem__, "PATH", os.environ["PATH"])
        os.environ["PATH"] = tools + ":" + os.environ["PATH"]
        code, said = self.result(session)
        self.assertEqual(code, 1)
        self.assertIn("was recovered", said)
        with open(os.path.join(self.folder, "recovered"), encoding="utf-8") as file:
            self.assertEqual(file.read(), "vest_bringup vest_recover_bag %s\n" % self.folder)

    def test_a_session_that_never_records_is_ended_after_its_patience(self):
        session = self.session("trap 'exit 0' INT; sleep 100 & wait", seconds=1)
        session.started -= 1000
        self.assertIn("nothing was recorded within 181 s", self.result(session)[0])

    def test_no_process_outlives_the_session_even_if_roslaunch_was_killed(self):
        session = self.session("setsid sleep 1000 & echo $! > pid; setsid bash -c 'trap : INT TERM; while :; do sleep 1; done' & kill -9 $$")
        code, _ = self.result(session)
        self.assertIn("with code -9", code)
        self.assertEqual(session.left_over(), [])

    def test_two_sessions_at_once_get_ports_of_their_own(self):
        one, lock = run_session.hold_port(21311)
        two, other = run_session.hold_port(21311)
        self.assertNotEqual(one, two)
        lock.close(), other.close()


class Systems(unittest.TestCase):
    """Nothing is installed beside another ROS, nor on a system whose packages are others'."""

    def said(self, release, ros):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "os-release"), "w", encoding="utf-8") as file:
                file.write(release)
            os.makedirs(os.path.join(folder, "ros", *ros))
            # ./run's own line: what follows would install and build.
            done = subprocess.run(["bash", "-c", '. "$0/.ci/common.sh"; refuse_other_systems; echo goes on', os.path.dirname(RUN)],
                                  env=dict(os.environ, VEST_OS_RELEASE=folder + "/os-release", VEST_OPT_ROS=folder + "/ros"),
                                  capture_output=True, text=True, timeout=60, check=False)
            return done.returncode, done.stdout + done.stderr

    def test_each_other_system_is_told_so_at_once(self):
        debian, ubuntu = 'ID=debian\nVERSION_ID="12"\nPRETTY_NAME="Debian 12"\n', 'ID=ubuntu\nVERSION_ID="20.04"\nPRETTY_NAME="Ubuntu 20.04"\n'
        self.assertEqual(self.said(debian, []), (0, "goes on\n"))
        code, said = self.said(ubuntu, [])
        self.assertEqual(code, 1)
        self.assertIn("this is Ubuntu 20.04", said)
        for release in (debian, ubuntu):
            code, said = self.said(release, ["noetic"])
            self.assertEqual(code, 1)
            self.assertIn("has a ROS of its own (noetic ): nothing was installed beside it", said)
        self.assertEqual(self.said("", [])[0], 1)

    def test_run_and_test_ask_before_they_install(self):
        for script in (RUN, os.path.join(PACKAGE, os.pardir, "test")):
            with open(script, encoding="utf-8") as file:
                text = file.read()
            self.assertLess(text.index("refuse_other_systems"), text.index("install_missing"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
