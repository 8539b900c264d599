"""Calibrations: the bits of the command, the optimum of SciPy, refusals, faults, threads."""

from __future__ import annotations

import copy
import gc
import os
import pickle
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import EXAMPLES
from formula import forward
from scipy.optimize import least_squares

import delta_cal as dc

@pytest.mark.parametrize(
    ("folder", "table", "options"),
    [
        ("paper-robot", "samples.csv", {}),
        ("paper-robot", "samples.csv", {"method": "ikm"}),
        ("paper-robot", "samples.csv", {"frame": "sensor"}),
        ("circle-sheet", "samples.csv", {"frame": "sensor"}),
        ("plate", "touches.csv", {}),
        ("printer", "samples.csv", {}),
    ],
)
def test_the_bits_are_those_of_the_command(folder, table, options, command, monkeypatch, tmp_path):
    monkeypatch.chdir(EXAMPLES)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    text = (EXAMPLES / folder / "robot.toml").read_text()
    robot, samples = str(tmp_path / "robot.toml"), f"{folder}/{table}"
    # The zeros of the real robot are off by degrees.
    Path(robot).write_text(text.replace("angle_deg = 0.2\n", "angle_deg = 0.2\nzero_deg = 6\n") if folder == "circle-sheet" else text)
    report, calibrated = command("calibrate", robot, samples, *(f"--{name}={own}" for name, own in options.items()))
    result = dc.calibrate(dc.Robot.read(robot), dc.read_samples(samples), **options)
    assert result.robot.to_toml() == calibrated.read_text()
    assert report["document"].pop("command").startswith("delta-cal calibrate")
    assert result.to_dict() == report


def test_arrays_have_the_bits_of_a_file(tmp_path, measured, robot):
    _, q, x = measured
    path = tmp_path / "samples.csv"
    rows = [",".join(map(repr, row)) for row in np.hstack([q, x]).tolist()]
    path.write_text("\n".join(["q1_rad,q2_rad,q3_rad,x_mm,y_mm,z_mm", *rows]) + "\n")
    table = pd.DataFrame(np.hstack([q, x]), columns=path.read_text().split("\n")[0].split(","))
    of_file = dc.calibrate(robot, dc.read_samples(path))
    joints, positions = table.iloc[:, :3], table.iloc[:, 3:]
    for result in (
        dc.calibrate(robot, q, x),
        dc.calibrate(robot, table),
        dc.calibrate(robot, pl.from_pandas(table)),
        dc.calibrate(robot, joints, positions),
        dc.calibrate(robot, q.tolist(), positions),
    ):
        np.testing.assert_array_equal(result.parameters, of_file.parameters)
        np.testing.assert_array_equal(result.covariance, of_file.covariance)


