#!/usr/bin/env python3
"""A client of the instrument node: CRTK commands, sources, tools, pedals, and who publishes what."""
import math
import threading
import time
import unittest

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage
from vest_msgs.msg import ContactModel, ContactModels, InstrumentState, InstrumentStates, OperatingState, StringStamped
from vest_msgs.srv import ExchangeTool, SelectSource

LEFT, RIGHT, THIRD = 0, 1, 2


class Box(threading.Thread):
    """Plays phantom_box/joint_states for all instruments until told to stop."""

    def __init__(self):
        super().__init__(daemon=True)
        self.publisher = rospy.Publisher('phantom_box/joint_states', JointState, queue_size=10)
        self.yaw, self.running = 0.1, True

    def run(self):
        while self.running and not rospy.is_shutdown():
            msg = JointState()
            msg.header.stamp = rospy.Time.now()
            for name in ('left', 'right', 'third', 'endoscope'):
                for joint, value in (('yaw', self.yaw), ('pitch', 0.0), ('insertion', 0.12), ('roll', 0.0)):
                    msg.name.append(name + '_' + joint)
                    msg.position.append(value)
            msg.name.append('left_jaw')
            msg.position.append(0.4)
            self.publisher.publish(msg)
            time.sleep(0.005)


class Instruments(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('client')
        cls.states, cls.count, cls.joints, cls.frames = None, 0, None, set()
        cls.keep = [rospy.Subscriber('instruments', InstrumentStates, cls.on_states),
                    rospy.Subscriber('joint_states', JointState, cls.on_joints),
                    rospy.Subscriber('/tf', TFMessage, cls.on_tf)]
        cls.publishers = {}
        for topic, kind in (('servo_jp', JointState), ('move_jp', JointState), ('servo_cp', PoseStamped),
                            ('jaw/servo_jp', JointState), ('state_command', StringStamped), ('hold', Empty)):
            for name in ('left', 'right'):
                cls.publishers[name, topic] = rospy.Publisher(name + '/' + topic, kind, queue_size=10)
        cls.pedals = rospy.Publisher('phantom_box/footswitches', Joy, queue_size=10)
        cls.contacts = rospy.Publisher('tissue/contacts', ContactModels, queue_size=10)
        rospy.wait_for_service('exchange_tool', 20)
        rospy.wait_for_service('select_source', 20)
        cls.exchange = rospy.ServiceProxy('exchange_tool', ExchangeTool)
        cls.select = rospy.ServiceProxy('select_source', SelectSource)
        cls.box = Box()
        cls.box.start()
        deadline = time.time() + 20
        while time.time() < deadline and not (
                cls.states and cls.states.instruments[LEFT].valid
                and all(p.get_num_connections() for p in cls.publishers.values())):
            time.sleep(0.05)

    @classmethod
    def on_states(cls, msg):
        cls.states = msg
        cls.count += 1

    @classmethod
    def on_joints(cls, msg):
        cls.joints = msg

    @classmethod
    def on_tf(cls, msg):
        cls.frames.update(t.child_frame_id for t in msg.transforms)

    def wait(self, condition, seconds=5.0):
        deadline = time.time() + seconds
        while time.time() < deadline:
            if condition():
                return True
            time.sleep(0.02)
        return False

    def state(self, i):
        return self.states.instruments[i]

    def send(self, name, topic, positions):
        msg = JointState()
        msg.header.stamp = rospy.Time.now()
        msg.position = positions
        self.publishers[name, topic].publish(msg)

    def command(self, name, word):
        msg = StringStamped()
        msg.header.stamp = rospy.Time.now()
        msg.string = word
        self.publishers[name, 'state_command'].publish(msg)

    def test_servo_jp_moves_the_crtk_instrument_and_not_the_box_one(self):
        self.send('right', 'servo_jp', [0.25, -0.1, 0.15, 0.5])
        self.assertTrue(self.wait(lambda: abs(self.state(RIGHT).joint_position[0] - 0.25) < 1e-9))
        self.assertTrue(self.state(RIGHT).valid)
        self.send('left', 'servo_jp', [0.9, -0.1, 0.15, 0.5])
        self.assertFalse(self.wait(lambda: abs(self.state(LEFT).joint_position[0] - self.box.yaw) > 1e-9, 0.4))
        # The box, in turn, moves left and not right.
        self.box.yaw = 0.2
        self.assertTrue(self.wait(lambda: abs(self.state(LEFT).joint_position[0] - 0.2) < 1e-9))
        self.assertAlmostEqual(self.state(RIGHT).joint_position[0], 0.25)

    def test_servo_cp_puts_the_tip_where_the_client_says_and_not_for_the_box(self):
        msg = PoseStamped()
        msg.header.stamp = rospy.Time.now()
        msg.pose.position.x, msg.pose.position.y, msg.pose.position.z = 0.03, 0.05, 0.06
        msg.pose.orientation.w = 1.0
        self.publishers['right', 'servo_cp'].publish(msg)
        self.publishers['left', 'servo_cp'].publish(msg)

        def arrived(i):
            p = self.state(i).tip.position
            return math.dist((p.x, p.y, p.z), (0.03, 0.05, 0.06)) < 1e-6
        self.assertTrue(self.wait(lambda: arrived(RIGHT)))
        self.assertFalse(self.wait(lambda: arrived(LEFT), 0.3))
        # Out of reach: the setpoint stays behind the command.
        msg.header.stamp = rospy.Time.now()
        msg.pose.position.z = -0.5
        self.publishers['right', 'servo_cp'].publish(msg)
        setpoint = rospy.wait_for_message('right/setpoint_cp', PoseStamped, 5)
        self.assertTrue(self.wait(lambda: not arrived(RIGHT)))
        setpoint = rospy.wait_for_message('right/setpoint_cp', PoseStamped, 5)
        self.assertGreater(setpoint.pose.position.z, -0.4)
        self.assertEqual(setpoint.header.frame_id, 'phantom_box')

    def test_undated_and_non_finite_commands_move_nothing(self):
        self.send('right', 'servo_jp', [0.1, 0.0, 0.15, 0.0])
        self.assertTrue(self.wait(lambda: abs(self.state(RIGHT).joint_position[0] - 0.1) < 1e-9))
        undated = JointState()
        undated.position = [0.4, 0.0, 0.15, 0.0]
        self.publishers['right', 'servo_jp'].publish(undated)
        self.send('right', 'servo_jp', [float('nan'), 0.0, 0.15, 0.0])
        self.send('right', 'servo_jp', [0.4, 0.0])
        self.assertFalse(self.wait(lambda: abs(self.state(RIGHT).joint_position[0] - 0.1) > 1e-9, 0.4))

    def test_state_command_pauses_and_resumes_and_the_state_is_latched(self):
        first = rospy.wait_for_message('right/operating_state', OperatingState, 5)
        self.assertEqual((first.state, first.is_homed), ('ENABLED', True))
        self.command('right', 'pause')
        self.assertTrue(self.wait(
            lambda: rospy.wait_for_message('right/operating_state', OperatingState, 5).state == 'PAUSED'))
        before = self.state(RIGHT).joint_position[0]
        self.send('right', 'servo_jp', [before + 0.2, 0.0, 0.15, 0.0])
        self.assertFalse(self.wait(lambda: abs(self.state(RIGHT).joint_position[0] - before) > 1e-9, 0.3))
        self.command('right', 'resume')
        self.assertTrue(self.wait(
            lambda: rospy.wait_for_message('right/operating_state', OperatingState, 5).state == 'ENABLED'))

    def test_move_jp_is_busy_and_arrives(self):
        self.send('right', 'servo_jp', [0.0, 0.0, 0.15, 0.0])
        self.assertTrue(self.wait(lambda: abs(self.state(RIGHT).joint_position[0]) < 1e-9))
        busy = []
        sub = rospy.Subscriber('right/operating_state', OperatingState, lambda m: busy.append(m.is_busy))
        self.assertTrue(self.wait(lambda: busy))
        self.send('right', 'move_jp', [0.2, 0.0, 0.15, 0.0])
        self.assertTrue(self.wait(lambda: abs(self.state(RIGHT).joint_position[0] - 0.2) < 1e-9))
        self.assertTrue(self.wait(lambda: busy[-1] is False and True in busy))
        sub.unregister()

    def test_measured_topics_agree_with_instruments(self):
        js = rospy.wait_for_message('right/measured_js', JointState, 5)
        self.assertEqual(list(js.name), ['right_yaw', 'right_pitch', 'right_insertion', 'right_roll'])
        cp = rospy.wait_for_message('left/measured_cp', PoseStamped, 5)
        self.assertEqual(cp.header.frame_id, 'phantom_box')
        self.assertAlmostEqual(cp.pose.position.x, self.state(LEFT).tip.position.x, delta=0.03)
        jaw = rospy.wait_for_message('left/jaw/measured_js', JointState, 5)
        self.assertEqual(list(jaw.name), ['left_jaw'])
        self.assertAlmostEqual(jaw.position[0], 0.4)

    def test_tools_are_exchanged_unless_tissue_is_held(self):
        self.assertTrue(self.exchange('third', InstrumentState.TOOL_SCISSORS).success)
        self.assertTrue(self.wait(lambda: self.state(THIRD).tool == InstrumentState.TOOL_SCISSORS))
        self.assertIn('scissors_jaw_left.stl', rospy.get_param('robot_description'))
        for instrument, tool in (('third', 99), ('middle', 1), ('endoscope', 1), ('third', 10)):
            answer = self.exchange(instrument, tool)
            self.assertFalse(answer.success)
            self.assertTrue(answer.message)
        held = ContactModels()
        held.contacts = [ContactModel(instrument='third', grasping=True)]
        self.wait(lambda: self.contacts.get_num_connections() > 0)

        def refused():
            self.contacts.publish(held)
            time.sleep(0.02)
            return not self.exchange('third', InstrumentState.TOOL_GRASPER).success
        self.assertTrue(self.wait(refused))

    def test_pedals_switch_the_tool_that_takes_them_and_go_off_when_silent(self):
        self.wait(lambda: self.pedals.get_num_connections() > 0)

        def press(mask):
            msg = Joy()
            msg.header.stamp = rospy.Time.now()
            msg.buttons = [(mask >> i) & 1 for i in range(6)]
            self.pedals.publish(msg)

        def coagulates():
            press(1)
            return self.state(LEFT).functions == InstrumentState.FUNCTION_COAGULATE
        self.assertEqual(self.state(LEFT).tool, InstrumentState.TOOL_COAGULATION_HOOK)
        self.assertTrue(self.wait(coagulates))
        self.assertEqual(self.state(RIGHT).functions, 0)
        self.assertTrue(self.wait(lambda: self.state(LEFT).functions == 0, 1.0), 'silence releases')
        tool = self.state(RIGHT).tool
        press(16)
        self.assertTrue(self.wait(lambda: self.state(RIGHT).tool != tool))
        press(0)
        self.assertTrue(self.exchange('right', InstrumentState.TOOL_GRASPER).success)

    def test_select_source_takes_effect_and_refuses_nonsense(self):
        self.assertFalse(self.select('right', 77).success)
        self.assertFalse(self.select('nobody', 1).success)
        self.assertTrue(self.select('right', InstrumentState.SOURCE_BOX).success)
        self.assertTrue(self.wait(lambda: self.state(RIGHT).source == InstrumentState.SOURCE_BOX and
                                  abs(self.state(RIGHT).joint_position[0] - self.box.yaw) < 1e-9))
        self.command('right', 'source:crtk')
        self.assertTrue(self.wait(lambda: self.state(RIGHT).source == InstrumentState.SOURCE_CRTK))

    def test_one_publisher_of_tf_and_joint_states_and_every_frame_is_there(self):
        publishers = dict(rosgraph.Master('/client').getSystemState()[0])
        self.assertEqual(publishers['/tf'], ['/vest/instruments'])
        self.assertEqual(publishers['/tf_static'], ['/vest/instruments'])
        self.assertEqual(publishers['/vest/joint_states'], ['/vest/instruments'])
        wanted = {n + '_' + l for n in ('left', 'right', 'third')
                  for l in ('yaw', 'pitch', 'insertion', 'roll', 'jaw_left', 'jaw_right')}
        self.assertTrue(self.wait(lambda: wanted | {'endoscope_roll', 'endoscope_optical_frame'} <= self.frames))
        static = {t.child_frame_id for t in rospy.wait_for_message('/tf_static', TFMessage, 5).transforms}
        self.assertLessEqual({'phantom_box', 'left_trocar', 'left_tip', 'endoscope_trocar'}, static)
        self.assertEqual(len(self.joints.name), len(set(self.joints.name)))
        self.assertIn('left_jaw', self.joints.name)

    def test_operating_state_and_state_command_are_crtk_on_the_wire(self):
        self.assertEqual(OperatingState._md5sum, 'b1bd4021639d9d9c5fbfff78d6ff3158')
        self.assertEqual(StringStamped._md5sum, '5e3e46086181199270f1ac3a28a5977f')
        types = dict(rosgraph.Master('/client').getTopicTypes())
        self.assertIn(types['/vest/right/operating_state'], ('vest_msgs/OperatingState', 'crtk_msgs/OperatingState'))

    def test_z_a_silent_box_is_no_longer_valid_and_the_pose_is_held(self):
        before = self.state(LEFT).joint_position
        self.box.running = False
        self.assertTrue(self.wait(lambda: not self.state(LEFT).valid, 1.0))
        self.assertEqual(self.state(LEFT).joint_position, before)
        count = self.count
        time.sleep(1.0)
        self.assertGreater(self.count - count, 300, 'the timer takes over the pace (500 Hz)')


if __name__ == '__main__':
    import rostest
    rostest.rosrun('vest_instruments', 'instruments', Instruments)
