"""Tasks with Gymnasium's signatures. Where gymnasium is installed its classes are used, and the tasks are registered there."""
import functools
import json
import os
import weakref

import numpy as np

from . import _core

try:
    import gymnasium
except ImportError:
    gymnasium = None


class _OwnBox:
    """A box of numbers: what is used of gymnasium.spaces.Box."""

    def __init__(self, low, high, shape, dtype=np.float32, seed=None):
        self.shape, self.dtype = tuple(shape), np.dtype(dtype)
        self.low, self.high = np.full(shape, low, dtype), np.full(shape, high, dtype)
        self.seed(seed)

    def seed(self, seed=None):
        self._random = np.random.default_rng(seed)

    def sample(self):
        """Uniform where it is bounded, normal elsewhere."""
        bounded = np.isfinite(self.low) & np.isfinite(self.high)
        low, high = np.where(bounded, self.low, 0), np.where(bounded, self.high, 1)
        return np.where(bounded, self._random.uniform(low, high), self._random.normal(size=self.shape)).astype(self.dtype)

    def contains(self, x):
        x = np.asarray(x)
        return x.shape == self.shape and np.can_cast(x.dtype, self.dtype) and bool(np.all(x >= self.low) and np.all(x <= self.high))

    __contains__ = contains

    def __eq__(self, other):
        return (isinstance(other, _OwnBox) and self.dtype == other.dtype and self.shape == other.shape
                and np.array_equal(self.low, other.low) and np.array_equal(self.high, other.high))

    def __repr__(self):
        return f"Box({self.low.min()}, {self.high.max()}, {self.shape}, {self.dtype})"


class _OwnDict:
    """Named spaces: what is used of gymnasium.spaces.Dict."""

    def __init__(self, spaces):
        self.spaces = dict(spaces)

    def __getitem__(self, name):
        return self.spaces[name]

    def seed(self, seed=None):
        for k, space in enumerate(self.spaces.values()):
            space.seed(None if seed is None else seed + k)

    def sample(self):
        return {name: space.sample() for name, space in self.spaces.items()}

    def contains(self, x):
        return isinstance(x, dict) and x.keys() == self.spaces.keys() and all(x[n] in s for n, s in self.spaces.items())

    __contains__ = contains

    def __eq__(self, other):
        return isinstance(other, _OwnDict) and self.spaces == other.spaces

    def __repr__(self):
        return f"Dict({self.spaces})"


Box = gymnasium.spaces.Box if gymnasium else _OwnBox
Dict = gymnasium.spaces.Dict if gymnasium else _OwnDict
_EnvBase = gymnasium.Env if gymnasium else object
_VectorBase = gymnasium.vector.VectorEnv if gymnasium else object


def tasks():
    """Names of the tasks."""
    return _core.task_names()


@functools.lru_cache(None)
def _package(name):
    import rospkg  # here: World needs no packages
    return rospkg.RosPack().get_path(name)


_models = weakref.WeakValueDictionary()


def exercises():
    """Names of the exercises that VEST brings, which are environments, too."""
    folder = f"{_package('vest_bringup')}/exercises"
    return sorted(name for name in os.listdir(folder) if os.path.exists(f"{folder}/{name}/exercise.yaml"))


def _model(task, scene=None, effects=False, skip=20, limit=0.0, **unknown):
    """Loads a task once: environments of the same task and options share its Model while one of them lives."""
    if unknown:
        raise ValueError(f"option: '{next(iter(unknown))}' is unknown (allowed: scene, effects, skip, limit, threads, pictures; "
                         "of a single environment render_mode, too)")
    try:
        if isinstance(skip, bool) or int(skip) != skip:
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"skip: {skip!r} (allowed: 1 to 1000)") from None
    try:
        limit = float(limit)
    except (TypeError, ValueError):
        raise ValueError(f"limit: {limit!r} (allowed: seconds, 0 for the task's own)") from None
    task = os.fspath(task)
    if task not in tasks():
        if "/" not in task and not task.endswith(".yaml"):
            if task not in exercises():
                raise ValueError(f"task: '{task}' is unknown (allowed: {', '.join(tasks() + exercises())}, or the path of an exercise file)")
            task = f"{_package('vest_bringup')}/exercises/{task}/exercise.yaml"
        effects = True  # scores ask for blood, smoke and the lens
    name = _core.task_scene(task)
    if not name and not scene:
        raise ValueError(f"task: '{task}' cannot be read as an exercise file (rosrun vest_bringup vest_exercise show says why)")
    scene = os.fspath(scene) if scene else f"{_package('vest_tissue')}/scenes/{name}/{name}.yaml"
    key = (task, scene, bool(effects), int(skip), limit)
    model = _models.get(key)
    if model is None:
        vessels = f"{_package('vest_effects')}/data/vessels/pelvis" if effects else ""
        model = _core.Model(task, scene, f"{_package('vest_instruments')}/config/trainer_box.yaml", vessels, key[3], key[4])
        _models[key] = model
    return model


