"""docs/python.md: its code runs, and its tables are every argument of every function, from the docstrings.

DELTA_CAL_ARGUMENTS=write writes the tables anew.
"""

from __future__ import annotations

import doctest
import inspect
import os
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import EXAMPLES, ROOT

import delta_cal as dc

PAGE = ROOT / "docs" / "python.md"
HEADING = "\n## Arguments\n"


def functions():
    """Functions and methods by their names."""
    for name in dc.__all__:
        own = getattr(dc, name)
        if not inspect.isclass(own):
            if callable(own):
                yield name, own
        elif not issubclass(own, (tuple, Exception)):
            methods = ((method, getattr(own, method)) for method in dir(own) if not method.startswith("_"))
            yield from ((f"{name}.{method}", each) for method, each in methods if callable(each))


def entries(function):
    """Of each argument, or several together: names, type and description, example."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w+\n---|\Z)", inspect.getdoc(function) or "", re.M | re.S)
    for names, kind, text in re.findall(r"^(\S[^:\n]*?)(?: : (.*))?\n((?:    .*\n?)+)", section[1] if section else "", re.M):
        text = " ".join(text.split()).replace("``", "`")
        own = [name.strip() for name in names.split(",")]
        text, example = re.fullmatch(rf"(.*?)(?:: `((?:\w+=).*)`)?\.?", text).groups()
        yield own, ". ".join(part for part in (kind, text) if part), example


def arguments(function):
    return [name for name in inspect.signature(function).parameters if name != "self"]


def tables():
    text = HEADING
    for name, function in functions():
        rows = [f"| {', '.join(f'`{own}`' for own in names)} | {said} | {f'`{example}`' if example else ''} |"
                for names, said, example in entries(function)]
        if rows:
            text += "\n".join([f"\n### `{name}`\n", "| argument | shape, unit | example |", "| --- | --- | --- |", *rows, ""])
    return text


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the files that page and docstrings name."""
    monkeypatch.chdir(tmp_path)
    for source in ("paper-robot/robot.toml", "paper-robot/samples.csv", "printer/printer.cfg"):
        shutil.copy(EXAMPLES / source, tmp_path)
    shutil.copy("samples.csv", "positions.csv")
    (tmp_path / "host").symlink_to(ROOT / "host")


def test_the_code_of_the_page_runs(folder, measured):
    made, rng = measured[0], np.random.default_rng(1)
    names = {"track": lambda q: made.forward(q) + 0.02 * rng.standard_normal(q.shape)}
    for block in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S):
        exec(block, names)  # noqa: S102


def test_every_argument_is_described():
    for name, function in functions():
        described = [own.strip("*") for names, *_ in entries(function) for own in names]
        assert sorted(described) == sorted(arguments(function)), name


def test_the_page_has_every_argument():
    text = PAGE.read_text(encoding="utf-8")
    if os.environ.get("DELTA_CAL_ARGUMENTS") == "write":
        text = text.split(HEADING)[0] + tables()
        PAGE.write_text(text, encoding="utf-8")
    assert HEADING + text.split(HEADING)[-1] == tables()


