"""Plans, validations, exports, imports and simulations."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _native
from ._native import Robot, Samples

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ._native import Rows

    Array = NDArray[np.float64]

_ENDINGS = "a name that ends in {} is needed"


def _write(path: str | os.PathLike[str], texts: dict[str, str]) -> None:
    text = texts.get(Path(path).suffix)
    if text is None:
        raise ValueError("path: " + _ENDINGS.format(" or ".join(texts)))
    Path(path).write_text(text, encoding="utf-8")


def _json(report: dict[str, Any]) -> str:
    return json.dumps(report, indent=2, ensure_ascii=False) + "\n"


@dataclass(frozen=True, repr=False)
class Plan:
    """Measurements to take. Two plans are equal if their samples files are."""

    csv: str
    """The samples file to fill in, which ``read_samples`` reads back."""
    q: Array = field(compare=False)
    """Joint angles, array (n, 3), radians."""
    x: Array = field(compare=False)
    """Where the nominal robot is then, array (n, 3), mm."""
    report: dict[str, Any] = field(compare=False)
    text: str = field(compare=False)

    @property
    def expected_error(self) -> dict[str, Any]:
        """The position error expected after them, with the keys of ``Calibration.expected_error``."""
        error: dict[str, Any] = self.report["expected_error"]
        return error

    def to_dict(self) -> dict[str, Any]:
        """The report of ``delta-cal plan --json``."""
        return self.report

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the samples file to fill in (.csv) or the report (.json, .txt)."""
        _write(path, {".csv": self.csv, ".json": _json(self.report), ".txt": self.text})

    def __repr__(self) -> str:
        return self.text


def plan(
    robot: Robot,
    count: int = 20,
    *,
    measure: str = "xyz",
    frame: Literal["base", "sensor"] = "base",
    within: str | None = None,
    absolute: bool = False,
    order: Literal["random", "shortest"] = "random",
    accuracy: float | None = None,
) -> Plan:
    """Chooses the measurements after which positions are known best.

    Parameters
    ----------
    count : int
        How many, 4 to 500.
    measure : str
        ``"xyz"`` or some of its letters, ``"plane"`` (heights), ``"distance"`` (between poses), ``"point"`` (from fixed
        points); several with commas, ``"plane,distance=8"`` for eight at most.
    frame : {"base", "sensor"}
        The frame of the coordinates.
    within : str, optional
        Only poses in this box or cylinder, mm: ``"x=-100..100,y=-100..100,z=-500..-400"``, ``"r=200,z=-500..-400"``.
    absolute : bool
        Minimise the absolute error, not the relative one.
    order : {"random", "shortest"}
        ``"shortest"`` is a short path of the joints.
    accuracy : float, optional
        As few measurements as leave this position error, mm rms, in place of ``count``.

    Raises
    ------
    Refused
        No such measurements determine the robot, or reach ``accuracy``.
    """
    found = _native.plan(robot, count, measure, frame, within, absolute, order, accuracy)
    return Plan(**found)


