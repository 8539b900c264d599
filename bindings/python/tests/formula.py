"""Kinematics of the 24 parameters in NumPy by columns, from docs/method.md: nothing is shared with the Rust code.

A vector is a tuple of three columns of n numbers, which is how NumPy computes them fastest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Columns = tuple[Array, Array, Array]


def dot(a: Columns, b: Columns) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Columns, b: Columns) -> Columns:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def less(a: Columns, b: Columns) -> Columns:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def axes(arm: Array) -> tuple[Array, Array]:
    """u and v of one arm: the elbow is D + u cos q + v sin q."""
    theta, alpha, la_x, la_y = arm[3:7]
    ex = np.array([np.cos(theta), np.sin(theta), 0.0])
    ez = np.array([np.sin(theta) * np.sin(alpha), -np.cos(theta) * np.sin(alpha), np.cos(alpha)])
    return (la_x * ex + la_y * ez).astype(arm.dtype), (la_y * ex - la_x * ez).astype(arm.dtype)


def elbow(arm: Array, q: Array) -> Columns:
    (u, v), cosine, sine = axes(arm), np.cos(q), np.sin(q)
    x, y, z = (d + one * cosine + other * sine for d, one, other in zip(arm[:3], u, v))
    return x, y, z


def positions(parameters: Array, q: Columns) -> Columns:
    """The lower of the two points at the forearms' lengths from the elbows; NaN without one."""
    b1, b2, b3 = (elbow(arm, own) for arm, own in zip(parameters, q))
    r1, r2, r3 = parameters[:, 7] ** 2
    edge2, edge3 = less(b2, b1), less(b3, b1)
    normal = cross(edge2, edge3)
    squared = dot(normal, normal)
    along2, along3 = (r1 - r2 + dot(edge2, edge2)) / (2 * squared), (r1 - r3 + dot(edge3, edge3)) / (2 * squared)
    one, other = cross(edge3, normal), cross(normal, edge2)
    within = one[0] * along2 + other[0] * along3, one[1] * along2 + other[1] * along3, one[2] * along2 + other[2] * along3
    with np.errstate(invalid="ignore"):
        height = np.sqrt((r1 - dot(within, within)) / squared)
    # The elbows of arms 1, 2, 3 go round counter-clockwise from above.
    x, y, z = (own + by - height * down for own, by, down in zip(b1, within, normal))
    return x, y, z


def joints(parameters: Array, x: Columns) -> Columns:
    """atan2(B, A) − acos(C / √(A² + B²)) with A = u·w, B = v·w, w = X − D."""
    found = []
    for arm in parameters:
        w = x[0] - arm[0], x[1] - arm[1], x[2] - arm[2]
        a, b = (own[0] * w[0] + own[1] * w[1] + own[2] * w[2] for own in axes(arm))
        c = (dot(w, w) + (arm[5] ** 2 + arm[6] ** 2 - arm[7] ** 2)) / 2
        with np.errstate(invalid="ignore"):
            found.append(np.arctan2(b, a) - np.arccos(c / np.sqrt(a * a + b * b)))
    return found[0], found[1], found[2]


def derivatives(parameters: Array, q: Columns) -> tuple[Columns, Columns, Columns]:
    """∂X/∂q of each joint: w_j × w_k (w_i · B′_i) / (w_1 · w_2 × w_3) with the forearms w."""
    x = positions(parameters, q)
    w = [less(x, elbow(arm, own)) for arm, own in zip(parameters, q)]
    normals = [cross(w[1], w[2]), cross(w[2], w[0]), cross(w[0], w[1])]
    volume = dot(w[0], normals[0])
    found = []
    for arm, own, forearm, normal in zip(parameters, q, w, normals):
        (u, v), cosine, sine = axes(arm), np.cos(own), np.sin(own)
        moved = (v[0] * cosine - u[0] * sine, v[1] * cosine - u[1] * sine, v[2] * cosine - u[2] * sine)
        by = dot(forearm, moved) / volume
        found.append((normal[0] * by, normal[1] * by, normal[2] * by))
    return found[0], found[1], found[2]


def columns(rows: Array) -> Columns:
    """(n, 3) as three columns."""
    x, y, z = np.ascontiguousarray(rows.T)
    return x, y, z


def forward(parameters: Array, q: Array) -> Array:
    """(n, 3) of (n, 3)."""
    return np.stack(positions(parameters, columns(q)), axis=-1)