def test_the_optimum_is_that_of_scipy(robot, measured):
    _, q, x = measured
    # A joint's zero is known as well as an angle, La_y by that and the upper arm.
    sigma = np.tile([0.5, 0.5, 0.5, 3.5e-3, 3.5e-3, 0.5, 260 * 3.5e-3, 0.5], (3, 1))
    nominal = robot.parameters
    result = dc.calibrate(robot, q, x, method="fkm")
    # Noise of the joints moves the platform: J at the robot's parameters.
    by_joints = robot.jacobian(q)
    noise = 0.02**2 * np.eye(3) + 3.5e-5**2 * by_joints @ by_joints.transpose(0, 2, 1)
    whiten = np.linalg.inv(np.linalg.cholesky(noise))

    # The last unknown is the scale of the instrument: 1e-5 where the robot file states none.
    def residual(unknown):
        parameters = nominal + sigma * unknown[:24].reshape(3, 8)
        off = np.einsum("nij,nj->ni", whiten, (1 + 1e-5 * unknown[24]) * forward(parameters, q) - x)
        return np.concatenate([off.ravel(), unknown])

    found = least_squares(residual, np.zeros(25), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    parameters = nominal + sigma * found.x[:24].reshape(3, 8)
    covariance = np.linalg.inv(found.jac.T @ found.jac)[:24, :24]
    expected = sigma * np.sqrt(np.diag(covariance)).reshape(3, 8)
    np.testing.assert_array_less(np.abs(result.parameters - parameters), 0.02 * result.sigma)
    np.testing.assert_allclose(result.sigma / expected, result.to_dict()["sigma_widened_by"], rtol=0.02)


def test_a_result_holds_what_it_says(robot, measured):
    made, q, x = measured
    result = dc.calibrate(robot, q, x)
    np.testing.assert_array_equal(result.parameters, result.robot.parameters)
    np.testing.assert_allclose(result.sigma.ravel(), np.sqrt(np.diag(result.covariance)))
    np.testing.assert_array_equal(result.covariance, result.covariance.T)
    np.testing.assert_allclose(result.residuals, x - result.robot.forward(q), atol=1e-9)
    error = np.linalg.norm(result.robot.forward(q) - made.forward(q), axis=1)
    assert np.sqrt(np.mean(error**2)) < 3 * result.expected_error["absolute_rms_mm"]
    assert result.frame is None and result.method == "joint" and result.before == robot
    assert all(finding["level"] in ("warning", "note") and finding["text"] for finding in result.findings)
    assert result.lines.tolist() == list(range(2, 42))
    assert "Dx" in repr(result) and "\x1b" not in repr(result)
    assert "<iframe" in result._repr_html_() and "<html" not in result._repr_html_()


def test_a_sensor_that_stands_anywhere(robot, measured):
    _, q, x = measured
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    seen = x @ turn.T + [100, 200, 300]
    result = dc.calibrate(robot, q, seen, frame="sensor")
    assert result.method == "fkm"
    np.testing.assert_allclose(result.frame[:3, :3], turn, atol=5e-3)
    at = np.c_[result.robot.forward(q), np.ones(len(q))] @ result.frame.T
    np.testing.assert_allclose(result.residuals, seen - at[:, :3], atol=1e-9)
    assert np.sqrt(np.mean(result.residuals**2)) < 0.03


def test_other_readings_than_positions():
    robot = dc.Robot.read(EXAMPLES / "plate" / "robot.toml")
    samples = dc.read_samples(EXAMPLES / "plate" / "touches.csv")
    result = dc.calibrate(robot, samples)
    arrays = samples.arrays(robot)
    assert result.residuals.shape == (len(arrays["q"]), 5)
    assert (np.isfinite(result.residuals) == np.c_[
        np.isfinite(arrays["x"]), np.isfinite(arrays["height"]), np.isfinite(arrays["distance"])
    ]).all()


def test_what_is_stated_takes_the_place_of_the_robot_s(robot, measured):
    _, q, x = measured
    stated = dc.calibrate(robot.replace(tolerance=(5.0, 0.05)), q, x, tolerance=(0.5, 3.5e-3), noise=(0.02, 3.5e-5))
    np.testing.assert_array_equal(stated.parameters, dc.calibrate(robot, q, x).parameters)
    assert dc.calibrate(robot, q, x, zero=0.1).before.zero == pytest.approx(0.1)
    assert dc.calibrate(robot, q, x, limit=0.1).to_dict()["acceptance"]["passed"]


def test_a_robust_fit_leaves_a_wrong_row_out(robot, measured):
    _, q, x = measured
    wrong = x.copy()
    wrong[7, 0] += 3
    result = dc.calibrate(robot, q, wrong, robust=True)
    assert result.to_dict()["suspected_samples"] == [9]


def test_a_refusal_has_findings(robot, measured):
    _, q, x = measured
    with pytest.raises(dc.Refused) as refused:
        dc.calibrate(robot, q[:, [1, 0, 2]], x)
    findings = refused.value.findings
    assert findings[0]["kind"] == "refused" and findings[0]["remedy"]
    assert any("exchanged" in finding["text"] for finding in findings)
    again = pickle.loads(pickle.dumps(refused.value))
    assert again.findings == findings and str(again) == str(refused.value)


FAULTS = [
    (lambda q, x: (q, x[:-1]), {}, "x: 39 rows, and q has 40"),
    (lambda q, x: (q[:, :2], x), {}, "q: shape"),
    (lambda q, x: (q, np.where(np.arange(120).reshape(40, 3) == 10, np.nan, x)), {}, "x: row 3 holds NaN"),
    (lambda q, x: (np.where(q > 1, np.inf, q), x), {}, "q: .* rows hold NaN or infinity"),
    (lambda q, x: (np.rad2deg(q), x), {}, "q: row 0 holds .*radians"),
    (lambda q, x: (q + [0, 0, 1], x), {}, "q, x: row .*outside the joint limits"),
    (lambda q, x: (q,), {}, "x: positions are needed"),
    (lambda q, x: (q[:0], x[:0]), {}, "q: no rows"),
    (lambda q, x: (q, x), {"frame": "world"}, "frame: "),
    (lambda q, x: (q, x), {"method": "newton"}, "method: "),
    (lambda q, x: (q, x), {"noise": 0.02}, "noise: "),
    (lambda q, x: (q, x), {"tolerance": (0, 1)}, "tolerance: "),
    (lambda q, x: (q, x), {"limit": -1}, "limit: "),
    (lambda q, x: (q, x), {"method": "joint", "frame": "sensor"}, '(?s)method="joint".*method="fkm"'),
    (lambda q, x: (pd.DataFrame({"q1_deg": [1.0]}),), {}, "samples.*q2_deg"),
]


@pytest.mark.parametrize(("arguments", "options", "message"), FAULTS)
def test_an_argument_that_cannot_be_used(arguments, options, message, robot, measured):
    _, q, x = measured
    with pytest.raises(ValueError, match=message):
        dc.calibrate(robot, *arguments(q, x), **options)


def test_files_that_cannot_be_used(tmp_path, robot):
    with pytest.raises(FileNotFoundError):
        dc.read_samples(tmp_path / "none.csv")
    (tmp_path / "samples.csv").write_text("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n1,2,3,4,5,six\n")
    with pytest.raises(ValueError, match="samples.csv:2: column z_mm"):
        dc.calibrate(robot, dc.read_samples(tmp_path / "samples.csv"))
    with pytest.raises(ValueError, match="columns: "):
        dc.read_samples(tmp_path / "samples.csv", columns="A1")


def test_copies_and_pickles_are_equal(robot, measured):
    _, q, x = measured
    result = dc.calibrate(robot, q, x, frame="sensor", limit=0.2)
    again = pickle.loads(pickle.dumps(result))
    for other in (again, copy.copy(result), copy.deepcopy(result)):
        assert other == result and hash(other) == hash(result) and other.fingerprint == result.fingerprint
    np.testing.assert_array_equal(again.covariance, result.covariance)
    assert again.to_dict() == result.to_dict()
    assert dc.calibrate(robot, q, x) != result
    samples = dc.read_samples(EXAMPLES / "paper-robot" / "samples.csv")
    assert pickle.loads(pickle.dumps(samples)) == samples != dc.read_samples(EXAMPLES / "plate" / "touches.csv")


@pytest.mark.parametrize("ending", ["html", "json", "txt", "toml"])
def test_reports_are_written(ending, tmp_path, robot, measured):
    _, q, x = measured
    result = dc.calibrate(robot, q, x)
    path = tmp_path / f"report.{ending}"
    result.write(path)
    assert len(path.read_text(encoding="utf-8")) > 1000
    if ending == "toml":
        assert dc.Robot.read(path) == result.robot
    with pytest.raises(ValueError, match="path: "):
        result.write(tmp_path / "report.pdf")


def test_plots_are_drawn(tmp_path, robot, measured):
    _, q, x = measured
    figure = dc.calibrate(robot, q, x).plot()
    figure.savefig(tmp_path / "figure.png")
    # Parameters, residuals, bed and its scale.
    assert len(figure.axes) == 4


def test_threads_get_the_bits_of_one(robot, measured):
    _, q, x = measured
    one = dc.calibrate(robot, q, x).covariance
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(lambda _: dc.calibrate(robot, q, x).covariance, range(16)))
    assert all((own == one).all() for own in found)


