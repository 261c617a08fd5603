#!/usr/bin/env python3
"""An agent learns to reach a point beside a tube, then shows what it does: a return and a picture.

    source build/test/devel/setup.bash && python3 examples/reach.py [PICTURE.png]"""
import sys

import vest
from vest import cem, picture

COLUMNS = (0, 1, 2)  # of the observation: goal minus tip, cm
weights = cem.train("reach", generations=6, population=16, episodes=1, columns=COLUMNS, limit=1.2, seed=1,
                    tell=lambda generation, mean, best: print(f"generation {generation}: mean score {mean:.2f}, best {best:.2f}"))

env = vest.make("reach", render_mode="rgb_array")
observation, info = env.reset(seed=2026)
total, over = 0.0, False
while not over:
    observation, reward, terminated, truncated, info = env.step(cem.act(weights, observation, COLUMNS))
    total, over = total + reward, terminated or truncated
print(f"return {total:.3f}, passed: {info['passed']}")
name = sys.argv[1] if len(sys.argv) > 1 else "reach.png"
picture.write_png(name, env.render())
print(f"picture: {name}")
