"""What the tests share: the examples of the host, a robot of a data sheet, the command."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import delta_cal as dc

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "host" / "examples"


@pytest.fixture
def robot() -> dc.Robot:
    return dc.Robot.nominal(
        base_radius=194,
        platform_radius=30,
        upper_arm=260,
        forearm=480,
        limits=(-1.05, 1.57),
        tolerance=(0.5, 3.5e-3),
        noise=(0.02, 3.5e-5),
    )


@pytest.fixture
def measured(robot: dc.Robot) -> tuple[dc.Robot, np.ndarray, np.ndarray]:
    """A robot made within the tolerance, joint angles, and its noisy positions."""
    rng = np.random.default_rng(7)
    sigma = np.tile([0.5, 0.5, 0.5, 3.5e-3, 3.5e-3, 0.5, 0.5, 0.5], (3, 1))
    made = dc.Robot.from_parameters(robot.parameters + sigma * rng.standard_normal((3, 8)), limits=(-1.05, 1.57))
    q = rng.uniform(-0.7, 1.2, (40, 3))
    x = made.forward(q + 3.5e-5 * rng.standard_normal(q.shape)) + 0.02 * rng.standard_normal(q.shape)
    return made, q, x


@pytest.fixture(scope="session")
def command(tmp_path_factory: pytest.TempPathFactory):
    """Runs `delta-cal`; DELTA_CAL names it, otherwise cargo builds it."""
    named = os.environ.get("DELTA_CAL")
    program = str(Path(named).resolve()) if named else shutil.which("delta-cal")
    if program is None:
        build = ["cargo", "build", "--quiet", "--profile", "test", "--package", "delta-cal-host", "--bin", "delta-cal"]
        subprocess.run(build, cwd=ROOT, check=True)
        program = str(ROOT / "target" / "debug" / "delta-cal")
    folder = tmp_path_factory.mktemp("command")

    def run(*arguments: str) -> tuple[dict, Path]:
        report = folder / "report.json"
        calibrated = folder / "calibrated.toml"
        calibrated.unlink(missing_ok=True)
        subprocess.run(
            [program, *arguments, "--json", report, "--output", calibrated],
            check=True,
            capture_output=True,
            cwd=EXAMPLES,
        )
        return json.loads(report.read_text()), calibrated

    return run
