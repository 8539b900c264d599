"""The classes Robot and Samples."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _native
from ._arrays import check, file_of, framed, in_units, lengths, path_of, rows
from ._pages import plain
from ._stated import several, shaped, stated

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._types import Array, Noise, PathLike, Rows, Section, Tolerance, Vector


_SYMBOLS = {
    "rotary": ("Dx", "Dy", "Dz", "theta", "alpha", "La_x", "La_y", "Lb"),
    "linear": ("Dx", "Dy", "Dz", "lean_x", "lean_y", "scale", "", "Lb"),
}
_ANY: dict[str, dict[str, Any]] = {
    "rotary": {
        "nominal": {"base_radius_mm": 194, "platform_radius_mm": 30, "upper_arm_mm": 260, "forearm_mm": 480},
        "joints": {"min_deg": -57, "max_deg": 57},
    },
    "linear": {
        "nominal": {"kind": "linear", "tower_radius_mm": 100, "forearm_mm": 200},
        "joints": {"min_mm": -1, "max_mm": 1},
    },
}
"""Robots of which the rest is stated."""


class _ByFingerprint:
    """Equal if fingerprints are."""

    @property
    def fingerprint(self) -> str:
        """SHA-256 of all that the file says, 64 hexadecimal digits."""
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and isinstance(other, _ByFingerprint) and self.fingerprint == other.fingerprint

    def __hash__(self) -> int:
        return hash(self.fingerprint)


@dataclass(frozen=True, eq=False, repr=False)
class Robot(_ByFingerprint):
    """A Delta robot: geometry, joint limits, convention, tolerance, noise.

    Arrays are in millimetres and radians, in the directions and axes of the robot file's ``[convention]``; of a robot
    with linear drives joints are travels in millimetres. Two robots are equal if all that their files say is, whatever
    the names of the files.

    Examples
    --------
    >>> import delta_cal as dc
    >>> robot = dc.Robot.nominal(base_radius=194, platform_radius=30, upper_arm=260, forearm=480, limits=(-1.05, 1.57))
    >>> robot.forward([[0.1, 0.2, 0.3]]).round(1).tolist()
    [[19.3, 11.5, -285.8]]
    """

    _own: _native.Robot

    @staticmethod
    def nominal(
        *,
        base_radius: float,
        platform_radius: float,
        upper_arm: float,
        forearm: float,
        limits: ArrayLike,
        tolerance: Tolerance | None = None,
        zero: float | None = None,
        noise: Noise | None = None,
        **sections: Section,
    ) -> Robot:
        """A robot of a data sheet: three equal arms, 120° apart, arm 1 along +x.

        Parameters
        ----------
        base_radius, platform_radius, upper_arm, forearm : float
            Base centre to motor axes, platform centre to forearm ends, and the two links, mm: ``upper_arm=260``.
        limits : (float, float)
            Smallest and largest joint angle, radians; positive angles swing the arm towards the platform:
            ``limits=(-1.05, 1.57)``.
        tolerance : (float, float) or dict, optional
            One σ of the lengths (mm) and angles (radians) of the parts as made, the prior; a dict as of ``sections`` also of
            single parameters: ``tolerance={"length_mm": 0.5, "angle_deg": 0.2, "lb_mm": 0.02}``.
        zero : float, optional
            One σ of the joint zeros, radians: ``tolerance=(0.5, 0.003), zero=0.1``.
        noise : (float, float), optional
            One σ of a measured coordinate (mm, or three) and of a joint angle (radians), the weights: ``noise=((0.01, 0.01,
            0.03), 3e-5)``.
        **sections : dict
            Sections of the robot file with its keys and units; a key that is None is removed: ``target={"x_mm": 0, "y_mm": 0, "z_mm": -40}``.

        Raises
        ------
        ValueError
            Lengths or limits that are impossible; the message begins with the argument.
        """
        lengths(base_radius=base_radius, platform_radius=platform_radius, upper_arm=upper_arm, forearm=forearm)
        _needed(limits=limits)
        sheet = {"base_radius_mm": base_radius, "platform_radius_mm": platform_radius, "upper_arm_mm": upper_arm, "forearm_mm": forearm}
        own = _of_sections({**_ANY["rotary"], "nominal": sheet}, "base_radius, platform_radius, upper_arm, forearm")
        more: dict[str, Any] = {**sections}
        return own.replace(limits=limits, tolerance=tolerance, zero=zero, noise=noise, **more)

    @staticmethod
    def from_parameters(
        parameters: ArrayLike,
        *,
        limits: ArrayLike,
        transmissions: ArrayLike | None = None,
        drive: Literal["rotary", "linear"] = "rotary",
        tolerance: Tolerance | None = None,
        zero: float | None = None,
        noise: Noise | None = None,
        **sections: Section,
    ) -> Robot:
        """A robot of its parameters.

        Parameters
        ----------
        parameters : array (3, 8)
            A row an arm: Dx, Dy, Dz (mm), theta, alpha (radians), La_x, La_y, Lb (mm); of linear drives Dx, Dy, Dz (mm),
            lean_x, lean_y (radians), scale, 0, Lb (mm): ``parameters=robot.parameters``.
        limits : (float, float)
            Smallest and largest joint, radians, or mm of travel: ``limits=robot.limits``.
        transmissions : array (3, 5), optional
            A row an arm: gain, then cos, sin, cos2, sin2 (radians); otherwise joints are exact:
            ``transmissions=np.zeros((3, 5))``.
        drive : {"rotary", "linear"}
            What moves the elbows: ``drive="rotary"``.
        tolerance, zero, noise, sections
            As of ``nominal``: ``tolerance=(0.5, 0.003)``.
        """
        _needed(parameters=parameters, limits=limits)
        check(str, drive=drive)
        if drive not in ("rotary", "linear"):
            raise ValueError('drive: "rotary" or "linear" is needed')
        arms = np.array(shaped("parameters", parameters, (3, 8)))
        # Upper arms of 1 mm are the scales of linear drives.
        if drive == "rotary" and not arms[:, 6].any() and (np.abs(arms[:, 5] - 1) < 0.5).all():
            raise ValueError('parameters: these are the parameters of linear drives; drive="linear" is needed')
        for arm in np.flatnonzero(arms[:, 6]) if drive == "linear" else ():
            raise ValueError(f"parameters: [{arm}, 6] is not 0; linear drives have seven parameters")
        own = _of_sections(_ANY[drive], "drive")
        more: dict[str, Any] = {"platform": None, **sections}
        return own.replace(
            parameters=parameters, limits=limits, transmissions=transmissions, tolerance=tolerance, zero=zero, noise=noise, **more
        )

    @staticmethod
    def read(path: PathLike) -> Robot:
        """Reads a robot file, with its convention, tolerance, noise and instruments.

        Parameters
        ----------
        path : path
            The file: ``path="robot.toml"``.

        Raises
        ------
        OSError
            The file cannot be read.
        ValueError
            The first fault of the file, with its line and what to do.
        """
        return Robot(_native.Robot.of_bytes(*file_of("path", path)))

    @staticmethod
    def from_toml(text: str, *, name: str = "robot") -> Robot:
        """A robot of the text of a robot file.

        Parameters
        ----------
        text : str
            The file's text: ``text=robot.to_toml()``.
        name : str
            What messages call it: ``text=robot.to_toml(), name="robot"``.

        Raises
        ------
        ValueError
            Its first fault, with its line and what to do.
        """
        check(str, text=text, name=name)
        return Robot(_native.Robot.of_bytes(name, text.encode()))

    def write(self, path: PathLike) -> None:
        """Writes the robot file, which ``delta-cal`` reads as well.

        Parameters
        ----------
        path : path
            The file: ``path="calibrated.toml"``.
        """
        path_of("path", path).write_bytes(self.to_toml().encode())

    def to_toml(self) -> str:
        """The robot file: TOML."""
        return self._own.text()[1]

    def to_dict(self) -> dict[str, Any]:
        """The sections of the robot file."""
        found: dict[str, Any] = json.loads(self._own.json())
        return found

    def replace(
        self,
        *,
        parameters: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        transmissions: ArrayLike | None = None,
        tolerance: Tolerance | None = None,
        zero: float | None = None,
        noise: Noise | None = None,
        **sections: Section | None,
    ) -> Robot:
        """The same robot with something else; None keeps what it has.

        Parameters
        ----------
        parameters, limits, transmissions
            As of ``from_parameters``.
        tolerance, zero, noise, sections
            As of ``nominal``; ``convention`` counts the same robot in another way: ``convention={"z_axis": "down"}``.
        """
        of_arms = [None if own is None else shaped(name, own, shape)
                   for name, own, shape in (("parameters", parameters, (3, 8)), ("transmissions", transmissions, (3, 5)))]
        given = {"limits": limits, "tolerance": tolerance, "zero": zero, "noise": noise}
        used = {name: own for name, own in given.items() if own is not None}
        own = self
        if "convention" in sections:
            counted = own._with({"convention": sections.pop("convention")})
            own = Robot(own._own.counted_as(counted._own))
        own = Robot(own._own.with_arms(*of_arms))
        return own._with({**used, **sections}) if used or sections else own

    def _with(self, given: dict[str, Any]) -> Robot:
        return _of_sections(_merged(self.to_dict(), stated(given, self)), ", ".join(given), self.name)

    def forward(
        self, q: Rows, *, target: str | Vector | None = None, errors: Literal["nan", "raise"] = "nan"
    ) -> Array:
        """Positions of the platform point, or of a target.

        Parameters
        ----------
        q : array (…, 3), or a frame with the columns of a samples file
            Joint angles, radians: ``q=[0.1, 0.2, 0.3]``.
        target : str or (3,), optional
            A target of the robot file, "tool", or a point of the platform, mm: ``target=(0, 0, -40)``.
        errors : {"nan", "raise"}
            How to treat a row without a pose, out of reach, at a singularity, more than 1° outside the limits:
            ``errors="raise"``.

        Returns
        -------
        array (…, 3)
            mm, float32 if ``q`` is. From 64 rows on they are computed several at once, float32 in 32 bits, and agree with
            those of single rows to 1e-12, float32 to 1e-6, near singularities to 1e-4.
        """
        return self._own.forward(self._typed("q", q), _target(target), _raised(errors))

    def inverse(
        self, x: Rows, *, target: str | Vector | None = None, errors: Literal["nan", "raise"] = "nan"
    ) -> Array:
        """Joint angles, elbows out.

        Parameters
        ----------
        x : array (…, 3), or a frame with the columns of a samples file
            Positions of the platform point, or of the target, mm: ``x=[26.2, 14.9, -412.4]``.
        target
            As of ``forward``.
        errors : {"nan", "raise"}
            How to treat a row that no joint angles within the limits reach: ``errors="raise"``.

        Returns
        -------
        array (…, 3)
            Radians.
        """
        return self._own.inverse(self._typed("x", x), _target(target), _raised(errors))

    def jacobian(self, q: Rows, *, errors: Literal["nan", "raise"] = "nan") -> Array:
        """∂x/∂q.

        Parameters
        ----------
        q, errors
            As of ``forward``; NaN also at singularities.

        Returns
        -------
        array (…, 3, 3)
            mm a radian: [..., i, j] is how x_i moves with q_j.
        """
        return self._own.jacobian(self._typed("q", q), _raised(errors))

    def parameter_jacobian(
        self, q: Rows, *, transmissions: bool = False, errors: Literal["nan", "raise"] = "nan"
    ) -> Array:
        """∂x/∂p of the 24 parameters, arm by arm in the order of ``parameters``.

        Parameters
        ----------
        q, errors
            As of ``forward``; NaN also at singularities.
        transmissions : bool
            The 15 numbers of ``transmissions`` below them: ``transmissions=True``.

        Returns
        -------
        array (…, 3, 24) or (…, 3, 39)
            Without a unit, or mm a radian.
        """
        check(bool, transmissions=transmissions)
        return self._own.parameter_jacobian(self._typed("q", q), transmissions, None, _raised(errors))

    def _typed(self, argument: str, given: Any) -> NDArray[Any]:
        """Rows of three numbers in the type of the array."""
        single = isinstance(given, np.ndarray) and given.dtype == np.float32
        return rows(argument, given, "float32") if single else self._rows(argument, given)

    def _rows(self, argument: str, given: Any) -> Array:
        """Rows of three numbers of an array or a frame: of ``x`` positions, of all else joints."""
        frame = framed(given)
        if frame is None:
            return rows(argument, given)
        return in_units(argument, frame, self._own.columns(argument, [str(name) for name in frame.columns]))

    @property
    def parameters(self) -> Array:
        """The 24 parameters: array (3, 8), a row an arm. Dx, Dy, Dz (mm), theta, alpha (radians), La_x, La_y, Lb (mm); of
        linear drives Dx, Dy, Dz (mm), lean_x, lean_y (radians), scale, 0, Lb (mm)."""
        return self._own.parameters()

    @property
    def transmissions(self) -> Array:
        """The errors of the joints: array (3, 5), a row an arm. The arm's angle is q + gain q + cos cos q + sin sin q +
        cos2 cos 2q + sin2 sin 2q, radians."""
        return self._own.transmissions()

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest joint, radians (mm of travel), in the controller's direction."""
        low, high = self._own.stated()["limits"]
        return low, high

    @property
    def tolerance(self) -> tuple[float, float] | None:
        """One σ of lengths (mm) and angles (radians) as made, or None; of single parameters ``to_dict()["tolerance"]``."""
        own: tuple[float, float] | None = self._own.stated()["tolerance"]
        return own

    @property
    def zero(self) -> float | None:
        """One σ of the joint zeros, radians, or None."""
        own: float | None = self._own.stated()["zero"]
        return own

    @property
    def noise(self) -> tuple[float | tuple[float, float, float], float] | None:
        """One σ of a measured coordinate (mm, or of each axis where they differ) and of a joint (radians), or None."""
        own = self._own.stated()["noise"]
        if own is None:
            return None
        (x, y, z), joint = own
        return (x if x == y == z else (x, y, z)), joint

    @property
    def name(self) -> str:
        """The name of its file."""
        return self._own.name()

    @property
    def drive(self) -> Literal["rotary", "linear"]:
        """"rotary" or "linear"."""
        own: Literal["rotary", "linear"] = self._own.stated()["drive"]
        return own

    @property
    def fingerprint(self) -> str:
        """SHA-256 of all that the file says, 64 hexadecimal digits."""
        return self._own.fingerprint()

    def __reduce__(self) -> tuple[Any, ...]:
        name, text = self._own.text()
        return _robot_of, (name, text.encode())

    def __repr__(self) -> str:
        low, high = self.limits
        unit = "rad" if self.drive == "rotary" else "mm"
        arm = f"forearm {self.parameters[0, 7]:.1f} mm, joints {low:.3f} to {high:.3f} {unit}"
        return f"<delta_cal.Robot {self.name}: {self.drive}, {arm}>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{symbol}</th>" for symbol in ("", *_SYMBOLS[self.drive]))
        rows_of = (
            f"<tr><th>arm {arm}</th>" + "".join(f"<td>{value:.4f}</td>" for value in row) + "</tr>"
            for arm, row in enumerate(self.parameters, 1)
        )
        return f"{plain(repr(self))}<table><tr>{head}</tr>{''.join(rows_of)}</table>"


