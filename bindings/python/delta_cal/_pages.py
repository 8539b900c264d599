"""What notebooks show, progress, and files of results."""

from __future__ import annotations

import glob
import html
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable

from ._arrays import path_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ._types import PathLike


def in_frame(page: str) -> str:
    """A whole page within another."""
    return f'<iframe style="width:100%;height:40em;border:0" srcdoc="{html.escape(page)}"></iframe>'


def plain(text: str) -> str:
    """A text in columns."""
    return f"<pre>{html.escape(text)}</pre>"


def written(path: PathLike, texts: Mapping[str, Callable[[], str]]) -> None:
    """Writes the text for the ending of a name."""
    own = path_of("path", path)
    text: Any = texts.get(own.suffix)
    if text is None:
        endings = " or ".join(texts)
        raise ValueError(f"path: a name that ends in {endings} is needed")
    own.write_text(text(), encoding="utf-8")


def included(start: str, wanted: str) -> list[tuple[str, bytes]]:
    """Names and contents of the files that a line of a printer's configuration includes, beside the file with the line."""
    folder = Path(start).parent
    pattern = str(Path(glob.escape(str(folder))) / wanted)
    paths = [folder / wanted] if (folder / wanted).is_file() else sorted(map(Path, glob.glob(pattern)))
    return [(str(path), path.read_bytes()) for path in paths if path.is_file()]


class Texts:
    """A report that was pickled."""

    def __init__(self, *texts: str) -> None:
        self.texts = texts

    def text(self) -> str:
        return self.texts[0]

    def json(self) -> str:
        return self.texts[1]

    def html(self) -> str:
        return self.texts[2]


class Told:
    """What is called with the steps that are done and all, or with the seconds of what has none."""

    def __init__(self, progress: bool | Callable[..., object], timed: bool = False) -> None:
        if not (callable(progress) or isinstance(progress, bool)):
            raise TypeError(f"progress: {type(progress).__name__}; True, False or a callable is needed")
        self.tell: Callable[..., object] | None = progress if callable(progress) else None
        self.timed = timed
        self.end: Callable[[], object] | None = None
        if progress is True:
            self._show()

    def _show(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self.tell = lambda done, whole="? s": print(f"\r{done:.0f} of {whole}", end="", file=sys.stderr, flush=True)
            self.end = lambda: print(file=sys.stderr)
        else:
            bar = tqdm(total=0, bar_format="{elapsed}" if self.timed else None)

            def show(done: float, whole: float = 0) -> None:
                bar.total = whole
                bar.update(done - bar.n)

            self.tell, self.end = show, bar.close

    def __enter__(self) -> Callable[..., object] | None:
        return self.tell

    def __exit__(self, *_: object) -> None:
        if self.end is not None:
            self.end()