@pytest.fixture
def called(folder, robot, measured):
    """Arguments with which each function runs, objects with its methods, and what the examples name."""
    made, q, x = measured
    robot = robot.replace(noise={"height_mm": 0.02, "distance_mm": 0.02})
    sides = {name: {"x_mm": place, "y_mm": 0, "z_mm": 0, "sigma_mm": 0.01} for name, place in (("left", -30), ("right", 30))}
    of_targets = {"robot": robot.replace(targets=sides), "q": q, "x": x + np.tile([[-30, 0, 0], [30, 0, 0]], (20, 1))}
    result, plan = dc.calibrate(**of_targets, target=["left", "right"] * 20), dc.plan(robot, 12)
    check = made.forward(plan.q)
    names = {"np": np, "robot": robot, "q": q, "x": x, "tracker": x, "result": result, "plan": plan,
             "gauge": x[:, 2] + 500, "bar": np.linalg.norm(x - [0, 0, -700], axis=1)}
    given = {
        "Robot.nominal": {"base_radius": 194, "platform_radius": 30, "upper_arm": 260, "forearm": 480, "limits": robot.limits},
        "Robot.from_parameters": {"parameters": robot.parameters, "limits": robot.limits},
        **{f"Robot.{name}": {"q": q} for name in ("forward", "jacobian", "parameter_jacobian")},
        "Robot.inverse": {"x": x},
        "Calibration.position_covariance": {"q": q},
        "calibrate": {"robot": robot, "q": q, "x": x},
        "compare": {"before": robot, "after": result.robot},
        "export": {"robot": result.robot, "target": "klipper"},
        "import_": {"path": "printer.cfg"},
        "plan": {"robot": robot, "count": 8},
        "read_samples": {"path": "samples.csv"},
        "simulate": {"robot": robot, "n": 20},
        "validate": {"robot": result.robot, "q": plan.q, "x": check, "limit": 0.2},
        "workspace": {"robot": robot, "tolerance": 1.0, "spacing": 50},
    }
    objects = {"Robot": robot, "Calibration": result, "Plan": plan, "Export": dc.export(robot, "klipper"),
               "Samples": dc.read_samples("samples.csv"), "Validation": dc.validate(result.robot, plan.q, check, limit=0.2)}
    return given, objects, names, of_targets


def examples(called):
    """Names, calls and arguments of all examples."""
    given, objects, names, of_targets = called
    for name, function in functions():
        owner, _, own_name = name.rpartition(".")
        for _, _, example in entries(function):
            own = eval(f"dict({example or ''})", names)  # noqa: S307
            base = {**given.get(name, {}), **(of_targets if name == "calibrate" and "target" in own else {})}
            # A robot's file, or readings of several kinds, take the place of the arrays.
            arrays = () if isinstance(own.get("robot", names["robot"]), dc.Robot) and not isinstance(own.get("q"), list) else ("q", "x")
            used = {key: value for key, value in base.items() if key not in arrays or name != "calibrate"} | own
            yield name, getattr(objects.get(owner, dc), own_name), used


def test_every_example_runs(called):
    for _, call, given in examples(called):
        call(**given)


# What no argument can be but that of a path, and what some cannot.
NONE_TAKES = (object(), 1j, "\0", "\udc80")
SOME_TAKE = (float("nan"), float("inf"), 1e300, 10**30, -1, "", [], [[1, 2], [3]], {}, {"a": 1}, {1, 2}, (None, None), np.zeros((0, 3)), np.full((2, 2), np.nan))


def test_every_argument_that_cannot_be_used_is_named(called):
    given, objects, *_ = called
    unnamed = []
    for name, function in functions():
        owner, _, own_name = name.rpartition(".")
        base = {**given.get(name, {}), **({"path": "file.json"} if own_name == "write" else {})}
        base.update({"text": objects["Robot"].to_toml(), "name": "text"} if own_name == "from_toml" else {})
        base.update({"robot": objects["Robot"]} if own_name == "arrays" else {})
        call = getattr(objects.get(owner, dc), own_name, None)
        known = [own for own in arguments(function) if own not in ("sections", "printer", "progress")]
        for argument, value in ((own, value) for own in known for value in (*NONE_TAKES, *SOME_TAKE)):
            if value is NONE_TAKES[3] and argument in ("path", "positions", "robot", "samples") or value is NONE_TAKES[2] and argument in ("name", "names"):
                continue
            try:
                call(**{**base, argument: value})
            except OSError:
                continue
            except (TypeError, ValueError, dc.Refused) as error:
                if isinstance(error, dc.Refused) or re.match(rf"(\w+, )*{argument}\b[^:]*:", str(error)):
                    continue
                unnamed.append(f"{name}({argument}={value!r}): {error!r}")
            else:
                if any(value is own for own in NONE_TAKES):
                    unnamed.append(f"{name}({argument}={value!r}) is taken")
    assert not unnamed, "\n".join(unnamed)


