"""Independent optima of calibrations from positions, heights and distances, computed with SciPy.

Nothing here is shared with the Rust code but the definitions that follow. X is the platform point of the
24 parameters P at the joint angles q: that intersection of the three spheres about the elbows which lies
below them, here in closed form and in millimetres. A row has the measured joint angles of a pose and one or
more of the predictions

    position   y = X in the base's frame, or y = R X + t in the sensor's frame, whole or by some coordinates
    height     h = (X_z - c - a X_x - b X_y) / sqrt(1 + a^2 + b^2) above the plane z = c + a x + b y
    distance   d = |X - p| + o from the point p, with an unknown offset o at those points that say so,
               or d = |X - X'| with X' at a second pose's joint angles q'

In a case with transmissions the angle of an arm is q + g q + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q, five
further unknowns a joint.

and W is the inverse of NumPy's Cholesky factor of the row's covariance

    cov = diag(sigma^2) + sq^2 G G^T

with G the derivative of the row's predictions by its three joint angles, or six when there are q'. G is taken
once, at the nominal robot and at the start values of R, t, c, a, b, p and o. The cost is

    sum |W (measured - predicted)|^2 + sum ((P - P_nominal) / tolerance)^2
        + sum over known points |p - p0|^2 / s^2 + sum over known planes (c - c0)^2 / s^2
        + sum over the numbers of transmissions (n / transmission)^2

where a case without tolerance lacks the second sum. With X = FK(P_nominal; q) of the rows that measure it, the
start values are

    plane      the least squares fit of X_z - h sqrt(1 + a^2 + b^2) = c + a X_x + b X_y, whether its height is known or
               not: three passes, the root from the pass before, at first 1.
    point      The known place with o = 0, or else the linear least squares |X|^2 - d^2 = 2 X.p - k by p
               and k, with an offset |X|^2 - d^2 = 2 X.p - 2 d o - k by p, o and k.
    frame      From the rows with x, y and z: the proper rotation and the translation that best take X to y,
               all coordinates weighing the same. If the rows have x and y alone: y_xy = A X + e by least
               squares, the third row of A is the cross product of the first two, normalised, R is the
               proper rotation nearest to A, and t_xy = mean(y_xy - (R X)_xy). Nothing then tells t_z: it is
               0 and no unknown, and the case says "fixed".

All parameters and unknowns are solved for at once by `scipy.optimize.least_squares` with MINPACK's lmder
tolerances at their limit and derivatives by the complex step, which are exact to rounding. Each optimum is
asserted to be stationary and to be found again from distant starts. `sigmas` are the square roots of the first
24 diagonal entries of the inverse of J^T J of the whole problem.

Numbers are stored as the bits of IEEE doubles. `noise` is sx, sy, sz, the sigma of a height, that of a distance,
and sq; `tolerance` is the length and the angle; a known plane is c0 and s, a known point x, y, z and s. A height
is the number of its plane and the value. `unknowns` are c, a, b of every plane, then x, y, z of every point, with o
after them if it has one; R and t are not stored. `numbers` are g, c1, s1, c2, s2 of every joint.

    pip install numpy==2.4.6 scipy==1.17.1
    python3 tests/goldens/generate_observations.py > tests/goldens/scipy_observations.json
"""

import numpy as np
import scipy
from generate import DEGREE, EXACTLY, basis, bits, bits_of, elbow, write
from scipy.optimize import least_squares

PARAMETERS = np.tile([100.0] * 3 + [1.0] * 2 + [100.0] * 3, 3)
LOW, HIGH = -25 * DEGREE, 50 * DEGREE


def forward(parameters, joints):
    """X of every row of joints, in closed form; not a number where the spheres do not meet."""
    arms = np.reshape(parameters, (3, 8))
    elbows = []
    for p, q in zip(arms, joints.T):
        ex, ez = basis(p)
        u = p[5] * ex + p[6] * ez
        v = p[6] * ex - p[5] * ez
        elbows.append(p[:3] + np.outer(np.cos(q), u) + np.outer(np.sin(q), v))
    first, second, third = elbows
    e, f = second - first, third - first
    ee, ef, ff = (np.sum(g * h, axis=1) for g, h in ((e, e), (e, f), (f, f)))
    fore = arms[:, 7] ** 2
    by_e, by_f = (fore[0] - fore[1] + ee) / 2, (fore[0] - fore[2] + ff) / 2
    gram = ee * ff - ef**2
    s, t = (by_e * ff - by_f * ef) / gram, (by_f * ee - by_e * ef) / gram
    across = s[:, None] * e + t[:, None] * f
    up = np.cross(e, f)
    with np.errstate(invalid="ignore"):
        depth = np.sqrt((fore[0] - np.sum(across**2, axis=1)) / np.sum(up**2, axis=1))
    return first + across - depth[:, None] * up


