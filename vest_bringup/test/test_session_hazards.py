#!/usr/bin/python3
"""Protects a session from what happens around it: the system clock is set while it is recorded, a second simulation is started in
it. Named in docs/HAZARDS.md."""
import glob
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import xmlrpc.client

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import Node, master, own_port, patient  # noqa: E402

FULL = "VEST_FULL" in os.environ
PORT = own_port()

import rosbag  # noqa: E402  (reads the environment)
import rosgraph  # noqa: E402
import rosnode  # noqa: E402
import rospy  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from vest_msgs.msg import (ContactModels, HapticState, InstrumentState, InstrumentStates, RecordingBatch, SessionState, StateHash, StepInput, StringStamped, TissueEvent, TissueField,  # noqa: E402
                           TissueState, TissueTopology)
from vest_msgs.srv import Snapshot, SnapshotRequest, SnapshotResponse  # noqa: E402


class Steps:
    """Publishes step_inputs a hundred times a second, stamped by a clock that can be set."""

    def __init__(self):
        self.by, self.step, self.load, self.stop = 0.0, 0, False, threading.Event()
        self.publisher = rospy.Publisher("step_inputs", StepInput, queue_size=1000)
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        while not self.stop.is_set():
            if self.publisher.get_num_connections() > 0:
                loads, self.load = self.load, False
                self.step = 1 if loads else self.step + 1
                message = StepInput(step=self.step, dt=0.01, command=StepInput.COMMAND_LOAD if loads else StepInput.COMMAND_NONE)
                message.header.stamp = rospy.Time.from_sec(time.time() + self.by)
                self.publisher.publish(message)
            time.sleep(0.01)

    def end(self):
        self.stop.set()
        self.thread.join()
        self.publisher.unregister()  # the next one makes itself known, also to a new master


def pid_of(node):
    """Of a node's process, as the node tells it."""
    return xmlrpc.client.ServerProxy(rosnode.get_api_uri(rosgraph.Master("/test"), node)).getPid("/test")[2]


