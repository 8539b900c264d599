"""Calibrations: the bits of the command, the optimum of SciPy, refusals, faults, threads."""

from __future__ import annotations

import copy
import errno
import gc
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
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
    # A command can be copied from the text.
    assert str(result).count("delta-cal plan") == str(result).count("--samples")


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
        dc.calibrate(robot, pl.from_pandas(table).lazy()),
        dc.calibrate(robot, table.astype("Float64").assign(use=1.0)),
        dc.calibrate(robot, joints, positions),
        dc.calibrate(robot, q.tolist(), positions),
        dc.calibrate(robot, pa.Table.from_pandas(table)),
    ):
        np.testing.assert_array_equal(result.parameters, of_file.parameters)
        np.testing.assert_array_equal(result.covariance, of_file.covariance)


@pytest.mark.parametrize(
    ("rows", "single"),
    [(40, {}), (9, {}), (9, {"lb_mm": 1.2, "la_mm": 0.9, "dx_mm": 0.4, "dz_mm": 2.0, "theta_deg": 1.0, "alpha_deg": 0.1})],
)
def test_the_optimum_is_that_of_scipy(rows, single, robot, measured):
    _, q, x = (own[:rows] if isinstance(own, np.ndarray) else own for own in measured)
    # A joint's zero is known as well as an angle, La_y by that and the upper arm.
    of_kinds = {"dx_mm": 0.5, "dy_mm": 0.5, "dz_mm": 0.5, "theta_deg": np.rad2deg(3.5e-3), "alpha_deg": np.rad2deg(3.5e-3), "la_mm": 0.5}
    *own, theta, alpha, la, lb = {**of_kinds, "lb_mm": 0.5, **single}.values()
    sigma = np.tile([*own, *np.deg2rad([theta, alpha]), la, 260 * 3.5e-3, lb], (3, 1))
    nominal = robot.parameters
    robot = robot.replace(tolerance=single)
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


def test_a_covariance_of_each_row_counts_as_scipy_has_it(robot, measured):
    made, q, _ = measured
    # Mostly along the beam of an instrument that stands beside the robot, a third of the rows worse.
    beam = made.forward(q) - [2000, 500, 0]
    beam /= np.linalg.norm(beam, axis=1)[:, None]
    across, along = np.where(np.arange(40) % 3, 0.01, 0.05)[:, None, None], 0.1
    covariance = across**2 * (np.eye(3) - beam[:, :, None] * beam[:, None]) + along**2 * beam[:, :, None] * beam[:, None]
    factor = np.linalg.cholesky(covariance)
    x = made.forward(q) + np.einsum("nij,nj->ni", factor, np.random.default_rng(5).standard_normal(q.shape))
    robot = robot.replace(noise=(0.02, 0.0))
    result = dc.calibrate(robot, q, x, sigma=covariance)
    whiten, nominal = np.linalg.inv(factor), robot.parameters
    sigma = np.tile([0.5, 0.5, 0.5, 3.5e-3, 3.5e-3, 0.5, 260 * 3.5e-3, 0.5], (3, 1))

    def residual(unknown):
        off = (1 + 1e-5 * unknown[24]) * forward(nominal + sigma * unknown[:24].reshape(3, 8), q) - x
        return np.concatenate([np.einsum("nij,nj->ni", whiten, off).ravel(), unknown])

    found = least_squares(residual, np.zeros(25), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    expected = sigma * np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac))[:24]).reshape(3, 8)
    np.testing.assert_array_less(np.abs(result.parameters - nominal - sigma * found.x[:24].reshape(3, 8)), 0.02 * expected)
    np.testing.assert_allclose(result.sigma / expected, result.to_dict()["sigma_widened_by"], rtol=0.02)
    # In other axes the same, and three σ a row are a diagonal covariance.
    axes = np.array([1, -1, -1])
    other = dc.calibrate(robot.replace(convention={"z_axis": "down"}), q, x * axes, sigma=covariance * axes * axes[:, None])
    np.testing.assert_allclose(np.abs(other.parameters), np.abs(result.parameters), atol=1e-7)
    each = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    diagonal = each[:, :, None] * each[:, None] * np.eye(3)
    np.testing.assert_array_equal(dc.calibrate(robot, q, x, sigma=each).sigma, dc.calibrate(robot, q, x, sigma=diagonal).sigma)
    assert dc.calibrate(robot, q, x, sigma=each) != result


