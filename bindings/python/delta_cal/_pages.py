"""What notebooks show, and files of results."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ._native import Robot

_SYMBOLS = {
    "rotary": ("Dx", "Dy", "Dz", "theta", "alpha", "La_x", "La_y", "Lb"),
    "linear": ("Dx", "Dy", "Dz", "lean_x", "lean_y", "scale", "", "Lb"),
}


def framed(page: str) -> str:
    """A whole page within another."""
    return f'<iframe style="width:100%;height:40em;border:0" srcdoc="{html.escape(page)}"></iframe>'


def plain(text: str) -> str:
    """A text in columns."""
    return f"<pre>{html.escape(text)}</pre>"


def robot(own: Robot) -> str:
    """The parameters of a robot as a table: mm and radians."""
    head = "".join(f"<th>{symbol}</th>" for symbol in ("", *_SYMBOLS[own.drive]))
    rows = (
        f"<tr><th>arm {arm}</th>" + "".join(f"<td>{value:.4f}</td>" for value in row) + "</tr>"
        for arm, row in enumerate(own.parameters, 1)
    )
    return f"{plain(repr(own))}<table><tr>{head}</tr>{''.join(rows)}</table>"


def written(path: str | os.PathLike[str], texts: Mapping[str, Callable[[], str]]) -> None:
    """Writes the text for the ending of a name."""
    text: Any = texts.get(Path(path).suffix)
    if text is None:
        endings = " or ".join(texts)
        raise ValueError(f"path: a name that ends in {endings} is needed")
    Path(path).write_text(text(), encoding="utf-8")
