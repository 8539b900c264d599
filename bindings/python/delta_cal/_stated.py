"""What is stated of a robot: arguments to numbers, or to sections of its file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._arrays import array_of, finite, numbers


def stated(given: Mapping[str, Any]) -> dict[str, Any]:
    """By the names of the arguments; what is a dict or has no argument of its own is a section, as JSON."""
    own = dict(given)
    names = ", ".join(own)

    def take(name: str) -> Any:
        is_section = name in ("noise", "tolerance") and isinstance(own.get(name), Mapping)
        return None if is_section else own.pop(name, None)

    found: dict[str, Any] = {
        "parameters": _shaped("parameters", take("parameters"), (3, 8)),
        "transmissions": _shaped("transmissions", take("transmissions"), (3, 5)),
        "limits": _several("limits", take("limits"), "(smallest, largest)"),
        "noise": _noise(take("noise")),
        "tolerance": _several("tolerance", take("tolerance"), "(length, angle) in mm and radians"),
        "zero": take("zero"),
    }
    if found["tolerance"] is not None:
        _not_degrees("tolerance", found["tolerance"][1], 0.2)
    if found["zero"] is not None:
        (found["zero"],) = several("zero", found["zero"], "a standard uncertainty in radians", 1)
        _not_degrees("zero", found["zero"], 0.6)
    for name, value in own.items():
        if not (value is None or isinstance(value, Mapping)):
            raise TypeError(f"{name}: a dict is needed, of the keys that a robot file has in this section")
    sections = {name: _plain(name, value) for name, value in own.items()}
    return {**found, "names": names, "sections": json.dumps(sections)}


def _plain(name: str, own: Any) -> Any:
    """As JSON has it: finite numbers, and what is neither a number nor an array of them as it is."""
    if isinstance(own, Mapping):
        return {str(key): _plain(f"{name}: {key}", value) for key, value in own.items()}
    if own is None or isinstance(own, (str, bool)):
        return own
    if isinstance(own, (list, tuple)):
        return [_plain(f"{name}: [{place}]", value) for place, value in enumerate(own)]
    array = numbers(name, own)
    finite(name, array)
    return own if isinstance(own, int) else array.tolist()


def printer(given: Mapping[str, Any]) -> str:
    """What is stated of a printer, by the names of the arguments, as JSON: one length of all rods is that of three."""
    own: dict[str, Any] = dict.fromkeys(("rods", "radius", "rods_sigma", "radius_sigma", "printed", "shrinkage"))
    for name, value in given.items():
        if name not in own:
            raise TypeError(f"{name}: not stated of a printer")
        own[name] = None if value is None else numbers(name, value)
    for name in ("rods", "radius", "rods_sigma", "radius_sigma"):
        lengths = own[name]
        if lengths is not None:
            if lengths.size not in ((1, 3) if name == "rods" else (1,)):
                raise ValueError(f"{name}: shape {lengths.shape}; {'one length or three are' if name == 'rods' else 'one length is'} needed")
            if not ((lengths > 0) & (lengths <= 1e6)).all():
                raise ValueError(f"{name}: {lengths.tolist()}; a length above 0 mm, up to 1e6 mm, is needed")
            own[name] = (lengths.ravel().tolist() * 3)[:3] if name == "rods" else lengths.item()
    pairs = np.empty((0, 2)) if own["printed"] is None else own["printed"]
    if pairs.shape[1:] != (2,) or not (np.abs(pairs[:, 1] / pairs[:, 0] - 1) < 0.1).all():
        raise ValueError("printed: (as designed, as printed), mm, within 10 %, are needed")
    if own["shrinkage"] is not None:
        (own["shrinkage"],) = several("shrinkage", own["shrinkage"], "a fraction", 1)
        if not abs(own["shrinkage"]) <= 0.1:
            raise ValueError(f"shrinkage: {own['shrinkage']}; a fraction of up to 0.1 is needed")
    return json.dumps({**own, "printed": pairs.tolist()})


def several(argument: str, given: Any, wanted: str, *counts: int) -> Any:
    """So many finite numbers, or as many as one of these counts."""
    array = numbers(argument, given)
    if array.size not in counts:
        raise ValueError(f"{argument}: {wanted} is needed, not {array.size} numbers")
    finite(argument, array)
    return array.ravel().tolist()


def _several(argument: str, given: Any, wanted: str) -> Any:
    return None if given is None else several(argument, given, wanted, 2)


def _shaped(argument: str, given: Any, shape: tuple[int, int]) -> Any:
    if given is None:
        return None
    array = numbers(argument, given)
    if array.shape != shape:
        raise ValueError(f"{argument}: shape {array.shape}; an array of shape {shape} is needed")
    finite(argument, array)
    return array.tolist()


def _noise(given: Any) -> Any:
    """σ of each coordinate, and of a joint."""
    if given is None:
        return None
    wanted = "(position, joint) is needed: standard uncertainties in mm and radians"
    pair = array_of("noise", given, object)
    if pair.shape[:1] != (2,):
        raise ValueError(f"noise: {wanted}")
    position, joint = pair
    axes = several("noise", position, wanted, 1, 3)
    (own,) = several("noise", joint, wanted, 1)
    _not_degrees("noise", own, 0.2)
    return (axes * 3)[:3], own


def _not_degrees(argument: str, angle: float, largest: float) -> None:
    if angle >= largest:
        degrees = f"σ of {angle:g} rad is {math.degrees(angle):.0f}°"
        raise ValueError(f"{argument}: {degrees}; angles are radians (numpy.deg2rad converts)")
