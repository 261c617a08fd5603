"""What a task costs on this machine: python3 -m vest.measure [TASK] [--environments N] [--effects]"""
import argparse
import resource
import time

import numpy as np

from .environment import make, make_vector, tasks


def _resident():
    """MB of memory that this process has now."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def _each(call, count):
    """ms of CPU time for a call."""
    begin = time.process_time()
    for k in range(count):
        call(k)
    return (time.process_time() - begin) / count * 1e3


def main():
    parser = argparse.ArgumentParser(prog="python3 -m vest.measure", description=__doc__)
    parser.add_argument("task", nargs="?", default="grasp_lift", choices=tasks())
    parser.add_argument("--environments", type=int, default=16)
    parser.add_argument("--effects", action="store_true")
    parser.add_argument("--steps", type=int, default=200, help="of each environment")
    words = parser.parse_args()
    one = make(words.task, effects=words.effects)  # the Model, and one State
    one.reset(seed=1)
    for _ in range(5):
        one.step(one.expert())
    state, begin = one.save(), _resident()
    print(f"reset {_each(lambda k: one.reset(seed=k), 50):.2f} ms, restore {_each(lambda k: one.restore(state), 50):.2f} ms of CPU time")
    many = make_vector(words.task, words.environments, effects=words.effects)
    many.reset(seed=1)
    print(f"{words.environments} environments share the Model: {begin:.0f} MB with one, {_resident():.0f} MB with all, "
          f"{(_resident() - begin) / words.environments:.1f} MB each")
    cpu, wall, done = time.process_time(), time.monotonic(), 0
    for _ in range(words.steps):
        terminated, truncated = many.step(many.expert())[2:4]
        done += words.environments - int(np.sum(terminated | truncated))
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    print(f"{done / cpu:.0f} steps of 20 ms per CPU second ({done / cpu * 0.02:.0f} x real time a core), {done / wall:.0f} per second of this run")


if __name__ == "__main__":
    main()
