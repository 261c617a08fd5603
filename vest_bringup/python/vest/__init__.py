"""VEST from Python: the tissue alone, and the whole trainer as tasks for learning. No ROS master is needed.

    world = vest.World("scene.yaml"); world.step(100); world.positions("tube")
    env = vest.make("grasp_lift"); observation, info = env.reset(seed=1)

Units are SI and the frame is world where nothing else is said (docs/learning.md)."""
from ._core import World, __version__
from .environment import Box, Env, VectorEnv, exercises, make, make_vector, tasks

__all__ = ["Box", "Env", "VectorEnv", "World", "__version__", "exercises", "make", "make_vector", "tasks"]
