"""Robots and their kinematics: against formulas of NumPy, difference quotients, and the files."""

from __future__ import annotations

import copy
import pickle
import re

import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import EXAMPLES
from formula import columns, derivatives, forward, joints
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import delta_cal as dc

ROBOT = dc.Robot.nominal(base_radius=194, platform_radius=30, upper_arm=260, forearm=480, limits=(-1.05, 1.57))
PRINTER = dc.Robot.read(EXAMPLES / "printer" / "robot.toml")
Q = np.random.default_rng(1).uniform(-0.9, 1.4, (500, 3))


def test_forward_is_that_of_an_independent_formula(measured):
    made, *_ = measured
    np.testing.assert_allclose(made.forward(Q), forward(made.parameters, Q), atol=1e-9)


def test_inverse_gives_joints_of_the_same_pose(measured):
    for robot in (ROBOT, measured[0]):
        x = robot.forward(Q)
        np.testing.assert_allclose(robot.inverse(x), np.stack(joints(robot.parameters, columns(x)), axis=-1), atol=1e-9)
        np.testing.assert_allclose(forward(robot.parameters, robot.inverse(x)), x, atol=1e-9)


DOWN = {"convention": {"z_axis": "down", "joint_positive": "up"}, "target": {"x_mm": 10, "y_mm": 20, "z_mm": -40}}


@pytest.mark.parametrize("own", [ROBOT.replace(limits=(-1.5, 2.7)), PRINTER, ROBOT.replace(**DOWN)], ids=["rotary", "linear", "downwards"])
def test_many_rows_are_those_of_single_ones(own):
    # Beyond the limits and the singularities too.
    low, high = np.array(own.limits) + 0.1 * np.ptp(own.limits) * np.array([-1, 1])
    q = np.random.default_rng(2).uniform(low, high, (3000, 3))
    calls = {own.forward: (q, 1e-10), own.inverse: (own.forward(q), 3e-12), own.jacobian: (q, 1e-7)}
    for call, (rows, bound) in calls.items():
        many, single = call(rows), np.array([call(row) for row in rows])
        # Positions of some 500 mm, joints, and derivatives that grow without bound towards a singularity: to 1e-12 of them.
        np.testing.assert_allclose(many, single, rtol=1e-12, atol=bound)
        assert 0.1 < np.isnan(single).mean() < 0.6
    target = {"target": (10.0, 20.0, -30.0)}
    at = own.forward(q, **target)
    np.testing.assert_allclose(at, own.forward(q) + target["target"], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(own.inverse(at, **target), own.inverse(own.forward(q)), atol=1e-9)


@pytest.mark.parametrize(("number", "bound"), [(np.float64, 5e-12), (np.float32, 1e-4)])
def test_nearly_stretched_arms_are_those_of_single_rows(number, bound):
    # Of arm 1 both links point from its joint to the position, but for an angle of 1e-5 to 0.1: rounding counts by its inverse.
    robot = ROBOT.replace(limits=(-1.5, 2.7))
    reach = 740 * (1 - np.logspace(-11, -3, 2000)[:, None])
    x = ([164, 0, 0] + reach * [np.cos(1.9), 0, -np.sin(1.9)]).astype(number)
    many, single = robot.inverse(x), np.array([robot.inverse(row) for row in x])
    np.testing.assert_allclose(many, single, atol=bound, rtol=0)
    assert np.isfinite(single).all(axis=1).mean() > 0.3


@pytest.mark.parametrize("rows", [slice(None), slice(10)], ids=["several at once", "each for itself"])
def test_numbers_of_32_bits_give_such_numbers(rows):
    q = Q[rows].astype(np.float32)
    x = ROBOT.forward(q)
    # Eight times the rounding of some 500 mm to 32 bits, 6e-8; of joints more, by which a stretched arm multiplies it: up to 100.
    for call, of, bound in ((ROBOT.forward, q, 2.5e-4), (ROBOT.inverse, x, 5e-5), (ROBOT.jacobian, q, 2.5e-4), (ROBOT.parameter_jacobian, q, 2.5e-4)):
        found = call(of)
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, call(of.astype(np.float64)), rtol=5e-7, atol=bound)
        assert call(of[0]).dtype == np.float32


@pytest.mark.parametrize("column", range(24))
def test_parameter_jacobian_is_the_difference_quotient(column):
    step = 1e-5
    moved = [forward(ROBOT.parameters + sign * step * np.eye(24)[column].reshape(3, 8), Q) for sign in (1, -1)]
    expected = (moved[0] - moved[1]) / (2 * step)
    np.testing.assert_allclose(ROBOT.parameter_jacobian(Q)[:, :, column], expected, atol=1e-4, rtol=1e-6)


