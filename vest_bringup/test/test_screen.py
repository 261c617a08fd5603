#!/usr/bin/env python3
"""Protects the screen of whoever starts VEST: a healthy session, a scene and a replay say nothing that looks like a fault, and what
they say fits on a screen. Launched as ./run and the pages do, with the view on a virtual screen."""
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import own_port, patient  # noqa: E402

SCREEN = 50  # lines
FAULT = re.compile(r"\x1b\[(?:\d+;)*31m|ERROR|FATAL|\b[Ee]rror\b|Assertion|Aborted|core dumped|has died|Traceback|Segmentation")


def launch(*words, until=None):
    """What a launch says on stdout and stderr; interrupted once `until` holds of it, as by Ctrl-C, or left to end by itself."""
    own_port()  # roslaunch makes the master of its own
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        process = subprocess.Popen(["roslaunch", "vest_bringup", *words], stdout=said, stderr=subprocess.STDOUT, start_new_session=True,
                                   env=dict(os.environ, ROSCONSOLE_STDOUT_LINE_BUFFERED="1"))

        def so_far():
            return os.pread(said.fileno(), 1 << 20, 0).decode(errors="replace")

        try:
            in_time = patient(lambda: process.poll() is not None or (until and until(so_far())), 300)
            early = until and process.poll() is not None
            if until and process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(120)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        said.seek(0)
        text = said.read()
    assert in_time and not early, text
    return text


class Screen(unittest.TestCase):
    def healthy(self, text):
        # roslaunch's own list of parameters and nodes, which roslaunch --no-summary leaves out (./run does).
        text = re.sub(r"\nSUMMARY\n=.*?\n\n(?=auto-starting|\x1b|ROS_MASTER)", "\n", text, flags=re.S)
        faults = [line for line in text.splitlines() if FAULT.search(line)]
        self.assertEqual(faults, [], text)
        self.assertLessEqual(len(text.splitlines()), SCREEN, text)

    def test_a_session_and_its_replay_say_no_fault_and_fit_on_a_screen(self):
        with tempfile.TemporaryDirectory() as folder:
            written = os.path.join(folder, "session.json")
            self.healthy(launch("trainer.launch", "script:=demo", "loop:=true", "headless:=true", "output:=" + folder, "seconds:=6",
                                "port:=" + os.path.join(folder, "box"), until=lambda _: os.path.exists(written)))
            self.assertTrue(os.path.exists(os.path.join(folder, "endoscope.png")), "the view was there")
            self.healthy(launch("replay.launch", "bag:=" + os.path.join(folder, "session.bag"), "headless:=true"))

    def test_a_scene_says_no_fault_and_fits_on_a_screen(self):
        with tempfile.TemporaryDirectory() as folder:
            box = os.path.join(folder, "box")
            self.healthy(launch("scene.launch", "scene:=surface_bleeding", "headless:=true", "port:=" + box,
                                until=lambda text: ": running" in text))


if __name__ == "__main__":
    unittest.main()
