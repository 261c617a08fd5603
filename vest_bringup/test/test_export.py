#!/usr/bin/env python3
"""Protects what other programs read of a recording: rows have the motion and the hashes of the session, HDF5 has robomimic's layout, COCO's
masks are the labels, and a bag that is none leaves one message and no file.
Moments of a rehearsal hold what belongs together.

usage: test_export.py EXERCISE EXPORT"""
import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest

import h5py
import numpy as np
import rosbag

EXERCISE, EXPORT = sys.argv[1:3]
del sys.argv[1:3]


class Export(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.session = os.path.join(cls.folder, "lift")
        subprocess.run([EXERCISE, "run", "lift_tube", "--output", cls.session], check=True, capture_output=True)

    def export(self, *words, session=None, code=0):
        """@return folder, what was said"""
        out = os.path.join(self.folder, "out_" + self.id().split(".")[-1])
        done = subprocess.run([EXPORT, session or self.session, "--output", out, *words], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stderr)
        if code == 0:
            with open(out + "/card.json") as file:
                card = json.load(file)
            there = sorted(os.listdir(out))
            self.assertEqual(sorted(card["files"]) + ["card.json"], [n for n in there if n != "card.json"] + ["card.json"])
            self.assertGreaterEqual(card["sessions"][0]["state_hashes_compared"], 50)
            return out, card
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertFalse(os.path.exists(out) or os.path.exists(out + ".part"))
        return out, done.stderr

    def test_tables_and_hdf5_are_the_session(self):
        out, card = self.export("--to", "csv", "--rate", "10")
        self.assertIn("not stated", card["licence"])
        with open(out + "/demo_0.csv") as file:
            rows = list(csv.DictReader(file))
        with rosbag.Bag(self.session + "/session.bag") as bag:
            inputs = {m.step: m for _, m, _ in bag.read_messages("/vest/step_inputs")}
            hashes = {m.step: "%016x" % m.hash for _, m, _ in bag.read_messages("/vest/tissue/state_hash")}
        for row in rows:
            step = int(row["step"])
            np.testing.assert_allclose([float(row["right_%s_m" % a]) for a in "xyz"], inputs[step].tools[1].position, atol=1e-9)
            self.assertEqual(row["state_hash"], hashes[step])
        self.assertAlmostEqual(float(rows[-1]["score"]), 1.0, places=6)
        with open(out + "/demo_0_events.csv") as file:
            self.assertIn("tube grasped by right", file.read())
        held = [float(row["right_pinch_N"]) for row in rows if row["right_grasping"] == "1"]
        self.assertGreater(max(held), 0)

    def test_instruments_that_come_late_and_go_early_have_their_columns(self):
        late = os.path.join(self.folder, "late")
        os.makedirs(late)
        with rosbag.Bag(self.session + "/session.bag") as bag, rosbag.Bag(late + "/session.bag", "w") as out:
            last = max(m.step for _, m, _ in bag.read_messages("/vest/step_inputs"))
            for topic, m, t, connection in bag.read_messages(return_connection_header=True):
                if topic == "/vest/step_inputs" and (m.step <= 250 or m.step > last - 150):
                    for tool in m.tools:
                        tool.present = False
                if topic not in ("/vest/tissue/state_hash", "/vest/effects/state_hash"):  # they are of other inputs
                    out.write(topic, m, t, connection_header=connection)
        for kind in ("csv", "hdf5"):
            out = os.path.join(self.folder, "late_" + kind)
            done = subprocess.run([EXPORT, late, "--output", out, "--to", kind, "--rate", "10"], capture_output=True, text=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.folder + "/late_csv/demo_0.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertIn("right_x_m", rows[0])
        self.assertEqual([int(rows[0]["step"]), int(rows[-1]["step"])], [300, (last - 150) // 100 * 100])
        with open(self.folder + "/late_csv/card.json") as file:
            self.assertEqual(json.load(file)["episodes"][0]["rows_without_instruments_left_out"], last // 100 - len(rows))

    def test_hdf5_has_the_layout_of_robomimic(self):
        out, card = self.export("--to", "hdf5", "--rate", "5", "--pictures", "--width", "84", "--height", "84", "--valid", self.session)
        with h5py.File(out + "/sessions.hdf5") as file:
            data = file["data"]
            env = json.loads(data.attrs["env_args"])
            self.assertEqual((env["env_name"], env["type"]), ("vest/grasp_tube", 2))
            self.assertEqual([bytes(n) for n in file["mask/train"][:]] + [bytes(n) for n in file["mask/valid"][:]], [b"demo_0", b"demo_1"])
            self.assertEqual(data.attrs["total"], sum(d.attrs["num_samples"] for d in data.values()))
            for demo in data.values():
                n = demo.attrs["num_samples"]
                self.assertEqual(demo["actions"].shape, (n, 6))
                self.assertLessEqual(abs(demo["actions"][:]).max(), 1)
                self.assertAlmostEqual(demo["rewards"][:].sum(), 1, places=5)
                self.assertEqual((demo["dones"][:].sum(), demo["dones"][-1], demo["states"].shape), (1, 1, (n, 0)))
                self.assertEqual(set(demo["obs"]), set(demo["next_obs"]))
                for key in demo["obs"]:
                    np.testing.assert_array_equal(demo["obs"][key][1:], demo["next_obs"][key][:-1], key)
                moved = demo["next_obs/right_pos"][:] - demo["obs/right_pos"][:]
                np.testing.assert_allclose(demo["actions"][:, :3] * 0.1 / 5, moved, atol=1e-7)  # 1: 0.1 m/s
                pictures = demo["obs/endoscope_image"]
                self.assertEqual((pictures.shape, pictures.dtype), ((n, 84, 84, 3), np.uint8))
                red, green, blue = pictures[n // 2].reshape(-1, 3).astype(float).mean(0)
                self.assertGreater(red, 1.5 * blue)
        self.assertEqual([s["split"] for s in card["sessions"]], ["train", "valid"])
        self.assertEqual(card["actions_cut_off"], 0)

    def test_coco_masks_are_where_boxes_and_tips_are(self):
        out, card = self.export("--to", "coco", "--rate", "1", "--width", "180", "--height", "144", "--licence", "CC-BY-4.0")
        with open(out + "/annotations.json") as file:
            coco = json.load(file)
        self.assertEqual((card["licence"], coco["licenses"][0]["name"]), ("CC-BY-4.0",) * 2)
        names = {c["id"]: c["name"] for c in coco["categories"]}
        seen, tips = set(), 0
        for a in coco["annotations"]:
            counts, (height, width) = a["segmentation"]["counts"], a["segmentation"]["size"]
            mask = np.repeat(np.arange(len(counts)) % 2, counts).reshape(width, height).T
            y, x = np.nonzero(mask)
            self.assertEqual(a["area"], len(x))
            self.assertEqual(a["bbox"], [x.min(), y.min(), x.max() - x.min() + 1, y.max() - y.min() + 1])
            seen.add(names[a["category_id"]])
            for u, v, visible in np.reshape(a.get("keypoints", []), (-1, 3))[:1]:
                tips += 1
                if visible == 2:
                    self.assertLess(np.hypot(x - u, y - v).min(), 6, "the tip lies at the instrument")
        self.assertTrue({"tube", "right"} <= seen, seen)
        self.assertGreaterEqual(tips, 4)
        self.assertEqual(len(coco["images"]), card["episodes"][0]["rows"])
        for image in coco["images"]:
            for key in ("file_name", "depth_file_name", "flow_file_name"):
                self.assertTrue(os.path.exists(os.path.join(out, image[key])))

    def test_a_video(self):
        out, _ = self.export("--to", "mp4", "--rate", "2", "--width", "180", "--height", "144")
        with open(out + "/session.mp4", "rb") as file:
            self.assertEqual(file.read(12)[4:8], b"ftyp")

    def test_what_is_no_bag_leaves_one_message_and_no_file(self):
        bad = os.path.join(self.folder, "bad.bag")
        with open(self.session + "/session.bag", "rb") as file:
            whole = file.read()
        for content in (b"", os.urandom(5000), whole[:len(whole) // 2], whole[:5000] + os.urandom(5000) + whole[10000:]):
            with open(bad, "wb") as file:
                file.write(content)
            self.assertIn(bad, self.export("--to", "csv", session=bad, code=2)[1])
        self.assertIn("cannot be read", self.export("--to", "csv", session="/nowhere", code=2)[1])


class Moments(unittest.TestCase):
    def test_a_bag_that_cannot_be_written_is_one_message_and_leaves_nothing(self):
        script = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "trajectories", "cut_strip.yaml")
        with tempfile.TemporaryDirectory() as folder:
            os.mkfifo(os.path.join(folder, "fifo"))
            full = os.path.join(folder, "full.bag")
            limit = "trap '' XFSZ; ulimit -f 8; "  # as a disk with room for 8 kB
            for bag, before in (("/dev/full", ""), (folder, ""), (os.path.join(folder, "fifo"), ""),
                                (os.path.join(folder, "nowhere", "a.bag"), ""), (full, limit)):
                done = subprocess.run(["bash", "-c", before + 'exec "$0" "$@"', "rosrun", "vest_bringup", "vest_rehearse", script, "--scene",
                                       "cut_strip", "--seconds", "0.1", "--bag", bag, "--at", "0.02", "0.05"],
                                      capture_output=True, text=True, timeout=300, check=False)
                self.assertEqual(done.returncode, 1, bag + done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(f"vest_rehearse: {bag}: ", done.stderr)
            self.assertEqual(os.listdir(folder), ["fifo"])

    def test_a_film_of_blood_is_on_the_tissue_that_is_drawn_though_that_was_cut_just_now(self):
        script = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "trajectories", "cut_strip.yaml")
        with tempfile.TemporaryDirectory() as folder:
            bag = os.path.join(folder, "moments.bag")
            subprocess.run(["rosrun", "vest_bringup", "vest_rehearse", script, "--scene", "cut_strip", "--seconds", "4.2", "--bag", bag,
                            "--at", "3.45", "3.63", "3.89", "4.2"], check=True, stdout=subprocess.DEVNULL)  # the last one is the end
            film, states = 0, []
            with rosbag.Bag(bag) as messages:
                for topic, message, _ in messages.read_messages():
                    if topic.endswith("effects/surface"):
                        film = message.revision
                    if topic.endswith("tissue/state"):
                        states.append((message.revision, film))
        self.assertEqual(len(states), 4)
        self.assertGreater(len({revision for revision, _ in states}), 1, "it is cut meanwhile")
        for revision, film in states:
            self.assertEqual(film, revision)


if __name__ == "__main__":
    unittest.main()