def _seed(seed):
    """A seed as a number, checked."""
    if isinstance(seed, (bool, np.bool_)) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**64:
        raise ValueError(f"seed: {seed!r} (allowed: 0 to 2^64 - 1)")
    return int(seed)


def _size(pictures):
    """Width and height, checked."""
    if pictures is None:
        return None
    try:
        width, height = (int(side) for side in pictures)
    except (TypeError, ValueError):
        raise ValueError(f"pictures: {pictures!r} (allowed: None, or width and height, 8 to 1024 pixels each)") from None
    if not (8 <= width <= 1024 and 8 <= height <= 1024):
        raise ValueError(f"pictures: {width} x {height} (allowed: 8 to 1024 pixels)")
    return width, height


def _space(numbers, size, before=()):
    """Of an observation: the numbers, or a dictionary with the pictures. @param before sizes of leading axes"""
    state = Box(-np.inf, np.inf, (*before, numbers), np.float32)
    if size is None:
        return state
    shape = (*before, size[1], size[0])
    return Dict({"state": state, "rgb": Box(0, 255, (*shape, 3), np.uint8), "depth": Box(0, np.inf, shape, np.float32)})


def _observation(state, size, draw):
    if size is None:
        return state
    rgb, depth = draw(*size)
    return {"state": state, "rgb": rgb, "depth": depth}


class Env(_EnvBase):
    """One task. See make()."""
    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(self, task, *, threads=1, render_mode=None, pictures=None, **options):
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: {render_mode!r} (allowed: None, 'rgb_array')")
        self._pictures = _size(pictures)
        self._model = _model(task, **options)
        self._env = _core.Environment(self._model, threads)
        self.task, self.render_mode, self.spec = task, render_mode, None
        self.action_space = Box(-1.0, 1.0, (self._model.action_size,), np.float32)
        self.observation_space = _space(self._model.observation_size, self._pictures)
        self._random = np.random.default_rng()
        self._seed = 0

    def _info(self, score, passed):
        return {"score": score, "passed": passed, "seed": self._seed}

    def reset(self, *, seed=None, options=None):
        """Begins an episode: its start and goal follow from the seed. options={"state": bytes of save()} continues there.
        Without a seed: the next one of the sequence that the last seed began."""
        options = dict(options or {})
        state = options.pop("state", None)
        if options:
            raise ValueError(f"options: {', '.join(options)} (allowed: state)")
        if seed is not None:
            seed = _seed(seed)
            self._random = np.random.default_rng(seed)
            if gymnasium:
                self._np_random = self._random
        self._seed = seed if seed is not None else int(self._random.integers(2**63))
        if state is not None:
            self._env.restore(state)
            observation = self._env.observe()
        else:
            observation = self._env.reset(self._seed)
        return self._seen(observation), self._info(float(observation[-2]), False)

    def step(self, action):
        """observation, reward, terminated, truncated, info: one action over `skip` simulated milliseconds.
        Numbers beyond -1 and 1 count as these, NaN and infinite ones as 0."""
        observation, reward, terminated, truncated, score, passed = self._env.step(np.asarray(action, np.float32))
        return self._seen(observation), reward, terminated, truncated, self._info(score, passed)

    def _seen(self, state):
        return _observation(state, self._pictures, self._env.picture)

    def expert(self):
        """The action of a script that sees the scene."""
        return self._env.expert()

    def render(self):
        """What the endoscope sees now, uint8 height x width x 3: plain shaded surfaces."""
        return self._env.picture(480, 360)[0]

    def result(self):
        """An exercise's result as it stands: items with values, points and marks, what failed, the total. ValueError: a task has none."""
        return json.loads(self._env.result())

    @property
    def observation_names(self):
        """What the numbers of an observation are, with their units."""
        return self._model.observation_names

    def close(self):
        self._env.close()

    @property
    def objects(self):
        return self._env.objects

    def positions(self, object):  # noqa: A002, as World's
        """Knots of an object, m, world."""
        return self._env.positions(object)

    def hash(self):
        """XXH64 of the tissue's State, as sessions record it."""
        return self._env.hash()

    def save(self):
        """Everything that evolves, commands and counters included, as bytes."""
        return self._env.save()

    def restore(self, state):
        """Takes what save() gave, exactly."""
        self._env.restore(state)


