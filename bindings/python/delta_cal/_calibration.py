"""Calibrations."""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from . import _native
from ._arrays import Frozen, check, file_of, framed, lengths
from ._errors import words
from ._pages import Texts, Told, in_frame, written
from ._robot import Robot, Samples
from ._samples import samples
from ._stated import printer as stated_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import ArrayLike

    from ._native import Report
    from ._types import Array, Noise, PathLike, Rows, Tolerance, Waiting


class CalibrationWarning(UserWarning):
    """A finding because of which a result may mislead."""


class Unknown(NamedTuple):
    """What was estimated: a row and a column of ``Calibration.covariance``."""

    name: str
    """``arm1.Dx``, ``arm1.gain``, ``frame.x``, ``plane.NAME.z``, ``point.NAME.x``, ``target.x`` or ``target.NAME.x``,
    ``scale``, …"""
    unit: str
    """``mm``, ``rad``, or empty of a ratio."""
    value: float
    """The estimate; NaN of ``frame.turn_x``, …, small turns about the sensor's axes."""


@dataclass(frozen=True, repr=False)
class Calibration(Frozen):
    """A calibrated robot with its uncertainty, residuals and findings; ``print`` shows its tables, a notebook its page.

    Two calibrations are equal if robot file, samples and options are. All arrays are for reading.
    """

    fingerprint: str
    """SHA-256 of robot file, samples and options, 64 hexadecimal digits."""
    robot: Robot = field(compare=False)
    """The calibrated robot, with all else that its file said."""
    before: Robot = field(compare=False)
    """The robot as it was."""
    parameters: Array = field(compare=False)
    """The 24 parameters, array (3, 8): mm and radians, as ``Robot.parameters``."""
    sigma: Array = field(compare=False)
    """Their standard uncertainties, array (3, 8)."""
    covariance: Array = field(compare=False)
    """The covariance of everything that was estimated, array (u, u), as ``unknowns`` lists it: the 24 parameters, arm by
    arm, the 15 numbers of the transmissions if they were to be found, then frame, planes, points, targets, scale."""
    unknowns: list[Unknown] = field(compare=False)
    """Names and units of its rows and columns."""
    residuals: Array = field(compare=False)
    """Readings less what the calibrated robot gives, mm, a row a sample: array (n, 3) of x, y, z, with heights or
    distances among the readings (n, 5). NaN where nothing was read."""
    lines: Array = field(compare=False)
    """The indices of the rows of ``residuals`` in the arrays, of a file its lines, array (n,). Rows equal to an earlier
    one are left out."""
    expected_error: dict[str, Any] | None = field(compare=False)
    """The position error that the calibrated robot is expected to have (σ), mm; None if it cannot be estimated. Keys:
    ``absolute_rms_mm``, ``absolute_worst_mm``, ``absolute_worst_at_mm``, and the same of ``relative``."""
    findings: list[dict[str, Any]] = field(compare=False)
    """Everything that was found, the gravest first: ``level`` ("warning" or "note"), ``text``, ``kind`` and figures."""
    frame: Array | None = field(compare=False)
    """From the robot's frame to the sensor's, array (4, 4): X_sensor = T X_robot, mm; None with ``frame="base"``."""
    method: Literal["joint", "ikm", "fkm"] = field(compare=False)
    """The estimator."""
    report: Report | Texts = field(compare=False)
    printer: dict[str, Any] | None = field(default=None, compare=False)
    """Of a printer's configuration: ``lines`` to paste, ``before`` and ``after`` (errors of the bed), ``next`` (what to
    measure), ``changes``, ``notes``, …, with the keys of docs/json.md."""

    @property
    def transmissions(self) -> Array | None:
        """The errors of the joints as found, array (3, 5), as ``Robot.transmissions``; None if they were exact."""
        found = self._of("arm1.gain") is not None
        return self.robot.transmissions if found else None

    @property
    def targets(self) -> dict[str, Array]:
        """Where each target is as found, array (3,) mm from the platform point, by name; the only one is ``"target"``."""
        places: dict[str, list[float]] = {}
        for own in self.unknowns:
            if own.name.startswith("target."):
                places.setdefault(own.name[len("target.") : -len(".x")] or "target", []).append(own.value)
        return {name: np.array(place) for name, place in places.items()}

    @property
    def scale(self) -> float | None:
        """Relative excess of the instrument's lengths; None if nothing was read that has it."""
        place = self._of("scale")
        return None if place is None else self.unknowns[place].value

    def _of(self, name: str) -> int | None:
        return next((place for place, own in enumerate(self.unknowns) if own.name == name), None)

    def position_covariance(self, q: Rows, target: str | None = None) -> Array:
        """The covariance of positions of the calibrated robot in the frame of its base, mm².

        Parameters
        ----------
        q : array (…, 3), or a frame
            Joint angles, radians: ``q=plan.q``.
        target : str, optional
            That of a target (``"target"`` if it has no name) in place of the platform point: ``target="left"``.

        Returns
        -------
        array (…, 3, 3)
            NaN as of ``Robot.parameter_jacobian``. Its diagonal is the square of σ in x, y and z.
        """
        check(str, optional={"target": target})
        rods = self._of("arm1.rod_difference")
        x, y, z = self.targets.get(target or "", np.zeros(3))
        own = self.robot._own.parameter_jacobian(self.robot._typed("q", q), True, None if rods is None else (x, y, z), False)
        columns = [*range(39 if self._of("arm1.gain") is not None else 24)]
        places = columns + ([] if rods is None else [*range(rods, rods + 12)])
        by = own[..., columns + ([] if rods is None else [*range(39, 51)])]
        found = by @ self.covariance[np.ix_(places, places)] @ np.swapaxes(by, -1, -2)
        if target is None:
            return np.asarray(found)
        first = self._of("target.x" if target == "target" else f"target.{target}.x")
        if first is None:
            stated = {own["name"] for own in self.to_dict()["targets"]}
            if target in stated:
                return np.asarray(found)
            raise ValueError(f"target: {target!r} is none of {sorted(stated)}")
        place = slice(first, first + 3)
        beside = by @ self.covariance[places, place]
        return np.asarray(found + beside + np.swapaxes(beside, -1, -2) + self.covariance[place, place])

    def to_dict(self) -> dict[str, Any]:
        """The report of ``delta-cal calibrate --json``: angles in degrees, keys as docs/json.md has them."""
        found: dict[str, Any] = json.loads(self.report.json())
        return found

    def to_html(self) -> str:
        """The report as one HTML page."""
        return self.report.html()

    def write(self, path: PathLike) -> None:
        """Writes the report, or what the name of the file says.

        Parameters
        ----------
        path : path
            .html, .json or .txt; .toml for the robot, .cfg for the lines to paste into a printer's configuration:
            ``path="report.html"``.
        """
        texts = {".html": self.report.html, ".json": self.report.json, ".txt": self.report.text, ".toml": self.robot.to_toml}
        if self.printer is not None:
            lines = self.printer["lines"]
            texts[".cfg"] = lambda: lines or ""
        written(path, texts)

    def plot(self) -> Any:
        """Draws parameters, residuals and where positions are known worst, with matplotlib.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from . import _plot

        return _plot.calibration(self)

    def __getstate__(self) -> dict[str, Any]:
        # The report without the solution behind it.
        report = self.report
        return {**self.__dict__, "report": Texts(report.text(), report.json(), report.html())}

    def __str__(self) -> str:
        return self.report.text()

    def __repr__(self) -> str:
        error = self.expected_error
        known = "unknown" if error is None else f"{error['relative_rms_mm']:.3g} mm relative, {error['absolute_rms_mm']:.3g} mm absolute"
        return f"<delta_cal.Calibration of {self.before.name}: {len(self.lines)} samples, {self.method}, expected error {known}>"

    def _repr_html_(self) -> str:
        return in_frame(self.to_html())


def read(robot: Robot, q: Any, x: Any, others: Mapping[str, Any]) -> Samples:
    """Samples of a frame or a file alone, or of arrays by their names."""
    given = {name: own for name, own in {"x": x, **others}.items() if own is not None}
    several = isinstance(q, (list, tuple)) and any(isinstance(own, dict) for own in q)
    alone = several or isinstance(q, (str, os.PathLike, Samples, dict))
    if not given and (alone or framed(q) is not None):
        return samples(robot, q, "q")
    if alone:
        raise TypeError(f"q: {type(q).__name__} holds the readings already, and {next(iter(given))} is given")
    if not given:
        raise ValueError("x: positions or other readings are needed beside joint angles")
    return samples(robot, {"q": q, **given})


def _transform(frame: dict[str, Any] | None) -> Array | None:
    if frame is None:
        return None
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = frame["rotation"], frame["translation_mm"]
    found.setflags(write=False)
    return found


def _warn(findings: Iterable[str]) -> None:
    for text in findings:
        warnings.warn(text, CalibrationWarning, stacklevel=3)


def calibrate(
    robot: Robot | PathLike,
    q: Rows | Samples | PathLike | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
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
    noise: Noise | None = None,
    noise_height: float | None = None,
    noise_distance: float | None = None,
    tolerance: Tolerance | None = None,
    zero: float | None = None,
    frame: Literal["base", "sensor"] = "base",
    method: Literal["joint", "ikm", "fkm"] | None = None,
    robust: bool = False,
    limit: float | None = None,
    progress: Waiting = False,
    **printer: Any,
) -> Calibration:
    """Calibrates a robot, or a printer from its configuration.

    Parameters
    ----------
    robot : Robot, or path
        The robot before calibration, or its file. State tolerance and noise for a better result and a reliable σ. Or a
        printer's configuration, with the heights that it holds and those of the files ``q`` and ``x``:
        ``robot="robot.toml", q="samples.csv"``.
    q : array (n, 3), Samples, a samples file, a frame with its columns, a dict of arrays, or several dicts
        Joint angles, radians (mm of travel). All but the array hold the readings as well; the keys of a dict are the
        names of the arguments down to ``name``: ``q=[{"q": q, "x": x}, {"q": q, "height": gauge, "plane": "table"}]``.
    x : array (n, 3) or frame, optional
        Measured positions, mm, a row for each of ``q``. NaN and masked are not measured: ``x=tracker``.
    height, plane : array (n,), name or names (n,), optional
        Heights above a plane, mm: ``height=gauge, plane="table"``.
    distance, point, to : array (n,), name or names (n,), array (n, 3), optional
        Distances, mm, from a fixed point, or from the pose of the joint angles ``to``: ``distance=bar, point="socket"``.
    sigma : float, array (n,), (n, 3) or (n, 3, 3), optional
        In place of ``noise``, σ of each row's readings, mm; or of each of its coordinates; or their covariance, mm²:
        ``sigma=0.02``.
    target : name or names (n,), optional
        The target that each row measured: ``target=["left", "right"] * 20``.
    name : names (n,), optional
        Of the rows, for the report: ``name=[f"P{row}" for row in range(40)]``.
    noise, tolerance, zero : optional
        In place of the robot's own, as of ``Robot.nominal``: ``tolerance=(0.5, 0.003)``.
    noise_height, noise_distance : float, optional
        σ of heights and of distances, mm, in place of the robot's own: ``noise_height=0.02``.
    frame : {"base", "sensor"}
        The frame of ``x``; the sensor's may stand anywhere and is found with the parameters: ``frame="sensor"``.
    method : {"joint", "ikm", "fkm"}, optional
        Joint for complete positions in the robot's frame, otherwise fkm: ``method="ikm"``.
    robust : bool
        Leave out and name samples that disagree (Tukey's loss): ``robust=True``.
    limit : float, optional
        Largest expanded uncertainty, mm rms; the report says whether it is met: ``limit=0.1``.
    progress : bool or callable
        Shows the time, with tqdm if that is installed; or what to call with the seconds: ``progress=print``.
    **printer : optional
        Of a configuration, as of ``import_``: ``robot="printer.cfg", shrinkage=0.002``.

    Raises
    ------
    Refused
        The samples cannot calibrate this robot; ``findings`` says why and what to do.
    ValueError, TypeError
        An argument that cannot be used; the message begins with its name. Rows are counted from 0.
    OSError
        A file that cannot be read.

    Warns
    -----
    CalibrationWarning
        For each finding of the level "warning".
    """
    readings = {
        "height": height, "plane": plane, "distance": distance, "point": point,
        "to": to, "sigma": sigma, "target": target, "name": name,
    }
    check(str, frame=frame, optional={"method": method})
    lengths(optional={"limit": limit, "noise_height": noise_height, "noise_distance": noise_distance})
    check(bool, robust=robust)
    if not isinstance(robot, (Robot, str, os.PathLike)):
        raise TypeError(f"robot: {type(robot).__name__}; a Robot or a path is needed")
    if not isinstance(robot, Robot) and Path(robot).suffix == ".toml":
        robot = Robot.read(robot)
    if isinstance(robot, Robot):
        for own in printer:
            raise TypeError(f"{own}: is no argument of a robot's calibration")
        if q is None:
            raise ValueError("q: joint angles or samples are needed")
        robot = robot.replace(noise=noise, tolerance=tolerance, zero=zero)
        for reading, noise_of in (("height", noise_height), ("distance", noise_distance)):
            if noise_of is not None:
                robot = robot.replace(noise={f"{reading}_mm": noise_of})
        begin: Any = robot._own, read(robot, q, x, readings)._own
    else:
        configuration = file_of("robot", robot)
        more = {"noise": noise, "noise_height": noise_height, "noise_distance": noise_distance, "tolerance": tolerance, "zero": zero,
                "frame": None if frame == "base" else frame}
        for own, value in {**readings, **more}.items():
            if value is not None:
                raise TypeError(f"{own}: is not for a printer's configuration")
        parts = {name: own for name, own in (("q", q), ("x", x)) if own is not None}
        for own, file in parts.items():
            if not isinstance(file, (str, os.PathLike)):
                raise TypeError(f"{own}: beside {robot}, which is no robot file (.toml), files with readings of a printer are needed")
        begin = configuration, [file_of(own, file) for own, file in parts.items()], stated_of(printer)
    with Told(progress, timed=True) as tell:
        found = _native.calibrate(begin, frame, method, robust, limit, tell)
    options = (frame, method, robust, limit, sorted(printer.items()))
    found["fingerprint"] = hashlib.sha256(f"{found['fingerprint']}{options}".encode()).hexdigest()
    found.update(json.loads(found.pop("json")))
    for own in found["findings"]:
        own["text"] = words(own["text"], found["report"].in_arrays())
    found["robot"] = Robot(found["robot"])
    found["parameters"] = found["robot"].parameters
    found["sigma"] = np.sqrt(np.diag(found["covariance"]))[:24].reshape(3, 8)
    found["sigma"].setflags(write=False)
    found["before"] = robot if isinstance(robot, Robot) else Robot(found["before"])
    found["frame"] = _transform(found["frame"])
    found["unknowns"] = [Unknown(*own) for own in found["unknowns"]]
    _warn(own["text"] for own in found["findings"] if own["level"] == "warning")
    return Calibration(**found)
