"""What is stated of a robot: arguments to sections of its file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._arrays import array_of, finite, lengths, numbers


def stated(given: Mapping[str, Any], robot: Any) -> dict[str, Any]:
    """Sections of a robot's file, of arguments by their names."""
    own = dict(given)
    of_file = robot.to_dict()
    in_file, unit = (float, "mm") if robot.drive == "linear" else (_degrees, "deg")
    if "limits" in own:
        low, high = several("limits", own.pop("limits"), "(smallest, largest)", 2)
        if low >= high or unit == "deg" and max(-low, high) > math.tau:
            raise ValueError(f"limits: {[low, high]}; (smallest, largest) is needed, {'mm' if unit == 'mm' else 'radians'}")
        key, of_limits = ("rad", float) if "min_rad" in of_file["joints"] else (unit, in_file)
        own["joints"] = {f"min_{key}": of_limits(low), f"max_{key}": of_limits(high), **own.get("joints", {})}
    if not isinstance(own.get("noise", {}), Mapping):
        position, joint = _noise(own["noise"])
        own["noise"] = {"position_mm": position, f"joint_{unit}": in_file(joint)}
    if not isinstance(own.get("tolerance", {}), Mapping):
        length, angle = several("tolerance", own["tolerance"], "(length, angle) in mm and radians", 2)
        _sigmas("tolerance", length, angle)
        _not_degrees("tolerance", angle, 0.2)
        if length > robot.parameters[0, 7]:
            raise ValueError(f"tolerance: σ of {length:g} mm is longer than the forearm")
        own["tolerance"] = {"length_mm": length, "angle_deg": _degrees(angle)}
    if "zero" in own:
        (zero,) = several("zero", own.pop("zero"), "a standard uncertainty in radians", 1)
        _sigmas("zero", zero)
        _not_degrees("zero", zero, 0.6)
        if unit == "mm" or not {**own, **of_file}.get("tolerance"):
            raise ValueError(f"zero: {'the joints of this robot do not turn' if unit == 'mm' else 'needs a tolerance as well'}")
        own["tolerance"] = {**own.get("tolerance", {}), "zero_deg": _degrees(zero)}
    for name, value in own.items():
        if not (value is None or isinstance(value, Mapping)):
            raise TypeError(f"{name}: a dict is needed, of the keys that a robot file has in this section")
    return {name: _plain(name, value) for name, value in own.items()}


def _degrees(radians: float) -> float:
    """Degrees that are read as the same radians."""
    plain = math.degrees(radians)
    near = (round(plain, 12), plain, math.nextafter(plain, math.inf), math.nextafter(plain, -math.inf))
    return next((own for own in near if math.radians(own) == radians), plain)


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
        if value is None or name == "printed":
            continue
        wanted = {"rods": "one length or three", "shrinkage": "a fraction"}.get(name, "one length")
        found = several(name, value, wanted, *((1, 3) if name == "rods" else (1,)))
        if name != "shrinkage":
            for one in found:
                lengths(**{name: one})
        elif abs(found[0]) > 0.1:
            raise ValueError(f"{name}: {found[0]}; a fraction of up to 0.1 is needed")
        own[name] = (found * 3)[:3] if name == "rods" else found[0]
    pairs = np.empty((0, 2)) if given.get("printed") is None else numbers("printed", given["printed"])
    if pairs.shape[1:] != (2,) or not (np.abs(pairs[:, 1] - pairs[:, 0]) < 0.1 * np.abs(pairs[:, 0])).all():
        raise ValueError("printed: (as designed, as printed), mm, within 10 %, are needed")
    return json.dumps({**own, "printed": pairs.tolist()})


def several(argument: str, given: Any, wanted: str, *counts: int) -> Any:
    """So many finite numbers, or as many as one of these counts."""
    array = numbers(argument, given)
    if array.size not in counts:
        raise ValueError(f"{argument}: {wanted} is needed, not {array.size} numbers")
    finite(argument, array)
    return array.ravel().tolist()


def shaped(argument: str, given: Any, shape: tuple[int, int]) -> Any:
    """Finite numbers of a shape."""
    array = numbers(argument, given)
    if array.shape != shape:
        raise ValueError(f"{argument}: shape {array.shape}; an array of shape {shape} is needed")
    finite(argument, array)
    return array.tolist()


def _noise(given: Any) -> Any:
    """σ of each coordinate, and of a joint."""
    wanted = "(position, joint) is needed: standard uncertainties in mm and radians"
    pair = array_of("noise", given, object)
    if pair.shape[:1] != (2,):
        raise ValueError(f"noise: {wanted}")
    position, joint = pair
    axes = several("noise", position, wanted, 1, 3)
    (own,) = several("noise", joint, wanted, 1)
    _sigmas("noise", *axes, own or 1)
    _not_degrees("noise", own, 0.2)
    return (axes * 3)[:3], own


def _sigmas(argument: str, *all_given: float) -> None:
    for own in all_given:
        if own <= 0:
            raise ValueError(f"{argument}: {own:g}; a standard uncertainty above 0 is needed")


def _not_degrees(argument: str, angle: float, largest: float) -> None:
    if angle >= largest:
        degrees = f"σ of {angle:g} rad is {math.degrees(angle):.0f}°"
        raise ValueError(f"{argument}: {degrees}; angles are radians (numpy.deg2rad converts)")