class VectorEnv(_VectorBase):
    """n environments on threads. See make_vector()."""

    def __init__(self, task, n, *, threads=None, pictures=None, **options):
        if not isinstance(n, (int, np.integer)) or not 1 <= n <= 4096:
            raise ValueError(f"environments: {n!r} (allowed: 1 to 4096)")
        self._pictures = _size(pictures)
        self._model = _model(task, **options)
        self._envs = _core.Environments(self._model, n, threads or min(n, os.cpu_count() or 1, 64))
        self.task, self.num_envs = task, n
        self.metadata = {"render_modes": []}
        if gymnasium:
            self.metadata["autoreset_mode"] = gymnasium.vector.AutoresetMode.NEXT_STEP
        self.single_action_space = Box(-1.0, 1.0, (self._model.action_size,), np.float32)
        self.single_observation_space = _space(self._model.observation_size, self._pictures)
        self.action_space = Box(-1.0, 1.0, (n, self._model.action_size), np.float32)
        self.observation_space = _space(self._model.observation_size, self._pictures, (n,))
        self._random = np.random.default_rng()

    def reset(self, *, seed=None, options=None):
        """@param seed a number (then seed, seed + 1, …), one number for each, or None"""
        if options:
            raise ValueError(f"options: {', '.join(options)} (allowed: none)")
        if seed is None:
            seed = int(self._random.integers(2**62))
        seeds = [_seed(one) for one in seed] if np.ndim(seed) else [(_seed(seed) + k) % 2**64 for k in range(self.num_envs)]
        observations = self._envs.reset(np.array(seeds, np.uint64))
        info = {"score": observations[:, -2].astype(float), "passed": np.zeros(self.num_envs, bool)}
        return _observation(observations, self._pictures, self._envs.pictures), info

    def step(self, actions):
        """Arrays. What is over begins anew with the next step, which has reward 0 then (Gymnasium's next-step mode)."""
        observations, reward, terminated, truncated, score, passed = self._envs.step(np.asarray(actions, np.float32))
        observations = _observation(observations, self._pictures, self._envs.pictures)
        return observations, reward, terminated, truncated, {"score": score, "passed": passed}

    def expert(self):
        """Actions of a script that sees the scenes."""
        return self._envs.expert()

    def close(self, **_):
        self._envs.close()


def make(task, **options):
    """A task as an environment.
    @param task one of tasks(), one of exercises(), or the path of an exercise file
    @param options effects=False (True: blood, fluid, smoke and lens too; exercises always have them), skip=20 (simulated steps of 1 ms for an action),
    limit=0 (s until an episode is truncated; 0: the task's), threads=1, scene=None (another scene file), render_mode=None,
    pictures=None (width, height: observations are dictionaries of state, rgb and depth then)
    @raises ValueError naming what is wrong"""
    return Env(task, **options)


def make_vector(task, n, **options):
    """n environments of a task, stepped together; they share one Model. @param options as of make; threads: as many as there
    are processors"""
    return VectorEnv(task, n, **options)


def _registered():
    """Exercises are registered where their package is found."""
    try:
        return tasks() + exercises()
    except (ImportError, LookupError, OSError):
        return tasks()


if gymnasium:
    for _name in _registered():
        gymnasium.register(f"vest/{_name}-v0", entry_point="vest:Env", kwargs={"task": _name})
