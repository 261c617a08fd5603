#!/usr/bin/python3
"""Protects what released CRTK clients need: commands as crtk_python_client up to 1.4.0 builds them (no stamp, no frame, no names), each
motion command of the CRTK pages, moves that one can wait for, measured values before the first command, kinematics and state as
services, `free`, and one sentence for each thing that is refused or done in part."""
import math
import sys
import unittest

import rospy
import rostest
from geometry_msgs.msg import PoseStamped, Vector3, WrenchStamped
from rospy.exceptions import ROSException
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, String
from vest_msgs.msg import ContactModel, ContactModels, InstrumentStates, OperatingState, StringStamped
from vest_msgs.srv import QueryForwardKinematics, QueryInverseKinematics, TriggerOperatingState

ARM = "/vest/right/"
REST = [0.0, 0.0, 0.12, 0.0]


def within(condition, seconds=20.0):
    """Until the condition holds; whether it did."""
    end = rospy.Time.now() + rospy.Duration(seconds)
    while rospy.Time.now() < end and not rospy.is_shutdown():
        if condition():
            return True
        rospy.sleep(0.005)
    return condition()


class Arm:
    """Publishers and subscribers as the released client makes them, and its two ways to wait."""

    def __init__(self):
        self.newest, self.states, self.said = {}, [], []
        self.publishers = {}
        for name, kind in (("servo_jp", JointState), ("servo_jr", JointState), ("move_jp", JointState), ("move_jr", JointState),
                           ("servo_cp", PoseStamped), ("servo_cr", PoseStamped), ("move_cp", PoseStamped), ("move_cr", PoseStamped),
                           ("jaw/servo_jp", JointState), ("jaw/move_jp", JointState), ("hold", Empty), ("free", Empty),
                           ("state_command", StringStamped)):
            self.publishers[name] = rospy.Publisher(ARM + name, kind, latch=name == "state_command", queue_size=10)
        for name, kind in (("measured_js", JointState), ("measured_cp", PoseStamped), ("measured_cf", WrenchStamped),
                           ("setpoint_js", JointState), ("setpoint_cp", PoseStamped), ("jaw/measured_js", JointState),
                           ("jaw/setpoint_js", JointState)):
            rospy.Subscriber(ARM + name, kind, lambda m, n=name: self.newest.update({n: m}), queue_size=10)
        rospy.Subscriber(ARM + "operating_state", OperatingState, self.states.append, queue_size=10)
        for name in ("error", "warning"):
            rospy.Subscriber(ARM + name, String, lambda m, n=name: self.said.append((n, m.data)), queue_size=100)
        assert within(lambda: all(p.get_num_connections() for p in self.publishers.values())), "not all commands are heard"
        assert within(lambda: len(self.newest) >= 6 and self.states)

    def joints(self, command, position):
        """Without stamp and names."""
        message = JointState()
        message.position = list(position)
        self.publishers[command].publish(message)

    def pose(self, command, position, orientation=(0.0, 0.0, 0.0, 1.0), frame=""):
        message = PoseStamped()
        message.header.frame_id = frame
        p, q = message.pose.position, message.pose.orientation
        p.x, p.y, p.z = position
        q.x, q.y, q.z, q.w = orientation
        self.publishers[command].publish(message)

    def moved(self, send, seconds=30.0):
        """As the handle of a move: busy after the command, then not; by the stamps of operating_state."""
        start = rospy.Time.now()
        send()
        return within(lambda: any(s.is_busy and s.header.stamp > start for s in self.states) and not self.states[-1].is_busy, seconds)

    def measured(self):
        return list(self.newest["measured_js"].position)

    def place(self):
        p = self.newest["measured_cp"].pose.position
        return [p.x, p.y, p.z]

    def at(self, joints, tolerance=1e-6):
        return within(lambda: all(abs(a - b) < tolerance for a, b in zip(self.measured(), joints)))

    def heard(self, kind, *words):
        return within(lambda: any(k == kind and all(w in text for w in words) for k, text in self.said))