def turned(numbers, joints):
    """The angles of the arms."""
    q = np.asarray(joints)
    parts = [q, np.cos(q), np.sin(q), np.cos(2 * q), np.sin(2 * q)]
    return q + sum(n * part for n, part in zip(np.reshape(numbers, (3, 5)).T, parts))


def plane_through(x, heights):
    """c, a and b of the plane that touches are nearest to."""
    root = 1.0
    for _ in range(3):
        columns = np.column_stack([np.ones(len(x)), x[:, 0], x[:, 1]])
        c, a, b = np.linalg.lstsq(columns, x[:, 2] - heights * root, rcond=None)[0]
        root = np.sqrt(1 + a**2 + b**2)
    return [c, a, b]


def rotation(w):
    """The rotation whose quaternion is along (1, w/2): analytic, unlike the angle |w|."""
    v = np.asarray(w) / 2
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 / (1 + np.sum(v * v)) * (k + k @ k)


def proper(matrix):
    """The proper rotation nearest to a matrix."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def length(v):
    return np.sqrt(np.sum(v * v, axis=-1))


class Problem:
    """The rows and instruments of a case, and its residuals as a function of what is unknown."""

    def __init__(self, nominal, tolerance, noise, frame, fixed, planes, points, rows, transmission):
        self.transmission = transmission
        self.nominal, self.tolerance, self.noise = nominal, tolerance, np.array(noise)
        self.frame, self.fixed, self.planes, self.points = frame, fixed, planes, points
        self.rows = rows
        self.joints = np.array([row["joints"] for row in rows])
        self.seconds = np.array([row.get("to", row["joints"]) for row in rows])
        # Columns of measured: x, y, z, height, distance.
        self.measured = np.full((len(rows), 5), np.nan)
        self.plane = np.array([row.get("plane", -1) for row in rows])
        self.point = np.array([row.get("point", -1) for row in rows])
        self.between = np.array(["to" in row for row in rows])
        for values, row in zip(self.measured, rows):
            values[:3] = row.get("position", [np.nan] * 3)
            values[3] = row.get("height", np.nan)
            values[4] = row.get("distance", np.nan)
        self.present = ~np.isnan(self.measured)
        self.in_frame = 0 if frame == "base" else 5 if fixed else 6
        self.turn = np.eye(3)
        self.start = self.start_values()
        self.whiten = self.whitening()

    def start_values(self):
        xs = forward(self.nominal, self.joints)
        start = [self.nominal]
        if self.frame == "sensor":
            self.turn, shift = self.start_frame(xs)
            start += [np.zeros(3), shift[:2] if self.fixed else shift]
        for k in range(len(self.planes)):
            on = self.plane == k
            start.append(plane_through(xs[on], self.measured[on, 3]))
        for k, (known, offset) in enumerate(self.points):
            if known is not None:
                start.append([*known[:3], 0.0] if offset else known[:3])
                continue
            x, d = xs[self.point == k], self.measured[self.point == k, 4]
            # About the mean of X, which changes k alone, for the sake of rounding.
            middle = x.mean(axis=0)
            x = x - middle
            columns = [2 * x] + ([-2 * d[:, None]] if offset else []) + [-np.ones((len(d), 1))]
            found = np.linalg.lstsq(np.hstack(columns), np.sum(x * x, axis=1) - d**2, rcond=None)[0]
            start.append(np.concatenate([found[:3] + middle, found[3:-1]]))
        start.append(np.zeros(self.numbers()))
        return np.concatenate(start)

    def numbers(self):
        return 0 if self.transmission is None else 15

    def start_frame(self, xs):
        if self.fixed:
            on = self.present[:, 0] & self.present[:, 1]
            x, y = xs[on], self.measured[on, :2]
            affine = np.linalg.lstsq(np.hstack([x, np.ones((len(x), 1))]), y, rcond=None)[0][:3].T
            third = np.cross(affine[0], affine[1])
            turn = proper(np.vstack([affine, third / length(third)]))
            return turn, np.append(np.mean(y - (x @ turn.T)[:, :2], axis=0), 0.0)
        on = self.present[:, :3].all(axis=1)
        x, y = xs[on], self.measured[on, :3]
        turn = proper((y - y.mean(axis=0)).T @ (x - x.mean(axis=0)))
        return turn, np.mean(y - x @ turn.T, axis=0)

    def predicted(self, unknown, joints, seconds):
        """x, y, z, height and distance of every row, zero where a row lacks it."""
        last = len(unknown) - self.numbers()
        if self.numbers():
            joints, seconds = (turned(unknown[last:], own) for own in (joints, seconds))
        xs = forward(unknown[:24], joints)
        result = np.zeros((len(xs), 5), dtype=np.result_type(unknown, joints, seconds))
        at = 24 + self.in_frame
        result[:, :3] = xs
        if self.frame == "sensor":
            result[:, :3] = xs @ (rotation(unknown[24:27]) @ self.turn).T
            result[:, : self.in_frame - 3] += unknown[27:at]
        for k in range(len(self.planes)):
            c, a, b = unknown[at : at + 3]
            at += 3
            on = self.plane == k
            x, y, z = xs[on].T
            result[on, 3] = (z - c - a * x - b * y) / np.sqrt(1 + a**2 + b**2)
        for k, (_, offset) in enumerate(self.points):
            on = self.point == k
            result[on, 4] = length(xs[on] - unknown[at : at + 3])
            if offset:
                result[on, 4] += unknown[at + 3]
            at += 4 if offset else 3
        on = self.between
        result[on, 4] = length(xs[on] - forward(unknown[:24], seconds[on]))
        assert at == last
        return np.where(self.present, result, 0)

    def whitening(self):
        """W of every row by its five possible residuals, zero where the row lacks one."""
        step = 1e-30j
        derivatives = []
        for h in np.eye(3) * step:
            derivatives.append(self.predicted(self.start, self.joints + h, self.seconds))
        for h in np.eye(3) * step:
            derivatives.append(self.predicted(self.start, self.joints, self.seconds + h))
        by_joints = np.stack(derivatives, axis=2).imag / step.imag
        factors = np.zeros((len(self.rows), 5, 5))
        for w, g, on in zip(factors, by_joints, self.present):
            g = g[on]
            covariance = np.diag(self.noise[:5][on] ** 2) + self.noise[5] ** 2 * g @ g.T
            w[np.ix_(on, on)] = np.linalg.inv(np.linalg.cholesky(covariance))
        return factors

    def sigmas_of_tolerance(self):
        by_length, by_angle = self.tolerance
        return np.tile([by_length] * 3 + [by_angle] * 2 + [by_length] * 3, 3)

    def residual(self, unknown):
        predicted = self.predicted(unknown, self.joints, self.seconds)
        difference = np.where(self.present, self.measured, 0) - predicted
        parts = [np.einsum("nij,nj->ni", self.whiten, difference)[self.present]]
        if self.tolerance is not None:
            parts.append((unknown[:24] - self.nominal) / self.sigmas_of_tolerance())
        at = 24 + self.in_frame
        for known in self.planes:
            if known is not None:
                parts.append((unknown[at : at + 1] - known[0]) / known[1])
            at += 3
        for known, offset in self.points:
            if known is not None:
                parts.append((unknown[at : at + 3] - known[:3]) / known[3])
            at += 4 if offset else 3
        if self.numbers():
            parts.append(unknown[at:] / self.transmission)
        return np.concatenate(parts)

    def jacobian(self, unknown):
        step = 1e-30j
        columns = [self.residual(unknown + h).imag for h in np.eye(len(unknown)) * step]
        return np.column_stack(columns) / step.imag

    def scale(self):
        parts = [PARAMETERS, [1.0] * 3, [100.0] * 3] if self.frame == "sensor" else [PARAMETERS]
        if self.fixed:
            parts[-1] = [100.0] * 2
        parts += [[100.0, 1.0, 1.0]] * len(self.planes)
        parts += [[100.0] * (4 if offset else 3) for _, offset in self.points]
        parts.append([1.0] * self.numbers())
        return np.concatenate(parts)

    def descend(self, start):
        """The optimum from a start, the covariance there and the Gauss-Newton step left, in sigmas."""
        scale = self.scale()
        result = least_squares(self.residual, start, jac=self.jacobian, x_scale=scale, **EXACTLY).x
        # MINPACK stops at the rounding of the cost, Gauss-Newton steps at that of the gradient.
        for _ in range(5):
            j = self.jacobian(result) * scale
            result = result - scale * np.linalg.lstsq(j, self.residual(result), rcond=None)[0]
        j = self.jacobian(result) * scale
        covariance = np.linalg.inv(j.T @ j)
        step = covariance @ (j.T @ self.residual(result))
        covariance = covariance * np.outer(scale, scale)
        sigmas = np.sqrt(np.diag(covariance))
        return result, covariance, np.max(np.abs(step * scale / sigmas))

    def optimum(self, rng):
        """The optimum from the start values, asserted to be stationary and found from elsewhere."""
        result, covariance, step = self.descend(self.start)
        cost = np.sum(self.residual(result) ** 2)
        sigmas = np.sqrt(np.diag(covariance))
        assert step < 1e-9, step
        # Instruments by 50 mm and slopes and turns of 0.2, the robot by three tolerances.
        away = np.where(self.scale() == 1.0, 0.2, 50.0)
        away[:24] = np.where(PARAMETERS == 1.0, 0.6 * DEGREE, 1.5)
        away[len(away) - self.numbers() :] = 0.2 * DEGREE
        for _ in range(4):
            elsewhere = self.start + away * rng.uniform(-1, 1, len(away))
            again = self.descend(elsewhere)[0]
            assert np.max(np.abs(again - result) / sigmas) < 1e-7
            assert abs(np.sum(self.residual(again) ** 2) - cost) < 1e-9 * cost
        return result, covariance, cost


class Bench:
    """A robot that differs from its nominal parameters, and what its instruments show."""

    def __init__(self, rng, nominal, spread, noise):
        self.rng, self.nominal, self.noise = rng, nominal, noise
        by_length, by_angle = spread
        sigmas = np.tile([by_length] * 3 + [by_angle] * 2 + [by_length] * 3, 3)
        self.truth = nominal + sigmas * rng.standard_normal(24)
        self.turn, self.shift = np.eye(3), np.zeros(3)
        self.planes, self.points, self.rows = [], [], []
        self.numbers = np.zeros(15)
        self.middle = forward(nominal, np.full((1, 3), 12 * DEGREE))[0]

    def at(self, q):
        """X of the robot as it is at the joint angles of a pose."""
        return forward(self.truth, turned(self.numbers, q)[None])[0]

    def usable(self, q):
        """In range and clear of singularities, for the robot as it is and as it should be."""
        if not np.all((q > LOW) & (q < HIGH)):
            return False
        for parameters in (self.truth, self.nominal):
            arms = parameters.reshape(3, 8)
            forearms = forward(parameters, q[None])[0] - [elbow(p, a) for p, a in zip(arms, q)]
            # Not a number compares false.
            if not abs(np.linalg.det(forearms / length(forearms)[:, None])) > 0.2:
                return False
        return True

    def pose(self):
        while True:
            q = self.rng.uniform(LOW, HIGH, 3)
            if self.usable(q):
                return q

    def reach(self, x):
        """Joint angles with which the robot as it is reaches x, or none."""
        q = []
        for p in self.truth.reshape(3, 8):
            u, v = elbow(p, 0.0) - p[:3], elbow(p, np.pi / 2) - p[:3]
            w = x - p[:3]
            along, side = 2 * w @ u, 2 * w @ v
            ratio = (w @ w + u @ u - p[7] ** 2) / np.hypot(along, side)
            if abs(ratio) >= 1:
                return None
            either = np.arctan2(side, along) + np.array([-1, 1]) * np.arccos(ratio)
            either = (either + np.pi) % (2 * np.pi) - np.pi
            either = either[(either > LOW) & (either < HIGH)]
            if len(either) != 1:
                return None
            q.append(either[0])
        q = np.array(q)
        if not self.usable(q) or length(forward(self.truth, q[None])[0] - x) > 1e-9:
            return None
        return q

    def on_plane(self, plane, height):
        """A pose at a height above a plane."""
        c, a, b = self.planes[plane]
        while True:
            x = forward(self.truth, self.pose()[None])[0]
            x[2] = c + a * x[0] + b * x[1] + height * np.sqrt(1 + a**2 + b**2)
            q = self.reach(x)
            if q is not None:
                return q

    def on_sphere(self, point, distance):
        """A pose at a distance from a point."""
        while True:
            direction = self.rng.standard_normal(3)
            q = self.reach(self.points[point][:3] + distance * direction / length(direction))
            if q is not None:
                return q

    def apart(self, low, high):
        """Two poses with a distance in a range."""
        while True:
            q, to = self.pose(), self.pose()
            x, there = self.at(q), self.at(to)
            if low < length(x - there) < high:
                return q, to

    def measure(self, q, axes="", plane=None, point=None, to=None, height=None, distance=None):
        """Adds a row; a stated height or distance is that of a gauge, which the pose meets."""
        deviates = self.rng.standard_normal(11)
        x = self.at(q)
        row = {"joints": q + self.noise[5] * deviates[:3]}
        if axes:
            y = self.turn @ x + self.shift + self.noise[:3] * deviates[3:6]
            row["position"] = [y[k] if axis in axes else np.nan for k, axis in enumerate("xyz")]
        if plane is not None:
            c, a, b = self.planes[plane]
            row["plane"], row["height"] = plane, height
            if height is None:
                row["height"] = (x[2] - c - a * x[0] - b * x[1]) / np.sqrt(1 + a**2 + b**2)
                row["height"] += self.noise[3] * deviates[6]
        if point is not None:
            place = self.points[point]
            row["point"], row["distance"] = point, distance
            if distance is None:
                row["distance"] = length(x - place[:3]) + (place[3] if len(place) > 3 else 0.0)
                row["distance"] += self.noise[4] * deviates[7]
        if to is not None:
            there = self.at(to)
            row["to"] = to + self.noise[5] * deviates[8:]
            row["distance"] = length(x - there) + self.noise[4] * deviates[7]
        self.rows.append(row)

    def block(self, plane, height):
        """A gauge block touched with the noise of a height."""
        met = height + self.noise[3] * self.rng.standard_normal()
        self.measure(self.on_plane(plane, met), plane=plane, height=height)

    def bar(self, point, distance):
        """A ball bar whose length is held with the noise of a distance."""
        met = distance + self.noise[4] * self.rng.standard_normal()
        self.measure(self.on_sphere(point, met), point=point, distance=distance)

    def tilted(self, tilt, azimuth, above):
        """A plane by its slope's angle and direction, and by its height above the middle pose."""
        a = np.tan(tilt * DEGREE) * np.cos(azimuth * DEGREE)
        b = np.tan(tilt * DEGREE) * np.sin(azimuth * DEGREE)
        self.planes.append(np.array([self.middle[2] + above, a, b]))

    def socket(self, x, y, above, *offset):
        self.points.append(np.concatenate([self.middle + [x, y, above], offset]))

    def problem(
        self,
        tolerance,
        frame="base",
        fixed=False,
        known_planes=None,
        known_points=None,
        transmission=None,
    ):
        """The problem as it is stated to the calibration; what is known is known with its sigma."""
        planes, points = [], []
        for k, plane in enumerate(self.planes):
            sigma = (known_planes or {}).get(k)
            deviate = self.rng.standard_normal()
            planes.append(None if sigma is None else np.array([plane[0] + sigma * deviate, sigma]))
        for k, point in enumerate(self.points):
            sigma = (known_points or {}).get(k)
            deviates = self.rng.standard_normal(3)
            known = None
            if sigma is not None:
                known = np.append(point[:3] + sigma * deviates, sigma)
            points.append((known, len(point) > 3))
        return Problem(
            self.nominal, tolerance, self.noise, frame, fixed, planes, points, self.rows, transmission
        )


