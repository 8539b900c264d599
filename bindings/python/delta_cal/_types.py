"""Types of arguments and results."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Callable, Protocol, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
PathLike = Union[str, "os.PathLike[str]"]
Progress = Union[bool, Callable[[int, int], object]]
Waiting = Union[bool, Callable[[float], object]]
Section = Mapping[str, Any]


class DataFrame(Protocol):
    """A frame of pandas or polars, by the column names of a samples file."""

    @property
    def columns(self) -> Any: ...
    @property
    def dtypes(self) -> Any: ...


Rows = Union[ArrayLike, DataFrame]
Vector = tuple[float, float, float]
File = tuple[str, bytes]
Noise = Union[tuple[float, float], tuple[tuple[float, float, float], float], Section]
Tolerance = Union[tuple[float, float], Section]
