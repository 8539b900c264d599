"""Forward kinematics of the 24 parameters in vectorised NumPy, from docs/method.md: nothing is shared with the Rust code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def elbow(arm: Array, q: Array) -> Array:
    """(n, 3): D + u cos q + v sin q."""
    theta, alpha, la_x, la_y = arm[3:7]
    ex = np.array([np.cos(theta), np.sin(theta), 0.0])
    ez = np.array([np.sin(theta) * np.sin(alpha), -np.cos(theta) * np.sin(alpha), np.cos(alpha)])
    u, v = la_x * ex + la_y * ez, la_y * ex - la_x * ez
    found: Array = arm[:3] + np.cos(q)[:, None] * u + np.sin(q)[:, None] * v
    return found


def forward(parameters: Array, q: Array) -> Array:
    """(n, 3): the lower of the two points at the forearms' lengths from the elbows; NaN without one."""
    b1, b2, b3 = (elbow(arm, angle) for arm, angle in zip(parameters, q.T))
    r1, r2, r3 = parameters[:, 7] ** 2
    edge2, edge3 = b2 - b1, b3 - b1
    normal = np.cross(edge2, edge3)
    squared = np.einsum("ij,ij->i", normal, normal)
    along2 = 0.5 * (r1 - r2 + np.einsum("ij,ij->i", edge2, edge2))
    along3 = 0.5 * (r1 - r3 + np.einsum("ij,ij->i", edge3, edge3))
    plane = (np.cross(edge3, normal) * along2[:, None] + np.cross(normal, edge2) * along3[:, None]) / squared[:, None]
    with np.errstate(invalid="ignore"):
        height = np.sqrt((r1 - np.einsum("ij,ij->i", plane, plane)) / squared)
    # The elbows of arms 1, 2, 3 go round counter-clockwise from above.
    found: Array = b1 + plane - normal * height[:, None]
    return found