@pytest.mark.parametrize("joint", range(3))
def test_jacobian_is_the_difference_quotient(joint):
    formula = derivatives(ROBOT.parameters, columns(Q))[joint]
    np.testing.assert_allclose(ROBOT.jacobian(Q)[:, :, joint], np.stack(formula, axis=-1), rtol=1e-9, atol=1e-9)
    step = 1e-6 * np.eye(3)[joint]
    expected = (forward(ROBOT.parameters, Q + step) - forward(ROBOT.parameters, Q - step)) / 2e-6
    np.testing.assert_allclose(ROBOT.jacobian(Q)[:, :, joint], expected, atol=1e-3)


def test_of_a_controller_with_other_directions(tmp_path, measured):
    made, *_ = measured
    # docs/instruments.md: with z downwards these change their signs, and arms and limits are stated in the convention too.
    axes, signs = np.array([1, -1, -1]), np.array([1, -1, -1, -1, 1, 1, -1, 1])
    text = re.sub(r"^(dy_mm|dz_mm|theta_deg|la_y_mm) = (.*)$", lambda line: f"{line[1]} = {-float(line[2])!r}", made.to_toml(), flags=re.M)
    low, high = (re.search(rf"^{name}_deg = (.*)$", text, re.M)[1] for name in ("min", "max"))
    text = text.replace(f"min_deg = {low}", f"min_deg = {-float(high)}").replace(f"max_deg = {high}", f"max_deg = {-float(low)}")
    path = tmp_path / "robot.toml"
    path.write_text('[convention]\njoint_positive = "up"\nz_axis = "down"\n' + text)
    other = dc.Robot.read(path)
    assert other.limits == pytest.approx((-1.57, 1.05))
    np.testing.assert_array_equal(other.parameters, made.parameters * signs)
    np.testing.assert_array_equal(other.forward(-Q), made.forward(Q) * axes)
    np.testing.assert_array_equal(other.inverse(made.forward(Q) * axes), -made.inverse(made.forward(Q)))
    np.testing.assert_array_equal(other.jacobian(-Q), -made.jacobian(Q) * axes[:, None])
    np.testing.assert_array_equal(other.parameter_jacobian(-Q), made.parameter_jacobian(Q) * axes[:, None] * np.tile(signs, 3))


@settings(max_examples=50, deadline=None)
@given(hnp.arrays(np.float64, st.tuples(st.integers(0, 40), st.just(3)), elements=st.floats(-6, 6)))
def test_any_joints_have_a_pose_or_nan(q):
    x = ROBOT.forward(q)
    assert x.shape == q.shape
    reached = np.isfinite(x).all(axis=1)
    assert (np.isnan(x).all(axis=1) | reached).all()
    assert ROBOT.jacobian(q).shape == (len(q), 3, 3)
    back = ROBOT.inverse(x)
    again = ROBOT.forward(back[np.isfinite(back).all(axis=1)])
    np.testing.assert_allclose(again, x[np.isfinite(back).all(axis=1)], atol=1e-6)


def test_one_pose_any_layout_and_any_type():
    one = ROBOT.forward(Q)
    np.testing.assert_allclose(ROBOT.forward(Q[3]), one[3], rtol=1e-12)
    assert ROBOT.forward([[0, 0, 1]]).shape == (1, 3)
    assert ROBOT.parameter_jacobian(Q[0]).shape == (3, 24)
    assert ROBOT.forward(np.empty((0, 3))).shape == (0, 3)
    np.testing.assert_array_equal(ROBOT.forward(Q.reshape(5, 10, 10, 3)), one.reshape(5, 10, 10, 3))
    assert ROBOT.jacobian(Q.reshape(50, 10, 3)).shape == (50, 10, 3, 3)


def test_rows_of_many_threads_have_the_bits_of_one():
    many = np.tile(Q, (20, 1))
    np.testing.assert_array_equal(ROBOT.forward(many), np.tile(ROBOT.forward(Q), (20, 1)))


