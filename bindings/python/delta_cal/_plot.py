"""Figures of a calibration, with matplotlib."""

from __future__ import annotations

import io
from functools import partial
from typing import Any

import numpy as np


def calibration(result: Any) -> Any:
    """Of a `Calibration`: changes of the parameters with their σ, residuals of the samples, and σ of positions in a plane."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("plot needs matplotlib: pip install matplotlib") from error
    report = result.to_dict()
    figure = Figure(figsize=(12, 4), layout="constrained")
    # For a notebook without pyplot.
    setattr(figure, "_repr_png_", partial(_png, figure))
    parameters, residuals, bed = figure.subplots(1, 3)

    symbols = [own["symbol"] for own in report["arms"][0]["parameters"]]
    for arm in report["arms"]:
        own = arm["parameters"]
        place = np.arange(len(own)) + 0.2 * (arm["arm"] - 2)
        change = [one["change"] for one in own]
        sigma = [one["sigma"] for one in own]
        parameters.errorbar(place, change, yerr=sigma, fmt="o", markersize=4, capsize=2, label=f"arm {arm['arm']}")
    parameters.axhline(0, color="0.7", linewidth=0.8)
    parameters.set_xticks(range(len(symbols)), symbols, rotation=45)
    parameters.set_ylabel("change ± σ, mm or °")
    parameters.legend()

    labels = ("x", "y", "z", "height", "distance")
    for column, label in zip(result.residuals.T, labels):
        if not np.isnan(column).all():
            residuals.plot(result.lines, column, ".", label=label)
    residuals.axhline(0, color="0.7", linewidth=0.8)
    residuals.set_xlabel("sample")
    residuals.set_ylabel("residual, mm")
    residuals.legend()

    q = result.robot.inverse(_grid(result))
    x = result.robot.forward(q)
    variance = np.trace(result.position_covariance(q), axis1=-2, axis2=-1)
    shown = bed.scatter(x[:, 0], x[:, 1], c=np.sqrt(variance), s=12, cmap="viridis")
    figure.colorbar(shown, ax=bed, label="σ of the position, mm")
    bed.set_aspect("equal")
    bed.set_xlabel(f"x, mm (z = {np.nanmedian(x[:, 2]):.0f} mm)")
    bed.set_ylabel("y, mm")
    return figure


def _png(figure: Any) -> bytes:
    into = io.BytesIO()
    figure.savefig(into, format="png")
    return into.getvalue()


def _grid(result: Any) -> Any:
    """Positions all over the workspace at its middle height."""
    robot = result.robot
    angles = np.linspace(robot.limits[0], robot.limits[1], 12)
    swept = np.stack(np.meshgrid(angles, angles, angles), axis=-1).reshape(-1, 3)
    x = robot.forward(swept)
    x = x[np.isfinite(x).all(axis=1)]
    height = np.median(x[:, 2])
    reach = np.quantile(np.hypot(x[:, 0], x[:, 1]), 0.9)
    steps = np.linspace(-reach, reach, 41)
    across, along = np.meshgrid(steps, steps)
    grid = np.stack([across, along, np.full_like(across, height)], axis=-1).reshape(-1, 3)
    return grid[np.hypot(grid[:, 0], grid[:, 1]) <= reach]
