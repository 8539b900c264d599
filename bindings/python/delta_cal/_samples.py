"""Readings to the columns of a samples file."""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arrays import array_of, file_of, framed, missing, numbers, radians, unicode
from ._robot import Robot, Samples, samples_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from ._types import Array


_NAMED = 5
"""Rows that a message names."""
_NUMBERS = {"height": "height_mm", "distance": "distance_mm", "sigma": "sigma_mm"}
_OF = {"plane": "height", "point": "distance", "to": "distance"}
_WORDS = ("plane", "point", "target", "name")
_READ = ("x_mm", "y_mm", "z_mm", "height_mm", "distance_mm")


def samples(robot: Robot, given: Any, argument: str = "samples") -> Samples:
    """Samples or their file, a frame of all columns, or arrays by the names of the arguments, in any mixture."""
    if isinstance(given, Samples):
        return given
    if isinstance(given, (str, os.PathLike)):
        return samples_of([file_of(argument, given)])
    frame = framed(given)
    if frame is not None:
        if len(frame) == 0:
            raise ValueError(f"{argument}: no rows")
        twice = [str(name) for name, count in Counter(frame.columns).items() if count > 1]
        if twice:
            raise ValueError(f"{argument}: column {twice[0]}: another one has the same name")
        columns = {str(name): _column(f"{argument}: column {name}", frame[name].to_numpy(), len(frame)) for name in frame.columns}
        return Samples(_native.samples_of_columns(robot._own, "samples", list(columns.items()), None))
    all_given = [given] if isinstance(given, Mapping) else given
    if not isinstance(all_given, (list, tuple)) or not all(isinstance(own, Mapping) for own in all_given):
        raise TypeError(f"{argument}: {type(given).__name__}; a file, a frame or a dict of arrays is needed")
    if not all_given:
        raise ValueError(f"{argument}: no rows")
    parts = [_table(robot, own) for own in all_given]
    counts = [len(own) for _, own in parts]
    names = dict.fromkeys(name for own, _ in parts for name in own)
    joined = {name: _joined([own.get(name) for own, _ in parts], counts) for name in names}
    stated = dict.fromkeys(name for own in all_given for name, value in own.items() if value is not None)
    shapes = np.concatenate([own for _, own in parts])
    return Samples(_native.samples_of_columns(robot._own, ", ".join(stated), list(joined.items()), shapes))


def _joined(parts: Sequence[Any], counts: Sequence[int]) -> Any:
    if any(isinstance(own, list) for own in parts):
        return [word for own, count in zip(parts, counts) for word in own or [""] * count]
    return np.concatenate([np.full(count, np.nan) if own is None else own for own, count in zip(parts, counts)])


def _table(robot: Robot, given: Mapping[str, Any]) -> tuple[dict[str, Any], Array]:
    """The columns of arrays by the names of their arguments, and the shapes of their covariances, NaN without."""
    for name in given:
        if name not in ("q", "x", "to", *_NUMBERS, *_WORDS):
            raise TypeError(f"{name}: no such reading")
    own = {name: value for name, value in given.items() if value is not None}
    if "q" not in own:
        raise ValueError("q: joint angles are needed")
    for name, reading in _OF.items():
        if name in own and reading not in own:
            raise ValueError(f"{name}: is given without {reading}")
    if "distance" in own and "point" not in own and "to" not in own:
        raise ValueError("distance: needs point or to, from where it is measured")
    joint = ("q{}_rad" if robot.drive == "rotary" else "s{}_mm").format
    q = _vectors(robot, "q", own["q"])
    count = len(q)
    if count == 0:
        raise ValueError("q: no rows")
    columns: dict[str, Any] = {joint(place + 1): q[:, place] for place in range(3)}
    for argument, names in (("x", "{}_mm".format), ("to", lambda axis: "to_" + joint("xyz".index(axis) + 1))):
        if argument in own:
            found = _vectors(robot, argument, own[argument])
            _check_count(argument, len(found), count)
            columns.update((names(axis), found[:, place]) for place, axis in enumerate("xyz"))
    shapes = np.full((count, 3, 3), np.nan)
    for argument, column in _NUMBERS.items():
        if argument == "sigma" and argument in own and numbers(argument, own[argument]).ndim > 1:
            positions = np.stack([columns.get(name, np.full(count, np.nan)) for name in _READ[:3]], axis=-1)
            columns[column], shapes = _covariances(own[argument], np.isnan(positions))
        elif argument in own:
            columns[column] = _numbers(argument, own[argument], count)
    for row in np.flatnonzero(columns.get("sigma_mm", np.ones(0)) <= 0):
        raise ValueError(f"sigma: row {row}: {columns['sigma_mm'][row]}; an uncertainty above 0 mm is needed")
    columns.update((argument, _words(argument, own[argument], count)) for argument in _WORDS if argument in own)
    # What was not measured has no plane, no point and no second pose.
    for argument, reading in _OF.items():
        for row in np.flatnonzero(np.isnan(columns[_NUMBERS[reading]])) if argument in own else ():
            for column in [name for name in columns if name.startswith("to_")] if argument == "to" else [argument]:
                columns[column][row] = np.nan if argument == "to" else ""
    # Rows without a joint or without any reading are not used.
    read = [columns[name] for name in _READ if name in columns]
    used = ~np.isnan(q).any(axis=1) & np.any(~np.isnan(read), axis=0)
    if not used.all():
        columns.update((joint(place + 1), np.nan_to_num(q[:, place])) for place in range(3))
        columns["use"] = ["1" if one else "0" for one in used]
    return columns, shapes


