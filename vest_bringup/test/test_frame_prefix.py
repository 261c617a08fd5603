#!/usr/bin/python3
"""Protects the frames of a session with frame_prefix: two trainers at one master are in one tree without a name in common, and what
knows a frame's name knows the prefix too, from the messages and the CRTK commands to the picture and the recording."""
import os
import signal
import subprocess
import sys
import tempfile
import unittest

import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import end, master, own_port, patient  # noqa: E402

PORT = own_port()

import genpy  # noqa: E402  (below: they read the environment)
import rosbag  # noqa: E402
import rospy  # noqa: E402
import rostopic  # noqa: E402
import tf2_ros  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from vest_msgs.msg import SessionState  # noqa: E402

FRAMES = {"world", "phantom_box", "endoscope_optical_frame"} | {
    f"{name}_{link}" for name in ("left", "right", "endoscope") for link in ("trocar", "yaw", "pitch", "insertion", "roll", "tip")}


def frames_of(message):
    """Every frame that a message names."""
    found = set()
    for name in message.__slots__:
        value = getattr(message, name)
        if name in ("frame_id", "child_frame_id"):
            found.add(value)
        for inner in value if isinstance(value, (list, tuple)) else [value]:
            if isinstance(inner, genpy.Message):
                found |= frames_of(inner)
    return found


class FramePrefix(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.master = master(PORT)
        rospy.init_node("test_frame_prefix", anonymous=True, disable_rosout=True)

    @classmethod
    def tearDownClass(cls):
        end(cls.master)

    def trainer(self, folder, ns, *words):
        """A session of one scene. @return its process, what it says, and its states."""
        states = []
        self.addCleanup(rospy.Subscriber(f"/{ns}/session/state", SessionState, states.append).unregister)
        log = os.path.join(folder, ns + ".log")
        with open(log, "w", encoding="utf-8") as said:
            process = subprocess.Popen(["roslaunch", "vest_bringup", "trainer.launch", "ns:=" + ns, "scene:=tube", "headless:=true",
                                        "output:=" + os.path.join(folder, ns), "port:=" + os.path.join(folder, ns + "_box"), *words],
                                       stdout=said, stderr=subprocess.STDOUT)
        self.addCleanup(end, process, 60)
        patient(lambda: rospy.has_param("/run_id"))  # a bare master has none: two launches at once would each set it
        return process, lambda: open(log, encoding="utf-8").read(), states  # pylint: disable=consider-using-with

    def test_two_trainers_share_one_tree_of_frames_and_each_name_is_of_one_of_them(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(buffer)
        _, said_a, states_a = self.trainer(folder.name, "a", "frame_prefix:=a", "rviz:=false", "record:=false")
        b, said_b, states_b = self.trainer(folder.name, "b", "frame_prefix:=b/", "right:=crtk", "left:=sim")
        self.assertTrue(patient(lambda: all(s and s[-1].step > 300 for s in (states_a, states_b)), 300), said_a() + said_b())

        # The tree, as a client finds it.
        for prefix in ("a/", "b/"):
            self.assertTrue(patient(lambda p=prefix: all(buffer.can_transform(p + "world", p + name, rospy.Time()) for name in FRAMES)),
                            buffer.all_frames_as_string())
        tree = yaml.safe_load(buffer.all_frames_as_yaml())
        for name, of in tree.items():
            self.assertIn(name[:2], ("a/", "b/"))
            self.assertEqual(of["parent"][:2], name[:2], "a frame has a parent of its own session")
            self.assertEqual(of["broadcaster"], f"/{name[0]}/manager")

        # Every message of the second session.
        named = {}
        hear = lambda topic: lambda m: named.setdefault(topic, set()).update(frames_of(m))
        listening = [rospy.Subscriber(topic, rostopic.get_topic_class(topic)[0], hear(topic)) for topic, _ in rospy.get_published_topics("/b")]
        wanted = ["instruments", "step_inputs", "right/measured_cp", "haptics/left/measured_cp", "haptics/left/state", "tissue/state",
                  "tissue/topology", "tissue/contacts", "tissue/markers", "effects/fluid", "effects/lens", "effects/haemodynamics",
                  "endoscope/camera_info", "endoscope/keypoints"]
        self.assertTrue(patient(lambda: all("/b/" + topic in named for topic in wanted), 120),
                        [topic for topic in wanted if "/b/" + topic not in named])
        for subscriber in listening:
            subscriber.unregister()
        for topic, frames in sorted(named.items()):
            self.assertEqual([f for f in frames if f and not (f[:2] == "b/" and f[2:] in FRAMES)], [], topic)
        for topic in wanted:
            picture, box = topic.startswith(("endoscope", "effects/lens")), topic.endswith("_cp")
            frame = "endoscope_optical_frame" if picture else "phantom_box" if box else "world"
            self.assertIn("b/" + frame, named["/b/" + topic], topic)

        # The names that commands may use.
        errors, poses = [], []
        self.addCleanup(rospy.Subscriber("/b/right/error", String, lambda m: errors.append(m.data)).unregister)
        self.addCleanup(rospy.Subscriber("/b/right/setpoint_cp", PoseStamped, poses.append).unregister)
        servo = rospy.Publisher("/b/right/servo_cp", PoseStamped, queue_size=10)
        self.assertTrue(patient(lambda: poses and servo.get_num_connections()))
        for frame in ("world", "phantom_box", "a/world"):
            poses[-1].header.stamp, poses[-1].header.frame_id = rospy.Time(), frame
            servo.publish(poses[-1])
            refused = f"frame_id '{frame}'; allowed: b/phantom_box (or empty), b/world"
            self.assertTrue(patient(lambda r=refused: any(r in error for error in errors)), errors)
        del errors[:]
        for frame in ("b/phantom_box", "", "b/world"):
            servo.publish(PoseStamped(pose=poses[-1].pose, header=rospy.Header(frame_id=frame)))
        rospy.sleep(1.0)
        self.assertEqual([e for e in errors if "frame_id" in e], [])

        # A third session would have the frames of the second.
        third = subprocess.run(["roslaunch", "vest_bringup", "trainer.launch", "ns:=c", "frame_prefix:=/b"], capture_output=True,
                               text=True, timeout=120, check=False)
        self.assertNotEqual(third.returncode, 0)
        self.assertIn("frames of the same names on /tf", third.stderr)

        # The recording has its own frames alone, and is worked on as any other.
        b.send_signal(signal.SIGINT)
        self.assertTrue(patient(lambda: b.poll() is not None, 120), said_b())
        bag = os.path.join(folder.name, "b", "session.bag")
        with rosbag.Bag(bag) as recorded:
            frames = set().union(*(frames_of(m) for _, m, _ in recorded.read_messages(topics=["/tf", "/tf_static"])))
        self.assertIn("b/left_tip", frames)
        self.assertEqual({f[:2] for f in frames}, {"b/"})
        again = subprocess.run(["rosrun", "vest_bringup", "vest_resimulate", os.path.dirname(bag)], capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(again.returncode, 0, again.stdout + again.stderr)

    def test_a_prefix_that_tf_cannot_bear_is_one_message(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for wrong in ("b c", "b//c", "b:"):
            process, said, _ = self.trainer(folder.name, "vest", "frame_prefix:=" + wrong, "rviz:=false", "record:=false")
            self.assertTrue(patient(lambda p=process: p.poll() is not None, 120), said())
            self.assertIn(f"/vest/frame_prefix: '{wrong}/'; allowed: letters, digits, _ - . and /, as in b/", said())


if __name__ == "__main__":
    unittest.main(verbosity=2, warnings="ignore")
