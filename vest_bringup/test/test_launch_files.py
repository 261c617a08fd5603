#!/usr/bin/env python3
"""Protects the launch files: each one that is shipped parses, in its shipped configurations, names what it starts, and sets the
parameters that its script and its arguments say."""
import glob
import os
import shlex
import subprocess
import sys
import unittest
import xml.etree.ElementTree

import yaml
from roslaunch.config import load_config_default

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "vest_haptics", "test"))
from ros_support import own_port  # noqa: E402

own_port()  # a session of somebody at the usual master is none of ours
LAUNCH = sys.argv.pop(1)
TRAJECTORIES = os.path.join(LAUNCH, os.pardir, "trajectories")
SCRIPTS = sorted(os.path.splitext(name)[0] for name in os.listdir(TRAJECTORIES))
CASES = [
    ("trainer.launch", [], ["manager", "instruments", "trainer", "recorder", "view", "phantom_box", "phantom_box_emulator"]),
    ("trainer.launch", ["headless:=true", "record:=false", "emulator:=false", "port:=/dev/ttyUSB0"],
     ["manager", "view", "phantom_box"]),
    ("trainer.launch", ["rviz:=false", "trajectory:=/tmp/a.csv", "loop:=true"], ["phantom_box_emulator", "recorder"]),
    ("trainer.launch", ["script:=demo"], ["phantom_box_emulator", "instruments"]),
    ("scene.launch", [], ["phantom_box_emulator", "trainer", "view"]),
    ("scene.launch", ["scene:=/tmp/mine.yaml"], ["phantom_box_emulator", "trainer"]),
    ("trainer.launch", ["left:=sim", "right:=impulse_engine"], ["haptics_left", "haptics_right"]),
    ("trainer.launch", ["inputs:=/tmp/inputs.yaml", "left:=sim"], ["input_devices", "haptic_devices"]),
    ("trainer.launch", ["ns:=b", "frame_prefix:=b"], ["manager", "view"]),
    ("replay.launch", ["bag:=/tmp/session.bag"], ["play", "view"]),
    ("replay.launch", ["bag:=/tmp/session.bag", "headless:=true"], ["play", "view"]),
    ("view.launch", [], ["view"]),
    ("teacher.launch", [], ["teacher", "camera_hand"]),
    ("teacher.launch", ["headless:=true", "camera_hand:=false"], ["teacher"]),
    ("hand.launch", ["name:=left", "tool:=scissors", "mover:=sim"], ["haptics_left"]),
]


def parameters(name, *arguments):
    """What roslaunch would set, by path below /vest."""
    config = load_config_default([(os.path.join(LAUNCH, name), list(arguments))], None, verbose=False)
    return {key[len("/vest/"):]: value.value for key, value in config.params.items() if key.startswith("/vest/")}


def script(name):
    with open(os.path.join(TRAJECTORIES, name + ".yaml"), encoding="utf-8") as file:
        return yaml.safe_load(file)


def flat(tree, path):
    """{path: value} of a nested dictionary."""
    if not isinstance(tree, dict):
        return {path: tree}
    return {key: value for name, inner in tree.items() for key, value in flat(inner, f"{path}/{name}").items()}