def _robot_of(name: str, text: bytes) -> Robot:
    return Robot(_native.Robot.of_bytes(name, text))


def _of_sections(sections: dict[str, Any], arguments: str, name: str = "robot") -> Robot:
    return Robot(_native.Robot.of_json(name, json.dumps(sections, default=float), arguments))


def _merged(own: Any, more: Any) -> Any:
    """Keys of ``more`` replace those of ``own``; None removes one."""
    if not (isinstance(own, dict) and isinstance(more, dict)):
        return more
    kept = {key: value for key, value in own.items() if key not in more}
    return {**kept, **{key: _merged(own.get(key, {}), value) for key, value in more.items() if value is not None}}


def _needed(**given: Any) -> None:
    for name, own in given.items():
        if own is None:
            raise TypeError(f"{name}: None; numbers are needed")


def _raised(errors: Any) -> bool:
    check(str, errors=errors)
    if errors not in ("nan", "raise"):
        raise ValueError('errors: "nan" or "raise" is needed')
    return bool(errors == "raise")


def _target(given: Any) -> Any:
    if given is None:
        return None
    if isinstance(given, str):
        check(str, target=given)
        return given
    return several("target", given, "a name or (x, y, z) in mm", 3)


@dataclass(frozen=True, eq=False, repr=False)
class Samples(_ByFingerprint):
    """Joint angles and what was measured there: positions, single coordinates, heights, distances, in any mixture.

    Read by ``read_samples``; its columns are explained with a robot when it is used.
    """

    _own: _native.Samples
    _source: tuple[list[tuple[str, bytes]], str | None] = ([], None)
    """Names and bytes of the files, and what their columns hold."""

    def arrays(self, robot: Robot) -> dict[str, NDArray[Any]]:
        """What the rows hold.

        Parameters
        ----------
        robot : Robot
            Its convention is that of the rows: ``robot=robot``.

        Returns
        -------
        dict of arrays
            ``q`` (n, 3) radians; ``x`` (n, 3), ``height`` (n,) and ``distance`` (n,) mm, NaN where nothing was read; ``line``
            (n,) of the file, or the index of the row of arrays.
        """
        check(Robot, robot=robot)
        return self._own.arrays(robot._own)

    @property
    def name(self) -> str:
        """The name of the file."""
        return self._own.text()[0]

    @property
    def text(self) -> str:
        """The text of the file."""
        return self._own.text()[1]

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the contents, 64 hexadecimal digits."""
        return self._own.fingerprint()

    def __reduce__(self) -> tuple[Any, ...]:
        return samples_of, self._source

    def __repr__(self) -> str:
        return f"<delta_cal.Samples {self.name}, {len(self.text.splitlines())} lines>"


def samples_of(parts: list[tuple[str, bytes]], columns: str | None = None) -> Samples:
    """Of the names and bytes of files."""
    return Samples(_native.Samples.of_bytes(parts, columns), (parts, columns))


def read_samples(path: PathLike, positions: PathLike | None = None, *, columns: str | None = None) -> Samples:
    """Reads a samples file: CSV in any encoding, units by the names of the columns.

    Parameters
    ----------
    path : path
        Joint angles and what was measured there; or joint angles alone: ``path="samples.csv"``.
    positions : path, optional
        What was measured, if the first file has the joint angles alone: ``positions="positions.csv"``.
    columns : str, optional
        What columns hold whose names do not say it: ``columns="q1_deg=A1,x_mm=Pos X"``.

    Raises
    ------
    OSError
        A file cannot be read.
    ValueError
        A file that is no text. Faults of its rows are raised where it is used.
    """
    check(str, optional={"columns": columns})
    files = [("path", path), *([] if positions is None else [("positions", positions)])]
    return samples_of([file_of(name, own) for name, own in files], columns)


for _own in (Robot, Samples, read_samples):
    # As they are imported.
    _own.__module__ = "delta_cal"
