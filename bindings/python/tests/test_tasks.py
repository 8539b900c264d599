"""Plans, validations, exports, imports, simulations: against the command and against arithmetic."""

from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import EXAMPLES

import delta_cal as dc


def test_a_plan_is_that_of_the_command(command, monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    report, poses = command("plan", "paper-robot/robot.toml", "--count", "12")
    plan = dc.plan(dc.Robot.read("paper-robot/robot.toml"), 12)
    assert plan.csv == poses.read_text()
    assert plan.to_dict() == report


def test_a_plan_holds_what_it_says(robot, tmp_path):
    plan = dc.plan(robot, 12, within="r=150,z=-600..-350")
    assert plan.q.shape == plan.x.shape and len(plan.q) >= 12
    np.testing.assert_allclose(robot.forward(plan.q), plan.x, atol=1e-9)
    assert (np.hypot(plan.x[:, 0], plan.x[:, 1]) <= 150 + 1e-9).all()
    assert plan._repr_html_().startswith("<pre>") and "<table>" in robot._repr_html_()
    assert plan.expected_error["relative_rms_mm"] > 0 and "12" in repr(plan) and "\n" not in repr(plan)
    assert (dc.plan(robot, 12, seed=2).q != dc.plan(robot, 12).q).any() and "P01" in dc.plan(robot, 10, names="P").csv
    plan.write(tmp_path / "poses.csv")
    assert dc.read_samples(tmp_path / "poses.csv").text == plan.csv
    few = dc.plan(robot, accuracy=0.05)
    assert few.to_dict()["count"] < 40


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count": 3}, "count: 3"),
        ({"count": -1}, "count: -1"),
        ({"count": 4.5}, "count: 4.5"),
        ({"measure": "plate"}, "measure: "),
        ({"within": "r=200"}, "within: "),
        ({"order": "any"}, "order: "),
        ({"accuracy": 0.0}, "accuracy: 0; a length above 0"),
        ({"samples": {"q": [[0, 0, 0]]}}, "q: row 0: the row does not say"),
        ({"frame": "sensor", "measure": "plane"}, "frame: "),
        ({"frame": "sensor", "absolute": True}, r"absolute: .*\n.*state \[datum"),
        ({"within": "r=10,z=100..200"}, "usable poses within"),
        *(({"samples": {"q": [[0, 0, 0]], "x": [[0, 0, -400]]}, **more}, f"{next(iter(more))}: ")
          for more in ({"measure": "xyz"}, {"accuracy": 0.1}, {"order": "shortest"}, {"count": 501})),
    ],
)
def test_a_plan_that_cannot_be(options, message, robot):
    with pytest.raises((ValueError, TypeError), match=message):
        dc.plan(robot, **options)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda robot: dc.plan(robot, samples=[[0, 0, 0]]), "samples: list; a file, a frame"),
        (lambda robot: dc.export(robot, "klipper", home=3), r"home: \(q1, q2, q3\) is needed"),
        (lambda robot: dc.export(robot, "klipper", home=(-50, -50, -50)), "home: .*radians"),
        (lambda robot: dc.export(robot, "correction-table", limit=0.0), "limit: 0; a length above 0"),
        (lambda robot: dc.compare(robot, "robot.toml"), "after: str"),
    ],
)
def test_an_argument_that_cannot_be(call, message, robot):
    with pytest.raises((ValueError, TypeError), match=f"^{message}"):
        call(robot)


def test_from_a_data_sheet_to_a_validated_robot(robot, measured, tmp_path):
    made, q, x = measured
    rng = np.random.default_rng(3)
    result = dc.calibrate(robot, q, x)
    check = rng.uniform(-0.7, 1.2, (25, 3))
    seen = made.forward(check) + 0.02 * rng.standard_normal(check.shape)
    found = dc.validate(result.robot, check, seen, limit=0.1)
    assert found.passed and found.verdict == "pass" and found.interval[1] < 0.1
    off = np.linalg.norm(seen - result.robot.forward(check), axis=1)
    np.testing.assert_allclose(found.deviations, off, atol=1e-9)
    assert "<iframe" in found._repr_html_()
    failed = dc.validate(robot, check, seen, limit=0.1)
    assert failed.verdict == "fail" and found and not failed
    for ending in ("html", "json", "txt"):
        found.write(tmp_path / f"certificate.{ending}")
    assert json.loads((tmp_path / "certificate.json").read_text()) == found.to_dict()
    # The very samples of the calibration prove nothing.
    with pytest.raises(ValueError, match="calibrated from the same measurements"):
        dc.validate(result.robot, q, x, limit=0.1)
    with pytest.raises(dc.Refused):
        dc.validate(result.robot, check[:4], seen[:4], limit=0.1)
    with pytest.raises(ValueError, match="limit: "):
        dc.validate(result.robot, check, seen, limit=0)