@pytest.mark.parametrize("frame", [pd.DataFrame, pl.DataFrame])
def test_frames_by_the_names_of_their_columns(frame):
    q = frame({"q1_rad": Q[:, 0], "q2_rad": Q[:, 1], "q3_rad": Q[:, 2]})
    np.testing.assert_array_equal(ROBOT.forward(q), ROBOT.forward(Q))
    degrees = frame({"other": Q[:, 0], "Q3 [deg]": np.rad2deg(Q[:, 2]), "q1/°": np.rad2deg(Q[:, 0]), "q2_deg": np.rad2deg(Q[:, 1])})
    np.testing.assert_allclose(ROBOT.forward(degrees), ROBOT.forward(Q))
    x = ROBOT.forward(Q)
    np.testing.assert_array_equal(ROBOT.inverse(frame(x, columns=["x_mm", "y_mm", "z_mm"])) if frame is pd.DataFrame
                                  else ROBOT.inverse(frame(x, schema=["x_mm", "y_mm", "z_mm"])), ROBOT.inverse(x))
    with pytest.raises(ValueError, match="q: needs columns such as q1_rad, q2_rad"):
        ROBOT.forward(frame({"q1_deg": [1.0], "q3_deg": [1.0]}))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ROBOT.forward([[1, 2]]), r"q: shape \(1, 2\)"),
        (lambda: ROBOT.forward([[0.1, "0.2", pd.NA]]), r"q: \[0, 1\]: str; a number"),
        (lambda: ROBOT.forward(None), "q: NoneType"),
        (lambda: ROBOT.forward(pd.DataFrame(Q)), "q: needs columns"),
        (lambda: ROBOT.forward([[0.1, 0.2, 30]]), "q: row 0 holds 30, more than a turn"),
        (lambda: ROBOT.forward([[0, 0, 0], [0, 0, 2]], errors="raise"), "q: row 1: a joint is outside its limits"),
        (lambda: ROBOT.forward([[0, 0, 0]], errors="no"), "errors: "),
        (lambda: ROBOT.inverse([[0, 0, -2000]], errors="raise"), "x: row 0: .*arm 1"),
        (lambda: ROBOT.inverse([[0, np.nan, -400]], errors="raise"), "x: row 0: "),
        (lambda: dc.Robot.from_parameters(np.zeros((3, 7)), limits=(-1, 1)), "parameters: shape"),
        (lambda: dc.Robot.from_parameters(np.zeros((3, 8)), limits=(-1, 1)), "parameters: "),
        (lambda: ROBOT.replace(noise={0.02, 1e-5}), r"noise: \(position, joint\)"),
        (lambda: ROBOT.replace(noise=(-1.0, 1.0)), "noise: "),
        (lambda: ROBOT.replace(tolerance=(0.5, 0.0)), "tolerance: "),
        (lambda: ROBOT.replace(tolerance=(0.5, 0.2)), "tolerance: .*radians"),
        (lambda: ROBOT.replace(noise=(0.02, 0.5)), "noise: .*radians"),
        (lambda: ROBOT.replace(limits=[1, 2, 3]), "limits: .*, not 3 numbers"),
        (lambda: ROBOT.replace(target=-40), "target: a dict"),
        (lambda: ROBOT.replace(target={"height": 1}), "height"),
        (lambda: dc.Robot.from_parameters(PRINTER.parameters, limits=(-1, 1)), "parameters: .*linear"),
        (lambda: dc.Robot.from_parameters(PRINTER.parameters + 0.1, limits=(0, 300), drive="linear"), r"parameters: \[0, 6\]"),
        (lambda: dc.Robot.from_toml("[nominal]\nbase_radius_mm = 'x'"), "robot:1: missing field `joints`"),
        (lambda: ROBOT.replace(colour={"a": 1}), "^colour: "),
        (lambda: ROBOT.replace(zero=0.1), "zero: "),
    ],
)
def test_a_fault_names_its_argument(call, message):
    with pytest.raises((ValueError, TypeError), match=message):
        call()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"base_radius": -1}, "base_radius: -1"),
        ({"forearm": float("nan")}, "forearm: nan; a finite"),
        ({"limits": (1.57, -1.05)}, "limits: .*radians"),
        ({"limits": (-60, 90)}, "limits: .*radians"),
        ({"limits": None}, "limits: None"),
        ({"forearm": 10}, "^base_radius, .*forearm: .*impossible"),
    ],
)
def test_a_data_sheet_that_cannot_be(change, message):
    sheet = {"base_radius": 194, "platform_radius": 30, "upper_arm": 260, "forearm": 480, "limits": (-1.05, 1.57)}
    with pytest.raises((ValueError, TypeError), match=message):
        dc.Robot.nominal(**{**sheet, **change})


