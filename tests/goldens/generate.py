"""Independent optima of the IKM problem, computed with SciPy.

Nothing here is shared with the Rust code: forward kinematics by a numerical solve, the constraint
in millimetres, Sampson weights from the formula, `scipy.optimize.least_squares` with MINPACK's lmder
tolerances at their limit. Numbers are stored as the bits of IEEE doubles.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 tests/goldens/generate.py > tests/goldens/scipy.json
"""

import json
import platform
import struct

import numpy as np
import scipy
from scipy.optimize import fsolve, least_squares

DEGREE = np.pi / 180
# MINPACK's tolerances at their limit.
EXACTLY = {"method": "lm", "xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "max_nfev": 10000}


def basis(p):
    theta, alpha = p[3], p[4]
    ex = np.array([np.cos(theta), np.sin(theta), 0.0])
    ez = np.array(
        [np.sin(theta) * np.sin(alpha), -np.cos(theta) * np.sin(alpha), np.cos(alpha)]
    )
    return ex, ez


def elbow(p, q):
    ex, ez = basis(p)
    u = p[5] * ex + p[6] * ez
    v = p[6] * ex - p[5] * ez
    return p[:3] + u * np.cos(q) + v * np.sin(q)


def elbow_derivative(p, q):
    ex, ez = basis(p)
    u = p[5] * ex + p[6] * ez
    v = p[6] * ex - p[5] * ez
    return -u * np.sin(q) + v * np.cos(q)


def constraint(p, x, q):
    w = x - elbow(p, q)
    return w @ w - p[7] ** 2


def forward(robot, joints):
    def residual(x):
        return [constraint(p, x, q) for p, q in zip(robot, joints)]

    x, _, found, _ = fsolve(residual, np.array([0.0, 0.0, -500.0]), full_output=True, xtol=1e-14)
    return x if found == 1 and x[2] < -150 and max(map(abs, residual(x))) < 1e-7 else None


def nominal_robot():
    radius = 194.0 - 30.0
    robot = []
    for k in range(3):
        theta = k * 120 * DEGREE
        robot.append(
            np.array(
                [radius * np.cos(theta), radius * np.sin(theta), 0, theta, 0, 260.0, 0.0, 480.0]
            )
        )
    return robot


def optimum(nominal, xs, qs, noise, tolerance):
    """The weighted and regularised optimum of one arm, and the inverse of JᵀJ there."""
    if noise is None:
        weights = np.ones(len(qs)) / (2 * nominal[7])
    else:
        sigma_x, sigma_q = noise
        weights = np.array(
            [
                1
                / np.sqrt(
                    (2 * nominal[7] * sigma_x) ** 2
                    + (2 * (x - elbow(nominal, q)) @ elbow_derivative(nominal, q) * sigma_q) ** 2
                )
                for x, q in zip(xs, qs)
            ]
        )
    sigmas = None
    if tolerance is not None:
        length, angle = tolerance
        sigmas = np.array([length] * 3 + [angle] * 2 + [length] * 3)

    def residual(p):
        r = np.array([w * constraint(p, x, q) for w, x, q in zip(weights, xs, qs)])
        return r if sigmas is None else np.concatenate([r, (p - nominal) / sigmas])

    scale = np.array([100.0] * 3 + [1.0] * 2 + [100.0] * 3)
    result = nominal.copy()
    # Three runs from the previous end: the finite-difference Jacobian limits each.
    for _ in range(3):
        fit = least_squares(residual, result, jac="3-point", x_scale=scale, **EXACTLY)
        result = fit.x
    # One Gauss-Newton step more, with central differences of a fixed size.
    step = scale * 1e-6
    jacobian = np.column_stack(
        [
            (residual(result + h) - residual(result - h)) / (2 * h.sum())
            for h in np.diag(step)
        ]
    )
    correction = np.linalg.lstsq(jacobian, -residual(result), rcond=None)[0]
    result = result + correction
    information = jacobian.T @ jacobian
    return result, np.linalg.inv(information), float(residual(result) @ residual(result))


def bits(value):
    return struct.pack(">d", float(value)).hex()


def bits_of(array):
    return [bits(v) for v in np.asarray(array).ravel()]


def write(generator, cases, *packages):
    """Prints the document with what computed it, a line for each case."""
    about = {"generator": f"tests/goldens/{generator}", "python": platform.python_version()}
    about |= {package.__name__: package.__version__ for package in packages}
    print("{")
    for key, value in about.items():
        print(f"{json.dumps(key)}: {json.dumps(value)},")
    print('"cases": [')
    print(",\n".join(json.dumps(case, separators=(",", ":")) for case in cases))
    print("]\n}")


def main():
    rng = np.random.default_rng(20200115)
    cases = []
    settings = [
        # count, start length mm, start angle deg, sigma_x mm, sigma_q deg, weights, prior
        (12, 1.0, 0.2, 0.01, 0.002, False, False),
        (20, 1.0, 0.2, 0.01, 0.002, False, False),
        (20, 1.0, 0.2, 0.01, 0.002, True, False),
        (20, 1.0, 0.2, 0.01, 0.002, True, True),
        (60, 5.0, 0.5, 0.05, 0.01, True, False),
        (60, 5.0, 0.5, 0.05, 0.01, True, True),
        (8, 0.5, 0.1, 0.01, 0.005, True, True),
        (5, 0.5, 0.1, 0.01, 0.005, True, True),
        (30, 10.0, 1.0, 0.001, 0.01, True, False),
        (200, 2.0, 0.5, 0.1, 0.02, True, True),
    ]
    for count, length, angle, sigma_x, sigma_q, weighted, prior in settings:
        for _ in range(2):
            nominal = nominal_robot()
            spread = np.array([length] * 3 + [angle * DEGREE] * 2 + [length] * 3)
            truth = [p + spread * rng.uniform(-1, 1, 8) for p in nominal]
            joints, positions = [], []
            while len(joints) < count:
                q = rng.uniform(-40 * DEGREE, 70 * DEGREE, 3)
                x = forward(truth, q)
                if x is None:
                    continue
                joints.append(q + sigma_q * DEGREE * rng.standard_normal(3))
                positions.append(x + sigma_x * rng.standard_normal(3))
            joints, positions = np.array(joints), np.array(positions)
            noise = (sigma_x, sigma_q * DEGREE) if weighted else None
            tolerance = (length, angle * DEGREE) if prior else None
            arms = [
                optimum(nominal[k], positions, joints[:, k], noise, tolerance) for k in range(3)
            ]
            cases.append(
                {
                    "joints": bits_of(joints),
                    "positions": bits_of(positions),
                    "noise": None if noise is None else bits_of(noise),
                    "tolerance": None if tolerance is None else bits_of(tolerance),
                    "parameters": [bits_of(a[0]) for a in arms],
                    "covariance": [bits_of(a[1]) for a in arms],
                    "cost": [bits(a[2]) for a in arms],
                }
            )
    write("generate.py", cases, np, scipy)


if __name__ == "__main__":
    main()