def test_an_export_is_that_of_the_command(command, monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    report, lines = command("export", "paper-robot/robot.toml", "--for", "klipper")
    found = dc.export(dc.Robot.read("paper-robot/robot.toml"), "klipper")
    assert found.text == lines.read_text()
    assert found.to_dict() == report
    assert found.text.endswith(found.lines) and str(found) == found.text
    with pytest.raises(ValueError, match="target: .*klipper"):
        dc.export(dc.Robot.read("paper-robot/robot.toml"), "no-such")


def test_a_printer_is_imported_and_calibrated():
    found = dc.import_(EXAMPLES / "printer" / "printer.cfg")
    assert found.robot.drive == "linear" and len(found.home) == 3
    assert found.samples is not None
    assert dc.calibrate(found.robot, found.samples).method == "fkm"
    with pytest.raises(ValueError, match="firmware: "):
        dc.import_(EXAMPLES / "printer" / "printer.cfg", "smoothie")


def test_simulated_robots_have_the_errors_that_they_state(robot):
    found = dc.simulate(robot, n=300, seed=5)
    assert {len(column) for column in found.values()} == {300}
    assert found["accepted"].mean() > 0.98
    kept = found["accepted"]
    ratio = np.sqrt(np.mean(found["error_after"][kept] ** 2) / np.mean(found["error_stated"][kept] ** 2))
    assert ratio == pytest.approx(1, abs=0.1)
    assert (found["error_before"] > found["error_after"])[kept].mean() > 0.98


def test_a_robot_of_a_campaign_is_the_same_in_every_range(robot):
    whole = dc.simulate(robot, n=30)
    part = dc.simulate(robot, first=10, n=10)
    for name, column in part.items():
        np.testing.assert_array_equal(column, whole[name][10:20])
    assert len(dc.simulate(robot, n=0)["robot"]) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [({"n": -1}, "n: "), ({"poses": 0}, "poses: "), ({"poses": 10**9}, "poses: 10"), ({"method": "guess"}, "guess"), ({"spread": "even"}, "even")],
)
def test_a_campaign_that_cannot_be(options, message, robot):
    with pytest.raises(ValueError, match=message):
        dc.simulate(robot, **options)


@pytest.mark.parametrize("name", ["plans", "targets"])
def test_the_notebook_runs(name):
    cells = json.loads((EXAMPLES.parents[1] / "bindings" / "python" / "examples" / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    names = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)  # noqa: S102


def test_progress_is_told(robot):
    told = []
    dc.simulate(robot, n=2000, progress=lambda done, whole: told.append((done, whole)))
    assert told[-1] == (2000, 2000) and told == sorted(told)
    told.clear()
    dc.plan(robot, 60, progress=lambda done, whole: told.append((done, whole)))
    # 240 / 60 starts, each exchanged and then four times in its neighbourhood.
    assert told == sorted(told) and told[-1] == (20, 20) and len({done for done, _ in told}) > 3
    waited = []
    q = np.random.default_rng(1).uniform(-0.9, 1.4, (20000, 3))
    dc.calibrate(robot, q, robot.forward(q), progress=waited.append)
    assert len(waited) > 3 and waited[0] < 1
    dc.plan(robot, 8, progress=True)

    def stop(*_):
        raise LookupError

    for call in (
        lambda: dc.simulate(robot, progress=stop),
        lambda: dc.plan(robot, 8, progress=stop),
        lambda: dc.plan(robot, 8, samples={"q": q[:9], "x": robot.forward(q[:9])}, progress=stop),
        lambda: dc.calibrate(robot, q[:99], robot.forward(q[:99]), progress=stop),
        lambda: dc.calibrate(EXAMPLES / "printer" / "printer.cfg", progress=stop),
    ):
        with pytest.raises(LookupError):
            call()


def test_what_to_add_to_samples(robot, measured, tmp_path):
    made, q, x = measured
    few, many = (dc.plan(robot, 0, samples={"q": q[:count], "x": x[:count]}) for count in (3, 40))
    errors = [own.expected_error["absolute_rms_mm"] for own in (few, many)]
    assert errors[1] == pytest.approx(dc.calibrate(robot, q, x).expected_error["absolute_rms_mm"], rel=0.2) and errors[0] > 3 * errors[1]
    assert "rows 0, 1 and 2" in str(few) and few.q.shape == (0, 3)
    # What is added leaves as much as it says.
    added = dc.plan(robot, 9, samples={"q": q[:3], "x": x[:3]}, names="A", seed=2)
    assert len(added.q) == 9 and "A9" in added.csv and added.expected_error["absolute_rms_mm"] < 0.5 * errors[0]
    both = np.vstack([q[:3], added.q])
    result = dc.calibrate(robot, both, made.forward(both))
    assert result.expected_error["absolute_rms_mm"] == pytest.approx(added.expected_error["absolute_rms_mm"], rel=0.2)
    added.write(tmp_path / "more.csv")
    again = dc.plan(robot, 4, samples=tmp_path / "more.csv", within="r=150,z=-600..-350", absolute=True)
    assert again.to_dict()["unmeasured_lines"] and (np.hypot(*again.x.T[:2]) <= 150 + 1e-9).all()


def test_workspace_and_comparison(robot, measured):
    made, *_ = measured
    found = dc.workspace(robot, tolerance=0.1, spacing=20)
    # On the boundary a joint is at its limit, or no other pose is there.
    q = robot.inverse(found.boundary)
    reached = np.isfinite(q).all(axis=1)
    np.testing.assert_allclose(robot.forward(q[reached]), found.boundary[reached], atol=1e-6)
    assert found.to_dict()["boundary_points"] == len(found.boundary)
    moved = dc.compare(robot, robot.replace(parameters=robot.parameters + [0, 0, 1, 0, 0, 0, 0, 0])).to_dict()
    assert moved["absolute_mm"][2][0] == pytest.approx(1, abs=1e-6) and moved["relative_mm"][3][1] < 1e-6
    with pytest.raises(ValueError, match="spacing: "):
        dc.workspace(robot, spacing=-1)
