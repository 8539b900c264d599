"""Plans, validations, exports, imports, simulations, workspaces, comparisons."""

from __future__ import annotations

import csv
import io
import json
import operator
from dataclasses import dataclass, field
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _native
from ._arrays import Frozen, check, file_of, finite, lengths, path_of, radians
from ._calibration import _warn, read
from ._pages import Told, in_frame, plain, written
from ._robot import Robot, Samples, samples_of
from ._samples import samples as as_samples
from ._stated import printer as stated_of, several

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike

    from ._types import Array, Noise, PathLike, Progress, Rows, Tolerance


_FIGURES = [
    *(f"parameter_{own}" for own in ("before", "after", "stated", "bound")),
    *(f"{name}_{own}" for name in ("error", "relative") for own in ("before", "after", "stated")),
]


def _json(report: dict[str, Any]) -> str:
    return json.dumps(report, indent=2, ensure_ascii=False) + "\n"


def _whole(name: str, number: Any, least: int, most: int = 2**63 - 1) -> int:
    try:
        own = operator.index(number)
    except TypeError:
        raise TypeError(f"{name}: {number!r}; a whole number is needed") from None
    if not least <= own <= most:
        raise ValueError(f"{name}: {own if own.bit_length() < 65 else 'too large'}; a whole number of {least} to {most:.0e} is needed")
    return own


class _Result(Frozen):
    """Shown as its text, in a notebook as the same."""

    text: str
    report: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """The report of the command's ``--json``."""
        return self.report

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        first = next((line for line in self.text.splitlines() if line.strip()), "")
        return f"<delta_cal.{type(self).__name__}: {first.strip()}>"

    def _repr_html_(self) -> str:
        return plain(self.text)


@dataclass(frozen=True, repr=False)
class Plan(_Result):
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
    def expected_error(self) -> dict[str, Any] | None:
        """The position error expected after them, with the keys of ``Calibration.expected_error``."""
        error: dict[str, Any] | None = self.report.get("expected_error_with_next") or self.report["expected_error"]
        return error

    def write(self, path: PathLike) -> None:
        """Writes what the name of the file says.

        Parameters
        ----------
        path : path
            .csv for the samples file to fill in, .json or .txt for the report: ``path="poses.csv"``.
        """
        written(path, {".csv": lambda: self.csv, ".json": lambda: _json(self.report), ".txt": lambda: self.text})


def plan(
    robot: Robot,
    count: int = 20,
    *,
    samples: Rows | Samples | PathLike | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
    measure: str | None = None,
    frame: Literal["base", "sensor"] = "base",
    within: str | None = None,
    absolute: bool = False,
    order: Literal["random", "shortest"] = "random",
    accuracy: float | None = None,
    seed: int = 1,
    names: str | None = None,
    progress: Progress = False,
) -> Plan:
    """Chooses the measurements after which positions are known best.

    Parameters
    ----------
    robot : Robot
        The robot as known before: ``robot=robot``.
    count : int
        How many, 4 to 500; with ``samples`` 0 to 500 more: ``count=12``.
    samples : optional
        What there is already, measured or only planned, as the ``q`` of ``calibrate``. The plan is what to add of the same
        readings, and its report says what they determine: ``samples={"q": q, "x": x}``.
    measure : str, optional
        ``"xyz"``, the default, or some of its letters, ``"plane"`` (heights), ``"distance"`` (between poses), ``"point"``
        (from fixed points); several with commas, eight of a kind at most: ``measure="xyz,plane=8"``.
    frame : {"base", "sensor"}
        The frame of the coordinates: ``frame="sensor"``.
    within : str, optional
        Only poses in this box (``"x=-100..100,y=-100..100,z=-500..-400"``) or cylinder, mm:
        ``within="r=200,z=-500..-400"``.
    absolute : bool
        Minimise the absolute error, not the relative one: ``absolute=True``.
    order : {"random", "shortest"}
        Random, or a short path of the joints: ``order="shortest"``.
    accuracy : float, optional
        As few measurements as leave this position error, mm rms, in place of ``count``: ``accuracy=0.1``.
    seed : int
        Another seed gives other poses: ``seed=2``.
    names : str, optional
        Names the rows P01, P02, …: ``names="P"``.
    progress : bool or callable
        Shows how far it is, with tqdm if that is installed; or what to call with the exchanges of measurements that are done
        and all that are known to be needed: ``progress=True``.

    Raises
    ------
    Refused
        No such measurements determine the robot, or reach ``accuracy``.
    """
    check(Robot, robot=robot)
    check(str, frame=frame, order=order, optional={"measure": measure, "within": within, "names": names})
    check(bool, absolute=absolute)
    lengths(optional={"accuracy": accuracy})
    count, seed = _whole("count", count, 0), _whole("seed", seed, 0)
    try:
        given = None if samples is None else as_samples(robot, samples, "samples")._own
    except (TypeError, ValueError) as error:
        # The keys of a dict have names of their own.
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"samples: {str(error).removeprefix('samples: ')}") from None
    beside = {"measure": measure, "accuracy": accuracy, "order": None if order == "random" else order}
    for name, own in beside.items():
        if given is not None and own is not None:
            raise ValueError(f"{name}: cannot be combined with samples")
    with Told(progress) as tell:
        return Plan(**_native.plan(robot._own, count, given, measure, frame, within, absolute, order, accuracy, seed, names, tell))


