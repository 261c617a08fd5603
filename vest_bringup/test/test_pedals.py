#!/usr/bin/python3
"""Protects what a pedal means, in each preset and through the launch file: from the byte on the serial line (the emulated box presses one
pedal after the other) to the functions that the instruments tell, that each step consumes, and the current that burns tissue. Of two
publishers of footswitches none is heard, by tissue and fluid neither."""
import bisect
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

import rospy
import rostest
from sensor_msgs.msg import Joy
from vest_msgs.msg import FluidState, InstrumentState, InstrumentStates, StepInput, TissueEvent

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import end, patient  # noqa: E402

CUT, COAG, WASH, SUCK, CLUTCH = (InstrumentState.FUNCTION_CUT, InstrumentState.FUNCTION_COAGULATE, InstrumentState.FUNCTION_IRRIGATE,
                                 InstrumentState.FUNCTION_SUCK, InstrumentState.FUNCTION_CLUTCH)
NAMES = ["left", "right", "third", "endoscope"]  # forceps, hook, suction-irrigator, endoscope
# What the pedal of each bit switches on, in the order of NAMES.
PRESETS = {
    "trainer": [(COAG, COAG, 0, 0), (0, CUT, 0, 0), (0, 0, WASH, WASH), (0, 0, SUCK, 0), (0, 0, 0, 0), (CLUTCH, CLUTCH, CLUTCH, 0)],
    "dvrk": [(CLUTCH, CLUTCH, CLUTCH, 0), (0, 0, 0, InstrumentState.FUNCTION_CAMERA_FOLLOW), (0, 0, 0, InstrumentState.FUNCTION_CAMERA_OUT),
             (0, 0, 0, InstrumentState.FUNCTION_CAMERA_IN), (COAG, 0, 0, 0), (0, COAG, 0, 0)],
    "custom": [(0, 0, SUCK, 0), (0, CUT, 0, 0), (0, 0, 0, InstrumentState.FUNCTION_CAMERA_IN), (COAG, COAG, 0, 0), (CLUTCH, CLUTCH, CLUTCH, 0),
               (0, 0, WASH, WASH)],
}
CUSTOM = "footswitch_functions:=[suction, cut, camera_in, coag, clutch, irrigation]"  # no preset has this order
PEDALS = {"trainer": ["coag", "cut", "irrigation", "suction", "tool", "clutch"],
          "dvrk": ["clutch", "camera", "cam_minus", "cam_plus", "bicoag", "coag"], "custom": [f"pedal_{bit}" for bit in range(6)]}
TOOL = 4  # bit of the pedal that hands over tools, in the preset trainer: not pressed, for the hook stays in the hand
BURNT = (0.0092, 0.0444, 0.0752)  # m: where the hook lies on the slab of the scene coagulate_slab
PRESS, PAUSE = 2.4, 1.2  # s
SLACK = 0.9  # s: so long may a message be under way
EACH = 10  # of so many steps one is read: Python reads 1,000 a second too slowly beside other work, and loses seconds of them

WAYPOINTS = """rate: 100
instruments:
  right: [{{t: 0, tip: [{0}, {1}, {2}], roll: -0.81}}, {{t: {end}, tip: [{0}, {1}, {2}]}}]
  left: [{{t: 0, tip: [-0.05, 0.03, 0.10]}}, {{t: {end}, tip: [-0.05, 0.03, 0.10]}}]
  third: [{{t: 0, tip: [0.04, 0.00, 0.11]}}, {{t: {end}, tip: [0.04, 0.00, 0.11]}}]
  endoscope: [{{t: 0, tip: [0.0, -0.02, 0.135]}}, {{t: {end}, tip: [0.0, -0.02, 0.135]}}]
footswitches:
{presses}
"""


