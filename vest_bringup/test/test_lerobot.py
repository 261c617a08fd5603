#!/usr/bin/env python3
"""Protects what a lab with LeRobot gets of a recording: the numbers, names and words of the session, one data set of all episodes, and one
message with no file where LeRobot is missing, too old, or wrote something else.

Two classes need LeRobot's place filled. One fills it with a stand-in (lerobot_stand_in), which shows what vest_export hands over. The other needs
the real one, in the python3 of PATH or in $VEST_LEROBOT_PYTHON, and shows what LeRobot reads back; else it is skipped.

usage: test_lerobot.py EXERCISE EXPORT"""
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

EXERCISE, EXPORT = sys.argv[1:3]
del sys.argv[1:3]
HERE = os.path.dirname(os.path.abspath(__file__))
REAL = os.environ.get("VEST_LEROBOT_PYTHON", "python3")
AIM = "Take the tube in its middle, lift it by 8 mm, hold it for a second, and lay it back without tearing it."
ULP = 2.0**-23  # a table has 9 digits, a frame is float32: both round

READ = """
import json, sys
import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset
data = LeRobotDataset("vest/read", root=sys.argv[1])
first = data[0]
out = {"frames": len(data), "episodes": data.num_episodes, "fps": data.fps, "task": first["task"],
       "names": {k: f["names"] for k, f in data.features.items()}}
columns = ("observation.state", "action", "next.reward", "simulated_time", "timestamp", "episode_index")
rows = data.hf_dataset[0:len(data)]
out.update({k: np.stack([np.asarray(v) for v in rows[k]]).reshape(len(data), -1).tolist() for k in columns})
if "observation.images.endoscope" in first:
    picture = np.asarray(data[len(data) // 2]["observation.images.endoscope"])
    out.update(picture=list(picture.shape), colour=picture.reshape(3, -1).mean(1).tolist())
json.dump(out, open(sys.argv[2], "w"))
"""


def has_lerobot(python):
    return subprocess.run([python, "-c", "from lerobot.datasets.lerobot_dataset import LeRobotDataset; LeRobotDataset.finalize"],
                          capture_output=True, check=False).returncode == 0