@dataclass(frozen=True, repr=False)
class Validation(_Result):
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

    def __bool__(self) -> bool:
        return self.passed

    def to_html(self) -> str:
        """The certificate, one page to print."""
        return self.html

    def write(self, path: PathLike) -> None:
        """Writes what the name of the file says.

        Parameters
        ----------
        path : path
            .html for the certificate, .json or .txt for the report: ``path="certificate.html"``.
        """
        written(path, {".html": lambda: self.html, ".json": lambda: _json(self.report), ".txt": lambda: self.text})

    def _repr_html_(self) -> str:
        return in_frame(self.html)


def validate(
    robot: Robot,
    q: Rows | Samples | PathLike | Mapping[str, Any] | Sequence[Mapping[str, Any]],
    x: Rows | None = None,
    *,
    height: ArrayLike | None = None,
    plane: str | Sequence[str] | None = None,
    distance: ArrayLike | None = None,
    point: str | Sequence[str] | None = None,
    to: Rows | None = None,
    sigma: ArrayLike | None = None,
    target: str | Sequence[str] | None = None,
    name: Sequence[str] | None = None,
    limit: float,
    frame: Literal["base", "sensor", "stored"] = "base",
) -> Validation:
    """Checks a robot file against poses that its calibration did not use.

    Parameters
    ----------
    robot : Robot
        The calibrated robot: ``robot=result.robot``.
    q, x, height, plane, distance, point, to, sigma, target, name
        As of ``calibrate``.
    limit : float
        The rms position error that passes, mm: ``limit=0.1``.
    frame : {"base", "sensor", "stored"}
        The frame of ``x``, stored for that which the calibration found: ``frame="sensor"``.

    Raises
    ------
    Refused
        Too few poses, or measurements that are wrong as a whole.
    """
    readings = {
        "height": height, "plane": plane, "distance": distance, "point": point,
        "to": to, "sigma": sigma, "target": target, "name": name,
    }
    check(Robot, robot=robot)
    check(str, frame=frame)
    lengths(limit=limit)
    found = Validation(**_native.validate(robot._own, read(robot, q, x, readings)._own, limit, frame))
    _warn(found.warnings)
    return found