def test_sections_are_those_of_the_file():
    made = ROBOT.replace(parameters=ROBOT.parameters + np.random.default_rng(3).uniform(-0.1, 0.1, (3, 8)))
    np.testing.assert_array_equal(made.replace(target={"x_mm": 0.1, "y_mm": 0, "z_mm": 0}).parameters, made.parameters)
    stated = ROBOT.replace(noise={"height_mm": 0.02, "joint_deg": 0.01})
    robot = stated.replace(target={"x_mm": 0, "y_mm": 0, "z_mm": -40}, convention={"z_axis": "down"})
    assert robot.to_dict()["target"]["z_mm"] == -40
    assert ROBOT.replace(target={"x_mm": np.int64(0), "y_mm": np.array(0.0), "z_mm": np.longdouble(-40)}).to_dict()["target"]["z_mm"] == -40
    # The same robot, counted in another way.
    np.testing.assert_allclose(robot.forward(Q), ROBOT.forward(Q) * [1, -1, -1])
    assert robot.replace(target=None, convention=None) == stated != robot
    sheet = {"base_radius": 194, "platform_radius": 30, "upper_arm": 260, "forearm": 480}
    stated = dc.Robot.nominal(**sheet, limits=np.array([-1.57, 1.05]), convention={"joint_positive": "up"}, joints={"forearm_max_deg": 45})
    assert stated.to_dict()["joints"]["forearm_max_deg"] == 45
    np.testing.assert_allclose(stated.forward(-Q), ROBOT.forward(Q))
    assert dc.Robot.from_toml(robot.to_toml()) == robot
    assert ROBOT.replace(noise=((0.01, 0.02, 0.03), 1e-5)).noise == ((0.01, 0.02, 0.03), pytest.approx(1e-5))


@pytest.mark.parametrize("own", [ROBOT, PRINTER], ids=["rotary", "linear"])
def test_parameters_make_the_robot_again(own):
    more = {} if own is PRINTER else {"transmissions": 1e-3 * np.arange(15).reshape(3, 5)}
    changed = own.replace(parameters=own.parameters + [1, 0, 1, 0, 0, 0, 0, 1], **more)
    again = dc.Robot.from_parameters(changed.parameters, limits=changed.limits, drive=own.drive, **more)
    np.testing.assert_array_equal(again.parameters, changed.parameters)
    q = np.linspace(*own.limits, 33)[1:-1].reshape(-1, 1) * [1, 0.98, 0.99]
    np.testing.assert_allclose(again.forward(q), changed.forward(q))
    if more:
        # The arms turn as docs/instruments.md states.
        turned = q + sum(row * term for row, term in zip(more["transmissions"].T, (q, np.cos(q), np.sin(q), np.cos(2 * q), np.sin(2 * q))))
        np.testing.assert_allclose(changed.forward(q), forward(changed.parameters, turned), atol=1e-9)


@pytest.mark.parametrize("number", range(15))
def test_jacobian_of_transmissions_is_the_difference_quotient(number):
    base = 1e-3 * np.arange(15)
    robots = [ROBOT.replace(transmissions=(base + by * np.eye(15)[number]).reshape(3, 5)) for by in (1e-6, 0, -1e-6)]
    up, middle, down = (own.forward(Q) for own in robots)
    found = robots[1].parameter_jacobian(Q, transmissions=True)
    np.testing.assert_allclose(found[:, :, 24 + number], (up - down) / 2e-6, atol=1e-3)
    np.testing.assert_array_equal(found[:, :, :24], robots[1].parameter_jacobian(Q))


@pytest.mark.parametrize("name", ["paper-robot", "circle-sheet", "plate", "printer"])
def test_a_robot_is_its_file(name, tmp_path):
    robot = dc.Robot.read(EXAMPLES / name / "robot.toml")
    robot.write(tmp_path / "copy.toml")
    for other in (
        dc.Robot.read(tmp_path / "copy.toml"),
        pickle.loads(pickle.dumps(robot)),
        copy.copy(robot),
        copy.deepcopy(robot),
    ):
        assert other == robot
        assert hash(other) == hash(robot)
        assert other.fingerprint == robot.fingerprint
        np.testing.assert_array_equal(other.parameters, robot.parameters)
    changed = robot.replace(tolerance=(0.123, 0.00123))
    assert changed != robot and robot != 1
    assert changed.tolerance == pytest.approx((0.123, 0.00123))


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileNotFoundError):
        dc.Robot.read(tmp_path / "none.toml")
    lines = (EXAMPLES / "paper-robot" / "robot.toml").read_text().splitlines()
    faulty = next(index for index, line in enumerate(lines) if line.startswith("base_radius_mm"))
    lines[faulty] = "base_radius_mm = 'x'"
    (tmp_path / "robot.toml").write_text("\n".join(lines))
    with pytest.raises(ValueError, match=f"robot.toml:{faulty + 1}"):
        dc.Robot.read(tmp_path / "robot.toml")
