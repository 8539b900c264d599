"""Refusals."""

from __future__ import annotations

import re
from collections.abc import Sequence


class Refused(Exception):
    """These measurements cannot calibrate or judge this robot, which keeps its parameters."""

    findings: list[dict[str, str]]
    """With the keys ``level``, ``kind``, ``text`` and ``remedy``: the cause first, then what would explain the samples as a
    whole."""
    rows: list[int]
    """The indices of the rows that they name; of a file, the lines."""


def refused(findings: Sequence[tuple[str, str, str]]) -> Refused:
    """Of the kind, the cause and the remedy of each finding."""
    lines = [f"Explained by: {text}" if kind == "diagnosis" else text for kind, text, _ in findings]
    error = Refused("\n".join([*lines, findings[0][2]]))
    keys = ("level", "kind", "text", "remedy")
    error.findings = [dict(zip(keys, ("warning", *own))) for own in findings]
    # "rows 3, 5 and 7", "row 3".
    named = re.findall(r"\b(?:row|line)s?\s+(\d+(?:(?:,\s*|\s+and\s+)\d+)*)", str(error), re.IGNORECASE)
    error.rows = sorted({int(number) for own in named for number in re.findall(r"\d+", own)})
    return error


# As it is imported.
Refused.__module__ = "delta_cal"
