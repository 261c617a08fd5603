#!/usr/bin/env python3
"""Protects the judge of sessions: a good one passes, and each way to be bad fails."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import genpy
import rosbag
from std_msgs.msg import Header
from vest_msgs.msg import StepInput, StringStamped

CHECK = sys.argv.pop(1)
RATES = {"joint_states": 1000, "phantom_box/joint_states": 1000, "phantom_box/footswitches": 60, "left/measured_js": 200,
         "left/measured_cp": 200, "right/measured_js": 200, "right/measured_cp": 200, "endoscope/measured_cp": 200,
         "tissue/state": 60, "tissue/contacts": 250, "/tf": 100, "endoscope/camera_info": 20}
SECONDS = 3


def write(folder, rates, every=None, skip=(), stall=None, json_edit=None, clock=None, marked=True):
    """A session of SECONDS s. every: of a topic, each so-manieth message is kept; skip: steps that are missing; stall: (step, seconds) that the simulation stands still; clock:
    (step, seconds) by which the system clock is set, marked by the recorder."""
    messages = []
    for topic, rate in rates.items():
        name = topic if topic.startswith("/") else "/vest/" + topic
        for k in range(0, int(SECONDS * rate), (every or {}).get(topic, 1)):
            messages.append((k / rate, name, Header(seq=k)))
    t, count = 0.0, 0
    for k in range(1, 1000 * SECONDS + 1):
        t += stall[1] if stall and stall[0] == k else 0.001
        if k in skip:
            continue
        m = StepInput(step=k, dt=0.001)
        m.header.stamp = genpy.Time.from_sec(10000.0 + t + (clock[1] if clock and k >= clock[0] else 0.0))
        if clock and k == clock[0] and marked:
            messages.append((t + 0.015, "/vest/session/marks", StringStamped(string=f"system clock set by {clock[1]:+.6f} s")))
        m.header.frame_id = "world"
        messages.append((t, "/vest/step_inputs", m))
        count += 1
    messages.sort(key=lambda m: m[0])
    with rosbag.Bag(os.path.join(folder, "session.bag"), "w") as bag:
        for time, topic, message in messages:
            bag.write(topic, message, genpy.Time.from_sec(10000.0 + time))
    session = {"real_time_factor": (1000 * SECONDS - 1) * 0.001 / (t - 0.001), "steps": count, "rates": {}, "events": [],
               "scene_hash": "0", "state_hash": "0", "version": "0.1.0", "ended": "interrupted"}
    session.update(json_edit or {})
    with open(os.path.join(folder, "session.json"), "w", encoding="utf-8") as f:
        json.dump({k: v for k, v in session.items() if v is not None}, f)


class CheckSession(unittest.TestCase):
    def judge(self, *options, **changes):
        rates = dict(RATES)
        rates.update(changes.pop("rates", {}))
        with tempfile.TemporaryDirectory() as folder:
            write(folder, {k: v for k, v in rates.items() if v}, **changes)
            done = subprocess.run([CHECK, folder, *options], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def test_a_good_session_passes(self):
        code, out = self.judge()
        self.assertEqual(code, 0, out)

    def test_each_topic_that_is_too_slow_fails(self):
        slow = {"joint_states": 400, "phantom_box/footswitches": 40, "left/measured_js": 90, "tissue/state": 50,
                "tissue/contacts": 150, "/tf": 40, "endoscope/camera_info": 12}
        for topic, rate in slow.items():
            code, out = self.judge(rates={topic: rate})
            self.assertEqual(code, 1, f"{topic} at {rate} Hz passed\n{out}")

    def test_of_thinned_topics_what_was_sent_counts_and_not_what_was_kept(self):
        kept = {"tissue/state": 6, "joint_states": 10, "tissue/contacts": 5, "left/measured_cp": 4}
        code, out = self.judge(every=kept)
        self.assertEqual(code, 0, out)
        code, out = self.judge(every={"/tf": 10})
        self.assertEqual(code, 1, "of all others it is what the bag has\n" + out)
        code, out = self.judge(every=kept, rates={"joint_states": 400})
        self.assertEqual(code, 1, out)

    def test_a_missing_topic_fails_and_the_picture_may_be_left_out_when_told(self):
        self.assertEqual(self.judge(rates={"tissue/contacts": 0})[0], 1)
        self.assertEqual(self.judge(rates={"endoscope/camera_info": 0})[0], 1)
        self.assertEqual(self.judge("--no-picture", rates={"endoscope/camera_info": 0})[0], 0)

    def test_one_skipped_step_fails(self):
        code, out = self.judge(skip={1500})
        self.assertEqual(code, 1, out)

    def test_a_stall_of_100_ms_fails_the_worst_second(self):
        code, out = self.judge(stall=(1500, 0.1))
        self.assertEqual(code, 1, out)

    def test_a_clock_that_is_set_is_told_apart_from_a_stall_by_its_mark(self):
        for by in (-3600.0, 3600.0, 0.3):
            code, out = self.judge(clock=(1500, by))
            self.assertEqual(code, 0, out)
            code, out = self.judge(clock=(1500, by), marked=False)
            self.assertEqual(code, 1, out)
        code, out = self.judge(clock=(1500, -3600.0), stall=(2000, 0.1))
        self.assertEqual(code, 1, out)

    def test_session_json_must_be_whole_and_agree_with_the_bag(self):
        self.assertEqual(self.judge(json_edit={"scene_hash": None})[0], 1)
        self.assertEqual(self.judge(json_edit={"steps": 17})[0], 1)
        self.assertEqual(self.judge(json_edit={"real_time_factor": 1.2})[0], 1)

    def test_a_key_that_stands_twice_in_session_json_is_no_word_of_either(self):
        with tempfile.TemporaryDirectory() as folder:
            write(folder, RATES)
            file = os.path.join(folder, "session.json")
            with open(file, encoding="utf-8") as f:
                text = f.read()
            with open(file, "w", encoding="utf-8") as f:
                f.write(text.replace("{", '{"ended": "killed",\n', 1))
            done = subprocess.run([CHECK, folder], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"session.json +line 2: key = ended +each key once +NO")

    def test_a_session_that_did_not_end_as_it_was_meant_to_never_holds(self):
        for ended in ("killed", "disk full", "", 17, None):
            code, out = self.judge(json_edit={"ended": ended})
            self.assertEqual(code, 1, out)
            self.assertNotIn("every row holds", out)
        for ended in ("stopped", "after the wished time"):
            self.assertEqual(self.judge(json_edit={"ended": ended})[0], 0)

    def test_one_that_was_not_recovered_is_told_to_be(self):
        with tempfile.TemporaryDirectory() as folder:
            write(folder, RATES)
            os.rename(os.path.join(folder, "session.bag"), os.path.join(folder, "session.bag.active"))
            done = subprocess.run([CHECK, folder], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("vest_recover_bag", done.stderr)

    def test_a_folder_without_a_bag_is_an_error_of_its_own(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([CHECK, folder], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("session.bag", done.stderr)


if __name__ == "__main__":
    unittest.main()