def symmetric(base, platform, upper, fore):
    r = base - platform
    thetas = [k * 120 * DEGREE for k in range(3)]
    return np.concatenate(
        [[r * np.cos(t), r * np.sin(t), 0, t, 0, upper, 0.0, fore] for t in thetas]
    )


def asymmetric():
    """Arms that differ in every parameter, with axes tilted out of the base plane."""
    robot = symmetric(194.0, 30.0, 260.0, 480.0).reshape(3, 8)
    robot[:, 2] = 0.0, 3.0, -2.0
    robot[:, 3] += np.array([0.0, 4.0, -6.0]) * DEGREE
    robot[:, 4] = np.array([6.0, -4.0, 9.0]) * DEGREE
    robot[:, 5] = 260.0, 240.0, 275.0
    robot[:, 6] = 5.0, -8.0, 0.0
    robot[:, 7] = 480.0, 510.0, 460.0
    return robot.ravel()


GEOMETRIES = {
    "paper": symmetric(194.0, 30.0, 260.0, 480.0),
    "long": symmetric(200.0, 45.0, 235.0, 800.0),
    "small": symmetric(60.0, 25.0, 70.0, 150.0),
    "asymmetric": asymmetric(),
}


def benches():
    """Name, geometry, bench and problem of every case."""
    made = []

    def bench(name, geometry, position=0.02, height=0.02, distance=0.05, joint=0.002):
        rng = np.random.default_rng([20261123, len(made)])
        spread = (0.2 if geometry == "small" else 0.5, 0.2 * DEGREE)
        noise = np.concatenate([np.broadcast_to(position, 3), [height, distance, joint * DEGREE]])
        made.append([name, geometry, Bench(rng, GEOMETRIES[geometry], spread, noise), None])
        return made[-1][2], spread

    def close(problem):
        made[-1][3] = problem

    for geometry, joint in (("paper", 0.002), ("long", 0.0)):
        b, spread = bench("one plane with gauge blocks", geometry, joint=joint)
        b.tilted(0.5, 40.0, -60.0)
        for k in range(45):
            b.block(0, [0.0, 60.0, 120.0][k % 3])
        close(b.problem(spread))

    b, spread = bench("three tilted planes", "asymmetric")
    for tilt, azimuth, above in ((3.0, 100.0, -50.0), (20.0, -30.0, 0.0), (14.0, 200.0, 30.0)):
        b.tilted(tilt, azimuth, above)
    for k in range(60):
        b.measure(b.on_plane(k % 3, b.rng.uniform(0, 50)), plane=k % 3)
    close(b.problem(spread))

    b, spread = bench("ball bar on one socket", "paper", distance=0.005)
    b.socket(20.0, -35.0, -120.0)
    for _ in range(60):
        b.bar(0, 200.0)
    close(b.problem(spread))

    b, spread = bench("three points", "long")
    for x, y, above in ((150.0, 20.0, -150.0), (-90.0, 130.0, -100.0), (-60.0, -140.0, 180.0)):
        b.socket(x, y, above)
    for k in range(60):
        b.measure(b.pose(), point=k % 3)
    close(b.problem(spread))

    for geometry, far in (("small", 0.3), ("paper", 1.0)):
        b, spread = bench("two points with unknown offset", geometry)
        b.socket(160.0 * far, 60.0 * far, -130.0 * far, 12.25)
        b.socket(-110.0 * far, -150.0 * far, 90.0 * far, -3.5)
        for k in range(60):
            b.measure(b.pose(), point=k % 2)
        close(b.problem(spread))

    b, spread = bench("distances between poses", "paper")
    for _ in range(40):
        q, to = b.apart(60.0, 350.0)
        b.measure(q, to=to)
    close(b.problem(spread))

    b, spread = bench("x and y in the sensor's frame", "asymmetric")
    b.turn, b.shift = rotation([0.9, -0.5, 1.6]), np.array([310.0, -120.0, 0.0])
    for _ in range(40):
        b.measure(b.pose(), "xy")
    close(b.problem(spread, "sensor", True))

    b, spread = bench("x, y and z in the sensor's frame", "long", (0.05, 0.05, 0.02))
    b.turn, b.shift = rotation([-2.1, 3.4, 1.2]), np.array([-450.0, 80.0, 1200.0])
    for _ in range(45):
        b.measure(b.pose(), "xyz")
    close(b.problem(spread, "sensor"))

    b, spread = bench("z alone in the base's frame", "paper")
    for _ in range(40):
        b.measure(b.pose(), "z")
    close(b.problem(spread))

    b, spread = bench("a mixture with gaps", "asymmetric", (0.02, 0.03, 0.05))
    b.tilted(8.0, 75.0, -150.0)
    b.socket(120.0, 40.0, -110.0)
    b.socket(-80.0, 100.0, -160.0, 7.75)
    for k in range(48):
        axes = ["xyz", "xy", "", "z", "xz", "", "yz", "x"][k % 8]
        plane = 0 if k % 3 == 0 or axes == "" else None
        q, to = b.apart(60.0, 350.0) if k % 4 == 1 else (b.pose(), None)
        point = None if k % 4 in (1, 3) else k // 2 % 2
        b.measure(q, axes, plane, point, to)
    close(b.problem(spread))

    b, spread = bench("a known point and a plane of known height", "small")
    b.tilted(6.0, -50.0, -25.0)
    b.socket(25.0, -30.0, -35.0)
    for k in range(50):
        if k % 2 == 0:
            b.block(0, [0.0, 10.0, 25.0][k // 2 % 3])
        else:
            b.measure(b.pose(), point=0)
    close(b.problem(spread, known_planes={0: 0.05}, known_points={0: 0.1}))

    b, _ = bench("no tolerance, full rank in the base's frame", "paper")
    b.socket(90.0, -70.0, -130.0)
    for k in range(25):
        b.measure(b.pose(), "xyz" if k < 20 else "", point=0 if k >= 15 else None)
    close(b.problem(None))

    b, spread = bench("noise of the joints that the residuals of a row share", "paper", joint=0.05)
    b.tilted(4.0, 160.0, -140.0)
    b.socket(-60.0, 110.0, -150.0)
    for k in range(40):
        if k % 2 == 0:
            b.measure(b.pose(), "xyz", 0, 0)
        else:
            q, to = b.apart(60.0, 350.0)
            b.measure(q, "xyz", 0, to=to)
    close(b.problem(spread))

    b, spread = bench("a sensor's frame, a plane and a known point with offset", "asymmetric")
    b.turn, b.shift = rotation([0.3, 1.1, -4.0]), np.array([75.0, 640.0, -210.0])
    b.tilted(11.0, -120.0, -80.0)
    b.socket(40.0, 130.0, -140.0, -20.5)
    for k in range(36):
        axes = "xyz" if k % 3 < 2 else ""
        b.measure(b.pose(), axes, 0 if k % 2 == 0 else None, 0 if k % 4 > 0 else None)
    close(b.problem(spread, "sensor", known_points={0: 0.1}))

    for geometry, kind in (("paper", "xyz"), ("long", "to"), ("asymmetric", "planes")):
        b, spread = bench(f"gears and encoders that are not exact, {kind}", geometry)
        sigma = 0.05 * DEGREE
        b.numbers = sigma * b.rng.standard_normal(15)
        for tilt, azimuth in ((3.0, 100.0), (20.0, -30.0), (14.0, 200.0)) if kind == "planes" else ():
            b.tilted(tilt, azimuth, -40.0)
        for k in range(60):
            if kind == "xyz":
                b.measure(b.pose(), "xyz")
            elif kind == "to":
                q, to = b.apart(60.0, 350.0)
                b.measure(q, to=to)
            else:
                b.measure(b.pose(), plane=k % 3)
        close(b.problem(spread, transmission=sigma))

    return made


def row_of(row):
    """A row as the document has it."""
    stored = {"joints": bits_of(row["joints"]), "position": None, "height": None, "distance": None}
    if "position" in row:
        stored["position"] = [None if np.isnan(y) else bits(y) for y in row["position"]]
    if "height" in row:
        stored["height"] = [row["plane"], bits(row["height"])]
    if "point" in row:
        stored["distance"] = {"point": row["point"], "value": bits(row["distance"])}
    if "to" in row:
        stored["distance"] = {"to": bits_of(row["to"]), "value": bits(row["distance"])}
    return stored


def main():
    cases = []
    for name, geometry, bench, problem in benches():
        result, covariance, cost = problem.optimum(bench.rng)
        cases.append(
            {
                "name": f"{name}, {geometry}",
                "nominal": bits_of(problem.nominal),
                "tolerance": None if problem.tolerance is None else bits_of(problem.tolerance),
                "noise": bits_of(problem.noise),
                "frame": problem.frame,
                "fixed": problem.fixed,
                "planes": [None if known is None else bits_of(known) for known in problem.planes],
                "points": [
                    {"known": None if known is None else bits_of(known), "offset": offset}
                    for known, offset in problem.points
                ],
                "rows": [row_of(row) for row in problem.rows],
                "parameters": bits_of(result[:24]),
                "sigmas": bits_of(np.sqrt(np.diag(covariance)[:24])),
                "cost": bits(cost),
                "transmission": None if problem.transmission is None else bits(problem.transmission),
                "unknowns": bits_of(result[24 + problem.in_frame : len(result) - problem.numbers()]),
                "numbers": bits_of(result[len(result) - problem.numbers() :]),
            }
        )
    write("generate_observations.py", cases, np, scipy)


if __name__ == "__main__":
    main()
