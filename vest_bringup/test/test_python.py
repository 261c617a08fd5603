#!/usr/bin/env python3
"""Protects `import vest`: what the interface promises, errors as exceptions, exact snapshots, the same hash as C and C++, free threads, no leak."""
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import threading
import types
import unittest

import numpy as np
import rosbag
import rospkg
import vest
from vest import cem, picture
from vest_msgs.msg import StepInput, VesselDilatation

FULL = "VEST_FULL" in os.environ
TUBE = os.path.join(rospkg.RosPack().get_path("vest_tissue"), "scenes/tube/tube.yaml")


def play(env, seed, steps=10**6, policy=None):
    observation, info = env.reset(seed=seed)
    total = 0.0
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(env.expert() if policy is None else policy(observation))
        total += reward
        if terminated or truncated:
            break
    return total, info


def compare_with_bag(test, file, most):
    """Steps a World by the inputs of a session, recorded by ROS, and compares each hash that was recorded."""
    with rosbag.Bag(file) as bag:
        scene = next(m for _, m, _ in bag.read_messages("/vest/tissue/scene")).scene
        inputs = []
        for _, m, _ in bag.read_messages("/vest/step_inputs"):
            if m.step == 1 and not inputs:  # of the session, or by a reset
                m.command = 0
            elif not inputs:
                continue
            if m.command != 0 or m.step > most:
                break
            inputs.append(m)
        begin, end = inputs[0].header.stamp, inputs[-1].header.stamp
        hashes = {m.step: m.hash for _, m, _ in bag.read_messages("/vest/tissue/state_hash") if begin <= m.header.stamp <= end}
    world, compared = vest.World("%s/scenes/%s/%s.yaml" % (rospkg.RosPack().get_path("vest_tissue"), scene, scene)), 0
    for m in inputs:
        world.step_input(m)
        if m.step in hashes:
            test.assertEqual("%016x" % world.hash(), "%016x" % hashes[m.step], "step %d" % m.step)
            compared += 1
    test.assertGreaterEqual(compared, max(1, world.steps // 100))


class TestWorld(unittest.TestCase):
    def test_a_vessels_pulse_is_taken_as_a_session_records_it(self):
        scene = "%s/scenes/arterial_bleeding/arterial_bleeding.yaml" % rospkg.RosPack().get_path("vest_tissue")
        hashes = set()
        for last in (0.99, 1.05):  # each of its places counts
            world = vest.World(scene)
            for _ in range(20):
                world.step_input(StepInput(seed=1, dilatations=[VesselDilatation("uterine_artery_left", [1.05, 1.03, 1.01, last])]))
            hashes.add(world.hash())
        self.assertEqual(len(hashes), 2)

    def test_steps_positions_hash_save_and_restore(self):
        world = vest.World(TUBE, threads=2)
        self.assertIn("tube", world.objects)
        before = world.positions("tube")
        self.assertEqual((before.dtype, before.shape[1]), (np.float32, 3))
        np.testing.assert_array_equal(before, world.positions(world.objects.index("tube")))
        world.step()
        world.step(n=30)
        self.assertEqual(world.steps, 31)
        self.assertAlmostEqual(world.time, 0.031)
        state, hash_there = world.save(), world.hash()
        self.assertIsInstance(state, bytes)
        world.step(20)
        self.assertNotEqual(world.hash(), hash_there)
        after, positions = world.hash(), world.positions("tube")
        world.restore(state)
        self.assertEqual(world.hash(), hash_there)
        world.step(20)
        self.assertEqual(world.hash(), after)
        other = vest.World(scene_path=pathlib.Path(TUBE))
        other.step(51)
        self.assertEqual(other.hash(), after)
        np.testing.assert_array_equal(other.positions("tube"), positions)

    def test_mistakes_are_exceptions_with_one_message(self):
        with self.assertRaisesRegex(ValueError, "nowhere.yaml"):
            vest.World("/nowhere.yaml")
        with self.assertRaisesRegex(ValueError, r"threads: 0 \(allowed: 1 to 64\)"):
            vest.World(TUBE, threads=0)
        world = vest.World(TUBE)
        with self.assertRaisesRegex(ValueError, r"'ovary' is not in the scene \(allowed: tube\)"):
            world.positions("ovary")
        with self.assertRaisesRegex(ValueError, r"object: 7 \(allowed: 0 to 0\)"):
            world.positions(7)
        for none in (-1, None, 0.5, 2**80):
            with self.assertRaisesRegex(ValueError, r"object: .* \(allowed: a name, or 0 to 0\)"):
                world.positions(none)
        there = world.hash()
        for bad in (b"", b"VESTWLD7", world.save()[:-1]):
            with self.assertRaises(ValueError):
                world.restore(bad)
        self.assertEqual(world.hash(), there)
        for n in (-1, 1.5, None, True, 2**80):
            with self.assertRaisesRegex(ValueError, r"n: .* \(allowed: 0 or more whole steps\)"):
                world.step(n)
        world.step(np.int32(1))
        for call in (lambda: world.restore("text"), lambda: vest.World(7)):
            with self.assertRaises(TypeError):
                call()
        world.close()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            world.step()

    def test_recorded_inputs_give_the_hashes_that_are_in_the_bag(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["rosrun", "vest_bringup", "vest_exercise", "run", "clip_cut_tube", "--output", folder],
                           check=True, capture_output=True)
            compare_with_bag(self, folder + "/session.bag", 3000)

    def test_an_input_moves_what_it_touches_or_is_refused(self):
        world, still = vest.World(TUBE), vest.World(TUBE)
        x, y, z = world.positions("tube").mean(0).astype(float)
        tool = types.SimpleNamespace(present=True, tool=1, position=(x, y, z), pivot=(0, 0, 0.3), jaw=0.5)
        nobody = types.SimpleNamespace()
        for _ in range(20):
            world.step_input(types.SimpleNamespace(tools=[nobody, tool]))
        still.step(20)
        self.assertNotEqual(world.hash(), still.hash())
        there = world.hash()
        for field, value in (("dt", 1.0), ("dt", float("nan")), ("step", 7), ("command", 1), ("requests", ["fly"]), ("tools", [nobody] * 5),
                             ("tools", [types.SimpleNamespace(tool=99)]), ("tools", [types.SimpleNamespace(jaw=float("inf"))])):
            with self.assertRaisesRegex(ValueError, r"allowed", msg=field):
                world.step_input(types.SimpleNamespace(**{field: value}))
        self.assertEqual(world.hash(), there)

    def test_the_interpreter_is_free_while_it_steps(self):
        world, counted = vest.World(TUBE), [0]
        thread = threading.Thread(target=world.step, args=(20000,))
        thread.start()
        while thread.is_alive():
            counted[0] += 1
        self.assertGreater(counted[0], 100)  # held: at most a few before the thread has the lock


class TestTasks(unittest.TestCase):
    def test_signatures_spaces_and_experts(self):
        for task in vest.tasks():
            if task == "tie_throw" and not FULL:
                continue  # 40 s of a core; test_learning.cpp does it in any case
            env = vest.make(task)
            observation, info = env.reset(seed=4)
            self.assertTrue(env.observation_space.contains(observation))
            self.assertTrue(env.action_space.contains(env.action_space.sample()))
            start = info["score"]
            total, info = play(env, 4)
            self.assertTrue(info["passed"], task)
            self.assertAlmostEqual(start + total, 1.0, places=5)
            with self.assertRaisesRegex(RuntimeError, "the episode is over"):
                env.step(np.zeros(env.action_space.shape))
            env.close()

    def test_both_hands_tie_a_throw(self):
        env = vest.make("tie_throw")
        self.assertEqual((env.action_space.shape, env.observation_space.shape), ((12,), (21,)))
        seen, _ = env.reset(seed=4)
        action = np.zeros(12)
        action[6:9] = (0, 0, 1)  # the left hand alone goes up
        after = env.step(action)[0]
        np.testing.assert_allclose(after[13:16] - seen[13:16], (0, 0, 0.2), atol=0.002)  # cm
        np.testing.assert_allclose(after[0:3], seen[0:3], atol=1e-5)
        with self.assertRaisesRegex(ValueError, "6"):
            env.step(action[:6])
        many = vest.make_vector("tie_throw", 2, threads=2)
        self.assertEqual(many.action_space.shape, (2, 12))
        many.reset(seed=4)
        self.assertEqual(many.step(many.expert())[0].shape, (2, 21))

    def test_an_exercise_is_an_environment_with_its_own_score(self):
        env = vest.make("clip_cut_tube", pictures=(64, 48))
        self.assertIn("clip_cut_tube", vest.exercises())
        seen, info = env.reset(seed=1)
        self.assertIn(seen, env.observation_space)
        self.assertEqual(env.observation_names[-4:], ["phases done (0 to 1)", "quality (0 to 1)", "score (0 to 1)", "time left (0 to 1)"])
        self.assertEqual((len(env.observation_names), env.action_space.shape), (seen["state"].size, (16,)))
        self.assertEqual(info["score"], 0)
        for _ in range(10):
            moved = env.step(env.expert())[0]
        self.assertTrue((moved["rgb"] != seen["rgb"]).any())
        result = env.result()
        self.assertEqual(({"clip_place", "economy"} - {item["name"] for item in result["items"]}, result["passed"]), (set(), False))
        with self.assertRaisesRegex(ValueError, "no exercise"):
            vest.make("reach").result()
        with self.assertRaisesRegex(ValueError, "cannot be read as an exercise file"):
            vest.make("/nowhere/exercise.yaml")
        many = vest.make_vector("clip_cut_tube", 2, threads=2)
        many.reset(seed=1)
        for _ in range(10):
            states = many.step(many.expert())[0]
        np.testing.assert_array_equal(states[0], moved["state"])

    def test_mistakes(self):
        with self.assertRaisesRegex(ValueError, r"task: 'fly' is unknown \(allowed: reach, grasp_lift, retract, clip, cut, suck, camera_follow, pass_needle, tie_throw, .*clip_cut_tube, .* or the path of an exercise file\)"):
            vest.make("fly")
        with self.assertRaisesRegex(ValueError, "skip: 0|skip: -1"):
            vest.make("reach", skip=-1)
        for skip in (None, float("nan"), "a", 1.7, True, float("inf")):
            with self.assertRaisesRegex(ValueError, r"skip: .* \(allowed: 1 to 1000\)"):
                vest.make("reach", skip=skip)
        for limit in (None, "a"):
            with self.assertRaisesRegex(ValueError, r"limit: .* \(allowed: seconds"):
                vest.make("reach", limit=limit)
        env = vest.make("reach")
        env.reset(seed=1)
        with self.assertRaisesRegex(ValueError, r"action: 5 numbers \(allowed: 6\)"):
            env.step(np.zeros(5))
        with self.assertRaisesRegex(ValueError, "options: nonsense"):
            env.reset(options={"nonsense": 1})
        many = vest.make_vector("reach", 2)
        for seed in (-1, 2**64, 0.5, "a", True):
            for of in (env, many):
                with self.assertRaisesRegex(ValueError, r"seed: .* \(allowed: 0 to 2\^64 - 1\)"):
                    of.reset(seed=seed)
        with self.assertRaisesRegex(ValueError, "seed: -1"):
            many.reset(seed=[0, -1])
        env.reset(seed=2**64 - 1)
        many.reset(seed=2**64 - 1)
        with self.assertRaisesRegex(ValueError, r"option: 'frame_skip' is unknown \(allowed: .*skip"):
            vest.make("reach", frame_skip=5)
        with self.assertRaisesRegex(ValueError, r"option: 'render_mode' is unknown .* of a single environment"):
            vest.make_vector("reach", 2, render_mode="rgb_array")
        with self.assertRaisesRegex(ValueError, r"skip: 1.7 \(allowed: 1 to 1000\)"):
            vest.make("reach", skip=1.7)
        with self.assertRaisesRegex(ValueError, r"pictures: 'wide' \(allowed"):
            vest.make("reach", pictures="wide")
        for n in (0, -1, 4097, "two"):
            with self.assertRaisesRegex(ValueError, r"environments: .* \(allowed: 1 to 4096\)"):
                vest.make_vector("reach", n)

    def test_seeds_states_and_vectors_are_exact(self):
        one, other = vest.make("grasp_lift"), vest.make("grasp_lift")
        play(one, 9, 70)
        play(other, 9, 40)
        state = other.save()
        play(other, 3, 5)
        other.reset(options={"state": state})
        for _ in range(30):
            other.step(other.expert())
        self.assertEqual(one.hash(), other.hash())
        self.assertEqual(one.save(), other.save())
        many = vest.make_vector("grasp_lift", 3, threads=2)
        seen, _ = many.reset(seed=[9, 10, 11])
        self.assertEqual(seen.shape, many.observation_space.shape)
        for _ in range(70):
            seen, reward, terminated, truncated, info = many.step(many.expert())
        self.assertEqual((reward.shape, terminated.dtype, truncated.dtype), ((3,), np.bool_, np.bool_))
        one.reset(options={"state": one.save()})
        np.testing.assert_array_equal(seen[0], one.reset(options={"state": one.save()})[0])
        self.assertEqual(info["passed"].shape, (3,))

    def test_a_picture_shows_the_tube_and_the_instrument(self):
        env = vest.make("grasp_lift", render_mode="rgb_array")
        play(env, 1, 60)
        drawn = env.render()
        self.assertEqual((drawn.dtype, drawn.ndim), (np.uint8, 3))
        red = (drawn[..., 0] > 1.5 * drawn[..., 2]) & (drawn[..., 0] > 60)
        grey = (abs(drawn[..., 0].astype(int) - drawn[..., 2]) < 30) & (drawn[..., 0] > 60)
        self.assertGreater(red.mean(), 0.02)
        self.assertGreater(grey.mean(), 0.002)
        with tempfile.NamedTemporaryFile(suffix=".png") as f:
            picture.write_png(f.name, drawn)
            self.assertEqual(f.read(8), b"\x89PNG\r\n\x1a\n")

    def test_pictures_and_depth_are_observations_and_threads_change_nothing(self):
        one, many = vest.make("grasp_lift", pictures=(96, 72)), vest.make_vector("grasp_lift", 2, threads=2, pictures=(96, 72))
        seen, all_seen = one.reset(seed=7)[0], many.reset(seed=[7, 8])[0]
        for env, observation in ((one, seen), (many, all_seen)):
            self.assertIn(observation, env.observation_space)
        for name in ("state", "rgb", "depth"):
            np.testing.assert_array_equal(seen[name], all_seen[name][0], err_msg=name)
        self.assertTrue((all_seen["rgb"][0] != all_seen["rgb"][1]).any())
        self.assertTrue((seen["depth"] > 0.02).all(), "the cavity closes the view")
        moved = one.step(np.ones(6, np.float32))[0]
        self.assertTrue((moved["depth"] != seen["depth"]).any())
        for bad in ((7, 72), (96, 2000)):
            with self.assertRaisesRegex(ValueError, r"allowed: 8 to 1024"):
                vest.make("reach", pictures=bad)

    def test_the_camera_sees_in_the_middle_what_it_follows(self):
        env = vest.make("camera_follow", pictures=(160, 120))
        middle = lambda seen: seen["depth"][56:65, 76:85].min()  # noqa: E731
        seen = env.reset(seed=2)[0]
        self.assertGreater(middle(seen), 0.08)
        over = False
        while not over:
            seen, _, over, truncated, info = env.step(env.expert())
            over = over or truncated
        self.assertTrue(info["passed"])
        self.assertLess(abs(middle(seen) - 0.060), 0.015, "m: as near as the task asks")

    def test_what_is_sucked_is_gone_from_the_picture(self):
        env = vest.make("suck", pictures=(160, 120))
        water = lambda seen: (seen["rgb"][..., 2] > 1.1 * seen["rgb"][..., 0]).mean()  # noqa: E731
        before = env.reset(seed=2)[0]
        play(env, 2)
        self.assertGreater(water(before), 0.1)
        self.assertLess(water(env._seen(None)), 0.5 * water(before))

    def test_ten_thousand_resets_leak_nothing(self):
        env = vest.make("reach", skip=1)
        seen = env.reset(seed=0)[0]

        def resets(count):
            for k in range(count):
                env.reset(seed=k)
                env.step(seen[:6])
                if k % 100 == 0:
                    env.restore(env.save())
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        before = resets(300)
        after = resets(10000 if FULL else 1000)
        self.assertLess(after - before, 3000, "KiB")  # a leak of one State a reset would be gigabytes

    def test_many_environments_share_one_model(self):
        said = subprocess.run([sys.executable, "-m", "vest.measure", "reach", "--steps", "5"], capture_output=True, text=True, check=True).stdout
        one, every = map(float, re.search(r"16 environments share the Model: (\d+) MB with one, (\d+) MB with all", said).groups())
        self.assertLess((every - one) / 16, 0.5 * one)  # each with a Model of its own: about as much as the first
        self.assertRegex(said, r"reset [\d.]+ ms, restore [\d.]+ ms of CPU time\n")

    def test_the_baseline_beats_chance(self):
        for task, columns, generations in (("reach", (0, 1, 2), 5), ("clip", (0, 1, 2, 7), 8 if not FULL else 20)):
            weights = cem.train(task, generations=generations, population=16, episodes=1, columns=columns, limit=1.2, seed=1)
            env = vest.make_vector(task, 8, limit=1.2)
            learnt = cem.returns(env, lambda seen: cem.act(weights, seen, columns), seed=1000)
            chance = cem.returns(env, cem.random_policy(), seed=1000)
            self.assertGreater(learnt[0].mean(), chance[0].mean() + 0.2, task)


if __name__ == "__main__":
    unittest.main()
