#!/usr/bin/python3
"""Protects what a running session does with raw pedals, absurd parameters and floods of fluid: a pedal acts by the instruments alone,
and silence switches off; each edit is refused with one sentence that /diagnostics repeats, and changes nothing; a flood and too many
wounds are bounded, announced, and every drop stays accounted for."""
import math
import os
import pathlib
import sys
import tempfile
import time
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import Joy
from vest_msgs.msg import FluidState, HaemodynamicsState, InstrumentState, InstrumentStates, ParameterEdit, SessionState, StepInput
from vest_msgs.srv import LoadScene

# object, parameter, value, what the sentence names
ABSURD = [
    ("", "heart_rate", math.nan, "0.3 to 4 Hz"),
    ("", "heart_rate", 1e9, "0.3 to 4 Hz"),
    ("", "heart_rate", -1.0, "0.3 to 4 Hz"),
    ("", "heart_rate", math.inf, "0.3 to 4 Hz"),
    ("", "mean_pressure", 1e9, "2000 to 30000 Pa"),
    ("", "resistance_scale", 0.0, "0.1 to 10"),
    ("", "resistance_scale", -2.0, "0.1 to 10"),
    ("", "pulse_dilatation", 1e6, "0 to 20"),
    ("", "surface_bleeding", -5.0, "0 to 1000"),
    ("", "gravity_z", -1e30, "-100 to 100 m/s²"),
    ("", "heartrate", 1.0, "heart_rate, mean_pressure"),
    ("fluid", "irrigation_flow", 1.0, "0 to 0.0005 m³/s"),
    ("fluid", "irrigation_flow", -1e-5, "0 to 0.0005 m³/s"),
    ("fluid", "suction_flow", math.nan, "0 to 0.0005 m³/s"),
    ("smoke", "yield", 1e3, "0 to 0.0001 kg/J"),
    ("lens", "temperature", 1e6, "250 to 318.15 K"),
    ("lens", "warming", -0.1, "0 to 1"),
    ("artery", "opening_area", -1.0, "m²"),
    ("artery", "opening_station", 1e3, "m"),
    ("artery", "clip_station", math.nan, "m"),
    ("artery", "youngs_modulus", 0.0, "Pa"),
    ("artrey", "youngs_modulus", 1e4, "artery"),
]