@dataclass(frozen=True, repr=False)
class Validation:
    """A robot against independent measurements. Lengths in mm."""

    verdict: str
    """``"pass"``, ``"fail"``, ``"undecided"`` or ``"not_judged"``."""
    rms: float
    """The rms position error, without the instrument's noise."""
    interval: tuple[float, float | None]
    """Its 95 % confidence interval."""
    largest: float
    """The largest position error at the measured poses."""
    confidence: float
    """That the rms error is below the limit, 0 to 1."""
    warnings: list[str] = field(compare=False)
    deviations: Array = field(compare=False)
    """Measured from computed position of each sample, array (n,), noise included."""
    report: dict[str, Any] = field(compare=False)
    html: str = field(compare=False)
    text: str = field(compare=False)

    @property
    def passed(self) -> bool:
        """Whether the interval ends below the limit."""
        return self.verdict == "pass"

    def to_dict(self) -> dict[str, Any]:
        """The report of ``delta-cal validate --json``."""
        return self.report

    def to_html(self) -> str:
        """The certificate, one page to print."""
        return self.html

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the certificate (.html) or the report (.json, .txt)."""
        _write(path, {".html": self.html, ".json": _json(self.report), ".txt": self.text})

    def __repr__(self) -> str:
        return self.text


def validate(
    robot: Robot,
    q: Rows | Samples,
    x: Rows | None = None,
    *,
    limit: float,
    frame: Literal["base", "sensor", "stored"] = "base",
) -> Validation:
    """Checks a robot file against poses that its calibration did not use.

    Parameters
    ----------
    q, x
        As of ``calibrate``.
    limit : float
        The rms position error that passes, mm.
    frame : {"base", "sensor", "stored"}
        The frame of ``x``; ``"stored"`` is that which the calibration found.

    Raises
    ------
    Refused
        Too few poses, or measurements that are wrong as a whole.
    """
    return Validation(**_native.validate(robot, q, x, limit, frame))


@dataclass(frozen=True, repr=False)
class Export:
    """A robot for another controller."""

    lines: str
    """The lines to paste."""
    text: str
    """The same below a comment that says what is kept and what is lost."""
    kept: float | None
    """The part of the calibration's gain that the controller can hold; 1 is everything."""
    warnings: list[str] = field(compare=False)
    report: dict[str, Any] = field(compare=False)

    def to_dict(self) -> dict[str, Any]:
        """The report of ``delta-cal export --json``."""
        return self.report

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the lines below their comment."""
        Path(path).write_text(self.text, encoding="utf-8")

    def __repr__(self) -> str:
        return self.text


def export(
    robot: Robot,
    target: str,
    *,
    nominal: Robot | None = None,
    x: Rows | None = None,
    home: tuple[float, float, float] | None = None,
    height: float | None = None,
    limit: float | None = None,
) -> Export:
    """The robot as another controller holds it.

    Parameters
    ----------
    target : str
        ``"klipper"``, ``"reprapfirmware"``, ``"marlin"``, ``"linuxcnc"``, ``"linuxcnc-component"``, ``"correction-table"``, …;
        an unknown name raises an error that lists all.
    nominal : Robot, optional
        The robot before its calibration.
    x : array (n, 3) or frame, optional
        Positions to fit at, mm; otherwise all over the workspace.
    home : (float, float, float), optional
        The joints at the end stops, radians or mm of travel.
    height : float, optional
        The robot's origin above the controller's z = 0, mm.
    limit : float, optional
        The largest error between the nodes of a correction table, mm.
    """
    return Export(**_native.export(robot, target, nominal, x, home, height, limit))


@dataclass(frozen=True)
class Imported:
    """A printer's configuration."""

    robot: Robot
    samples: Samples | None
    """The readings that the configuration holds."""
    home: tuple[float, float, float]
    """The joints at the end stops, radians or mm of travel."""
    bed_radius: float | None
    """The radius within which the nozzle is wanted, mm."""
    notes: list[str] = field(compare=False)
    """Notes of the import."""


def import_(
    path: str | os.PathLike[str],
    firmware: Literal["klipper", "reprapfirmware", "marlin"] | None = None,
    *,
    rods: float | tuple[float, float, float] | None = None,
) -> Imported:
    """Reads ``printer.cfg``, ``config.g`` or what M503 prints.

    Parameters
    ----------
    firmware : str, optional
        Needed if the file does not show it.
    rods : float or (float, float, float), optional
        The rods as made, mm, in place of those of the configuration.
    """
    three = (rods, rods, rods) if isinstance(rods, (int, float)) else rods
    return Imported(**_native.import_(os.fspath(path), firmware, three))


def simulate(
    robot: Robot,
    *,
    tolerance: tuple[float, float] | None = None,
    zero: float | None = None,
    noise: tuple[float, float] | None = None,
    seed: int = 1,
    n: int = 1000,
    first: int = 0,
    poses: int = 20,
    method: Literal["joint", "ikm", "fkm"] = "joint",
    planned: bool = False,
    spread: Literal["normal", "uniform"] = "normal",
) -> dict[str, Any]:
    """Makes robots within the tolerance, measures and calibrates each.

    Parameters
    ----------
    tolerance, zero, noise : optional
        In place of the robot's own, as of ``Robot.nominal``.
    seed, n, first : int
        The robots ``first`` to ``first + n`` of a seed. A robot is the same in every range, so ranges on many computers
        join to one campaign.
    poses : int
        Measured positions of each.
    method : {"joint", "ikm", "fkm"}
        The estimator.
    planned : bool
        Poses of ``plan`` in place of random ones.
    spread : {"normal", "uniform"}
        The tolerance as one σ, or as the limits.

    Returns
    -------
    dict of arrays (n,)
        ``robot``, ``accepted``, ``status``; in mm, NaN where there is nothing to state: ``error_before``, ``error_after``
        and ``error_stated`` (positions, rms over held-out poses; stated: one σ), the same of ``relative`` (after the
        best rigid motion) and ``parameter`` (with ``parameter_bound``, the Cramér–Rao bound).
    """
    if n < 0 or first < 0 or seed < 0 or poses < 1:
        name = next(name for name, own in (("n", n), ("first", first), ("seed", seed), ("poses", poses - 1)) if own < 0)
        raise ValueError(f"{name}: a whole number of at least {int(name == 'poses')} is needed")
    known = robot.replace(noise=noise, tolerance=tolerance, zero=zero)
    found: dict[str, Any] = _native.simulate(known, first, n, seed, poses, method, planned, spread)
    return found
