"""Independent optima of the joint problem, computed with SciPy.

Nothing here is shared with the Rust code but the definitions: forward kinematics by a numerical solve, the
three closures of a sample in millimetres, their dense covariance at the nominal robot

    cov(f)_ij = 4 (X - B_i)^T S (X - B_j) + delta_ij ((df_i/dq_i)^2 sq^2 + (2 Lb_i)^2 tr S / 3 * 0.01^2)

with S the diagonal matrix of the position's variances, and W the inverse of NumPy's Cholesky factor (lower
triangular, where the Rust code's is upper triangular: |W f| is the same).
`scipy.optimize.least_squares` with MINPACK's lmder tolerances at their limit, all 24 parameters at once.
Numbers are stored as the bits of IEEE doubles; `noise` is sx, sy, sz and sq.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 tests/goldens/generate_joint.py > tests/goldens/scipy_joint.json
"""

import numpy as np
import scipy
from generate import DEGREE, EXACTLY, basis, bits, bits_of, elbow, elbow_derivative, write
from scipy.optimize import fsolve, least_squares

ARM = np.array([100.0] * 3 + [1.0] * 2 + [100.0] * 3)
SCALE = np.concatenate([ARM] * 3)
DIRECTION = 0.01


def whitening(nominal, xs, joints, sigma_x, sigma_q):
    """W of every sample at the nominal robot."""
    variances = np.square(np.array(sigma_x))
    factors = []
    for x, q in zip(xs, joints):
        forearms = np.array([x - elbow(p, a) for p, a in zip(nominal, q)])
        covariance = 4 * (forearms * variances) @ forearms.T
        for k, (p, a) in enumerate(zip(nominal, q)):
            by_joint = 2 * forearms[k] @ elbow_derivative(p, a) * sigma_q
            covariance[k, k] += by_joint**2
            covariance[k, k] += (2 * p[7] * DIRECTION) ** 2 * variances.sum() / 3
        factors.append(np.linalg.inv(np.linalg.cholesky(covariance)))
    return np.array(factors)


def closures(p, xs, joints, whiten):
    """W f of all samples, one after the other."""
    f = np.empty((len(xs), 3))
    for k in range(3):
        arm = p[8 * k : 8 * k + 8]
        ex, ez = basis(arm)
        u = arm[5] * ex + arm[6] * ez
        v = arm[6] * ex - arm[5] * ez
        q = joints[:, k]
        w = xs - (arm[:3] + np.outer(np.cos(q), u) + np.outer(np.sin(q), v))
        f[:, k] = np.sum(w * w, axis=1) - arm[7] ** 2
    return np.einsum("nij,nj->ni", whiten, f).ravel()


def jacobian(p, xs, joints, whiten):
    columns = []
    for h in np.diag(SCALE * 1e-6):
        ahead, behind = (closures(p + s * h, xs, joints, whiten) for s in (1, -1))
        columns.append((ahead - behind) / (2 * h.sum()))
    return np.column_stack(columns)


def robots():
    """Symmetric robots of several proportions, one with different arms, one with tilted axes."""
    made = []
    for base, platform, upper, fore in [
        (194.0, 30.0, 260.0, 480.0),
        (200.0, 45.0, 235.0, 800.0),
        (60.0, 40.0, 400.0, 900.0),
        (60.0, 110.0, 250.0, 520.0),
        (60.0, 25.0, 80.0, 180.0),
    ]:
        r = base - platform
        thetas = [k * 120 * DEGREE for k in range(3)]
        made.append(
            [
                np.array([r * np.cos(t), r * np.sin(t), 0, t, 0, upper, 0.0, fore])
                for t in thetas
            ]
        )
    asymmetric = [p.copy() for p in made[0]]
    for p, turn, upper, fore in zip(asymmetric, (0.0, 0.2, -0.3), (260, 230, 290), (480, 520, 450)):
        p[3] += turn
        p[5], p[7] = upper, fore
    tilted = [p.copy() for p in made[0]]
    for p, turn, tilt in zip(tilted, (0.0, 0.0, 0.1), (0.35, -0.25, 0.2)):
        p[3] += turn
        p[4] = tilt
    return made + [asymmetric, tilted]