def _vectors(robot: Robot, argument: str, given: Any) -> Array:
    array = robot._rows(argument, given)
    if array.ndim != 2:
        raise ValueError(f"{argument}: shape {array.shape}; an array of shape (n, 3) is needed")
    if argument != "x" and robot.drive == "rotary":
        radians(argument, array)
    return _finite(argument, array)


def _finite(argument: str, array: Array) -> Array:
    faulty = np.flatnonzero(np.isinf(array).any(axis=tuple(range(1, array.ndim))))
    if len(faulty) > 0:
        first = ", ".join(map(str, faulty[:_NAMED]))
        many = f"{len(faulty)} rows ({first}, …)" if len(faulty) > _NAMED else f"rows {first}"
        raise ValueError(f"{argument}: infinity in {f'row {first}' if len(faulty) == 1 else many}")
    return array


def _check_count(argument: str, own: int, count: int) -> None:
    if own != count:
        raise ValueError(f"{argument}: {own} rows, and q has {count}")


def _numbers(argument: str, given: Any, count: int) -> Array:
    """One number, or one a row."""
    array = numbers(argument, given)
    if array.ndim == 0:
        array = np.full(count, array)
    if array.ndim != 1:
        raise ValueError(f"{argument}: shape {array.shape}; an array of shape (n,) is needed")
    _check_count(argument, len(array), count)
    return _finite(argument, array)


def _words(argument: str, given: Any, count: int) -> list[str]:
    """One word, or one a row."""
    # Of times not the count of their units.
    dated = getattr(getattr(given, "dtype", None), "kind", "") in ("m", "M")
    array = array_of(argument, given, str if dated else object)
    if array.ndim > 1 or array.ndim == 0 and not isinstance(array[()], str):
        raise TypeError(f"{argument}: {type(given).__name__}; a word, or words (n,), are needed")
    words = ["" if missing(own) else str(own) for own in (array if array.ndim == 1 else [array[()]] * count)]
    _check_count(argument, len(words), count)
    for row, word in enumerate(words):
        if re.search(r'[",;\x00-\x1f]', word):
            raise ValueError(f"{argument}: row {row}: a word without separators is needed")
        unicode(argument, word)
    return words


def _column(name: str, array: Any, count: int) -> Any:
    if name.endswith(" use") and array.dtype.kind == "f":
        # Whole numbers that were beside missing ones.
        return _words(name, ["" if math.isnan(own) else f"{own:g}" for own in array], count)
    if array.dtype == object and any(isinstance(own, float) and not missing(own) for own in array):
        try:
            return _numbers(name, array, count)
        except TypeError:
            pass
    return _numbers(name, array, count) if array.dtype.kind == "f" else _words(name, array, count)


@np.errstate(all="ignore")
def _covariances(given: Any, unread: NDArray[np.bool_]) -> tuple[Array, Array]:
    """σ and shape of the covariance of each row, of σ of its coordinates (n, 3) or of covariances (n, 3, 3). Coordinates that
    were not read have none, and stand for the mean of the others."""
    array = numbers("sigma", given)
    if array.ndim > 3 or array.shape[1:] not in ((3,), (3, 3)):
        raise ValueError(f"sigma: shape {array.shape}; (n,), (n, 3) or (n, 3, 3) is needed")
    _check_count("sigma", len(array), len(unread))
    # A negative σ is no uncertainty.
    matrices = (array * np.abs(array))[:, :, None] * np.eye(3) if array.ndim == 2 else array
    without = unread & ~unread.all(axis=1, keepdims=True)
    both = without[:, :, None] | without[:, None]
    mean = np.where(without, 0, np.diagonal(matrices, axis1=1, axis2=2)).sum(axis=1) / (3 - without.sum(axis=1))
    matrices = np.where(both, mean[:, None, None] * np.eye(3), matrices)
    square = np.trace(matrices, axis1=1, axis2=2) / 3
    shapes = matrices / square[:, None, None]
    known = np.where(np.isfinite(shapes), shapes, 0)
    # As symmetric as rounding leaves it.
    symmetric = np.abs(known - np.swapaxes(known, 1, 2)).max(axis=(1, 2)) < 1e-9
    stated = ~np.isnan(matrices).all(axis=(1, 2))
    for row in np.flatnonzero(stated & ~(symmetric & (square > 0) & (np.linalg.eigvalsh(known)[:, 0] > 0))):
        raise ValueError(f"sigma: row {row} is no σ above 0 and no covariance: symmetric and positive definite")
    return np.sqrt(square), shapes