def test_python_runs_while_arrays_are_computed(robot):
    q = np.random.default_rng(1).uniform(-0.9, 1.4, (400_000, 3))
    worker = threading.Thread(target=lambda: [robot.parameter_jacobian(q[:100_000]) for _ in range(4)])
    worker.start()
    turns = 0
    while worker.is_alive():
        turns += 1
        time.sleep(0.001)
    worker.join()
    assert turns > 20


def test_a_child_that_was_forked_has_cores_as_well():
    code = """
import os, numpy as np, delta_cal as dc
robot = dc.Robot.nominal(base_radius=194, platform_radius=30, upper_arm=260, forearm=480, limits=(-1.05, 1.57))
q = np.zeros((10000, 3))
robot.forward(q)
child = os.fork()
if child == 0:
    robot.forward(q)
    os._exit(0)
raise SystemExit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    if hasattr(os, "fork"):
        subprocess.run([sys.executable, "-W", "ignore", "-c", code], check=True, timeout=60)


def test_memory_does_not_grow(robot, measured):
    resource = pytest.importorskip("resource")
    _, q, x = measured
    many = np.tile(q, (500, 1))

    def work(times):
        for _ in range(times):
            robot.parameter_jacobian(many)
            dc.calibrate(robot, q, x).to_dict()
        gc.collect()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = work(5)
    # Twenty times the array of one call are 230 MB.
    assert work(20) - before < 40_000
