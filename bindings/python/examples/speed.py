"""Kinematics of 10⁶ poses beside the same formulas in NumPy by columns, and what limits them, processor time each; frames beside
arrays; and a calibration of 40 samples. On a busy machine the shortest of many runs is nearest to what an idle one does.

    python bindings/python/examples/speed.py [--write]     # writes the table into docs/python.md
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pandas as pd
import polars as pl
from numpy.typing import NDArray

import delta_cal as dc

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from formula import columns, derivatives, joints, positions  # noqa: E402


def best(times: int, work: Callable[[], object]) -> tuple[float, float]:
    """Wall clock and processor time of the shortest of some runs, s."""
    walls, processors = [], []
    for _ in range(times):
        begin, before = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - begin)
        processors.append(time.process_time() - before)
    return min(walls), min(processors)


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
table = {name: f"| `{name}`" for name in ("forward", "inverse", "jacobian")}
off = []
for number in (np.float64, np.float32):
    angles: NDArray[Any] = q.astype(number)
    of: NDArray[Any] = parameters.astype(number)
    x: NDArray[Any] = robot.forward(angles)
    by_columns, places = columns(angles), columns(x)
    calls: dict[str, tuple[Callable[[Any], NDArray[Any]], NDArray[Any], Callable[[], object]]] = {
        "forward": (robot.forward, angles, lambda: positions(of, by_columns)),
        "inverse": (robot.inverse, x, lambda: joints(of, places)),
        "jacobian": (robot.jacobian, angles, lambda: derivatives(of, by_columns)),
    }
    for name, (call, rows, formula) in calls.items():
        found, expected = call(rows), np.moveaxis(np.array(formula()), -1, 0)
        expected = np.swapaxes(expected, -1, -2) if name == "jacobian" else expected
        own, numpy = best(20, lambda: call(rows))[1], best(5, formula)[1]
        # Rows that the processor's cache holds, less what a call costs; and what the input takes to be read and the result
        # to be written.
        few, none = (best(20, lambda: [call(rows[:count]) for _ in range(100)])[1] for count in (1984, 0))
        arithmetic = (few - none) / 100 * len(rows) / 1984
        memory = best(20, lambda: (rows.sum(), np.full_like(found, 1.0)))[1]
        table[name] += "".join(f" | {1e3 * one:.{int(one < 0.01)}f}" for one in (own, numpy, arithmetic, memory))
        off.append(f"{name} {number.__name__} {np.nanmax(np.abs(found - expected)):.0e}")
head = "| |" + "".join(f" {number} | NumPy | arithmetic | memory |" for number in ("float64", "float32")) + "\n|" + 9 * " --- |"
page_table = "\n".join([head, *(f"{row} |" for row in table.values())])
print(page_table)
print("largest difference:", ", ".join(off))
jacobian = best(3, lambda: robot.parameter_jacobian(q))
print(f"parameter Jacobian, 10⁶ poses: {jacobian[0]:.2f} s ({jacobian[1]:.2f} s of processors)")

names = ["q1_rad", "q2_rad", "q3_rad", "x_mm", "y_mm", "z_mm"]
many = pd.DataFrame(np.hstack([q, robot.forward(q)])[: 10**5], columns=names)
given: dict[str, Any] = {"arrays": {"q": q[: 10**5], "x": many[names[3:]]}, "pandas": many, "polars": pl.from_pandas(many)}
# Rows without noise.
warnings.simplefilter("ignore", dc.CalibrationWarning)
spent = {name: best(3, lambda: dc.calibrate(robot, own))[1] for name, own in given.items()}
calibrated = "Calibrating 10⁵ rows: " + ", ".join(f"{name} {own:.1f} s" for name, own in spent.items()) + "."
print(calibrated)
assert max(spent.values()) < 3 * spent["arrays"]
if "--write" in sys.argv:
    page = Path(__file__).parents[3] / "docs" / "python.md"
    before, old = page.read_text().split("<!-- speed.py -->")
    after = old.split("<!-- end -->")[1]
    page.write_text(f"{before}<!-- speed.py -->\n{time.strftime('%-d %B %Y')}:\n\n{page_table}\n\n{calibrated}\n<!-- end -->{after}")

sigma = np.array([0.5, 0.5, 0.5, 3.5e-3, 3.5e-3, 0.5, 0.5, 0.5])
made = dc.Robot.from_parameters(parameters + sigma * rng.standard_normal((3, 8)), limits=robot.limits)
poses = rng.uniform(-0.7, 1.2, (40, 3))
seen = made.forward(poses) + 0.02 * rng.standard_normal(poses.shape)
print(f"calibrate, 40 samples: {1000 * best(20, lambda: dc.calibrate(robot, poses, seen))[0]:.1f} ms")
