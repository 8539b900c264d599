"""Independent robust fits of the IKM problem, computed with NumPy.

Nothing here is shared with the Rust code but the definitions: weights of Huber's loss (k = 1.345, nothing
from 4.685 on) and of Tukey's (c = 4.685); the scale is the largest of the arms' median|r|/0.6745 *
sqrt(n/(n - 8)), 1 or more with a stated noise; a sample that one arm rejects counts in none. The fits start from the truth, so
that no search for a start is needed, and are repeated until weights and scales stand still. Jacobians
are central differences. The covariance is Huber's (1981, section 7.6), mean psi^2 / (mean psi')^2 (J^T J)^-1,
with J^T J from the weighted rows, and sigma as stated or estimated.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 tests/goldens/generate_robust.py > tests/goldens/numpy_robust.json
"""

import numpy as np
from generate import DEGREE, basis, bits_of, elbow, elbow_derivative, forward, nominal_robot, write

K, C = 1.345, 4.685
SCALE = np.array([100.0] * 3 + [1.0] * 2 + [100.0] * 3)


def weight(loss, r):
    r = np.abs(r)
    w = (1 - (r / C) ** 2) ** 2 if loss == "tukey" else np.minimum(1, K / np.maximum(r, 1e-300))
    return np.where(r < C, w, 0.0)


def slope(loss, r):
    r = np.abs(r)
    if loss == "tukey":
        s = (1 - (r / C) ** 2) * (1 - 5 * (r / C) ** 2)
        return np.where(r < C, s, 0.0)
    return np.where(r <= K, 1.0, 0.0)


def residuals(p, xs, qs, by_sigma):
    ex, ez = basis(p)
    u = p[5] * ex + p[6] * ez
    v = p[6] * ex - p[5] * ez
    w = xs - (p[:3] + np.outer(np.cos(qs), u) + np.outer(np.sin(qs), v))
    return (np.sum(w * w, axis=1) - p[7] ** 2) * by_sigma


def jacobian(p, xs, qs, by_sigma):
    columns = []
    for h in np.diag(SCALE * 1e-6):
        ahead, behind = (residuals(p + s * h, xs, qs, by_sigma) for s in (1, -1))
        columns.append((ahead - behind) / (2 * h.sum()))
    return np.column_stack(columns)


def weighted_fit(p, xs, qs, by_sigma, w):
    root = np.sqrt(w)
    for _ in range(3):
        r = residuals(p, xs, qs, by_sigma) * root
        j = jacobian(p, xs, qs, by_sigma) * root[:, None]
        p = p - SCALE * np.linalg.lstsq(j * SCALE, r, rcond=None)[0]
    return p


def robust(truth, xs, joints, by_sigma, stated, loss, good):
    arms = [weighted_fit(truth[k], xs, joints[:, k], by_sigma[k], good.astype(float)) for k in range(3)]
    n = len(xs)
    previous = None
    for _ in range(100):
        rs = [residuals(arms[k], xs, joints[:, k], by_sigma[k]) for k in range(3)]
        scale = max(np.median(np.abs(r)) for r in rs) / 0.6745 * np.sqrt(n / (n - 8))
        if stated:
            scale = max(scale, 1.0)
        rejected = np.any([np.abs(r) >= C * scale for r in rs], axis=0)
        ws = [np.where(rejected, 0.0, weight(loss, r / scale)) for r in rs]
        if previous is not None and max(np.max(np.abs(a - b)) for a, b in zip(ws, previous)) < 1e-9:
            break
        previous = ws
        arms = [weighted_fit(arms[k], xs, joints[:, k], by_sigma[k], ws[k]) for k in range(3)]
    else:
        return None
    covariances = []
    for k in range(3):
        kept = ws[k] > 0
        r, w = (rs[k] / scale)[kept], ws[k][kept]
        variance = np.mean(w * r**2) / np.mean(slope(loss, r))
        kappa = np.mean((w * r) ** 2) * np.mean(w) / np.mean(slope(loss, r)) ** 2 / variance
        j = jacobian(arms[k], xs, joints[:, k], by_sigma[k])
        covariance = np.linalg.inv((j * ws[k][:, None]).T @ j) * kappa
        if not stated:
            worth = np.sum(slope(loss, r)) / kappa
            covariance = covariance * np.sum(ws[k] * rs[k] ** 2) / kappa / (worth - 8 - 2)
        covariances.append(covariance)
    return arms, ws, rejected, covariances


def main():
    rng = np.random.default_rng(20260601)
    cases = []
    for count, wrong, sigma_x, sigma_q, stated, loss in [
        (60, 12, 0.02, 0.002, True, "tukey"),
        (60, 12, 0.02, 0.002, True, "huber"),
        (60, 12, 0.02, 0.002, False, "tukey"),
        (60, 12, 0.02, 0.002, False, "huber"),
        (30, 4, 0.1, 0.01, True, "tukey"),
        (41, 5, 0.05, 0.0, False, "tukey"),
        (40, 0, 0.02, 0.002, True, "huber"),
        (40, 0, 0.02, 0.002, False, "tukey"),
    ]:
        found = None
        while found is None:
            nominal = nominal_robot()
            spread = np.array([1.0] * 3 + [0.5 * DEGREE] * 2 + [1.0] * 3)
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
            good = np.ones(count, dtype=bool)
            for number, index in enumerate(rng.permutation(count)[:wrong]):
                good[index] = False
                if number % 3 == 2:
                    joints[index, number // 3 % 3] += rng.uniform(1, 10) * DEGREE
                else:
                    direction = rng.standard_normal(3)
                    positions[index] += rng.uniform(5, 50) * direction / np.linalg.norm(direction)
            by_sigma = []
            for k in range(3):
                if not stated:
                    by_sigma.append(np.ones(count) / (2 * nominal[k][7]))
                    continue
                by_position = 2 * nominal[k][7] * sigma_x
                by_joint = [
                    2 * (x - elbow(nominal[k], q)) @ elbow_derivative(nominal[k], q) * sigma_q * DEGREE
                    for x, q in zip(positions, joints[:, k])
                ]
                by_sigma.append(1 / np.hypot(by_position, by_joint))
            found = robust(truth, positions, joints, by_sigma, stated, loss, good)
        arms, weights, rejected, covariances = found
        cases.append(
            {
                "joints": bits_of(joints),
                "positions": bits_of(positions),
                "noise": bits_of((sigma_x, sigma_q * DEGREE)) if stated else None,
                "tolerance": None,
                "loss": loss,
                "parameters": [bits_of(p) for p in arms],
                "weights": bits_of(np.min(weights, axis=0)),
                "rejected": [bool(r) for r in rejected],
                "covariance": [bits_of(c) for c in covariances],
            }
        )
    write("generate_robust.py", cases, np)


if __name__ == "__main__":
    main()
