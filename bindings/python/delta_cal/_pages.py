"""What notebooks show, progress, and files of results."""

from __future__ import annotations

import html
import os
import sys
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


class Told:
    """What is called with the finished and all, or with the seconds of what has no parts."""

    def __init__(self, progress: bool | Callable[..., object], whole: int | None = None) -> None:
        self.tell: Callable[..., object] | None = progress if callable(progress) else None
        self.whole = whole
        self.end: Callable[[], object] | None = None
        if progress is True:
            self._show()

    def _show(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self.tell = lambda done, *_: print(f"\r{done:.0f} of {self.whole or '? s'}", end="", file=sys.stderr, flush=True)
            self.end = lambda: print(file=sys.stderr)
        else:
            bar = tqdm(total=self.whole, bar_format=None if self.whole else "{elapsed}")
            self.tell = lambda done, *_: bar.update(done - bar.n)
            self.end = bar.close

    def __enter__(self) -> Callable[..., object] | None:
        return self.tell

    def __exit__(self, error: object, *_: object) -> None:
        if self.tell is not None and self.whole is not None and error is None:
            self.tell(self.whole, self.whole)
        if self.end is not None:
            self.end()