class Session(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.session = os.path.join(cls.folder, "lift")
        subprocess.run([EXERCISE, "run", "lift_tube", "--output", cls.session], check=True, capture_output=True)

    def python(self, *environment, flags=""):
        """@return a Python of these variables, as a virtual environment's"""
        file = os.path.join(self.folder, "python_" + self.id().split(".")[-1])
        with open(file, "w") as script:
            script.write('#!/bin/sh\nexec env %s /usr/bin/python3 %s "$@"\n' % (" ".join(environment), flags))
        os.chmod(file, 0o755)
        return file

    def export(self, *words, sessions=None, code=0, to="lerobot"):
        """@return folder, what was said"""
        out = os.path.join(self.folder, "%s_%s" % (to, self.id().split(".")[-1]))
        done = subprocess.run([EXPORT, *(sessions or [self.session]), "--to", to, "--output", out, *words], capture_output=True, text=True, timeout=600,
                              check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        if code != 0:
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertFalse(os.path.exists(out) or os.path.exists(out + ".part"))
        return out, done.stderr


class Refusals(Session):
    def test_without_lerobot_one_message_says_what_to_install(self):
        said = self.export("--python", self.python(flags="-I -S"), code=2)[1]
        self.assertIn("cannot import lerobot (No module named", said)
        self.assertIn("install LeRobot 0.4 or later", said)
        self.assertIn("--python", said)

    def test_a_lerobot_that_is_too_old_or_broken(self):
        for text, what in (("class LeRobotDataset: pass", "does not write format 3"), ("raise OSError('libx.so\\nis missing')", "libx.so is missing")):
            old = os.path.join(self.folder, "old", "lerobot", "datasets")
            os.makedirs(old)
            for name, content in (("../__init__.py", ""), ("__init__.py", ""), ("lerobot_dataset.py", text)):
                with open(os.path.join(old, name), "w") as file:
                    file.write(content)
            said = self.export("--python", self.python("PYTHONDONTWRITEBYTECODE=1", "PYTHONPATH=%s/old" % self.folder), code=2)[1]
            self.assertIn(what, said)
            shutil.rmtree(os.path.join(self.folder, "old"))

    def test_a_python_that_is_none(self):
        self.assertIn("/nowhere/python3 cannot be run", self.export("--python", "/nowhere/python3", code=2)[1])
        self.assertIn("ended with status 1", self.export("--python", "/bin/false", code=2)[1])


class StandIn(Session):
    def stand_in(self, *more):
        return self.python("PYTHONDONTWRITEBYTECODE=1", "PYTHONPATH=" + os.path.join(HERE, "lerobot_stand_in"), *more)

    def read(self, out):
        sys.path.insert(0, os.path.join(HERE, "lerobot_stand_in"))
        self.addCleanup(sys.path.remove, sys.path[0])
        from lerobot.datasets.lerobot_dataset import LeRobotDataset
        return LeRobotDataset("vest/read", root=out)

    def test_frames_are_the_rows_of_the_table(self):
        out, _ = self.export("--python", self.stand_in(), "--rate", "20", "--licence", "CC-BY-4.0")
        table, _ = self.export("--rate", "20", to="csv")
        with open(table + "/demo_0.csv") as file:
            rows = list(csv.DictReader(file))
        data = self.read(out)
        self.assertEqual((data.info["fps"], data.num_episodes, len(data)), (20, 1, len(rows) - 1))
        self.assertEqual(set(data.rows["task"]), {AIM})
        names = data.info["features"]["observation.state"]["names"]
        self.assertEqual(names, [n for n in rows[0] if n.startswith(("left_", "right_", "third_", "endoscope_"))])
        for k, state in enumerate(data.rows["observation.state"]):
            np.testing.assert_allclose(state, [float(rows[k][n]) for n in names], rtol=ULP)
            np.testing.assert_allclose(data.rows["simulated_time"][k][0], float(rows[k]["t_s"]), rtol=ULP)
            for axis in "xyz":  # 1: 0.1 m/s
                i = data.info["features"]["action"]["names"].index("right_" + axis)
                moved = float(rows[k + 1]["right_%s_m" % axis]) - float(rows[k]["right_%s_m" % axis])
                self.assertAlmostEqual(data.rows["action"][k][i] * 0.1 / 20, moved, places=7)
        self.assertAlmostEqual(float(np.sum(data.rows["next.reward"])), 1, places=5)
        self.assertEqual([bool(d[0]) for d in data.rows["next.done"]], [False] * (len(data) - 1) + [True])
        with open(out + "/card.json") as file:
            card = json.load(file)
        self.assertEqual((card["licence"], card["lerobot"]["format"], card["actions_cut_off"]), ("CC-BY-4.0", "v3.0", 0))
        self.assertEqual(sorted(card["files"]), ["data/episodes.pickle", "meta/info.json"])
        self.assertEqual(sorted(os.listdir(out)), ["card.json", "data", "meta"])

    def test_sessions_are_episodes_of_one_data_set(self):
        out, _ = self.export("--python", self.stand_in(), "--rate", "5", "--valid", self.session)
        data = self.read(out)
        self.assertEqual(data.num_episodes, 2)
        half = len(data) // 2
        for name in ("observation.state", "action", "next.reward"):
            np.testing.assert_array_equal(data.rows[name][:half], data.rows[name][half:])
        with open(out + "/card.json") as file:
            self.assertEqual([s["split"] for s in json.load(file)["sessions"]], ["train", "valid"])

    def test_pictures_are_what_the_endoscope_saw(self):
        out, _ = self.export("--python", self.stand_in(), "--rate", "2", "--pictures", "--width", "84", "--height", "64")
        data = self.read(out)
        pictures = np.stack(data.rows["observation.images.endoscope"])
        self.assertEqual(pictures.shape, (len(data), 64, 84, 3))
        red, _, blue = pictures[len(data) // 2].reshape(-1, 3).astype(float).mean(0)
        self.assertGreater(red, 1.5 * blue)
        self.assertFalse(np.array_equal(pictures[0], pictures[-1]))

    def test_what_is_read_back_with_other_numbers_is_not_kept(self):
        said = self.export("--python", self.stand_in("VEST_STAND_IN=spoil"), "--rate", "5", code=2)[1]
        self.assertIn("read back: observation.state of episode 0 has other numbers", said)

    def test_a_rate_that_lerobot_cannot_say(self):
        self.assertIn("--rate: rows would come 30.303030 times", self.export("--python", self.stand_in(), "--rate", "30", code=2)[1])
        self.assertIn("even numbers", self.export("--python", self.stand_in(), "--pictures", "--width", "85", code=2)[1])


@unittest.skipUnless(has_lerobot(REAL), "%s has no LeRobot 0.4 or later: $VEST_LEROBOT_PYTHON names one that has" % REAL)
class Real(Session):
    def read(self, *words):
        out, _ = self.export("--python", REAL, "--rate", "20", *words)
        file = os.path.join(self.folder, "read.json")
        subprocess.run([REAL, "-c", READ, out, file], check=True, timeout=600, env={**os.environ, "HF_HUB_OFFLINE": "1"})
        with open(file) as text:
            return json.load(text)

    def test_lerobot_reads_what_the_table_has(self):
        data = self.read("--valid", self.session)
        table, _ = self.export("--rate", "20", to="csv")
        with open(table + "/demo_0.csv") as file:
            rows = list(csv.DictReader(file))
        frames = len(rows) - 1
        self.assertEqual((data["frames"], data["episodes"], data["fps"], data["task"]), (2 * frames, 2, 20, AIM))
        names = data["names"]["observation.state"]
        expected = np.array([[float(row[n]) for n in names] for row in rows[:-1]])
        np.testing.assert_allclose(data["observation.state"], np.tile(expected, (2, 1)), rtol=ULP)
        np.testing.assert_allclose(np.array(data["timestamp"])[:, 0], np.tile(np.arange(frames) / 20, 2), rtol=1e-6)
        self.assertEqual([e[0] for e in data["episode_index"]], [0] * frames + [1] * frames)
        self.assertAlmostEqual(float(np.sum(data["next.reward"])), 2, places=5)

    def test_lerobot_shows_the_pictures(self):
        data = self.read("--pictures", "--width", "128", "--height", "96")
        self.assertEqual(data["picture"], [3, 96, 128])
        self.assertGreater(data["colour"][0], 1.5 * data["colour"][2])


if __name__ == "__main__":
    unittest.main()
