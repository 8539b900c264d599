"""Independent robust fits of the joint problem, computed with NumPy.

Nothing here is shared with the Rust code but the definitions: d = |W f| of a sample's three closures, W from
their dense covariance at the nominal robot; weights of Huber's loss (k = 1.345, nothing from 4.685 on) and of
Tukey's (c = 4.685), wider by what the length of three residuals asks for; the scale is median d / 1.538172 *
sqrt(n/(n - 12)), 1 or more with a stated noise. The fits start from the truth, so that no search for a start
is needed, and are repeated until weights and scale stand still. Jacobians are central differences. The
covariance is Huber's (1981, section 7.6) of vectors of three, mean psi^2 / (mean psi')^2 (J^T J)^-1, with J^T J
from the weighted rows, and sigma as stated or estimated.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 tests/goldens/generate_robust.py > tests/goldens/numpy_robust.json
"""

import numpy as np
from generate import DEGREE, bits_of, forward, nominal_robot, write
from generate_joint import SCALE, closures, jacobian, whitening

K, C = 1.345, 4.685
STRETCH = {"huber": 1.210396, "tukey": 1.171878}
MEDIAN = 1.538172


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


def weighted_fit(p, xs, joints, whiten, w):
    root = np.sqrt(np.repeat(w, 3))
    for _ in range(3):
        r = closures(p, xs, joints, whiten) * root
        j = jacobian(p, xs, joints, whiten) * root[:, None]
        p = p - SCALE * np.linalg.lstsq(j * SCALE, r, rcond=None)[0]
    return p


def robust(truth, xs, joints, whiten, stated, loss, good):
    n = len(xs)
    p = weighted_fit(truth, xs, joints, whiten, good.astype(float))
    previous = None
    for _ in range(100):
        d = np.linalg.norm(closures(p, xs, joints, whiten).reshape(n, 3), axis=1)
        scale = np.median(d) / MEDIAN * np.sqrt(n / (n - 12))
        if stated:
            scale = max(scale, 1.0)
        unit = scale * STRETCH[loss]
        w = weight(loss, d / unit)
        if previous is not None and np.max(np.abs(w - previous)) < 1e-9:
            break
        previous = w
        p = weighted_fit(p, xs, joints, whiten, w)
    else:
        return None
    kept = w > 0
    r, wk = (d / scale)[kept], w[kept]
    # The slope of psi along the residual, and psi/r in the two directions across it.
    slopes = (slope(loss, (d / unit)[kept]) + 2 * wk) / 3
    variance = np.mean(wk * r**2) / 3 / np.mean(slopes)
    kappa = np.mean((wk * r) ** 2) / 3 * np.mean(wk) / np.mean(slopes) ** 2 / variance
    j = jacobian(p, xs, joints, whiten) * SCALE
    information = (j * np.repeat(w, 3)[:, None]).T @ j
    covariance = np.linalg.inv(information) * np.outer(SCALE, SCALE) * kappa
    if not stated:
        worth = np.sum(slopes) / kappa
        covariance = covariance * np.sum(w * d**2) / kappa / (3 * worth - 24 - 2)
    return p, w, ~kept, covariance


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
            noise = (sigma_x, sigma_q * DEGREE) if stated else (1.0, 0.0)
            whiten = whitening(nominal, positions, joints, (noise[0],) * 3, noise[1])
            truth = np.concatenate(truth)
            found = robust(truth, positions, joints, whiten, stated, loss, good)
        parameters, weights, rejected, covariance = found
        cases.append(
            {
                "joints": bits_of(joints),
                "positions": bits_of(positions),
                "noise": bits_of((sigma_x, sigma_q * DEGREE)) if stated else None,
                "tolerance": None,
                "loss": loss,
                "parameters": bits_of(parameters),
                "weights": bits_of(weights),
                "rejected": [bool(r) for r in rejected],
                "covariance": bits_of(covariance),
            }
        )
    write("generate_robust.py", cases, np)


if __name__ == "__main__":
    main()