@dataclass(frozen=True, repr=False)
class Export(_Result):
    """A robot for another controller."""

    lines: str
    """The lines to paste."""
    text: str
    """The same below a comment that says what is kept and what is lost."""
    kept: float | None
    """The part of the calibration's gain that the controller can hold; 1 is everything."""
    warnings: list[str] = field(compare=False)
    report: dict[str, Any] = field(compare=False)

    def write(self, path: PathLike) -> None:
        """Writes the lines below their comment.

        Parameters
        ----------
        path : path
            Any file: ``path="lines.cfg"``.
        """
        path_of("path", path).write_text(self.text, encoding="utf-8")


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
    robot : Robot
        The calibrated robot: ``robot=result.robot``.
    target : str
        ``"reprapfirmware"``, ``"marlin"``, ``"linuxcnc"``, ``"linuxcnc-component"``, ``"correction-table"``, …; an unknown name
        raises an error that lists all: ``target="klipper"``.
    nominal : Robot, optional
        The robot before its calibration: ``nominal=robot``.
    x : array (n, 3) or frame, optional
        Positions to fit at, mm; otherwise all over the workspace: ``x=x``.
    home : (float, float, float), optional
        The joints at the end stops, radians or mm of travel: ``home=(0.1, 0.1, 0.1)``.
    height : float, optional
        The robot's origin above the controller's z = 0, mm: ``height=600``.
    limit : float, optional
        The largest error between the nodes of a correction table, mm: ``target="correction-table", limit=0.05``.
    """
    check(Robot, robot=robot, optional={"nominal": nominal})
    check(str, target=target)
    check(Real, optional={"height": height})
    lengths(optional={"limit": limit})
    if height is not None and abs(height) > 1e6:
        raise ValueError(f"height: {float(height):g}; a height of up to 1e6 mm is needed")
    joints = None if home is None else several("home", home, "(q1, q2, q3)", 3)
    if joints is not None and robot.drive == "rotary":
        radians("home", np.array(joints))
    places = None if x is None else robot._rows("x", x)
    finite("x", np.empty(0) if places is None else places)
    before = None if nominal is None else nominal._own
    return Export(**_native.export(robot._own, target, before, places, joints, height, limit))


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
    path: PathLike,
    firmware: Literal["klipper", "reprapfirmware", "marlin"] | None = None,
    *,
    rods: float | Sequence[float] | None = None,
    radius: float | None = None,
    rods_sigma: float | None = None,
    radius_sigma: float | None = None,
    printed: Sequence[tuple[float, float]] | None = None,
    shrinkage: float | None = None,
) -> Imported:
    """Reads ``printer.cfg``, ``config.g`` or what M503 prints.

    Parameters
    ----------
    path : path
        The file: ``path="printer.cfg"``.
    firmware : {"klipper", "reprapfirmware", "marlin"}, optional
        Needed if the file does not show it: ``firmware="klipper"``.
    rods, radius : float, optional
        The rods (one or three) and the delta radius as made, mm, in place of those of the configuration: ``rods=345.2``.
    rods_sigma, radius_sigma : float, optional
        Their σ, mm: ``radius=161.5, radius_sigma=0.2``.
    printed : list of (float, float), optional
        Lengths as designed and as printed, mm: ``printed=[(100, 99.8), (150, 149.7)]``.
    shrinkage : float, optional
        The fraction by which prints shrink: ``shrinkage=0.002``.
    """
    check(str, optional={"firmware": firmware})
    printer = {
        "rods": rods, "radius": radius, "rods_sigma": rods_sigma, "radius_sigma": radius_sigma,
        "printed": printed, "shrinkage": shrinkage,
    }
    found = _native.import_(file_of("path", path), firmware, stated_of(printer))
    if found["samples"] is not None:
        name, text = found["samples"]
        found["samples"] = samples_of([(name, text.encode())])
    return Imported(**{**found, "robot": Robot(found["robot"]), "home": tuple(found["home"])})


@dataclass(frozen=True, repr=False)
class Workspace(_Result):
    """Where a robot can be."""

    boundary: Array = field(compare=False)
    """Points of its boundary, array (n, 3), mm."""
    report: dict[str, Any] = field(hash=False)
    text: str


def workspace(robot: Robot, *, tolerance: float = 0.01, spacing: float | None = None) -> Workspace:
    """Computes boundary, volume, cylinders and singularities of the workspace.

    Parameters
    ----------
    robot : Robot
        Any robot: ``robot=robot``.
    tolerance : float
        How exact the boundary's points are, mm: ``tolerance=0.1``.
    spacing : float, optional
        Between lines along which they lie, mm; otherwise a part of the workspace: ``spacing=20``.
    """
    check(Robot, robot=robot)
    lengths(tolerance=tolerance, optional={"spacing": spacing})
    return Workspace(**_native.workspace(robot._own, tolerance, spacing))


@dataclass(frozen=True, repr=False)
class Comparison(_Result):
    """How positions of two robots differ."""

    report: dict[str, Any] = field(hash=False)
    text: str


def compare(before: Robot, after: Robot) -> Comparison:
    """Compares the positions of two robots over the workspace, absolute and relative, with their σ.

    Parameters
    ----------
    before, after : Robot
        With the same drives: ``after=result.robot``.
    """
    check(Robot, before=before, after=after)
    return Comparison(**_native.compare(before._own, after._own))


def simulate(
    robot: Robot,
    *,
    tolerance: Tolerance | None = None,
    zero: float | None = None,
    noise: Noise | None = None,
    seed: int = 1,
    n: int = 1000,
    first: int = 0,
    poses: int = 20,
    method: Literal["joint", "ikm", "fkm"] = "joint",
    planned: bool = False,
    spread: Literal["normal", "uniform"] = "normal",
    progress: Progress = False,
) -> dict[str, Any]:
    """Makes robots within the tolerance, measures and calibrates each.

    Parameters
    ----------
    robot : Robot
        The nominal robot, with a tolerance and noise: ``robot=robot``.
    tolerance, zero, noise : optional
        In place of the robot's own, as of ``Robot.nominal``: ``tolerance=(0.5, 0.003)``.
    seed, n, first : int
        The robots ``first`` to ``first + n`` of a seed. A robot is the same in every range, so ranges on many computers
        join to one campaign: ``seed=7, n=100, first=200``.
    poses : int
        Measured positions of each: ``poses=30``.
    method : {"joint", "ikm", "fkm"}
        The estimator: ``method="ikm"``.
    planned : bool
        Poses of ``plan`` in place of random ones: ``planned=True``.
    spread : {"normal", "uniform"}
        The tolerance as one σ, or as the limits: ``spread="uniform"``.
    progress : bool or callable
        Shows how far it is, with tqdm if that is installed; or what to call with the finished robots and ``n``:
        ``progress=True``.

    Returns
    -------
    dict of arrays (n,)
        ``robot``, ``accepted``, ``status``; in mm, NaN where there is nothing to state: ``error_before``, ``error_after``
        and ``error_stated`` (positions, rms over held-out poses; stated: one σ), the same of ``relative`` (after the
        best rigid motion) and ``parameter`` (with ``parameter_bound``, the Cramér–Rao bound).
    """
    n, first, seed, poses = _whole("n", n, 0), _whole("first", first, 0), _whole("seed", seed, 0), _whole("poses", poses, 1, 10**6)
    check(Robot, robot=robot)
    check(str, method=method, spread=spread)
    check(bool, planned=planned)
    known = robot.replace(noise=noise, tolerance=tolerance, zero=zero)
    with Told(progress) as tell:
        table = _native.simulate(known._own, first, n, seed, poses, method, planned, spread, tell)
    rows = list(csv.DictReader(io.StringIO(table)))
    status = np.array([row["status"] for row in rows], dtype=str)
    found: dict[str, Any] = {"robot": np.array([int(row["robot"]) for row in rows], dtype=np.uint64), "accepted": status == "accepted"}
    for name in _FIGURES:
        found[name] = np.array([float(row[f"{name}_mm"] or "nan") for row in rows])
    return {**found, "status": status}
