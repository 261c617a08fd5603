#!/usr/bin/env python3
"""Protects whoever looks at a new box or device with watch_device: a dead potentiometer, noise, readings that leap once, lost
frames, force over pose are seen in the picture and said in words. Nothing is drawn on a real screen."""
import importlib.machinery
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import unittest

import numpy as np

SCRIPT = sys.argv.pop(1)
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import own_port  # noqa: E402

os.environ["QT_QPA_PLATFORM"] = "offscreen"
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("watch_device", SCRIPT)
watch = importlib.util.module_from_spec(importlib.util.spec_from_loader("watch_device", loader))
loader.exec_module(watch)
application = watch.QtWidgets.QApplication([])
JOINTS = ["left_" + axis for axis in ("yaw", "pitch", "insertion", "roll", "jaw")]


def table(joints, frames=20000, rate=1000, lost=()):
    """Rows as box_setup prints them. @param joints {name: (position, raw)} of each frame, NaN: not usable, not read"""
    names = [word for name in joints for word in (name, name + "_raw")]
    lines, missing = ["t_s," + ",".join(names) + ",footswitches,lost,crc_errors\n"], 0
    for k in range(frames):
        if k in lost:
            missing += 1
            continue
        words = ["" if np.isnan(x) else "%.6f" % x for pair in joints.values() for x in (pair[0][k], pair[1][k])]
        lines.append(",".join(["%.6f" % (k / rate), *words, "0", str(missing), "0"]) + "\n")
    return lines


def watched(lines):
    """The source, once it has taken all of a table's lines."""
    with tempfile.NamedTemporaryFile("w+") as file:
        file.writelines(lines)
        file.flush()
        with open(file.name, encoding="utf-8") as rows:
            source = watch.Table(rows, 20.0, ["left"])
            while not source.ended:
                source.take()
            source.take()
    return source


def picture(source):
    image = watch.QtGui.QImage(900, 700, watch.QtGui.QImage.Format_RGB32)
    painter = watch.QtGui.QPainter(image)
    watch.paint(painter, image.size(), source)
    painter.end()
    pixels = image.constBits()
    pixels.setsize(image.byteCount())
    return np.frombuffer(bytes(pixels), np.uint8).reshape(image.height(), image.width(), 4)[:, :, 2::-1].astype(int)


def blue(pixels):
    return (pixels[:, :, 2] - pixels[:, :, 0] > 90)


def moved():
    """All joints in motion; the driver uses none before 20 readings."""
    angle = [0.3 * np.sin(0.7 * np.arange(20000) / 1000 + i) for i in range(len(JOINTS))]
    return {name: (np.concatenate((np.full(20, np.nan), x[20:])), x) for name, x in zip(JOINTS, angle)}


