#!/usr/bin/env python3
"""Protects ./run's refusals (one line that names argument and value, before anything is installed or built), and the launch
prefix that lets a driver start when the session has begun."""
import os
import subprocess
import sys
import tempfile
import unittest

PACKAGE = sys.argv.pop(1)
RUN = os.path.join(PACKAGE, os.pardir, "run")
REFUSED = [
    (["--bogus"], "--bogus"),
    (["--seconds", "soon"], "--seconds soon"),
    (["--seconds", "-1"], "--seconds -1"),
    (["--seconds"], "--seconds"),
    (["--instrument", "up"], "--instrument up"),
    (["--trajectory", "/nowhere.csv"], "--trajectory /nowhere.csv"),
    (["--hardware", "/nowhere"], "--hardware /nowhere"),
    (["--hardware", "/dev/null"], "--hardware /dev/null: not a serial device"),
    (["--hardware", "/etc/passwd"], "--hardware /etc/passwd: not a serial device"),
    (["--output", "/dev/null/session"], "--output /dev/null/session"),
    (["scen:=tube"], "scen:=tube: unknown"),
    (["footswitch_preset:=feet"], "footswitch_preset:=feet"),
    (["output:=/tmp/elsewhere"], "--output"),
]
# A stand-in for rospy: one message on the topic of VEST_TOPIC, with what VEST_MESSAGE says.
ROSPY = """
import os, types
class rostime:
    @staticmethod
    def wallsleep(seconds):
        import time; time.sleep(seconds)
def init_node(*a, **k): pass
def Subscriber(topic, kind, callback):
    if topic == os.environ["VEST_TOPIC"]:
        callback(types.SimpleNamespace(RUNNING=1, **eval(os.environ["VEST_MESSAGE"])))
"""


class Run(unittest.TestCase):
    def test_each_wrong_argument_is_refused_in_one_line_that_names_it(self):
        for arguments, named in REFUSED:
            done = subprocess.run(["bash", RUN, *arguments], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 2, (arguments, done))
            self.assertIn(named, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertEqual(done.stdout, "")


class WhenRecording(unittest.TestCase):
    def waits(self, topic, message, quick=True):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "vest_msgs"))
            for name, text in (("rospy.py", ROSPY), ("vest_msgs/__init__.py", ""), ("vest_msgs/msg.py", "SessionState = None\n")):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            environment = dict(os.environ, PYTHONPATH=folder, VEST_TOPIC=topic, VEST_MESSAGE=message)
            script = os.path.join(PACKAGE, "scripts", "when_recording")
            begun = subprocess.Popen([sys.executable, script, "3600", "true"], env=environment)
            try:
                return begun.wait(timeout=20 if quick else 2) != 0
            except subprocess.TimeoutExpired:
                begun.kill()
                begun.wait()
                return True

    def test_the_command_starts_with_the_recording(self):
        self.assertFalse(self.waits("session/recording", "{'recording': True, 'state': 0}"))

    def test_the_command_waits_while_nothing_is_recorded_and_nothing_runs(self):
        self.assertTrue(self.waits("session/recording", "{'recording': False, 'state': 0}", quick=False))
        self.assertTrue(self.waits("session/state", "{'recording': False, 'state': 2}", quick=False))

    def test_a_driver_that_comes_back_does_not_wait_for_a_recorder_that_died(self):
        self.assertFalse(self.waits("session/state", "{'recording': False, 'state': 1}"))


if __name__ == "__main__":
    unittest.main()