class Absurd(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.told, cls.newest, cls.edits, cls.reports = {}, {}, [], []
        cls.edit = rospy.Publisher("/vest/parameter_edit", ParameterEdit, queue_size=100)
        cls.instruments = rospy.Publisher("/vest/instruments", InstrumentStates, queue_size=10)
        cls.subscribers = [
            rospy.Subscriber("/diagnostics", DiagnosticArray, cls.diagnosed, queue_size=100),
            rospy.Subscriber("/vest/step_inputs", StepInput, cls.consumed, queue_size=8000),
            rospy.Subscriber("/vest/effects/haemodynamics", HaemodynamicsState, lambda m: cls.newest.update(blood=m)),
            rospy.Subscriber("/vest/effects/fluid", FluidState, lambda m: cls.newest.update(fluid=m)),
            rospy.Subscriber("/vest/session/state", SessionState, lambda m: cls.newest.update(session=m)),
        ]
        for publisher in (cls.edit, cls.instruments):
            assert cls.within(60, lambda p=publisher: p.get_num_connections() > 0), publisher.name
        assert cls.within(60, lambda: {"blood", "session"} <= set(cls.newest))

    @classmethod
    def consumed(cls, message):
        cls.edits.extend(message.edits)
        cls.newest["step"] = message

    @classmethod
    def diagnosed(cls, message):
        for status in message.status:
            cls.told[status.name] = status
            cls.reports.append((status.name, status.level, status.message))

    @staticmethod
    def within(seconds, condition):
        end = time.monotonic() + seconds
        while time.monotonic() < end and not rospy.is_shutdown():
            if condition():
                return True
            time.sleep(0.02)
        return condition()

    def announced(self, name, words):
        """Whether /diagnostics warned of it."""
        return self.within(30, lambda: any(n == name and level == DiagnosticStatus.WARN and words in text
                                           for n, level, text in self.reports))

    def steps(self, count):
        first = self.newest["session"].step
        self.assertTrue(self.within(60, lambda: self.newest["session"].step >= first + count), "it does not go on")
        self.assertEqual(self.newest["session"].state, SessionState.RUNNING)

    @staticmethod
    def irrigator(functions):
        """A suction-irrigator in the right hand; its jet points up, so that water stays long in the air."""
        tool = InstrumentState(name="right", tool=InstrumentState.TOOL_SUCTION_IRRIGATOR, valid=True, functions=functions)
        tool.tip.position.x, tool.tip.position.y, tool.tip.position.z = 0.02, 0.03, 0.10
        tool.tip.orientation.w = tool.shaft.orientation.w = 1.0
        tool.shaft.position.x, tool.shaft.position.y, tool.shaft.position.z = 0.02, 0.03, 0.01
        message = InstrumentStates(instruments=[tool])
        message.header.stamp = rospy.Time.now()
        return message

    def test_0_pedals_act_by_the_instruments_alone_and_silence_switches_off(self):
        raw = [rospy.Publisher("/vest/phantom_box/footswitches", Joy, queue_size=10) for _ in range(2)]
        on = lambda: self.newest["step"].tools[1].functions
        water = lambda: self.newest["fluid"].emitted if "fluid" in self.newest else 0.0

        def tell(functions, until, seconds=60):
            def told():
                pressed = Joy(buttons=[1] * 6)
                pressed.header.stamp = rospy.Time.now()
                for publisher in raw:
                    publisher.publish(pressed)
                self.instruments.publish(self.irrigator(functions))
                return until()
            return self.within(seconds, told)

        self.assertTrue(tell(0, lambda: self.newest.get("step") and self.newest["step"].tools[1].present))
        first = self.newest["session"].step
        self.assertTrue(tell(0, lambda: self.newest["session"].step > first + 300))
        self.assertEqual((on(), water()), (0, 0.0), "raw pedals are down, the instruments say that nothing is on")
        self.assertTrue(tell(InstrumentState.FUNCTION_IRRIGATE, lambda: on() and water() > 0.0))
        self.assertTrue(self.within(30, lambda: on() == 0), "who said that it is on is silent")
        self.steps(100)
        emitted = water()
        self.steps(300)
        self.assertEqual(water(), emitted)

    def test_1_each_absurd_edit_is_refused_with_one_sentence_and_changes_nothing(self):
        self.steps(100)
        for thing, parameter, value, allowed in ABSURD:
            self.edit.publish(thing, parameter, value)
            said = lambda: next((v.value for v in self.told["vest: simulation"].values if v.key == "last_refused_input"), "")
            self.assertTrue(self.within(30, lambda: (parameter in said() or thing == "artrey") and allowed in said() and
                                        (not thing or thing in said())),
                            "%s %s = %s: %r" % (thing, parameter, value, said()))
            self.assertEqual(self.told["vest: simulation"].level, DiagnosticStatus.WARN)
            self.assertIn("refused: parameter_edit", self.told["vest: simulation"].message)
        self.steps(200)
        self.assertEqual(self.edits, [], "no step consumed one")
        blood = self.newest["blood"]
        self.assertTrue(0.9 < blood.heart_rate < 1.6 and 8000 < blood.mean_pressure < 16000, blood.heart_rate)

    def test_2_an_edit_at_the_end_of_its_range_is_taken(self):
        for thing, parameter, value in (("", "heart_rate", 4.0), ("fluid", "irrigation_flow", 5e-4)):
            self.edit.publish(thing, parameter, value)
            self.assertTrue(self.within(30, lambda: any(e.object == thing and e.parameter == parameter and e.value == value
                                                        for e in self.edits)))

    def test_3_more_wounds_than_there_is_room_for_are_left_out_and_announced(self):
        for i in range(60):
            self.edit.publish("artery", "opening_station", 0.00125 * (1 + i))
            self.edit.publish("artery", "opening_area", 2e-7 if i % 2 == 0 else 1e-4)  # a hole; cut through
            self.edit.publish("artery", "clip_station", 0.00125 * (1 + i))  # holes near each other are one, clips are not
            self.steps(1)
        self.assertTrue(self.announced("vest: circulation", "more openings or clips than there is room for"))
        self.steps(500)
        blood = self.newest["blood"]
        self.assertTrue(math.isfinite(blood.mean_pressure) and blood.blood_loss > 0)

    def test_4_a_flood_is_bounded_announced_and_accounted_for(self):
        end = time.monotonic() + 60
        while time.monotonic() < end and not any("more fluid than particles" in t for _, _, t in self.reports):
            self.instruments.publish(self.irrigator(InstrumentState.FUNCTION_IRRIGATE))
            time.sleep(0.02)
        self.assertTrue(self.announced("vest: operating field", "more fluid than particles"), self.told["vest: operating field"])
        self.steps(300)
        fluid = self.newest["fluid"]
        self.assertLessEqual(len(fluid.positions), 3 * 200)
        self.assertEqual(len(fluid.volume), len(fluid.positions) // 3)
        parts = fluid.flying + fluid.pooled + fluid.filmed + fluid.sucked + fluid.soaked + fluid.lost + fluid.stained
        self.assertLess(abs(parts - fluid.emitted), 0.01 * fluid.emitted)

    def test_5_a_scene_whose_object_falls_for_ever_is_announced(self):
        with tempfile.TemporaryDirectory() as folder:
            files = {"chain.yaml": "name: chain\nobjects:\n  - {name: bead, model: net, nodes: n.csv, links: l.csv, knot_mass: 0.001, "
                                   "link_area: 1e-6, material: {youngs_modulus: 1e4, density: 1000}}\n",
                     "n.csv": "node,x,y,z\n0,0,0,0.05\n1,0.01,0,0.05\n", "l.csv": "n0,n1\n0,1\n"}
            for name, text in files.items():
                pathlib.Path(folder, name).write_text(text)
            loaded = rospy.ServiceProxy("/vest/tissue/load_scene", LoadScene)(os.path.join(folder, "chain.yaml"))
        self.assertTrue(loaded.success, loaded.message)
        self.assertTrue(self.announced("vest: simulation", "object bead falls for ever"), self.told["vest: simulation"])


if __name__ == "__main__":
    rospy.init_node("test_absurd")
    rostest.rosrun("vest_bringup", "absurd", Absurd, sys.argv)
