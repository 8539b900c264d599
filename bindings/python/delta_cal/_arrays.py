"""Arguments: numbers, words, paths, frames."""

from __future__ import annotations

import math
import os
from importlib import import_module
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from ._types import Array


def array_of(argument: str, given: Any, dtype: Any = None) -> Any:
    """As NumPy has it. What has no order, such as a set, is one object."""
    try:
        return np.asanyarray(given, dtype)
    except Exception as error:  # noqa: BLE001
        # As the object's own conversion has it: on a GPU, of several lengths.
        raise (TypeError if isinstance(error, TypeError) else ValueError)(f"{argument}: {error}") from error


def numbers(argument: str, given: Any, dtype: str = "float64") -> NDArray[Any]:
    """Contiguous real numbers of any shape; NaN where they are masked or missing."""
    array: Any = array_of(argument, given)
    if array.dtype == object:
        cells = [_cell(argument, place, array[place]) for place in np.ndindex(array.shape)]
        array = np.array(cells, dtype).reshape(array.shape)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{argument}: dtype {array.dtype}; an array of real numbers is needed")
    if hasattr(array, "filled"):
        array = array.astype(dtype).filled(np.nan)
    return np.asarray(array, dtype, order="C")


def missing(own: Any) -> bool:
    """None, and what frames and masked arrays have for it."""
    return own is None or own is np.ma.masked or type(own).__name__ in ("NAType", "NaTType") or isinstance(own, float) and math.isnan(own)


def _cell(argument: str, place: tuple[int, ...], own: Any) -> float:
    if not place:
        return _real(argument, own)
    return math.nan if missing(own) else _real(f"{argument}: {list(place)}", own)


def _real(argument: str, own: Any) -> float:
    if not isinstance(own, Real) or isinstance(own, (bool, np.bool_, np.timedelta64)):
        raise TypeError(f"{argument}: {type(own).__name__}; a number is needed")
    try:
        return float(own)
    except OverflowError:
        return math.inf


def finite(argument: str, array: Array) -> None:
    """Whether all are."""
    for place in np.argwhere(~np.isfinite(array))[:1]:
        where = f"{place.tolist()} is " if array.ndim > 0 else ""
        raise ValueError(f"{argument}: {where}{array[tuple(place)]}; a finite number is needed")


def check(kind: Any, *, optional: Mapping[str, Any] | None = None, **given: Any) -> None:
    """Whether arguments are of a type, and numbers finite; of optional ones those that are not None."""
    stated = {name: own for name, own in (optional or {}).items() if own is not None}
    for name, value in {**given, **stated}.items():
        if kind is Real:
            finite(name, np.array(_real(name, value)))
        elif not isinstance(value, (bool, np.bool_) if kind is bool else kind):
            raise TypeError(f"{name}: {type(value).__name__}; a {kind.__name__} is needed")
        if kind is str:
            unicode(name, value)


def unicode(argument: str, text: str) -> None:
    """Whether a text is one for other programs as well."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{argument}: {ascii(text)}; text without surrogates is needed") from None


def lengths(*, optional: Mapping[str, Any] | None = None, **given: Any) -> None:
    """Whether lengths are above 0, and no longer than a robot's can be; of optional ones those that are not None."""
    check(Real, optional=optional, **given)
    for name, value in {**given, **(optional or {})}.items():
        if value is not None and not 0 < value <= 1e6:
            raise ValueError(f"{name}: {float(value):g}; a length above 0 mm, up to 1e6 mm, is needed")


def path_of(argument: str, given: Any) -> Path:
    """The path of a file."""
    try:
        path = Path(given)
    except TypeError:
        raise TypeError(f"{argument}: {type(given).__name__}; a path is needed") from None
    if "\0" in str(path):
        raise ValueError(f"{argument}: a path without null characters is needed")
    return path


def file_of(argument: str, given: Any) -> tuple[str, bytes]:
    """Name and bytes of a file; an error has its path and number."""
    path = path_of(argument, given)
    return str(path).encode(errors="replace").decode(), path.read_bytes()


def rows(argument: str, given: Any, dtype: str = "float64") -> NDArray[Any]:
    """Numbers in the shape (…, 3)."""
    array = numbers(argument, given, dtype)
    if array.shape[-1:] != (3,):
        raise ValueError(f"{argument}: shape {array.shape}; an array of shape (…, 3) is needed")
    return array


def framed(given: Any) -> Any:
    """A data frame: of pandas, polars, or what has their methods; that of another library by the interchange protocol."""
    if hasattr(given, "collect_schema") and hasattr(given, "lazy") and not hasattr(given, "__len__"):
        given = given.collect()
    if hasattr(given, "columns") and hasattr(given, "dtypes"):
        return given
    if not hasattr(given, "__dataframe__"):
        return None
    for reader in ("polars", "pandas.api.interchange"):
        try:
            return import_module(reader).from_dataframe(given)
        except ImportError:
            pass
    raise ImportError("pandas or polars is needed to read this frame")


def in_units(argument: str, frame: Any, columns: Iterable[tuple[str, float]]) -> Array:
    """Three columns of a frame, each by its factor."""
    return np.stack([factor * numbers(f"{argument}: column {name}", frame[name].to_numpy()) for name, factor in columns], axis=-1)


class Frozen:
    """Whose arrays are for reading, in copies and from pickles as well."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for own in state.values():
            if isinstance(own, np.ndarray):
                own.setflags(write=False)
        self.__dict__.update(state)


def radians(argument: str, angles: Array) -> None:
    """Joint angles of more than a turn are degrees."""
    table = angles.reshape(-1, 3)
    for row, place in np.argwhere(np.isfinite(table) & (np.abs(table) > math.tau))[:1]:
        beyond = f"row {row} holds {table[row, place]:g}, more than a turn"
        raise ValueError(f"{argument}: {beyond}; angles are radians (numpy.deg2rad converts)")