class SessionHazards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.master = master(PORT)
        rospy.init_node("test_session_hazards", anonymous=True, disable_rosout=True)

    @classmethod
    def tearDownClass(cls):
        cls.master.kill()
        cls.master.wait()

    def test_a_scene_loaded_in_the_first_moments_begins_the_recording(self):
        # The State that is saved for the recording is then another scene's than that of the first steps.
        steps = Steps()
        steps.step = 3000
        self.addCleanup(steps.end)

        def save(request):
            steps.load = True
            time.sleep(0.5)
            self.assertEqual(request.name, "start")
            return SnapshotResponse(success=True, message=os.path.join(folder, "snapshots", "start.snapshot"), step=steps.step)

        with tempfile.TemporaryDirectory() as folder:
            service = rospy.Service("tissue/snapshot", Snapshot, save)
            self.addCleanup(service.shutdown)
            node = Node("vest_bringup", "recorder", f"_directory:={folder}", "_seconds:=4")
            self.addCleanup(node.end)
            self.assertEqual(node.process.wait(60), 0, node.text())
            with rosbag.Bag(os.path.join(folder, "session.bag")) as bag:
                kept = [message for _, message, _ in bag.read_messages(topics=["/step_inputs"])]
        self.assertGreater(len(kept), 50)
        self.assertEqual((kept[0].step, kept[0].command), (1, StepInput.COMMAND_LOAD), "steps of the scene before cannot be re-simulated")
        self.assertEqual([m.step for m in kept], list(range(1, len(kept) + 1)))

    def test_a_session_with_a_script_ends_with_it_and_not_before_though_its_hands_are_not_let_run(self):
        steps = Steps()
        self.addCleanup(steps.end)
        contacts = rospy.Publisher("tissue/contacts", ContactModels, queue_size=10)
        states = rospy.Publisher("session/state", SessionState, queue_size=10)
        stop = threading.Event()

        def tell():
            while not stop.is_set():
                states.publish(SessionState(step=steps.step, simulated_time=0.01 * steps.step))
                contacts.publish(ContactModels(step=steps.step))
                time.sleep(0.01)

        told = []
        ends = rospy.Subscriber("session/script_end", StringStamped, told.append)
        with tempfile.TemporaryDirectory() as folder:
            with open(f"{folder}/script.csv", "w", encoding="utf-8") as file:
                file.write("t_s,left_yaw\n0,0\n2,0.1\n")
            telling = threading.Thread(target=tell)
            recorder = Node("vest_bringup", "recorder", f"_directory:={folder}", "_end_with_script:=true", "_seconds:=300")
            self.addCleanup(recorder.end)
            emulator = Node("vest_hw_phantom_box", "phantom_box_emulator", "--pace", "--link", f"{folder}/box", "--trajectory", f"{folder}/script.csv")
            self.addCleanup(emulator.end)
            try:
                telling.start()
                self.assertTrue(patient(lambda: steps.step > 10 and os.path.exists(f"{folder}/box")), recorder.text() + emulator.text())
                with open(f"{folder}/box", "rb", buffering=0) as box:
                    self.assertTrue(box.read(100))
                    emulator.signal(signal.SIGSTOP)
                    begun = steps.step
                    # A clock that knows nothing of the script would have ended it: 2 s, and the 5 s that an exercise may go on.
                    self.assertTrue(patient(lambda: steps.step > begun + 1000 or recorder.process.poll() is not None))
                    self.assertEqual((told, recorder.process.poll()), ([], None), recorder.text())
                    emulator.signal(signal.SIGCONT)
                    self.assertTrue(patient(lambda: box.read(4096) and recorder.process.poll() is not None), recorder.text())
                self.assertEqual(len(told), 1, emulator.text())
            finally:
                stop.set()
                telling.join()
                for end in (ends, contacts, states):
                    end.unregister()
            with open(f"{folder}/session.json", encoding="utf-8") as file:
                self.assertEqual(json.load(file)["ended"], "after the script")

    def recorded(self, by, stamps_follow):
        """A session of 8 s whose system clock is set by so many s in its midst: its session.json, and its messages in order."""
        library = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
        self.assertTrue(library, "libfaketime is missing: apt-get install libfaketime")
        steps, statuses = Steps(), []
        self.addCleanup(steps.end)
        listening = rospy.Subscriber("session/recording", SessionState, statuses.append)
        self.addCleanup(listening.unregister)
        with tempfile.TemporaryDirectory() as folder, tempfile.NamedTemporaryFile("w", suffix=".time") as clock:
            clock.write("+0")
            clock.flush()
            node = Node("vest_bringup", "recorder", f"_directory:={folder}", "_seconds:=8", LD_PRELOAD=library[0],
                        FAKETIME_TIMESTAMP_FILE=clock.name, FAKETIME_NO_CACHE="1", FAKETIME_DONT_FAKE_MONOTONIC="1",
                        FAKETIME_DONT_RESET="1")
            self.addCleanup(node.end)
            self.assertTrue(patient(lambda: bool(statuses) and statuses[-1].recorded_messages > 100), node.text())
            clock.seek(0)
            clock.write(f"{by:+d}")
            clock.flush()
            steps.by = by if stamps_follow else 0.0
            had = len(statuses)
            # By a clock set back it would go on for an hour, by one set forward it would have ended at once.
            self.assertTrue(patient(lambda: os.path.exists(f"{folder}/session.json")), node.text())
            self.assertGreaterEqual(len(statuses) - had, 2, "it says how it goes all the time")
            self.assertIn("system clock set by", node.text())
            with open(f"{folder}/session.json", encoding="utf-8") as f:
                session = json.load(f)
            with rosbag.Bag(f"{folder}/session.bag") as bag:
                messages = list(bag.read_messages())
        return session, messages

    def judge(self, by, session, messages):
        self.assertEqual(session["ended"], "after the wished time")
        self.assertEqual(len(session["clock_jumps"]), 1, session["clock_jumps"])
        jump = session["clock_jumps"][0]
        self.assertAlmostEqual(jump["by_s"], by, delta=1.0)  # the machine may have paused when the file was written
        self.assertGreater(jump["step"], 50)
        self.assertLess(jump["step"], session["steps"])
        self.assertGreater(jump["time_s"], 0.0)
        self.assertLess(abs(session["duration_s"]), 60.0, "not an hour")
        times = [m.timestamp.to_sec() for m in messages]
        self.assertLess(max(times) - min(times), 60.0, "not an hour")
        steps = [m.message.step for m in messages if m.topic == "/step_inputs"]
        self.assertEqual(steps, sorted(steps), "in the order in which they came")
        self.assertEqual(session["skipped_steps"], 0)
        marks = [(i, m) for i, m in enumerate(messages) if m.topic == "/session/marks"]
        self.assertEqual(len(marks), 1)
        i, mark = marks[0]
        self.assertRegex(mark.message.string, r"^system clock set by [-+][0-9.]+ s$")
        self.assertAlmostEqual(float(mark.message.string.split()[4]), by, delta=1.0)
        before = [m.message.step for m in messages[:i] if m.topic == "/step_inputs"]
        self.assertGreater(len(before), 50, "it stands where it happened")
        self.assertLess(len(before), len(steps))

    def test_a_clock_that_is_set_back_an_hour_is_marked_and_the_recording_goes_by_the_steady_clock(self):
        session, messages = self.recorded(-3600, stamps_follow=True)
        self.judge(-3600, session, messages)

    def test_a_clock_that_is_set_forward_is_marked_also_where_other_machines_stamps_do_not_follow(self):
        session, messages = self.recorded(3600, stamps_follow=False)
        self.judge(3600, session, messages)

    def test_interrupted_at_any_phase_a_recording_is_closed_within_five_seconds(self):
        steps = Steps()
        self.addCleanup(steps.end)
        rounds, chance = (50 if FULL else 3), random.Random(5)
        print(f"count: {rounds} of 50 interrupted recordings (SessionHazards.{self._testMethodName})", flush=True)
        for _ in range(rounds):
            with tempfile.TemporaryDirectory() as folder:
                node = Node("vest_bringup", "recorder", f"_directory:={folder}")
                self.addCleanup(node.end)
                begun = steps.step
                self.assertTrue(patient(lambda: steps.step > begun + 20), node.text())  # noqa: B023
                time.sleep(chance.random())
                interrupted = time.monotonic()
                node.signal(signal.SIGINT)
                self.assertEqual(node.process.wait(60), 0, node.text())
                self.assertLess(time.monotonic() - interrupted, 5.0)
                with open(f"{folder}/session.json", encoding="utf-8") as f:
                    session = json.load(f)
                self.assertEqual(session["ended"], "interrupted")
                with rosbag.Bag(f"{folder}/session.bag") as bag:
                    self.assertEqual(bag.get_message_count("/step_inputs"), session["steps"])
                self.assertFalse(glob.glob(f"{folder}/*.active"))

    def test_without_a_master_the_recorder_hears_both_signals(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with tempfile.TemporaryDirectory() as folder:
                for words in ([f"_directory:={folder}"], []):  # with a private parameter roscpp itself waits
                    node = Node("vest_bringup", "recorder", *words, ROS_MASTER_URI="http://localhost:9")
                    self.addCleanup(node.end)
                    self.assertTrue(patient(lambda: "master" in node.text()), node.text())  # noqa: B023
                    node.signal(number)
                    node.process.wait(60)

    def test_a_killed_recorder_is_told_at_once_and_holds_no_start(self):
        for seen in (True, False):  # killed while the start waits for it, or before anybody heard of it
            with tempfile.TemporaryDirectory() as folder:
                states, statuses = [], []
                # Others may take the inputs: it is the recorder that is waited for.
                inputs = rospy.Subscriber("step_inputs", StepInput)
                listening = [rospy.Subscriber("session/state", SessionState, states.append),
                             rospy.Subscriber("session/recording", SessionState, statuses.append), inputs]
                # It waits for a picture that never comes.
                recorder = Node("vest_bringup", "recorder", "__name:=killed", f"_directory:={folder}", "_wait_for_picture:=true",
                                "_picture_timeout:=3000")
                self.addCleanup(recorder.end)
                self.assertTrue(patient(lambda: bool(statuses)), recorder.text())  # noqa: B023
                words = ("_wait_for_recorder:=true", "_recorder_timeout:=3600")
                if seen:
                    simulation = self.simulation("waits", *words)
                    self.assertTrue(patient(lambda: inputs.get_num_connections() > 0))  # noqa: B023
                    self.assertTrue(patient(lambda: bool(states) and states[-1].status == "waiting for the recorder"))  # noqa: B023
                    time.sleep(1.0)
                    self.assertEqual(states[-1].step, 0)
                recorder.signal(signal.SIGKILL)
                recorder.process.wait()
                if not seen:
                    simulation = self.simulation("waits", *words)
                self.assertTrue(patient(lambda: bool(states) and states[-1].step > 100), simulation.text())  # noqa: B023
                self.assertTrue(patient(lambda: states[-1].status.startswith("THE RECORDER HAS DIED")), states[-1])  # noqa: B023
                self.assertFalse(states[-1].recording)
                if seen:
                    self.assertIn("the recorder has died: nothing more is recorded", simulation.text())
                for subscriber in listening:
                    subscriber.unregister()
                simulation.end()

    def test_a_recorder_that_stands_still_for_seconds_is_not_dead(self):
        # A busy machine does so: the session would go on without its inputs.
        states = []
        listening = rospy.Subscriber("session/state", SessionState, states.append)
        self.addCleanup(listening.unregister)
        with tempfile.TemporaryDirectory() as folder:
            # Of a name of its own: parameters of earlier recorders count at this master.
            recorder = Node("vest_bringup", "recorder", "__name:=still", f"_directory:={folder}")
            self.addCleanup(recorder.end)
            simulation = self.simulation("waits")
            self.assertTrue(patient(lambda: bool(states) and states[-1].recording), recorder.text())
            recorder.signal(signal.SIGSTOP)
            time.sleep(6.0)
            recorder.signal(signal.SIGCONT)
            had = len(states)
            self.assertTrue(patient(lambda: len(states) > had + 3 and states[-1].recording), simulation.text() + recorder.text() + str(states[-1]))
            self.assertNotIn("recorder has died", simulation.text())
            simulation.end()
            recorder.end()

    def test_a_recorder_that_ends_as_it_was_meant_to_is_no_death_and_one_that_refuses_holds_no_start(self):
        states = []
        listening = rospy.Subscriber("session/state", SessionState, states.append)
        self.addCleanup(listening.unregister)
        refused = Node("vest_bringup", "recorder", "_directory:=/dev/null/nowhere")
        self.addCleanup(refused.end)
        self.assertEqual(refused.process.wait(60), 1, refused.text())
        simulation = self.simulation("waits", "_wait_for_recorder:=true", "_recorder_timeout:=3600")
        self.assertTrue(patient(lambda: bool(states) and states[-1].step > 100), simulation.text())
        with tempfile.TemporaryDirectory() as folder:
            recorder = Node("vest_bringup", "recorder", f"_directory:={folder}")
            self.addCleanup(recorder.end)
            self.assertTrue(patient(lambda: states[-1].recording), recorder.text())
            self.assertEqual(states[-1].status, "")
            recorder.end()
        had = len(states)
        self.assertTrue(patient(lambda: len(states) > had + 6))
        self.assertNotIn("DIED", states[-1].status)
        self.assertNotIn("recorder has died", simulation.text())
        simulation.end()

    def test_a_script_finds_tissue_that_has_not_moved(self):
        # Jaws that close on a thread a third of a second late find that it has fallen.
        states, steps = [], []
        for name, kind, to in (("session/state", SessionState, states), ("step_inputs", StepInput, steps)):
            listening = rospy.Subscriber(name, kind, to.append, queue_size=10000)
            self.addCleanup(listening.unregister)
        simulation = self.simulation("waits", "_wait_for_hands:=true")
        self.assertTrue(patient(lambda: bool(states) and states[-1].status == "waiting for the hands"), simulation.text())
        hands = InstrumentStates(instruments=[
            InstrumentState(name=name, tool=InstrumentState.TOOL_GRASPER, source=InstrumentState.SOURCE_BOX, valid=name == "left")
            for name in ("left", "right")])
        for hand in hands.instruments:
            hand.tip.orientation.w = hand.shaft.orientation.w = 1.0
            hand.tip.position.z, hand.shaft.position.z = 0.2, 0.3
        publisher = rospy.Publisher("instruments", InstrumentStates, queue_size=10)
        self.addCleanup(publisher.unregister)
        self.assertTrue(patient(lambda: publisher.get_num_connections() > 0))

        def begun():
            publisher.publish(hands)
            return bool(states) and states[-1].step > 0

        had = len(states)
        self.assertTrue(patient(lambda: begun() or len(states) > had + 5))
        self.assertEqual(states[-1].step, 0, "one of two hands is no pair")
        hands.instruments[1].valid = True
        self.assertTrue(patient(begun), simulation.text())
        self.assertTrue(patient(lambda: bool(steps)))
        self.assertEqual([tool.present for tool in steps[0].tools[:2]], [True, True])
        self.assertNotEqual(states[-1].status, "waiting for the hands")
        simulation.end()

    def test_nothing_of_the_first_steps_is_lost(self):
        # A simulation begins once its inputs are taken: whatever else it publishes is connected by then.
        kinds = {"tissue/events": TissueEvent, "tissue/state_hash": StateHash, "effects/state_hash": StateHash,
                 "haptics/endoscope/operating_state": HapticState}
        for k, (inputs, first) in enumerate((i, f) for i in ("step_inputs", "session/batches") for f in ("recorder", "simulation")):
            relay = inputs == "session/batches"
            words = (f"__name:=recorder_{k}", f"_relay:={str(relay).lower()}")
            with tempfile.TemporaryDirectory() as folder:
                states = []
                status = rospy.Subscriber("session/recording", SessionState, states.append)
                if first == "recorder":
                    recorder = Node("vest_bringup", "recorder", f"_directory:={folder}", *words)
                    self.assertTrue(patient(lambda: states and states[-1].status == "waiting for the simulation"), recorder.text())  # noqa: B023
                publishers = {name: rospy.Publisher(name, kind, queue_size=10) for name, kind in kinds.items()}
                if relay:
                    publishers[inputs] = rospy.Publisher(inputs, RecordingBatch, queue_size=10)
                publishers["step_inputs"] = rospy.Publisher("step_inputs", StepInput, queue_size=10)
                if first == "simulation":
                    recorder = Node("vest_bringup", "recorder", f"_directory:={folder}", *words)
                self.addCleanup(recorder.end)
                taken = publishers[inputs]
                while taken.get_num_connections() == 0 and recorder.process.poll() is None:
                    time.sleep(0.0005)
                missing = [name for name in kinds if publishers[name].get_num_connections() == 0]
                recorder.end()
            for publisher in [status, *publishers.values()]:
                publisher.unregister()
            self.assertEqual(missing, [], (inputs, first))

    def test_forces_on_the_hand_are_recorded_and_of_the_states_those_that_pictures_need(self):
        force = rospy.Publisher("haptics/left/state", HapticState, queue_size=100)
        state = rospy.Publisher("tissue/state", TissueState, queue_size=100)
        with tempfile.TemporaryDirectory() as folder:
            recorder = Node("vest_bringup", "recorder", f"_directory:={folder}", "_state_rate:=5")
            self.addCleanup(recorder.end)
            self.assertTrue(patient(lambda: force.get_num_connections() > 0 and state.get_num_connections() > 0), recorder.text())
            for k in range(120):
                force.publish(HapticState(instrument="left", step=k))
                fields = [TissueField(data=b"1")] if k % 40 == 0 else []
                state.publish(TissueState(step=k, positions=[0.0] * 300, fields=fields))
                time.sleep(0.02)
            time.sleep(0.5)
            recorder.end()
            with rosbag.Bag(f"{folder}/session.bag") as bag:
                self.assertEqual(bag.get_message_count("/haptics/left/state"), 120)
                steps = [m.message.step for m in bag.read_messages(topics=["/tissue/state"])]
                self.assertEqual([k for k in (0, 40, 80) if k not in steps], [], "fields per knot are kept, all of them")
                self.assertLess(len(steps), 60)
                self.assertGreater(len(steps), 3)
        force.unregister()
        state.unregister()

    def test_what_re_simulation_makes_again_is_thinned_and_all_else_is_kept(self):
        everything = {"step_inputs": StepInput, "haptics/left/state": HapticState}
        thinned = {"tissue/contacts": (ContactModels, 50), "joint_states": (JointState, 100), "left/measured_cp": (PoseStamped, 50)}
        types = {**everything, **{topic: kind for topic, (kind, _) in thinned.items()}}
        for thin in (True, False):
            # New ones each time: those of before count the recorder that has ended until they write to it.
            publishers = {topic: rospy.Publisher(topic, kind, queue_size=10000) for topic, kind in types.items()}
            topology = rospy.Publisher("tissue/topology", TissueTopology, queue_size=100)
            with tempfile.TemporaryDirectory() as folder:
                recorder = Node("vest_bringup", "recorder", f"_directory:={folder}", f"_thin:={str(thin).lower()}")
                self.addCleanup(recorder.end)
                self.assertTrue(patient(lambda: all(p.get_num_connections() for p in [topology, *publishers.values()])), recorder.text())
                taken = []
                status = rospy.Subscriber("session/recording", SessionState, lambda m: taken.append(m.recorded_messages))
                self.addCleanup(status.unregister)
                began, steps = time.time(), 1000
                for k in range(1, steps + 1):
                    for topic, publisher in publishers.items():
                        publisher.publish(types[topic](step=k, dt=0.001) if topic == "step_inputs" else types[topic]())
                    if k % 100 == 0:  # ten times, one cut
                        topology.publish(TissueTopology(scene_hash="1", step=k, revision=int(k >= 500)))
                        # A busy machine hands them over in heaps, of which one is kept: here each hundred is one.
                        self.assertTrue(patient(lambda: taken and taken[-1] >= len(everything) * k), recorder.text())
                    time.sleep(0.001)
                took = time.time() - began
                time.sleep(0.5)
                recorder.end()
                with rosbag.Bag(f"{folder}/session.bag") as bag:
                    count = {topic: bag.get_message_count("/" + topic) for topic in types}
                    revisions = [m.message.revision for m in bag.read_messages(topics=["/tissue/topology"])]
                    newest = {topic: max(m.message.header.seq for m in bag.read_messages(topics=["/" + topic])) for topic in thinned}
                    first = {topic: min(m.message.header.seq for m in bag.read_messages(topics=["/" + topic])) for topic in thinned}
                with open(f"{folder}/session.json", encoding="utf-8") as f:
                    rates = json.load(f)["rates"]
            for topic in everything:
                self.assertEqual(count[topic], steps, topic)
            for topic, (_, rate) in thinned.items():
                most = 1.2 * rate * took + 2 if thin else steps
                self.assertLessEqual(count[topic], most, topic)
                self.assertGreaterEqual(count[topic], 4 if thin else steps, topic)
                # Of the first and of the last hundred any one may be the one that is kept.
                self.assertGreater(newest[topic] - first[topic], 0.8 * steps, "how many were sent can still be told")
                self.assertGreater(rates["/" + topic] * took, 0.8 * steps, "rates are those that were sent")
            self.assertEqual(revisions, [0, 1] if thin else 4 * [0] + 6 * [1])
            for publisher in [topology, *publishers.values()]:
                publisher.unregister()

    def test_a_snapshot_by_name_is_kept_and_restored_where_nothing_is_recorded(self):
        with tempfile.TemporaryDirectory() as folder:
            simulation = self.simulation("alone", f"_session_directory:={folder}/not_there")
            rospy.wait_for_service("tissue/snapshot", 60)
            snapshot = rospy.ServiceProxy("tissue/snapshot", Snapshot)
            saved = snapshot(operation=SnapshotRequest.SAVE, name="before")
            self.assertTrue(saved.success, saved.message)
            self.assertIn("in memory", saved.message)
            self.assertFalse(os.path.exists(f"{folder}/not_there"))
            os.mkdir(f"{folder}/not_there")  # as a recorder does that starts now
            restored = snapshot(operation=SnapshotRequest.RESTORE, name="before")
            self.assertTrue(restored.success, restored.message)
            self.assertTrue(os.path.exists(f"{folder}/not_there/snapshots/before.snapshot"), "re-simulation will ask for it")
            simulation.end()

    def simulation(self, name, *words):
        node = Node("vest_tissue", "tissue_node", f"__name:={name}", "_scene:=tube", *words)
        self.addCleanup(node.end)
        return node

    def goes_on(self, states, node):
        had = len(states)
        self.assertTrue(patient(lambda: len(states) > had + 3), node.text())

    def launched(self, *words):
        """What roslaunch says that refuses to start."""
        done = subprocess.run(["roslaunch", *words], capture_output=True, text=True, timeout=120, check=False)
        self.assertNotEqual(done.returncode, 0, done.stdout)
        return done.stdout + done.stderr

    def test_a_second_launch_at_one_master_is_one_message_before_any_node_starts(self):
        states = []
        listening = rospy.Subscriber("/vest/session/state", SessionState, states.append)
        self.addCleanup(listening.unregister)
        first = self.simulation("first", "__ns:=vest")
        self.goes_on(states, first)
        nodes = set(rosnode.get_node_names())
        for words in (["trainer.launch", "ns:=vest"], ["scene.launch"], ["replay.launch", "bag:=/nowhere"],
                      ["replay.launch", "ns:=other", "bag:=/nowhere"]):
            said = self.launched("vest_bringup", *words)
            self.assertEqual(said.count("a session runs at this ROS master already"), 1, said)
            self.assertIn("/vest/first publishes /vest/", said)
            self.assertIn("roslaunch -p PORT", said)
            self.assertLessEqual(set(rosnode.get_node_names()), nodes, "nothing was started")
        self.assertFalse(rospy.has_param("/use_sim_time"), "the first would begin to wait for a clock")
        self.goes_on(states, first)
        rospy.set_param("/use_sim_time", True)  # as beside a replay, whose clock is everybody's
        self.assertIn("not beside a replay", self.launched("vest_bringup", "trainer.launch", "ns:=other"))
        rospy.delete_param("/use_sim_time")
        # With a master of its own it is no second one.
        names = subprocess.run(["roslaunch", "-p", str(PORT + 1), "--nodes", "vest_bringup", "trainer.launch"], capture_output=True,
                               text=True, timeout=120, check=False)
        self.assertIn("/vest/manager", names.stdout, names.stderr)
        # Nor where the first was killed, though the master still knows its name.
        first.signal(signal.SIGKILL)
        first.process.wait()
        self.assertIn("/vest/first", rosnode.get_node_names())
        names = subprocess.run(["roslaunch", "--nodes", "vest_bringup", "trainer.launch"], capture_output=True, text=True, timeout=120,
                               check=False)
        self.assertIn("/vest/manager", names.stdout, names.stderr)

    def test_two_trainers_run_side_by_side_at_one_master_each_with_its_own_names(self):
        heard = {}
        for ns in ("one", "two"):
            for topic, kind in (("session/state", SessionState), ("tf", TFMessage), ("diagnostics", DiagnosticArray),
                                ("tissue/contacts", ContactModels)):
                heard[ns, topic] = []
                listening = rospy.Subscriber(f"/{ns}/{topic}", kind, heard[ns, topic].append)
                self.addCleanup(listening.unregister)
        common = []
        frames = rospy.Subscriber("/tf", TFMessage, common.append)
        self.addCleanup(frames.unregister)
        words = rospy.Subscriber("/diagnostics", DiagnosticArray, common.append)
        self.addCleanup(words.unregister)
        with tempfile.TemporaryDirectory() as folder:
            trainers = []
            for ns in ("one", "two"):
                said = open(f"{folder}/{ns}.log", "w", encoding="utf-8")  # pylint: disable=consider-using-with
                self.addCleanup(said.close)
                trainers.append(subprocess.Popen(["roslaunch", "vest_bringup", "trainer.launch", f"ns:={ns}", "scene:=tube", "rviz:=false",
                                                  "record:=false"], stdout=said, stderr=subprocess.STDOUT))
                patient(lambda: rospy.has_param("/run_id"))  # a bare master has none: two launches at once would each set it
            try:
                self.assertTrue(patient(lambda: all(heard.values()) and all(heard[ns, "session/state"][-1].step > 300 for ns in ("one", "two")), 300),
                                open(f"{folder}/one.log", encoding="utf-8").read() + open(f"{folder}/two.log", encoding="utf-8").read())
                self.assertEqual([t.poll() for t in trainers], [None, None])
                self.assertEqual(common, [], "frames and warnings of the two would be mixed")
                for ns in ("one", "two"):
                    names = lambda n=ns: {status.name for m in list(heard[n, "diagnostics"]) for status in m.status}
                    self.assertTrue(patient(lambda n=names: {"vest_instruments: left", "vest: simulation"} <= n()), names())
                # A machine that is put aside (a lid, a full memory) is no end of a session.
                stopped = pid_of("/one/manager")
                os.kill(stopped, signal.SIGSTOP)
                time.sleep(6.0)  # nodelet's bonds break after four
                os.kill(stopped, signal.SIGCONT)
                for ns in ("one", "two"):
                    before = heard[ns, "session/state"][-1].step
                    self.assertTrue(patient(lambda n=ns, b=before: heard[n, "session/state"][-1].step > b + 300),
                                    open(f"{folder}/{ns}.log", encoding="utf-8").read())
                time.sleep(2.0)
                self.assertEqual([t.poll() for t in trainers], [None, None])
                for ns in ("one", "two"):
                    steps = [s.step for s in heard[ns, "session/state"]]
                    self.assertEqual(steps, sorted(steps), "each has its own simulation")
            finally:
                for trainer in trainers:
                    trainer.send_signal(signal.SIGINT)
                for trainer in trainers:
                    trainer.wait(60)

    def test_a_second_simulation_of_a_session_ends_with_one_message_and_the_first_goes_on(self):
        states = []
        listening = rospy.Subscriber("session/state", SessionState, states.append)
        first = self.simulation("first")
        self.goes_on(states, first)
        second = self.simulation("second")
        self.assertEqual(second.process.wait(60), 1, second.text())
        # Of the same name, too: the master is not even asked, or it would tell the first to end.
        self.assertEqual(self.simulation("first").process.wait(60), 1)
        self.assertEqual(second.text().count("the simulation of this session already runs in another process"), 1, second.text())
        self.goes_on(states, first)
        steps = [s.step for s in states]
        self.assertEqual(steps, sorted(steps), "nobody else stepped")
        # A master that was restarted knows nothing of the first.
        self.master.kill()
        self.master.wait()
        type(self).master = master(PORT)
        second = self.simulation("first")
        self.assertEqual(second.process.wait(60), 1, second.text())
        self.assertIn("If the ROS master was started anew, the old session still goes on", second.text())
        self.assertIsNone(first.process.poll())
        # However the first dies, its place is free.
        first.signal(signal.SIGKILL)
        first.process.wait()
        listening.unregister()  # the new master does not know it
        del states[:]
        listening = rospy.Subscriber("session/state", SessionState, states.append)
        self.addCleanup(listening.unregister)
        third = self.simulation("third")
        self.assertTrue(patient(lambda: len(states) > 2), third.text())


if __name__ == "__main__":
    unittest.main(verbosity=2, warnings="ignore")