def test_a_result_holds_what_it_says(robot, measured):
    made, q, x = measured
    result = dc.calibrate(robot, q, x)
    np.testing.assert_array_equal(result.parameters, result.robot.parameters)
    np.testing.assert_array_equal(result.sigma.ravel(), np.sqrt(np.diag(result.covariance))[:24])
    np.testing.assert_array_equal(result.covariance, result.covariance.T)
    # The scale of the instrument is one of the unknowns.
    assert [own.name for own in result.unknowns[-2:]] == ["arm3.Lb", "scale"] and result.scale == result.unknowns[-1].value
    np.testing.assert_allclose(result.residuals, x - result.robot.forward(q), atol=1e-9)
    error = np.linalg.norm(result.robot.forward(q) - made.forward(q), axis=1)
    assert np.sqrt(np.mean(error**2)) < 3 * result.expected_error["absolute_rms_mm"]
    assert result.frame is None and result.method == "joint" and result.before == robot
    assert all(finding["level"] in ("warning", "note") and finding["text"] for finding in result.findings)
    assert result.lines.tolist() == list(range(40))
    assert "Dx" in str(result) and "\x1b" not in str(result) and len(repr(result)) < 200
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
    path = EXAMPLES / "plate" / "touches.csv"
    samples = dc.read_samples(path)
    result = dc.calibrate(robot, path)
    arrays = samples.arrays(robot)
    given = {"q": arrays["q"], "height": arrays["height"], "plane": "plane"}
    blocks = [{name: own[part] for name, own in given.items()} for part in (slice(0, 5), slice(5, None))]
    for other in (dc.calibrate(robot, **given), dc.calibrate(robot, blocks), dc.calibrate(robot, pl.read_csv(path, comment_prefix="#"))):
        np.testing.assert_allclose(other.parameters, result.parameters, rtol=1e-12)
    assert result.residuals.shape == (len(arrays["q"]), 5)
    assert (np.isfinite(result.residuals) == np.c_[
        np.isfinite(arrays["x"]), np.isfinite(arrays["height"]), np.isfinite(arrays["distance"])
    ]).all()


def test_rows_of_any_readings_together(robot, measured):
    made, q, x = measured
    robot = robot.replace(noise={"height_mm": 0.02, "distance_mm": 0.02})
    rng, from_q = np.random.default_rng(3), np.roll(q, 1, axis=0)
    seen = made.forward(q)
    noise = 0.02 * rng.standard_normal((3, len(q)))
    height, apart = seen[:, 2] + 500 + noise[0], np.linalg.norm(seen - made.forward(from_q), axis=1) + noise[1]
    ball = np.linalg.norm(seen - [0, 0, -700], axis=1) + noise[2]
    together = dc.calibrate(robot, [
        {"q": q, "x": x, "sigma": 0.02},
        {"q": q, "height": height, "plane": "table"},
        {"q": q, "distance": apart, "to": from_q},
        {"q": q, "distance": ball, "point": "socket"},
    ])
    values = {own.name: own.value for own in together.unknowns}
    sigma = dict(zip(values, np.sqrt(np.diag(together.covariance))))
    for name, true in {"plane.table.z": -500, "plane.table.slope_x": 0, "point.socket.x": 0, "point.socket.z": -700, "scale": 0}.items():
        assert abs(values[name] - true) < 4 * sigma[name]
    assert together.residuals.shape == (160, 5)
    assert np.isfinite(together.residuals).sum(axis=0).tolist() == [40, 40, 40, 40, 80]