class Session:
    """trainer.launch with a box whose pedals are pressed one after the other, for ever, and all that is heard of it."""

    def __init__(self, folder, preset):
        self.lock = threading.Lock()
        self.raw, self.told, self.consumed, self.burns = [], [], [], []
        self.steps = 0
        self.water = 0.0
        self.named = {}
        begin, lines = PAUSE, []
        for bit in range(6):
            if preset == "trainer" and bit == TOOL:
                continue
            lines += [f"  - {{t: {begin:.2f}, pressed: [{bit}]}}", f"  - {{t: {begin + PRESS:.2f}, pressed: []}}"]
            begin += PRESS + PAUSE
        waypoints, box = os.path.join(folder, preset + ".yaml"), os.path.join(folder, preset + ".csv")
        with open(waypoints, "w", encoding="utf-8") as f:
            f.write(WAYPOINTS.format(*BURNT, end=begin, presses="\n".join(lines)))
        subprocess.run(["rosrun", "vest_instruments", "trajectory_from_waypoints", waypoints, "--output", box], check=True)
        self.subscribers = [
            rospy.Subscriber("/vest/phantom_box/footswitches", Joy, self.on_raw, queue_size=1000),
            rospy.Subscriber("/vest/instruments", InstrumentStates, self.on_told, queue_size=5000),
            rospy.Subscriber("/vest/step_inputs", rospy.AnyMsg, self.on_step, queue_size=8000),
            rospy.Subscriber("/vest/tissue/events", TissueEvent, self.on_event, queue_size=1000),
            rospy.Subscriber("/vest/effects/fluid", FluidState, self.on_fluid, queue_size=10),
        ] + [rospy.Subscriber("/vest/footpedals/" + name, Joy, self.on_named, name, queue_size=100) for name in PEDALS[preset]]
        self.process = subprocess.Popen(
            ["roslaunch", "vest_bringup", "trainer.launch", "rviz:=false", "record:=false", "scene:=coagulate_slab", "loop:=true",
             "footswitch_preset:=" + preset, "trajectory:=" + box, "port:=" + os.path.join(folder, "box_" + preset),
             "left_tool:=bipolar_forceps", "right_tool:=coagulation_hook", "third_tool:=suction_irrigator",
             *([CUSTOM] if preset == "custom" else [])])

    def close(self):
        for subscriber in self.subscribers:
            subscriber.unregister()
        end(self.process)

    def on_raw(self, message):
        mask = sum(1 << i for i, down in enumerate(message.buttons) if down)
        with self.lock:
            self.raw.append((message.header.stamp.to_sec(), mask))

    def on_named(self, message, name):
        with self.lock:
            self.named.setdefault(name, []).append((message.header.stamp.to_sec(), message.buttons[0]))

    def on_told(self, message):
        functions = {i.name: i.functions for i in message.instruments}
        with self.lock:
            self.told.append((message.header.stamp.to_sec(), tuple(functions[n] for n in NAMES)))

    def on_step(self, raw):
        self.steps += 1
        if self.steps % EACH:
            return
        message = StepInput().deserialize(raw._buff)
        with self.lock:
            self.consumed.append((message.header.stamp.to_sec(), tuple(t.functions for t in message.tools)))

    def on_event(self, message):
        if message.kind == TissueEvent.COAGULATED:
            with self.lock:
                self.burns.append((message.header.stamp.to_sec(), message.instrument))

    def on_fluid(self, message):
        self.water = message.emitted

    def pressed(self, t, before=SLACK, after=SLACK):
        """Masks of the box from `before` to `after` about a moment; empty where the box was not heard."""
        first = bisect.bisect_left(self.raw, (t - before, -1))
        last = bisect.bisect_left(self.raw, (t + after, -1))
        masks = {mask for _, mask in self.raw[first:last]}
        return masks | {self.raw[first - 1][1]} if masks and first else masks