def with_last(own, last):
    found = own.astype(object)
    found.flat[-1] = last
    return found


def first_of(own):
    return own == own.flat[0]


# The same numbers in other forms, NaN where they have no value.
FORMS = {
    "columns first": np.asfortranarray,
    "every other": lambda own: np.repeat(own, 2, axis=-1)[..., ::2],
    "backwards": lambda own: own[::-1].copy()[::-1],
    "read-only": lambda own: np.frombuffer(own.tobytes()).reshape(own.shape),
    "other end first": lambda own: own.astype(">f8"),
    "128 bits": np.longdouble,
    "16 bits": np.float16,
    "whole": lambda own: own.astype("i8"),
    "rows": tuple,
    "memory": memoryview,
    "more dimensions": lambda own: own[None],
    "one row": lambda own: own[:1],
    "no row": lambda own: own[:0],
    "one masked": lambda own: np.ma.masked_array(own, first_of(own), fill_value=5),
    "all masked": lambda own: np.ma.masked_array(own, True),
    "one None": lambda own: with_last(own, None),
    "one infinite": lambda own: np.where(first_of(own), np.inf, own),
    "an array's method": lambda own: SimpleNamespace(__array__=lambda dtype=None, copy=None: own),
    "an array's memory": lambda own: SimpleNamespace(__array_interface__=own.__array_interface__),
    "pandas": lambda own: pd.Series(own.ravel(), range(own.size, 0, -1), "Float64").replace(own.flat[0], pd.NA),
    "polars": pl.Series,
}
NO_NUMBERS = {
    "set": lambda own: set(own.flat),
    "generator": iter,
    "text": lambda own: own.astype(str),
    "complex": lambda own: own + 0j,
    "bool": lambda own: own > 0,
    "fields": lambda own: np.zeros(len(own), "f8,f8"),
    "ragged": lambda own: [*own.tolist(), [1.0] * 9],
    "one text": lambda own: with_last(own, "1"),
    "on a GPU": lambda own: SimpleNamespace(__array__=lambda dtype=None, copy=None: own.nothing),
}


def outcome(call, **given):
    try:
        found = call(**given)
    except (TypeError, ValueError, dc.Refused) as error:
        return str(error)
    found = getattr(found, "robot", found)
    return getattr(found, "fingerprint", found)


def test_arrays_of_any_form_are_the_numbers_that_numpy_has(called):
    seen = set()
    for name, call, given in examples(called):
        for argument, own in given.items():
            try:
                array = np.array(own, float)
            except (TypeError, ValueError):
                continue
            if array.ndim == 0 or (name, argument, array.shape) in seen:
                continue
            seen.add((name, argument, array.shape))
            known = {}
            for form, make in FORMS.items():
                made = make(array)
                plain = np.ma.filled(made, np.nan) if isinstance(made, np.ma.MaskedArray) else np.array(made, float)
                key = plain.tobytes(), plain.shape
                known[key] = known[key] if key in known else outcome(call, **{**given, argument: plain})
                np.testing.assert_equal(outcome(call, **{**given, argument: made}), known[key], f"{name}, {argument}, {form}")
            for form, make in NO_NUMBERS.items():
                error = str(outcome(call, **{**given, argument: make(array)}))
                assert re.match(f"{argument}: ", error), f"{name}, {argument}, {form}"
    assert len(seen) > 20


def test_the_example_of_a_docstring_is_right():
    found = doctest.DocTestFinder(recurse=False).find(dc.Robot, "Robot")
    runner = doctest.DocTestRunner()
    assert sum(runner.run(own).attempted for own in found) == 3 and runner.failures == 0