def test_what_was_not_measured_is_left_out(robot, measured):
    _, q, x = measured
    masked = np.ma.masked_array(x.copy(), np.arange(120).reshape(40, 3) // 3 == 5)
    masked.data[5] += 50
    with_nan = np.where(masked.mask, np.nan, x)
    without = dc.calibrate(robot, np.delete(q, 5, axis=0), np.delete(x, 5, axis=0))
    frame = pd.DataFrame(np.hstack([q, with_nan]), columns=["q1_rad", "q2_rad", "q3_rad", "x_mm", "y_mm", "z_mm"])
    # As databases give it.
    of_objects = frame.astype(object).where(frame.notna(), None).assign(name=pd.date_range("2026-01-01", periods=40))
    alike = [dc.calibrate(robot, own) for own in (of_objects, frame)]
    alike += [dc.calibrate(robot, q, masked), dc.calibrate(robot, q, with_nan), dc.calibrate(robot, np.ma.masked_array(q, masked.mask), x)]
    for result in alike:
        np.testing.assert_array_equal(result.parameters, without.parameters)
        assert result.lines.tolist() == [row for row in range(40) if row != 5]
    # A plane or a point that holds for all rows, of which some have no such reading.
    some = np.where(np.arange(40) < 20, x[:, 2] + 800, np.nan)
    for own in ({"height": some, "plane": "table"}, {"distance": some, "point": "ball"}, {"distance": some, "to": np.roll(q, 1, axis=0)}):
        kind = next(iter(own))
        halves = [{"q": q[:20], "x": x[:20], **{name: part if isinstance(part, str) else part[:20] for name, part in own.items()}},
                  {"q": q[20:], "x": x[20:]}]
        found = [dc._samples.samples(robot, given).arrays(robot)[kind] for given in ({"q": q, "x": x, **own}, halves)]
        np.testing.assert_array_equal(*found)
    one = with_nan.copy()
    one[5, :2] = x[5, :2]
    assert np.isnan(dc.calibrate(robot, q, one).residuals[5]).tolist() == [False, False, True]
    # With σ of each coordinate, or a covariance, that is masked where nothing was read: σ of the others decides.
    of_one = np.ma.masked_array(x, np.isnan(one))
    sigma = np.ma.masked_array(np.full((40, 3), 0.02), of_one.mask)
    covariance = np.ma.masked_array(np.broadcast_to(4e-4 * np.eye(3), (40, 3, 3)), of_one.mask[:, :, None] | of_one.mask[:, None])
    alike = dc.calibrate(robot, q, of_one, sigma=np.full(40, 0.02))
    for given in (sigma, covariance):
        result = dc.calibrate(robot, q, of_one, sigma=given)
        np.testing.assert_allclose(result.parameters, alike.parameters, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(result.sigma, alike.sigma, rtol=1e-9)
    doubtful = sigma.copy()
    doubtful[5, 0] = 1e6
    without_it = np.where(np.arange(120).reshape(40, 3) == 15, np.nan, one)
    of_two = [dc.calibrate(robot, q, given, sigma=own) for given, own in ((of_one, doubtful), (without_it, sigma))]
    np.testing.assert_allclose(of_two[0].sigma, of_two[1].sigma, rtol=1e-6)


def spread(result, q, **options):
    covariance = result.position_covariance(q, **options)
    assert covariance.shape == (*q.shape[:-1], 3, 3)
    return np.sqrt(np.nanmean(np.trace(covariance, axis1=-2, axis2=-1)))


def test_unknowns_beside_the_24_parameters_count(robot, measured):
    made, q, x = measured
    numbers = 1e-3 * np.random.default_rng(5).standard_normal((3, 5))
    turned = made.replace(transmissions=numbers)
    q = np.random.default_rng(6).uniform(-0.9, 1.4, (200, 3))
    seen = turned.forward(q) + 0.02 * np.random.default_rng(7).standard_normal(q.shape)
    loose = robot.replace(tolerance={"transmission_deg": 0.1})
    result = dc.calibrate(loose, q, seen)
    assert len(result.unknowns) == len(result.covariance) == 40 and result.unknowns[24].name == "arm1.gain"
    sigma = np.sqrt(np.diag(result.covariance))
    np.testing.assert_array_less(np.abs(result.transmissions - numbers), 4 * sigma[24:39].reshape(3, 5))
    # What the report states over the workspace, by another way.
    everywhere = np.random.default_rng(8).uniform(-1.05, 1.57, (4000, 3))
    assert spread(result, everywhere) == pytest.approx(result.expected_error["absolute_rms_mm"], rel=0.1)
    again = dc.Robot.from_parameters(result.parameters, transmissions=result.transmissions, limits=robot.limits)
    np.testing.assert_allclose(again.forward(q), result.robot.forward(q), atol=1e-9)


def test_a_platform_that_tilts_is_found_and_counts(robot, measured):
    made, *_ = measured
    rods = {"spacing_mm": 60}
    made = made.replace(parallelogram=rods, platform={"radius_mm": 30}).to_toml()
    made = dc.Robot.from_toml(made.replace("[[arm]]", "[[arm]]\nrod_difference_mm = 0.2", 1))
    places = {"T1": [60.0, 0.0, 0.0], "T2": [-30.0, 52.0, 0.0], "T3": [-30.0, -52.0, -20.0]}
    stated = {name: dict(zip(("x_mm", "y_mm", "z_mm"), place), sigma_mm=0.01) for name, place in places.items()}
    robot = robot.replace(parallelogram=rods, targets=stated)
    q = np.random.default_rng(3).uniform(-0.2, 0.8, (30, 3))
    names = np.array(list(places))[np.arange(30) % 3]
    x = np.array([made.forward(q, target=places[name])[row] for row, name in enumerate(names)])
    x += 0.02 * np.random.default_rng(4).standard_normal(x.shape)
    np.testing.assert_allclose(made.forward(made.inverse(x[:3], target=places["T1"]), target=places["T1"]), x[:3], atol=1e-6)
    result = dc.calibrate(robot, q, x, target=names)
    off = result.robot.forward(q, target=places["T1"]) - made.forward(q, target=places["T1"])
    # 30 poses share some 20 errors of the parameters.
    assert 0.5 < np.sqrt(np.mean(np.sum(off**2, axis=-1))) / spread(result, q, target="T1") < 1.6
    assert result.unknowns[result._of("arm1.rod_difference")].value == pytest.approx(0.2, abs=0.19)
    with pytest.raises(ValueError, match="target: .*T1, T2"):
        robot.forward(q, target="T9")


def test_a_target_is_known_otherwise_than_the_platform_point(robot, measured):
    made, q, x = measured
    place = np.array([1.0, -2.0, -40.0])
    stated = robot.replace(target={"x_mm": 1.1, "y_mm": -2.1, "z_mm": -40, "sigma_mm": 0.3})
    result = dc.calibrate(stated, q, x + place)
    assert result.targets["target"] == pytest.approx(place, abs=1)
    assert spread(result, q, target="target") < 0.1 < spread(result, q)
    for none in (None, np.ma.masked, float("nan"), pd.NA):
        given = np.ma.masked_array(["T"] * 40, True) if none is np.ma.masked else [none] * 40
        np.testing.assert_array_equal(dc.calibrate(stated, q, x + place, target=given).parameters, result.parameters)
    with pytest.raises(ValueError, match="target: 'other' is none of"):
        result.position_covariance(q, target="other")
    both = {"z_mm": 0, "sigma_mm": 0.01}
    robot = robot.replace(targets={"left": {"x_mm": -30, "y_mm": 0, **both}, "right": {"x_mm": 30, "y_mm": 0, **both}})
    names = np.where(np.arange(40) % 2, "left", "right")
    beside = np.where(names[:, None] == "left", [-30, 0, 0], [30, 0, 0])
    found = dc.calibrate(robot, q, x + beside, target=names)
    assert found.targets["left"] == pytest.approx([-30, 0, 0], abs=0.05) and set(found.targets) == {"left", "right"}


@pytest.mark.parametrize(
    ("folder", "table", "options"),
    [("paper-robot", "samples.csv", {"frame": "sensor"}), ("plate", "touches.csv", {}), ("printer", "samples.csv", {})],
)
def test_every_unknown_has_a_name_and_a_unit(folder, table, options):
    robot = dc.Robot.read(EXAMPLES / folder / "robot.toml")
    result = dc.calibrate(robot, EXAMPLES / folder / table, **options)
    names = [own.name for own in result.unknowns]
    assert len(set(names)) >= len(names) - 2 and len(names) == len(result.covariance)
    assert {own.unit for own in result.unknowns} <= {"mm", "rad", ""}
    # With z downwards the same numbers, in the other axes.
    other = dc.calibrate(robot.replace(convention={"z_axis": "down"}), EXAMPLES / folder / table, **options) if folder == "plate" else result
    np.testing.assert_allclose(np.diag(other.covariance), np.diag(result.covariance), rtol=1e-3)


def test_what_is_stated_takes_the_place_of_the_robot_s(robot, measured):
    _, q, x = measured
    stated = dc.calibrate(robot.replace(tolerance=(5.0, 0.05)), q, x, tolerance=(0.5, 3.5e-3), noise=(0.02, 3.5e-5))
    np.testing.assert_array_equal(stated.parameters, dc.calibrate(robot, q, x).parameters)
    assert dc.calibrate(robot, q, x, zero=0.1).before.zero == pytest.approx(0.1)
    noise = dc.calibrate(robot, q, x, noise_height=0.03, noise_distance=0.04).before.to_dict()["noise"]
    assert (noise["height_mm"], noise["distance_mm"]) == (0.03, 0.04)
    assert dc.calibrate(robot, q, x, limit=0.1).to_dict()["acceptance"]["passed"]


def test_a_robust_fit_leaves_a_wrong_row_out(robot, measured):
    _, q, x = measured
    wrong = x.copy()
    wrong[7, 0] += 3
    result = dc.calibrate(robot, q, wrong, robust=True)
    assert result.to_dict()["suspected_samples"] == [7]
    assert any("Row 7" in finding["text"] or "row 7" in finding["text"] for finding in result.findings)
    assert "line 7" not in str(result).lower() and "in row" in str(result)


def test_a_refusal_has_findings(robot, measured):
    _, q, x = measured
    with pytest.raises(dc.Refused) as refused:
        dc.calibrate(robot, q[:, [1, 0, 2]], x)
    findings = refused.value.findings
    assert findings[0]["kind"] == "refused" and findings[0]["remedy"]
    with pytest.raises(dc.Refused, match="Convert the arrays") as metres:
        dc.calibrate(robot, q, x / 1000)
    assert "header" not in str(metres.value) and "file was" not in str(metres.value)
    assert any("exchanged" in finding["text"] for finding in findings) and refused.value.rows == []
    wrong = x.copy()
    wrong[[3, 9]] += 30
    with pytest.raises(dc.Refused, match="robust=True") as rows:
        dc.calibrate(robot, q, wrong)
    assert rows.value.rows == [3, 9]
    again = pickle.loads(pickle.dumps(refused.value))
    assert again.findings == findings and str(again) == str(refused.value)


FAULTS = [
    (lambda q, x: (q, x[:-1]), {}, "x: 39 rows, and q has 40"),
    (lambda q, x: (q[:, :2], x), {}, "q: shape"),
    (lambda q, x: (q, np.where(np.arange(120).reshape(40, 3) == 10, np.inf, x)), {}, "x: infinity in row 3"),
    (lambda q, x: (np.where(q > 1, -np.inf, q), x), {}, r"q: infinity in \d+ rows \("),
    (lambda q, x: (np.rad2deg(q), x), {}, "q: row 0 holds .*radians"),
    (lambda q, x: (q + [0, 0, 1], x), {}, "q, x: row .*outside the joint limits"),
    (lambda q, x: (q,), {}, "x: positions or other readings are needed"),
    (lambda q, x: (q[:0], x[:0]), {}, "q: no rows"),
    (lambda q, x: (q, x), {"frame": "world"}, "frame: "),
    (lambda q, x: (q, x), {"method": "newton"}, "method: "),
    (lambda q, x: (q, x), {"tolerance": (0, 0.1)}, "tolerance: "),
    (lambda q, x: (q, x), {"tolerance": (0.5, 0.2)}, "tolerance: .*radians"),
    (lambda q, x: (q, x), {"tolerance": (1e155, 0.1)}, "tolerance: .*forearm"),
    (lambda q, x: (q, x), {"tolerance": {"Lb": 0.02}}, "(?s)tolerance: unknown field `Lb`.*`lb_mm`"),
    (lambda q, x: (q, x), {"tolerance": {"lb_mm": 0.0}}, "tolerance: invalid value: 0, expected a number above 0"),
    (lambda q, x: (q, x), {"tolerance": {"theta_deg": -0.1}}, "tolerance: invalid value: -0.1"),
    (lambda q, x: (q, x), {"tolerance": {"la_mm": np.ma.masked}}, "tolerance: la_mm: nan; a finite number"),
    (lambda q, x: (q, x), {"zero": 6}, "zero: .*radians"),
    (lambda q, x: (q, x), {"target": "T"}, "^target: rows name the target T, which is not stated"),
    (lambda q, x: (pd.DataFrame(np.hstack([q, q]), columns=["q1_rad", "q2_rad", "q3_rad"] * 2),), {}, "q: column q1_rad: another"),
    (lambda q, x: (q, x), {"sigma": np.ma.masked_array(np.full((40, 3), 0.02), np.eye(40, 3))}, "sigma: row 0 is no σ"),
    (lambda q, x: (q, x), {"target": ["a"]}, "target: 1 rows, and q has 40"),
    (lambda q, x: (q,), {"height": 1.0, "plane": "a,b"}, "plane: row 0: a word"),
    (lambda q, x: (q,), {"height": [1.0]}, "height: 1 rows, and q has 40"),
    (lambda q, x: (q,), {"height": 1.0, "plane": {"a", "b"}}, "plane: set; a word"),
    (lambda q, x: (q, x), {"plane": "table"}, "plane: is given without height"),
    (lambda q, x: (q, x), {"point": "socket"}, "point: is given without distance"),
    (lambda q, x: (q,), {"distance": 400.0}, "distance: needs point or to"),
    (lambda q, x: (q, x), {"noise_plane": 1}, "noise_plane: is no argument"),
    (lambda q, x: (q, x), {"robust": "yes"}, "robust: str; a bool"),
    (lambda q, x: (q, x), {"limit": 10**400}, "limit: inf; a finite number"),
    (lambda q, x: (q, x), {"noise": {"height_mm": np.nan}}, "noise: height_mm: nan; a finite number"),
    (lambda q, x: (q, x), {"noise": {"joint": 1}}, "(?s)noise: unknown field `joint`.*joint = 1"),
    (lambda q, x: ([{"q": q, "x": x}, 3],), {}, "q: list; a file, a frame or a dict"),
    (lambda q, x: (pd.DataFrame(columns=["q1_deg"]),), {}, "q: no rows"),
    (lambda q, x: (q, x), {"progress": 3}, "progress: int"),
    (lambda q, x: (pd.DataFrame(np.hstack([q, x])),), {}, "samples"),
    (lambda q, x: ([{"q": q, "x": x[1:]}],), {}, "x: 39 rows, and q has 40"),
    (lambda q, x: (q, x), {"sigma": np.tile(np.ones((3, 3)), (40, 1, 1))}, "sigma: row 0 is no .* covariance"),
    (lambda q, x: (q, x), {"sigma": np.full((40, 3), -0.02)}, "sigma: row 0 is no σ above 0"),
    (lambda q, x: (q, x), {"sigma": np.arange(40)}, "sigma: row 0: 0.0; an uncertainty above 0"),
    (lambda q, x: (q, x), {"method": "joint", "frame": "sensor"}, '(?s)method="joint".*method="fkm"'),
    (lambda q, x: (pd.DataFrame({"q1_deg": [1.0]}),), {}, "samples.*q2_deg"),
    (lambda q, x: (pd.DataFrame({"q1_rad": pd.date_range("2026-01-01", periods=2), "q2_rad": 0.1, "q3_rad": 0.1, "z_mm": -400.0}),), {}, "samples: row 0: column q1_rad"),
    (lambda q, x: (q, pd.DataFrame(x, columns=["x_mm", "y_mm", "z_mm"]).astype(str)), {}, r"x: column x_mm: \[0\]: str"),
    (lambda q, x: (pd.DataFrame({"q1_rad": [np.inf]}),), {}, "q: column q1_rad: infinity in row 0"),
    (lambda q, x: (pd.DataFrame({"angle": [1.0]}),), {}, "(?s)samples: .*angle.*read_samples takes columns"),
]


@pytest.mark.parametrize(("arguments", "options", "message"), FAULTS)
def test_an_argument_that_cannot_be_used(arguments, options, message, robot, measured):
    _, q, x = measured
    with pytest.raises((ValueError, TypeError), match=message) as error:
        dc.calibrate(robot, *arguments(q, x), **options)
    # No option of the command.
    assert "--" not in str(error.value)


def test_a_fault_of_the_robot_has_no_row(robot, measured):
    _, q, x = measured
    with pytest.raises(ValueError, match=r"^robot: \[planes.table\]: no row"):
        dc.calibrate(robot.replace(planes={"table": {"z_mm": -500, "sigma_mm": 0.1}}), q, x)


def test_files_that_cannot_be_used(tmp_path, robot):
    with pytest.raises(FileNotFoundError) as missing:
        dc.read_samples(tmp_path / "none.csv")
    assert missing.value.errno == errno.ENOENT and missing.value.filename == str(tmp_path / "none.csv")
    (tmp_path / "samples.csv").write_text("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n1,2,3,4,5,six\n")
    with pytest.raises(ValueError, match="samples.csv:2: column z_mm"):
        dc.calibrate(robot, tmp_path / "samples.csv")
    with pytest.raises(ValueError, match="columns: "):
        dc.read_samples(tmp_path / "samples.csv", columns="A1")


def test_copies_and_pickles_are_equal_and_for_reading(robot, measured, monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    _, q, x = measured
    result, printer = dc.calibrate(robot, q, x, frame="sensor", limit=0.2), dc.calibrate("printer/printer.cfg")
    samples, imported = dc.read_samples("paper-robot/samples.csv"), dc.import_("printer/printer.cfg")
    space = dc.workspace(robot, tolerance=1, spacing=50)
    of_two = dc.compare(robot, result.robot)
    found = (robot, result, printer, samples, imported, space, of_two, dc.plan(robot, 8), dc.validate(robot, q, x, limit=1), dc.export(robot, "klipper"))
    for one in found:
        for again in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
            assert again == one and hash(again) == hash(one) and str(again) == str(one)
            for name, own in vars(one).items():
                if isinstance(own, np.ndarray):
                    np.testing.assert_array_equal(getattr(again, name), own)
                    assert not getattr(again, name).flags.writeable
    again = pickle.loads(pickle.dumps(result))
    assert again.to_dict() == result.to_dict() and again.to_html() == result.to_html()
    assert dc.calibrate(robot, q, x) != result and samples != dc.read_samples("plate/touches.csv")


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


def test_a_printer_is_calibrated_as_by_the_command(command, monkeypatch, tmp_path):
    monkeypatch.chdir(EXAMPLES)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    paste = tmp_path / "paste.cfg"
    report, calibrated = command("calibrate", "printer/printer.cfg", "--paste", str(paste))
    result = dc.calibrate("printer/printer.cfg")
    report["document"].pop("command")
    assert result.to_dict() == report
    assert result.robot.to_toml() == calibrated.read_text()
    assert result.printer["lines"] == paste.read_text() and result.printer["next"]
    result.write(tmp_path / "lines.cfg")
    assert (tmp_path / "lines.cfg").read_text() == paste.read_text()
    for option in ({"zero": 0.1}, {"frame": "sensor"}, {"rods": (345, 345)}, {"radius": -1}, {"shrinkage": 2}, {"printed": [(0, 1)]}, {"rod": 1}):
        with pytest.raises((TypeError, ValueError), match=f"^{next(iter(option))}: "):
            dc.calibrate("printer/printer.cfg", **option)


def test_warnings_are_pythons(robot, measured):
    _, q, x = measured
    with pytest.warns(dc.CalibrationWarning, match="Residuals"):
        dc.calibrate(robot, q, x + np.random.default_rng(2).standard_normal(x.shape) * 0.04)


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT")
@pytest.mark.parametrize("call", ["dc.plan(robot, 500)", "dc.simulate(robot, n=10**7)", "dc.simulate(robot, n=10**6, planned=True)",
                                  "dc.workspace(robot, tolerance=1e-9, spacing=2.0)", "[robot.forward(q) for _ in range(1000)]",
                                  "dc.calibrate(robot, q[:200000], robot.forward(q[:200000]))", "[dc.read_samples(path) for _ in range(1000)]"])
def test_an_interrupt_ends_every_call(call, tmp_path):
    path = tmp_path / "many.csv"
    if "path" in call:
        path.write_text("q1_rad,q2_rad,q3_rad,x_mm,y_mm,z_mm\n" + "0.1,0.2,0.3,26.2,14.9,-412.4\n" * 10**6)
    code = f"""
import time, numpy as np, delta_cal as dc
robot = dc.Robot.nominal(base_radius=194, platform_radius=30, upper_arm=260, forearm=480, limits=(-1.05, 1.57),
                         tolerance=(0.5, 3.5e-3), noise=(0.02, 3.5e-5))
q, path = np.random.default_rng(1).uniform(-0.9, 1.4, (10**6, 3)), {str(path)!r}
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", time.time(), flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.7)
    child.send_signal(signal.SIGINT)
    begin = time.time()
    out, _ = child.communicate(timeout=60)
    assert out.startswith("interrupted") and child.returncode == 0
    print(f"{call}: {float(out.split()[1]) - begin:.2f} s after the interrupt")


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT")
def test_an_interrupt_costs_other_threads_nothing(robot):
    # A shell lets what runs in its background ignore interrupts.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    expected, found = dc.simulate(robot, n=2000)["error_after"], []
    other = threading.Thread(target=lambda: found.extend(dc.simulate(robot, n=2000)["error_after"] for _ in range(3)))
    other.start()
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        dc.plan(robot, 500)
    other.join()
    np.testing.assert_array_equal(found, [expected] * 3)


def test_plots_are_drawn(tmp_path, robot, measured):
    _, q, x = measured
    figure = dc.calibrate(robot, q, x).plot()
    figure.savefig(tmp_path / "figure.png")
    # Parameters, residuals, bed and its scale.
    assert len(figure.axes) == 4 and figure._repr_png_().startswith(b"\x89PNG")


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