class CrtkClient(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.arm = Arm()

    def setUp(self):
        self.arm.said.clear()

    def rest(self):
        self.arm.joints("servo_jp", REST)
        self.assertTrue(self.arm.at(REST))

    def test_0_measured_values_are_valid_before_the_first_command(self):
        self.assertFalse(self.arm.states[-1].is_busy)
        for name in ("measured_js", "measured_cp", "setpoint_js", "setpoint_cp", "jaw/measured_js", "jaw/setpoint_js"):
            self.assertTrue(within(lambda n=name: n in self.arm.newest), name)
            header = self.arm.newest[name].header
            self.assertFalse(header.stamp.is_zero(), name + " is marked as invalid")
            self.assertEqual(header.frame_id, "phantom_box", name)

    def test_1_commands_without_a_stamp_move_the_arm(self):
        arm = self.arm
        arm.joints("servo_jp", [0.1, -0.1, 0.13, 0.2])
        self.assertTrue(arm.at([0.1, -0.1, 0.13, 0.2]))
        arm.joints("servo_jr", [0.05, 0.0, -0.01, 0.0])
        self.assertTrue(arm.at([0.15, -0.1, 0.12, 0.2]))
        arm.joints("jaw/servo_jp", [0.5])
        self.assertTrue(within(lambda: abs(arm.newest["jaw/measured_js"].position[0] - 0.5) < 1e-6))
        arm.pose("servo_cp", [0.03, 0.05, 0.06])
        self.assertTrue(within(lambda: math.dist(arm.place(), [0.03, 0.05, 0.06]) < 1e-6))
        self.assertEqual([text for kind, text in arm.said if kind == "error"], [])

    def test_2_relative_poses_go_along_the_axes_of_their_frame(self):
        arm = self.arm
        # Not where the arm is: ROS keeps no order between topics, and a command seen to act has been taken.
        arm.pose("servo_cp", [0.03, 0.045, 0.06])
        self.assertTrue(within(lambda: math.dist(arm.place(), [0.03, 0.045, 0.06]) < 1e-6))
        arm.pose("servo_cr", [0.0, 0.01, 0.0])
        self.assertTrue(within(lambda: math.dist(arm.place(), [0.03, 0.055, 0.06]) < 1e-6), arm.place())
        self.assertTrue(arm.moved(lambda: arm.pose("move_cr", [-0.01, 0.0, 0.005])))
        self.assertTrue(within(lambda: math.dist(arm.place(), [0.02, 0.055, 0.065]) < 1e-6), arm.place())
        there = arm.newest["measured_cp"].header.stamp  # joints come on a topic of their own, and may be behind
        self.assertTrue(within(lambda: arm.newest["measured_js"].header.stamp >= there))
        roll = arm.measured()[3]
        half = 0.25  # the shaft's own axis, about which alone the arm turns where it is
        q = arm.newest["measured_cp"].pose.orientation
        axis = [2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y)]
        arm.pose("servo_cr", [0.0, 0.0, 0.0], [math.sin(half) * a for a in axis] + [math.cos(half)])
        self.assertTrue(within(lambda: abs(arm.measured()[3] - roll - 2 * half) < 1e-6), arm.measured())

    def test_3_moves_can_be_waited_for_though_they_are_there_already(self):
        arm = self.arm
        self.rest()
        self.assertTrue(arm.moved(lambda: arm.joints("move_jp", [0.2, 0.1, 0.14, 0.0])))
        self.assertTrue(arm.at([0.2, 0.1, 0.14, 0.0]))
        self.assertTrue(arm.moved(lambda: arm.joints("move_jp", [0.2, 0.1, 0.14, 0.0])), "already there")
        self.assertTrue(arm.moved(lambda: arm.joints("move_jr", [-0.2, 0.0, 0.0, 0.0])))
        self.assertTrue(arm.at([0.0, 0.1, 0.14, 0.0]))
        self.assertTrue(arm.moved(lambda: arm.pose("move_cp", [0.02, 0.05, 0.06])))
        self.assertTrue(within(lambda: math.dist(arm.place(), [0.02, 0.05, 0.06]) < 1e-6))
        self.assertTrue(arm.moved(lambda: arm.joints("jaw/move_jp", [0.8])))
        self.assertTrue(within(lambda: abs(arm.newest["jaw/setpoint_js"].position[0] - 0.8) < 1e-6))

    def test_4_the_frame_world_is_told_apart_from_the_tilted_box(self):
        arm = self.arm
        states = rospy.wait_for_message("/vest/instruments", InstrumentStates, 20)
        self.assertEqual(states.header.frame_id, "world")
        for frame in ("world", "phantom_box"):
            arm.pose("servo_cp", [0.02, 0.04, 0.07], frame=frame)

            def there():
                tip = rospy.wait_for_message("/vest/instruments", InstrumentStates, 20).instruments[1].tip.position
                here = [tip.x, tip.y, tip.z] if frame == "world" else arm.place()
                return math.dist(here, [0.02, 0.04, 0.07]) < 1e-6

            self.assertTrue(within(there), frame)
        before = arm.place()
        arm.pose("servo_cp", [0.0, 0.0, 0.08], frame="PSM1_psm_base_link")
        self.assertTrue(arm.heard("error", "servo_cp", "PSM1_psm_base_link", "world"))
        self.assertEqual(arm.place(), before)

    def test_5_what_is_out_of_reach_is_refused_or_told(self):
        arm = self.arm
        self.rest()
        arm.joints("move_jp", [2.0, 0.0, 0.12, 0.0])
        self.assertTrue(arm.heard("error", "move_jp", "out of reach", "yaw 2", "1.2"))
        arm.pose("move_cp", [0.0, 0.0, -0.5])
        self.assertTrue(arm.heard("error", "move_cp", "out of reach", "mm away"))
        arm.joints("jaw/move_jp", [3.0])
        self.assertTrue(arm.heard("error", "jaw/move_jp", "jaw 3"))
        self.assertTrue(arm.at(REST), "a refused move moves nothing")
        arm.joints("servo_jp", [2.0, 0.0, 0.12, 0.0])
        self.assertTrue(arm.heard("warning", "servo_jp", "as far as the arm reaches", "yaw 2"))
        self.assertTrue(arm.at([1.2, 0.0, 0.12, 0.0]), "a servo goes as far as it can, and says so")
        arm.pose("servo_cp", [0.0, 0.0, -0.5])
        self.assertTrue(arm.heard("warning", "servo_cp", "mm away"))
        self.assertGreater(arm.newest["setpoint_cp"].pose.position.z, -0.4, "setpoint_cp stays behind the command")

    def test_6_each_refusal_is_told_not_the_first_alone(self):
        arm = self.arm
        self.rest()
        old = JointState(position=[0.5, 0.0, 0.12, 0.0])
        old.header.stamp = rospy.Time.now() - rospy.Duration(5)
        arm.publishers["servo_jp"].publish(old)
        arm.joints("servo_jp", [0.5])
        arm.joints("servo_jp", [math.nan, 0.0, 0.12, 0.0])
        arm.joints("move_jr", [9.0, 0.0, 0.0, 0.0])
        arm.publishers["state_command"].publish(StringStamped(string="explode"))
        for words in (("servo_jp", "s old"), ("servo_jp", "position has 1 values"), ("servo_jp", "not finite"), ("move_jr", "out of reach"),
                      ("state_command", "explode")):
            self.assertTrue(arm.heard("error", *words), words)
        self.assertTrue(arm.at(REST))

    def test_7_kinematics_and_state_are_services(self):
        arm = self.arm
        self.rest()
        forward = rospy.ServiceProxy(ARM + "forward_kinematics", QueryForwardKinematics)
        inverse = rospy.ServiceProxy(ARM + "inverse_kinematics", QueryInverseKinematics)
        jp = [0.2, -0.1, 0.15, 0.7]
        there = forward(jp=jp)
        self.assertTrue(there.result, there.message)
        back = inverse(cp=there.cp, jp=REST)
        self.assertTrue(back.result, back.message)
        for a, b in zip(back.jp, jp):
            self.assertAlmostEqual(a, b, places=9)
        arm.joints("servo_jp", jp)
        self.assertTrue(arm.at(jp))
        p = there.cp.position
        self.assertTrue(within(lambda: math.dist(arm.place(), [p.x, p.y, p.z]) < 1e-9))
        there.cp.position.z = -0.5
        self.assertFalse(inverse(cp=there.cp, jp=[]).result)
        self.assertIn("out of reach", inverse(cp=there.cp, jp=[]).message)
        self.assertFalse(forward(jp=[9.0, 0.0, 0.1, 0.0]).result)
        self.assertIn("3 values", forward(jp=[0.0] * 3).message)
        state = rospy.ServiceProxy(ARM + "operating_state", TriggerOperatingState)
        for command, expected in (("pause", "PAUSED"), ("resume", "ENABLED")):
            arm.publishers["state_command"].publish(StringStamped(string=command))
            self.assertTrue(within(lambda e=expected: state().operating_state.state == e), command)
            self.assertTrue(within(lambda e=expected: arm.states[-1].state == e))
        self.assertTrue(state().operating_state.is_homed)

    def test_8_a_free_arm_gives_way_and_a_held_one_does_not(self):
        arm = self.arm
        self.rest()
        contacts = rospy.Publisher("/vest/tissue/contacts", ContactModels, queue_size=10)
        self.assertTrue(within(lambda: contacts.get_num_connections() > 0))

        def push(until, seconds=20.0):
            touch = ContactModel(instrument="right", in_contact=True)
            touch.wrench.force = Vector3(0.0, 0.0, 2.0)  # up, towards the lid

            def pushed():
                message = ContactModels(contacts=[touch])
                message.header.stamp = rospy.Time.now()
                contacts.publish(message)
                return until()
            return within(pushed, seconds)

        push(lambda: False, 0.3)
        self.assertTrue(arm.at(REST), "held")
        arm.publishers["free"].publish(Empty())
        self.assertTrue(push(lambda: arm.measured()[2] < REST[2] - 0.01), "free: it gives way")
        arm.publishers["hold"].publish(Empty())
        rospy.sleep(0.3)
        held = arm.measured()
        push(lambda: False, 0.3)
        self.assertEqual(arm.measured(), held)

    def test_9_an_arm_of_another_source_says_whose_it_is(self):
        said = []
        rospy.Subscriber("/vest/left/error", String, lambda m: said.append(m.data))
        left = rospy.Publisher("/vest/left/servo_jp", JointState, queue_size=1)
        self.assertTrue(within(lambda: left.get_num_connections() > 0))
        self.assertTrue(within(lambda: left.publish(JointState(position=REST)) or any("source:crtk" in text for text in said)))


if __name__ == "__main__":
    rospy.init_node("crtk_client")
    try:
        rospy.wait_for_message(ARM + "operating_state", OperatingState, 60)
    except ROSException:
        print("no arm")
    rostest.rosrun("vest_instruments", "crtk_client", CrtkClient, sys.argv)
