"""Independent optima of the FKM problem, computed with SciPy.

Nothing here is shared with the Rust code: forward kinematics by a numerical solve, its derivatives by
the joints from the implicit function theorem on finite differences of the constraint,
`scipy.optimize.least_squares` on all 24 parameters with MINPACK's tolerances at their limit. Numbers
are stored as the bits of IEEE doubles.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 tests/goldens/generate_fkm.py > tests/goldens/scipy_fkm.json
"""

import numpy as np
import scipy
from generate import DEGREE, bits, bits_of, constraint, forward, nominal_robot, write
from scipy.optimize import least_squares

STEP = 1e-5


def refined(robot, x, joints):
    """Two Newton steps on the constraints, with central differences by x: exact to rounding."""
    for _ in range(2):
        value = np.array([constraint(p, x, q) for p, q in zip(robot, joints)])
        x = x - np.linalg.solve(by_position(robot, x, joints), value)
    return x


def central(function, at):
    columns = []
    for h in np.eye(3) * STEP:
        columns.append((function(at + h) - function(at - h)) / (2 * STEP))
    return np.column_stack(columns)


def by_position(robot, x, joints):
    return central(lambda at: np.array([constraint(p, at, q) for p, q in zip(robot, joints)]), x)


def by_joints(robot, x, joints):
    by_q = central(
        lambda at: np.array([constraint(p, x, q) for p, q in zip(robot, at)]), np.array(joints)
    )
    return -np.linalg.solve(by_position(robot, x, joints), by_q)


def optimum(nominal, xs, qs, noise, tolerance):
    """The weighted and regularised optimum of all 24 parameters, and the inverse of JᵀJ there."""
    whitening = [np.eye(3)] * len(xs)
    if noise is not None:
        sigma_x, sigma_q = noise
        whitening = []
        for x, q in zip(xs, qs):
            j = by_joints(nominal, x, q)
            covariance = sigma_x**2 * np.eye(3) + sigma_q**2 * j @ j.T
            whitening.append(np.linalg.inv(np.linalg.cholesky(covariance)))
    sigmas = None
    if tolerance is not None:
        length, angle = tolerance
        sigmas = np.tile([length] * 3 + [angle] * 2 + [length] * 3, 3)
    start = np.concatenate(nominal)

    def residual(p):
        robot = p.reshape(3, 8)
        # The measured point is near the platform: Newton's method leads to the same side.
        rows = [
            w @ (x - refined(robot, refined(robot, x, q), q)) for w, x, q in zip(whitening, xs, qs)
        ]
        r = np.concatenate(rows)
        return r if sigmas is None else np.concatenate([r, (p - start) / sigmas])

    scale = np.tile([100.0] * 3 + [1.0] * 2 + [100.0] * 3, 3)
    result = start
    for _ in range(2):
        fit = least_squares(
            residual,
            result,
            jac="3-point",
            method="lm",
            x_scale=scale,
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=3000,
        )
        result = fit.x
    # One Gauss-Newton step more, with central differences of a fixed size.
    jacobian = np.column_stack(
        [(residual(result + h) - residual(result - h)) / (2 * h.sum()) for h in np.diag(scale * 1e-6)]
    )
    result = result + np.linalg.lstsq(jacobian, -residual(result), rcond=None)[0]
    residuals = residual(result)
    return result, np.linalg.inv(jacobian.T @ jacobian), float(residuals @ residuals)


def main():
    rng = np.random.default_rng(20200116)
    cases = []
    settings = [
        # count, start length mm, start angle deg, sigma_x mm, sigma_q deg, weights, prior
        (12, 0.5, 0.1, 0.01, 0.002, False, False),
        (20, 1.0, 0.2, 0.01, 0.002, False, False),
        (20, 1.0, 0.2, 0.01, 0.002, True, False),
        (20, 1.0, 0.2, 0.01, 0.002, True, True),
        (30, 5.0, 0.5, 0.001, 0.01, True, False),
        (8, 0.5, 0.1, 0.01, 0.005, True, True),
        (5, 0.5, 0.1, 0.01, 0.005, True, True),
        (60, 2.0, 0.5, 0.05, 0.01, True, True),
    ]
    for count, length, angle, sigma_x, sigma_q, weighted, prior in settings:
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
        parameters, covariance, cost = optimum(nominal, positions, joints, noise, tolerance)
        cases.append(
            {
                "joints": bits_of(joints),
                "positions": bits_of(positions),
                "noise": None if noise is None else bits_of(noise),
                "tolerance": None if tolerance is None else bits_of(tolerance),
                "parameters": bits_of(parameters),
                "covariance": bits_of(covariance),
                "cost": bits(cost),
            }
        )
    write("generate_fkm.py", cases, np, scipy)


if __name__ == "__main__":
    main()
