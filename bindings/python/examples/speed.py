"""Forward kinematics of 10⁶ poses against vectorised NumPy of the same formula, and a calibration of 40 samples.

    python bindings/python/examples/speed.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Callable

import numpy as np

import delta_cal as dc

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from formula import forward  # noqa: E402


def best(times: int, work: Callable[[], object]) -> float:
    """The shortest of some runs, s."""
    found = []
    for _ in range(times):
        begin = time.perf_counter()
        work()
        found.append(time.perf_counter() - begin)
    return min(found)


robot = dc.Robot.nominal(
    base_radius=194,
    platform_radius=30,
    upper_arm=260,
    forearm=480,
    limits=(-1.05, 1.57),
    tolerance=(0.5, 3.5e-3),
    noise=(0.02, 3.5e-5),
)
rng = np.random.default_rng(1)
q = rng.uniform(-0.9, 1.4, (10**6, 3))
parameters = robot.parameters
largest = np.nanmax(np.abs(robot.forward(q) - forward(parameters, q)))
own, numpy = best(5, lambda: robot.forward(q)), best(5, lambda: forward(parameters, q))
print(f"forward, 10⁶ poses: delta_cal {own:.3f} s, NumPy {numpy:.3f} s: {numpy / own:.1f} times as fast")
print(f"largest difference {largest:.1e} mm")

sigma = np.array([0.5, 0.5, 0.5, 3.5e-3, 3.5e-3, 0.5, 0.5, 0.5])
made = dc.Robot.from_parameters(parameters + sigma * rng.standard_normal((3, 8)), limits=robot.limits)
poses = rng.uniform(-0.7, 1.2, (40, 3))
seen = made.forward(poses) + 0.02 * rng.standard_normal(poses.shape)
print(f"calibrate, 40 samples: {1000 * best(5, lambda: dc.calibrate(robot, poses, seen)):.1f} ms")