class LaunchFiles(unittest.TestCase):
    def test_every_shipped_file_is_tried(self):
        self.assertEqual({name for name, _, _ in CASES}, set(os.listdir(LAUNCH)))

    def test_each_parses_and_names_its_nodes(self):
        for name, arguments, nodes in CASES:
            done = subprocess.run(["roslaunch", "--nodes", os.path.join(LAUNCH, name), *arguments], capture_output=True,
                                  text=True, check=False)
            self.assertEqual(done.returncode, 0, name + done.stderr)
            started = {line.rsplit("/", 1)[-1] for line in done.stdout.split()}
            self.assertTrue(set(nodes) <= started, f"{name} {arguments}: {started}")

    def test_a_script_s_tools_tray_and_effects_are_what_roslaunch_sets(self):
        for name in SCRIPTS:
            says = script(name)
            wanted = {"instruments/tools/left": "grasper", "instruments/tools/right": "grasper", "instruments/tools/third": "none",
                      "trainer/effects/fluid/spacing": 0.003, **flat(says.get("tools", {}), "instruments/tools"),
                      **flat(says.get("effects", {}), "trainer/effects")}
            if "tool_tray" in says:
                wanted["instruments/tool_tray"] = says["tool_tray"]
            found = parameters("scene.launch", "scene:=" + ("gynaecology" if name == "demo" else name))
            self.assertEqual({key: found.get(key) for key in wanted}, wanted, name)
            if name != "demo":
                self.assertEqual(found["trainer/scene"], name)

    def test_arguments_say_more_than_the_script(self):
        arguments = {"left_tool": "bipolar_forceps", "right_tool": "clip_applier", "third_tool": "injection_needle",
                     "tool_tray": "[scissors, grasper]", "fluid_spacing": "0.002"}
        for name in ("cut_tube", "demo", "smoke_lens"):  # with tools alone, a tray, effects
            found = parameters("trainer.launch", "script:=" + name, *(f"{key}:={value}" for key, value in arguments.items()))
            self.assertEqual([found["instruments/tools/" + hand] for hand in ("left", "right", "third")],
                             ["bipolar_forceps", "clip_applier", "injection_needle"], name)
            self.assertEqual(found["instruments/tool_tray"], ["scissors", "grasper"], name)
            self.assertEqual(found["trainer/effects/fluid/spacing"], 0.002, name)

    def test_frames_are_on_tf_where_they_have_a_prefix_and_in_the_namespace_where_they_have_none(self):
        own = [["/tf", "/two/tf"], ["/tf_static", "/two/tf_static"]]
        for launch, name in (("trainer.launch", "manager"), ("teacher.launch", "teacher")):
            for words, prefix, remaps in ((["ns:=vest"], "", []), (["ns:=two"], "", own), (["ns:=two", "frame_prefix:=/"], "", own),
                                          (["ns:=two", "frame_prefix:=b"], "b/", []), (["ns:=two", "frame_prefix:=5/"], "5/", [])):
                config = load_config_default([(os.path.join(LAUNCH, launch), words)], None, verbose=False)
                nodes = {node.name: node for node in config.nodes}
                self.assertEqual([r for r in map(list, nodes[name].remap_args) if r[0].startswith("/tf")], remaps, (launch, words))
                shown = shlex.split(nodes["view" if name == "manager" else name].launch_prefix)
                self.assertEqual((os.path.basename(shown[-2]), shown[-1].strip("/")), ("rviz_with_prefix", prefix.strip("/")), (launch, words))
                if name == "manager":
                    self.assertEqual(config.params["/" + words[0][4:] + "/frame_prefix"].value, prefix)

    def test_the_tissue_does_not_run_away_from_the_hands_of_a_script(self):
        played = ("script:=cut_tube", "trajectory:=/tmp/a.csv")  # as run_session gives them
        for words in (played, played[:1]):
            found = parameters("trainer.launch", *words)
            self.assertEqual((found["trainer/catch_up"], found["trainer/wait_for_hands"]), (0.05, True), "ScriptClock::kLead")
        found = parameters("trainer.launch", "trajectory:=/tmp/a.csv")
        self.assertEqual((found.get("trainer/catch_up"), found["trainer/wait_for_hands"]), (None, False))

    def test_a_path_is_taken_wherever_a_name_is(self):
        here = os.environ.get("PWD", os.getcwd())
        os.environ["PWD"] = TRAJECTORIES
        try:
            for path in (os.path.join(TRAJECTORIES, "cut_tube.yaml"), "cut_tube.yaml", "./cut_tube.yaml"):
                for launch in ("trainer.launch", "scene.launch"):
                    found = parameters(launch, "script:=" + path, "scene:=mine/mine.yaml", "output:=mine", "record:=true")
                    self.assertEqual(found["instruments/tools/right"], "scissors")
                    for which, name in (("trainer/scene", "mine/mine.yaml"), ("recorder/directory", "mine"),
                                        ("trainer/session_directory", "mine")):
                        self.assertEqual(os.path.normpath(found[which]), os.path.normpath(os.path.join(TRAJECTORIES, name)), which)
        finally:
            os.environ["PWD"] = here

    def test_nothing_of_an_earlier_launch_at_the_same_master_counts(self):
        # The options of an earlier device would choose the robot that gets forces; an earlier input map what the pedals do.
        def cleared(package, name, *arguments):
            file = os.path.join(LAUNCH, os.pardir, os.pardir, package, "launch", name)
            return set(load_config_default([(file, list(arguments))], None, verbose=False).clear_params)

        self.assertIn("/haptics_left/", cleared("vest_haptics", "device.launch"))
        self.assertIn("/phantom_box/", cleared("vest_hw_phantom_box", "phantom_box.launch"))
        self.assertIn("/vest/instruments/", cleared("vest_instruments", "instruments.launch"))
        session = cleared("vest_bringup", "trainer.launch", "left:=sim")
        self.assertLessEqual({"/vest/instruments/", "/vest/trainer/", "/vest/phantom_box/", "/vest/haptics_left/"}, session)
        mapped = cleared("vest_bringup", "trainer.launch", "inputs:=/tmp/inputs.yaml")
        self.assertLessEqual({f"/vest/haptics_{name}/" for name in ("left", "right", "third")}, mapped)

    def test_the_force_limit_reaches_the_devices_of_an_input_map_too(self):
        config = load_config_default([(os.path.join(LAUNCH, "trainer.launch"), ["inputs:=/tmp/inputs.yaml", "force_limit:=1.5"])], None,
                                     verbose=False)
        [devices] = [node for node in config.nodes if node.name == "haptic_devices"]
        self.assertEqual(devices.args.split(), ["/tmp/inputs.yaml", "_force_limit:=1.5"])
        self.assertEqual(parameters("trainer.launch", "left:=sim", "force_limit:=1.5")["haptics_left/force_limit"], 1.5)

    def test_a_script_that_is_not_there_or_wrong_is_refused_before_any_node_starts(self):
        for wrong, named in (("nosuch", "cut_tube"), ("/nowhere/mine.yaml", "no such file"), (os.path.abspath(__file__), "")):
            done = subprocess.run(["roslaunch", "--nodes", os.path.join(LAUNCH, "trainer.launch"), "script:=" + wrong],
                                  capture_output=True, text=True, check=False)
            self.assertNotEqual(done.returncode, 0, wrong)
            self.assertIn("allowed", done.stderr, wrong)
            self.assertIn(named, done.stderr, wrong)

    def test_every_argument_of_every_launch_file_is_explained(self):
        files = glob.glob(os.path.join(LAUNCH, os.pardir, os.pardir, "vest_*", "launch", "*.launch"))
        self.assertGreater(len(files), 5)
        for file in files:
            for argument in xml.etree.ElementTree.parse(file).getroot().findall("arg"):
                if "value" not in argument.attrib:
                    self.assertTrue(argument.get("doc"), f"{file}: {argument.get('name')}")

    def test_other_hosts_are_refused_unless_the_shell_names_an_address(self):
        files = glob.glob(os.path.join(LAUNCH, os.pardir, os.pardir, "vest_*", "launch", "*.launch"))
        files = [file for file in files if next(xml.etree.ElementTree.parse(file).iter("node"), None) is not None]
        self.assertGreater(len(files), 5)
        needed = {"replay.launch": ["bag:=/tmp/session.bag"], "show_image.launch": ["image:=/tmp/a.nrrd"]}
        before = dict(os.environ)
        try:
            for named, wanted in (({}, "localhost"), ({"ROS_IP": "10.78.0.1"}, None), ({"ROS_HOSTNAME": "trainer"}, None)):
                for name in ("ROS_IP", "ROS_HOSTNAME"):
                    os.environ.pop(name, None)
                os.environ.update(named)
                for file in files:
                    config = load_config_default([(file, needed.get(os.path.basename(file), []))], None, verbose=False)
                    for node in config.nodes:
                        self.assertEqual(dict(node.env_args).get("ROS_HOSTNAME"), wanted, f"{file}: {node.name} with {named}")
        finally:
            os.environ.clear()
            os.environ.update(before)

    def test_trainee_and_teacher_share_a_master_and_the_teacher_gives_way(self):
        def nodes(name, *arguments):
            return load_config_default([(os.path.join(LAUNCH, name), list(arguments))], None, verbose=False).nodes
        trainee = nodes("trainer.launch", "rviz_config:=trainee.rviz")
        for headless in ("true", "false"):
            teacher = nodes("teacher.launch", "headless:=" + headless)
            self.assertEqual({n.namespace + n.name for n in trainee} & {n.namespace + n.name for n in teacher}, set())
            rviz = next(n for n in teacher if n.type == "rviz")
            self.assertIn("nice -n 10 ", rviz.launch_prefix)
            self.assertFalse(any(n.required for n in teacher), "the session goes on without a teacher")

    def test_the_optic_is_an_argument(self):
        self.assertNotIn("instruments/optic_deg", parameters("trainer.launch"))
        self.assertEqual(parameters("trainer.launch", "optic_deg:=0")["instruments/optic_deg"], 0.0)

    def test_a_haptic_process_that_died_is_never_started_again(self):
        for arguments, nodes in ((["left:=sim", "third:=phantom"], {"haptics_left", "haptics_third"}),
                                 (["left:=haptic"], set()),  # started by itself
                                 (["inputs:=/tmp/inputs.yaml"], {"haptic_devices"})):
            config = load_config_default([(os.path.join(LAUNCH, "trainer.launch"), arguments)], None, verbose=False)
            haptic = [node for node in config.nodes if node.package == "vest_haptics"]
            self.assertEqual({node.name for node in haptic}, nodes)
            for node in haptic:
                self.assertFalse(node.respawn, node.name)
                self.assertTrue(node.required, f"{node.name}: the session ends with it")
                self.assertFalse(node.launch_prefix, f"{node.name}: keep_running would start it again")

    def test_without_the_emulator_none_is_started(self):
        done = subprocess.run(["roslaunch", "--nodes", os.path.join(LAUNCH, "trainer.launch"), "emulator:=false"],
                              capture_output=True, text=True, check=False)
        self.assertNotIn("phantom_box_emulator", done.stdout)


if __name__ == "__main__":
    unittest.main()