class Pedals(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_pedals", anonymous=True)
        cls.folder = tempfile.mkdtemp(prefix="vest_pedals_")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def judge(self, session, expected, heard, what):
        """No function is on that no pedal of those moments asks for. @return masks of one pedal with all its functions seen"""
        seen = set()
        for t, functions in heard:
            masks = session.pressed(t)
            if not masks:
                continue
            allowed = [0, 0, 0, 0]
            for mask in masks:
                for bit in range(6):
                    if mask >> bit & 1:
                        allowed = [a | b for a, b in zip(allowed, expected[bit])]
            for name, on, most in zip(NAMES, functions, allowed):
                self.assertEqual(on & ~most, 0, f"{what}: {name} does {on} while the box says {masks}")
            if len(masks) == 1 and list(functions) == allowed:
                seen |= masks
        return seen

    def play(self, preset):
        expected = PRESETS[preset]
        bits = [b for b in range(6) if not (preset == "trainer" and b == TOOL)]
        session = Session(self.folder, preset)
        try:
            wanted = {1 << b for b in bits}
            done = lambda: (len(session.consumed) > 200 and session.burns and
                            wanted <= {m for _, m in list(session.raw)} and len(session.told) > 2000)
            self.assertTrue(patient(done, 180.0), f"{preset}: {len(session.raw)} {len(session.told)} {len(session.consumed)} {session.burns}")
            rounds = (len(bits) + 1) * (PRESS + PAUSE)
            for _ in range(20):  # rounds, until each pedal was seen to act
                first = session.raw[-1][0]
                patient(lambda: session.raw[-1][0] > first + rounds, 120.0)
                with session.lock:
                    told = self.judge(session, expected, session.told[::EACH], "instruments")
                    steps = self.judge(session, expected, session.consumed, "step_inputs")
                if wanted <= told and wanted <= steps:
                    break
            self.assertEqual((wanted - told, wanted - steps), (set(), set()), "a pedal that does not act")
            with session.lock:
                coag = {1 << b for b in bits if expected[b][1] & COAG}
                judged = 0
                for t, instrument in session.burns:
                    self.assertEqual(instrument, "right")
                    masks = session.pressed(t, before=SLACK + 0.2)  # empty: the box was not heard about then
                    self.assertTrue(masks & coag or not masks, "tissue burns while no pedal asks for it")
                    judged += bool(masks)
                self.assertGreater(judged, 0)
                for bit in bits:  # the topic of the name goes down with the bit
                    downs = [t for t, value in session.named[PEDALS[preset][bit]] if value == 1]
                    # Empty: of what the box told from then on nothing arrived, for a busy machine dropped it.
                    after = [masks for masks in (session.pressed(t, before=0.0) for t in downs) if masks]
                    self.assertTrue(after and all(1 << bit in masks for masks in after), f"{PEDALS[preset][bit]}: {downs} {after}")
            if preset == "trainer":
                self.second_publisher(session)
        finally:
            session.close()

    def second_publisher(self, session):
        self.assertGreater(session.water, 0.0, "irrigation irrigates")
        second = rospy.Publisher("/vest/phantom_box/footswitches", Joy, queue_size=10)
        pressed = Joy(buttons=[1, 1, 1, 1, 0, 0])

        def both(until, seconds):
            def told():
                pressed.header.stamp = rospy.Time.now()
                second.publish(pressed)
                return until()
            return patient(told, seconds)

        def off():  # for longer than between two pedals: what is heard here may be some seconds old
            since = session.consumed[-1][0] - 2 * PAUSE - 2 * SLACK
            return not any(any(f) for t, f in session.consumed[-800:] if t > since)

        try:
            self.assertTrue(both(off, 120.0))
            with session.lock:
                count, start, water = len(session.consumed), session.consumed[-1][0], session.water
            self.assertTrue(both(lambda: session.consumed[-1][0] > start + 6 * (PRESS + PAUSE), 240.0))
            with session.lock:
                self.assertFalse([f for _, f in session.consumed[count:] if any(f)], "two feet on one pedal: nobody is heard")
                self.assertAlmostEqual(session.water, water, delta=0.02 * water)
        finally:
            second.unregister()
        self.assertTrue(patient(lambda: any(any(f) for _, f in session.consumed[-20:]), 60.0), "one is left, and is heard")

    def test_1_of_the_trainer(self):
        self.play("trainer")

    def test_2_of_the_dvrk(self):
        self.play("dvrk")

    def test_3_of_a_lab_that_says_what_each_means(self):
        self.play("custom")


if __name__ == "__main__":
    rostest.rosrun("vest_bringup", "pedals", Pedals, sys.argv)
