#!/usr/bin/env python3
"""Protects ./run's refusals (one line that names argument and value, before anything is installed or built), the launch
prefixes that start a driver when the session has begun and keep it running, and the page that tells aim, time and picture of each exercise."""
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

PACKAGE = sys.argv.pop(1)
RUN = os.path.join(PACKAGE, os.pardir, "run")
REFUSED = [
    (["--bogus"], "--bogus"),
    (["--seconds", "soon"], "--seconds soon"),
    (["--seconds", "-1"], "--seconds -1"),
    (["--seconds"], "--seconds"),
    (["--instrument", "up"], "--instrument up"),
    (["--exercise", "juggle"], "--exercise juggle: unknown (allowed: "),
    (["--trainee", "anna"], "belong to --exercise"),
    (["--exercise", "clip_cut_tube", "script:=demo"], "give the script of an exercise as --script"),
    (["--exercise", "a\nb\x1b[31m"], "--exercise a\\nb\\x1b[31m: unknown (allowed: "),
    (["--exercise", "x" * 10000], "10000 characters (allowed: 4096)"),
    (["--exercise", "clip_cut_tube", "scene:=pelvis"], "scene:=pelvis: the exercise clip_cut_tube says it"),
    (["exercise:=look_round", "--exercise", "clip_cut_tube"], "exercise:=look_round: the exercise clip_cut_tube says it"),
    (["--exercise", "clip_cut_tube", "--script", "/nowhere/mine.yaml"], "the path of a waypoint file"),
    (["--trajectory", "/nowhere.csv"], "--trajectory /nowhere.csv"),
    (["--trajectory", "/nowhere.yaml"], "--trajectory /nowhere.yaml: no such file (allowed: "),
    (["--trajectory", os.path.join(PACKAGE, "trajectories", "demo.yaml"), "script:=demo"], "give one of them"),
    (["script:=nosuch"], "cut_tube"),
    (["script:=/nowhere/mine.yaml"], "the path of a waypoint file"),
    (["--hardware", "/nowhere"], "--hardware /nowhere"),
    (["--hardware", "/dev/null"], "--hardware /dev/null: not a serial device"),
    (["--hardware", "/etc/passwd"], "--hardware /etc/passwd: not a serial device"),
    (["--output", "/dev/null/session"], "--output /dev/null/session"),
    (["scen:=tube"], "scen:=tube: unknown"),
    (["footswitch_preset:=feet"], "footswitch_preset:=feet (allowed: trainer, dvrk, custom)"),
    (["scene:=nosuch"], "scene:=nosuch (allowed: arterial_bleeding, "),
    (["scene:=/nowhere/mine.yaml"], "or the path of a scene file"),
    (["left_tool:=foo"], "left_tool:=foo (allowed: none, grasper, "),
    (["third_tool:=endoscope"], "third_tool:=endoscope (allowed: "),
    (["left:=foot"], "left:=foot (allowed: box, crtk, "),
    (["endoscope:=haptic"], "endoscope:=haptic (allowed: box, crtk, none, teleop)"),
    (["threads:=x"], "threads:=x (allowed: a whole number 1 to 64)"),
    (["threads:=0"], "threads:=0 (allowed: "),
    (["fluid_spacing:=nan"], "fluid_spacing:=nan (allowed: m, 0.0005 to 0.01)"),
    (["force_limit:=-1"], "force_limit:=-1 (allowed: N, 0 to 1000)"),
    (["record:=maybe"], "record:=maybe (allowed: true, false)"),
    (["calibration:=/nowhere.yaml"], "calibration:=/nowhere.yaml (allowed: the path of a file)"),
    (["exercise:=juggle"], "exercise:=juggle (allowed: clip_cut_tube, "),
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
AnyMsg = None
def Subscriber(topic, kind, callback, queue_size=None):
    if topic == os.environ["VEST_TOPIC"]:
        callback(types.SimpleNamespace(RUNNING=1, **eval(os.environ["VEST_MESSAGE"])))
"""


ACCEPTED = [[], ["threads:=2", "left_tool:=scissors", "scene:=cut_tube"], ["third_tool:=", "fluid_spacing:=2e-3"],
            ["left:=my_devices/Omega", "right:=sim", "force_limit:=2.5", "record:=false"],
            ["scene:=" + os.path.join(PACKAGE, os.pardir, "vest_tissue", "scenes", "slab", "slab.yaml")],
            ["--exercise", "clip_cut_tube", "threads:=2"], ["--trajectory", os.path.join(PACKAGE, "trajectories", "demo.yaml")]]
ACCEPTED += [["--exercise", name, "--script", which] for name in sorted(os.listdir(os.path.join(PACKAGE, "exercises"))) for which in ("pass", "fail")]


class Run(unittest.TestCase):
    def test_what_the_nodes_take_is_accepted(self):
        session = os.path.join(PACKAGE, "scripts", "run_session")
        for arguments in ACCEPTED:
            done = subprocess.run([sys.executable, session, "--check", *arguments], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""), arguments)

    def test_its_tools_are_those_of_the_interface(self):
        with open(os.path.join(PACKAGE, os.pardir, "vest_msgs", "msg", "InstrumentState.msg"), encoding="utf-8") as file:
            tools = [name.lower() for name in re.findall(r"TOOL_(\w+) *=", file.read())]
        with open(os.path.join(PACKAGE, "scripts", "run_session"), encoding="utf-8") as file:
            said = re.search(r"TOOLS = \((.*?)\)", file.read(), re.S)[1]
        self.assertEqual(re.findall(r'"(\w+)"', said), [name for name in tools if name != "endoscope"])

    def test_each_wrong_argument_is_refused_in_one_line_that_names_it(self):
        for arguments, named in REFUSED:
            done = subprocess.run(["bash", RUN, *arguments], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 2, (arguments, done))
            self.assertIn(named, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertEqual(done.stdout, "")


class WhenRecording(unittest.TestCase):
    def waits(self, topic, message, *options, quick=True):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "vest_msgs"))
            for name, text in (("rospy.py", ROSPY), ("vest_msgs/__init__.py", ""), ("vest_msgs/msg.py", "SessionState = None\n")):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            environment = dict(os.environ, PYTHONPATH=folder, VEST_TOPIC=topic, VEST_MESSAGE=message)
            script = os.path.join(PACKAGE, "scripts", "when_recording")
            begun = subprocess.Popen([sys.executable, script, "3600", *options, "true"], env=environment)
            try:
                return begun.wait(timeout=20 if quick else 2) != 0
            except subprocess.TimeoutExpired:
                begun.kill()
                begun.wait()
                return True

    def test_the_command_starts_with_the_first_step(self):
        self.assertFalse(self.waits("session/state", "{'state': 1, 'step': 1}"))

    def test_the_command_waits_while_nothing_runs_though_a_recorder_is_ready(self):
        self.assertTrue(self.waits("session/recording", "{'recording': True, 'state': 1, 'step': 0}", quick=False))
        self.assertTrue(self.waits("session/state", "{'state': 2, 'step': 0}", quick=False))

    def test_with_picture_the_command_waits_for_the_view_too(self):
        self.assertTrue(self.waits("session/state", "{'state': 1, 'step': 1}", "--picture", quick=False))


class KeepRunning(unittest.TestCase):
    SCRIPT = os.path.join(PACKAGE, "scripts", "keep_running")

    def counted(self, ending):
        """Starts a command that notes each start and ends as told; returns (starts, exit code)."""
        with tempfile.TemporaryDirectory() as folder:
            notes = os.path.join(folder, "starts")
            command = 'echo $$ >> %s; [ "$(wc -l < %s)" -ge 3 ] && exit 0; %s' % (notes, notes, ending)
            code = subprocess.run([sys.executable, self.SCRIPT, "bash", "-c", command], timeout=60,
                                  stderr=subprocess.DEVNULL, check=False).returncode
            with open(notes, encoding="utf-8") as file:
                return len(file.readlines()), code

    def test_what_refused_its_parameters_is_not_started_again_and_its_code_is_kept(self):
        self.assertEqual(self.counted("exit 2"), (1, 2))

    def test_what_was_killed_is_started_again(self):
        self.assertEqual(self.counted("kill -9 $$"), (3, 0))

    def test_the_command_dies_with_the_script(self):
        with tempfile.TemporaryDirectory() as folder:
            note = os.path.join(folder, "pid")
            kept = subprocess.Popen([sys.executable, self.SCRIPT, "bash", "-c", "echo $$ > %s.new; mv %s.new %s; sleep 600" % (note, note, note)])
            while not os.path.exists(note):
                time.sleep(0.02)
            with open(note, encoding="utf-8") as file:
                child = int(file.read())
            kept.kill()
            kept.wait()
            for _ in range(500):
                try:
                    with open("/proc/%d/stat" % child, encoding="utf-8") as file:
                        if file.read().rsplit(")", 1)[1].split()[0] == "Z":
                            return
                except FileNotFoundError:
                    return
                time.sleep(0.02)
            self.fail("process %d outlives the script" % child)


class Page(unittest.TestCase):
    def test_each_exercise_has_its_aim_its_time_and_a_picture_that_is_there(self):
        import yaml
        docs = os.path.join(PACKAGE, os.pardir, "docs")
        with open(os.path.join(docs, "exercises.md"), encoding="utf-8") as file:
            page = file.read()
        names = sorted(os.listdir(os.path.join(PACKAGE, "exercises")))
        self.assertGreaterEqual(len(names), 12)
        for name in names:
            with open(os.path.join(PACKAGE, "exercises", name, "exercise.yaml"), encoding="utf-8") as file:
                e = yaml.safe_load(file)
            self.assertIn("| %s | %s | %g s | %g s |\n" % (name, e["aim"].strip(), e["limit_s"], e["proficient_s"]), page)
            reasons = ", ".join(one["reason"] for one in e["scripts"]["fail"])
            row = re.search(r"^\| %s \| %s \| %s \| !\[%s\]\((.*)\) \|$" % (name, re.escape(e["title"]), reasons, name), page, re.M)
            self.assertTrue(row, "%s: %s, fails by %s" % (name, e["title"], reasons))
            self.assertTrue(os.path.isfile(os.path.join(docs, row.group(1))), row.group(1))


if __name__ == "__main__":
    unittest.main()