def below(robot, joints):
    """Forward kinematics: the intersection of the spheres below the elbows."""
    fore = max(p[7] for p in robot)
    elbows = np.array([elbow(p, q) for p, q in zip(robot, joints)])

    def residual(x):
        w = x - elbows
        return np.sum(w * w, axis=1) - np.array([p[7] ** 2 for p in robot])

    guess = elbows.mean(axis=0) - [0, 0, fore]
    x, _, found, _ = fsolve(residual, guess, full_output=True, xtol=1e-14)
    if found != 1 or np.max(np.abs(residual(x))) > 1e-6:
        return None
    # Clear of the singularity where the forearms lie in a plane.
    directions = (x - elbows) / np.linalg.norm(x - elbows, axis=1)[:, None]
    beneath = np.dot(np.cross(elbows[1] - elbows[0], elbows[2] - elbows[0]), x - elbows[0])
    if beneath > 0 or abs(np.linalg.det(directions)) < 0.1:
        return None
    return x


def optimum(nominal, xs, joints, whiten, tolerance):
    sigmas = None
    start = np.concatenate(nominal)
    if tolerance is not None:
        length, angle = tolerance
        sigmas = np.array(([length] * 3 + [angle] * 2 + [length] * 3) * 3)

    def residual(p):
        r = closures(p, xs, joints, whiten)
        return r if sigmas is None else np.concatenate([r, (p - start) / sigmas])

    def derivative(p):
        j = jacobian(p, xs, joints, whiten)
        return j if sigmas is None else np.vstack([j, np.diag(1 / sigmas)])

    result = start
    # Three runs from the previous end: central differences limit each.
    for _ in range(3):
        result = least_squares(residual, result, jac=derivative, x_scale=SCALE, **EXACTLY).x
    # One Gauss-Newton step more.
    j = derivative(result) * SCALE
    result = result - SCALE * np.linalg.lstsq(j, residual(result), rcond=None)[0]
    j = derivative(result) * SCALE
    covariance = np.linalg.inv(j.T @ j) * np.outer(SCALE, SCALE)
    return result, covariance, float(residual(result) @ residual(result))


def main():
    rng = np.random.default_rng(20261122)
    made = robots()
    cases = []
    for number in range(20):
        nominal = made[number % len(made)]
        count, sigma_x, sigma_q, prior = [
            (20, (0.02, 0.02, 0.02), 0.002, True),
            (20, (0.02, 0.02, 0.02), 0.002, False),
            (12, (0.05, 0.05, 0.05), 0.0, True),
            (40, (0.02, 0.02, 0.1), 0.002, True),
            (60, (0.01, 0.03, 0.02), 0.01, False),
            (30, None, 0.0, False),
        ][number % 6]
        spread = np.array([0.5] * 3 + [0.2 * DEGREE] * 2 + [0.5] * 3)
        truth = [p + spread * rng.standard_normal(8) for p in nominal]
        joints, positions = [], []
        actual = sigma_x or (0.02,) * 3
        while len(joints) < count:
            q = rng.uniform(-40 * DEGREE, 70 * DEGREE, 3)
            x = below(truth, q)
            if x is None:
                continue
            joints.append(q + sigma_q * DEGREE * rng.standard_normal(3))
            positions.append(x + np.array(actual) * rng.standard_normal(3))
        joints, positions = np.array(joints), np.array(positions)
        noise = None if sigma_x is None else (*sigma_x, sigma_q * DEGREE)
        tolerance = (0.5, 0.2 * DEGREE) if prior else None
        stated = noise or (1.0, 1.0, 1.0, 0.0)
        whiten = whitening(nominal, positions, joints, stated[:3], stated[3])
        parameters, covariance, cost = optimum(nominal, positions, joints, whiten, tolerance)
        cases.append(
            {
                "nominal": bits_of(np.concatenate(nominal)),
                "joints": bits_of(joints),
                "positions": bits_of(positions),
                "noise_by_axis": None if noise is None else bits_of(noise),
                "tolerance": None if tolerance is None else bits_of(tolerance),
                "parameters": bits_of(parameters),
                "covariance": bits_of(covariance),
                "cost": bits(cost),
            }
        )
    write("generate_joint.py", cases, np, scipy)


if __name__ == "__main__":
    main()