class WatchDevice(unittest.TestCase):
    def test_what_is_wrong_with_a_joint_is_said_and_a_good_one_has_no_blame(self):
        joints = moved()
        tremble = np.random.default_rng(3).normal(0, 0.002, 20000)  # 2 mrad beside a motion of 600
        joints["left_pitch"] = tuple(x + tremble for x in joints["left_pitch"])
        joints["left_roll"] = tuple(0 * x + 0.1 for x in joints["left_roll"])
        position, raw = (x.copy() for x in joints["left_jaw"])
        raw[5000], position[12000:12100] = raw[5000] + 1, np.nan
        joints["left_jaw"] = position, raw
        source = watched(table(joints, lost=range(9000, 9200)))
        yaw, pitch, insertion, roll, jaw = source.columns[0]
        for good in (yaw, insertion):
            self.assertEqual(good.note()[1], watch.INK, good.note())
        self.assertIn("noise 0.00", yaw.note()[0])
        self.assertAlmostEqual(watch.noise(pitch.read()[1][0]), 2.0, delta=0.3)
        self.assertIn("HAS NOT MOVED", roll.note()[0])
        self.assertIn("101 not taken", jaw.note()[0])
        self.assertIn("lost 200", source.foot.note()[0])

    def test_a_reading_that_leaps_once_and_a_hole_are_in_the_picture(self):
        joints = moved()
        plain = picture(watched(table(joints)))
        position, raw = (x.copy() for x in joints["left_yaw"])
        raw[10000] += 1.0
        joints["left_yaw"] = position, raw
        leaps = picture(watched(table(joints)))
        first = slice(40, 130)  # rows of the first joint's frame
        middle = np.abs(np.arange(900) - (50 + (900 - 58) / 2)) < 4
        self.assertGreater(blue(leaps[first][:, middle]).any(axis=1).sum(), 40, "a line up to the leap")
        self.assertLess(blue(plain[first][:, middle]).any(axis=1).sum(), 20)
        holes = picture(watched(table(moved(), lost=range(9000, 11000))))
        red = (holes[45:120][:, :, 0] - holes[45:120][:, :, 2] > 30).all(axis=0)
        self.assertAlmostEqual(red.sum(), 0.1 * (900 - 58), delta=4)
        flat = moved()
        flat["left_yaw"] = (np.full(20000, 0.1),) * 2
        self.assertGreater(blue(picture(watched(table(flat)))[first]).any(axis=0).sum(), 800, "a line that is flat is drawn, too")

    def run_it(self, *words, **more):
        return subprocess.run(["/usr/bin/python3", SCRIPT, *words], capture_output=True, text=True, timeout=600, check=False, **more)

    def test_what_it_cannot_do_is_one_message(self):
        nowhere = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        with tempfile.TemporaryDirectory() as folder:
            picture_of = os.path.join(folder, "a.png")
            for words, said in ((["table", "/dev/null"], "there is no display"),
                                (["table", "/dev/null", "--output", picture_of], "names no columns"),
                                (["table", "/dev/zero", "--output", picture_of], "names no columns"),
                                (["table", "/nowhere", "--output", picture_of], "/nowhere"),
                                (["table", "-", "--output", "a.bmp"], "allowed: NAME.png"),
                                (["table", "-", "--arms", "foot", "--output", picture_of], "allowed: some of left,right,third,endoscope"),
                                (["table", "-", "--span", "nan", "--output", picture_of], "1 … 300"),
                                (["box", "--port", "/nowhere", "--output", picture_of], "--port /nowhere")):
                done = self.run_it(*words, env=nowhere, stdin=subprocess.DEVNULL)
                self.assertNotEqual(done.returncode, 0, words)
                self.assertIn(said, done.stderr)
                self.assertNotIn("Traceback", done.stderr)

    def test_a_box_is_watched_on_its_line(self):
        with tempfile.TemporaryDirectory() as folder:
            link = os.path.join(folder, "box")
            with subprocess.Popen(["rosrun", "vest_hw_phantom_box", "phantom_box_emulator", "--link", link, "--jump", "0.01", "--instruments", "2"],
                                  stdout=subprocess.PIPE, text=True) as emulator:
                try:
                    emulator.stdout.readline()
                    done = self.run_it("box", "--port", link, "--seconds", "3", "--output", os.path.join(folder, "box.png"))
                finally:
                    emulator.send_signal(signal.SIGINT)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("left_yaw, mrad", done.stdout)
            self.assertNotIn("third", done.stdout)
            self.assertRegex(done.stdout, r"[1-9]\d* not taken")
            self.assertGreater(os.path.getsize(os.path.join(folder, "box.png")), 5000)

    def test_a_haptic_device_is_watched_by_its_topics(self):
        own_port()
        with tempfile.TemporaryDirectory() as folder:
            launch = subprocess.Popen(["roslaunch", "vest_haptics", "device.launch", "options:={motion: circle}"], start_new_session=True,
                                      env=dict(os.environ, ROS_NAMESPACE="vest"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                done = self.run_it("haptic", "--seconds", "3", "--output", os.path.join(folder, "device.png"))
            finally:
                launch.send_signal(signal.SIGINT)
                launch.wait(120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, r"position in the box, .*, mm: x -?\d+\.\d+ y -?\d+\.\d+ z -?\d+\.\d+")
            self.assertRegex(done.stdout, r"force, N, over position, mm, along x: -?\d+\.\d … -?\d+\.\d mm")
            self.assertRegex(done.stdout, r"ticks, Hz: \d{2,}")


if __name__ == "__main__":
    unittest.main()
