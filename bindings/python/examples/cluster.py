"""Many robots on many processes or computers, with Dask.

    python bindings/python/examples/cluster.py 2000 2      # robots, workers

Each task simulates and calibrates a range of one campaign; a robot is the same in every range. With Ray, decorate `part`
with `@ray.remote` and collect `ray.get([part.remote(...) for ...])`.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from dask.distributed import Client

import delta_cal as dc

ROBOTS_A_TASK = 250


def part(robot: dc.Robot, first: int, n: int) -> dict[str, np.ndarray]:
    """Figures of the robots from `first` on: some bytes each, where reports would be kilobytes."""
    found = dc.simulate(robot, first=first, n=n, poses=20)
    return {name: found[name] for name in ("accepted", "error_before", "error_after", "error_stated")}


def main(robots: int, workers: int) -> None:
    robot = dc.Robot.nominal(
        base_radius=194,
        platform_radius=30,
        upper_arm=260,
        forearm=480,
        limits=(-1.05, 1.57),
        tolerance=(0.5, 3.5e-3),
        noise=(0.02, 3.5e-5),
    )
    begin = time.perf_counter()
    # Of a real cluster: Client("scheduler:8786").
    with Client(n_workers=workers, threads_per_worker=1, dashboard_address=None) as client:  # type: ignore[no-untyped-call]
        starts = range(0, robots, ROBOTS_A_TASK)
        tasks = [client.submit(part, robot, first, min(ROBOTS_A_TASK, robots - first)) for first in starts]
        parts = client.gather(tasks)
    found = {name: np.concatenate([own[name] for own in parts]) for name in parts[0]}
    seconds = time.perf_counter() - begin
    accepted = found["accepted"]
    print(f"{robots} robots on {workers} processes: {seconds:.1f} s, {1000 * seconds * workers / robots:.1f} ms a robot and core")
    print(f"calibrated: {accepted.sum()}")
    for name in ("error_before", "error_after", "error_stated"):
        print(f"{name}: {np.sqrt(np.mean(found[name][accepted] ** 2)):.4f} mm rms")


if __name__ == "__main__":
    robots, workers = (sys.argv[1:] or ["2000", "2"])[:2]
    main(int(robots), int(workers))
