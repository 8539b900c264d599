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


# What the command's messages call its options, where an argument is not called the same.
_ARGUMENTS = {
    "`delta-cal init --output -` prints a robot file with every key (with towers, add --kind linear)": "docs/instruments.md lists all keys",
    "state zero_deg in [tolerance], how many degrees": "state zero, how many radians",
    "--frame sensor": 'frame="sensor"',
    "--method joint and ikm": 'method="joint" and method="ikm"',
    "--method fkm": 'method="fkm"',
    "leave out --robust": "leave out robust",
    "--robust": "robust=True",
    "with --for": "as target",
    "in a column target": "in target",
    "name its contents with --columns": "read_samples takes columns",
}
# A command stays one: in quotation marks, or as a paragraph.
_OPTIONS = re.compile("|".join([*map(re.escape, _ARGUMENTS), r"(`delta-cal[^`]*`?|^delta-cal (?:.+\n?)+)", "--(?=[a-z])"]), re.M)
# Arrays have rows in place of lines, no names of columns, and are in no file. Headers stand at the right.
_ROWS = {
    ". No file was changed": "",
    ", but the header says millimetres": "",
    "in line\n": " in row\n",
    "Line ": "Row ",
    "line ": "row ",
    "Lines ": "Rows ",
    "lines ": "rows ",
}


def words(text: str, in_arrays: bool) -> str:
    """A message without colours, in the names of arguments."""
    text = re.sub("\x1b[^m]*m", "", text)
    text = _OPTIONS.sub(lambda own: own[1] or _ARGUMENTS.get(own[0], ""), text)
    if not in_arrays:
        return text
    if text.startswith("Name the columns of "):
        return "Convert the arrays: they are in millimetres and radians."
    for line, row in _ROWS.items():
        text = text.replace(line, row)
    return text


def fault(text: str, place: tuple[str, int | None, str | None, str | None], arrays: str | None) -> ValueError:
    """Of a message, and its file, line, excerpt and remedy; ``arrays``: their name, if not all are files."""
    file, line, excerpt, remedy = place
    in_arrays = arrays is not None and line is not None
    if arrays is not None:
        # What rows of the arrays name, and the robot does not.
        argument = "target" if "target" in arrays.split(", ") else arrays
        text = text.replace(f"{file}: rows of {arrays} name ", f"{argument}: rows name ", 1)
    if in_arrays:
        # A robot beside arrays is no file that anybody has.
        text = text.replace(f"{file}:{line}:", f"{file}: row {line}:" if file == arrays else "robot:", 1)
    said = [words(text, in_arrays), None if in_arrays else excerpt, remedy and words(remedy, False)]
    return ValueError("\n".join(own for own in said if own))


def refused(findings: Sequence[tuple[str, str, str]], in_arrays: bool) -> Refused:
    """Of the kind, the cause and the remedy of each finding."""
    findings = [(kind, words(text, in_arrays), words(remedy, in_arrays)) for kind, text, remedy in findings]
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
