"""Simulates the packaging robot of docs/tutorial.md: what its controller and a laser tracker write.

    python3 generate_plant.py poses.csv check.csv FOLDER

poses.csv and check.csv are plans of delta-cal for FOLDER/robot.toml. The kinematics is written here: elbows from the
equations of Model 24, the platform by Newton's method on the three spheres, z upwards and joints downwards. The files
have z downwards and joints upwards.
"""

import csv
import math
import random
import sys

rng = random.Random(57)
REFLECTOR = (12.0, 0.0, -25.0)
DATUM = [(500.0, 0.0, -400.0), (-400.0, 450.0, -500.0), (-300.0, -500.0, -300.0), (0.0, 0.0, -1000.0)]
DATUM_AS_MADE = [[c + rng.gauss(0.0, 0.02) for c in place] for place in DATUM]


def arms():
    made = []
    # Arm 1 at +y with z upwards, which is -y with z downwards; clockwise from above.
    for azimuth in (90.0, -30.0, -150.0):
        theta = math.radians(azimuth)
        off = lambda: rng.gauss(0.0, 0.4)
        turn = lambda: rng.gauss(0.0, math.radians(0.15))
        zero, length = turn(), 350.0 + off()
        made.append((
            155.0 * math.cos(theta) + off(), 155.0 * math.sin(theta) + off(), off(), theta + turn(), turn(),
            length * math.cos(zero), length * math.sin(zero), 800.0 + off(),
        ))
    return made


def elbow(arm, q):
    dx, dy, dz, theta, alpha, la_x, la_y, _ = arm
    ex = (math.cos(theta), math.sin(theta), 0.0)
    ez = (math.sin(theta) * math.sin(alpha), -math.cos(theta) * math.sin(alpha), math.cos(alpha))
    u = [la_x * a + la_y * b for a, b in zip(ex, ez)]
    v = [la_y * a - la_x * b for a, b in zip(ex, ez)]
    return [d + a * math.cos(q) + b * math.sin(q) for d, a, b in zip((dx, dy, dz), u, v)]


def solve(rows, right):
    """Cramer's rule."""
    def det(m):
        return sum(m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]) for i in range(3))
    whole = det(rows)
    return [det([[right[r] if c == k else rows[r][c] for c in range(3)] for r in range(3)]) / whole for k in range(3)]


def platform(made, joints):
    at = [0.0, 0.0, -900.0]
    for _ in range(60):
        away = [[x - b for x, b in zip(at, elbow(arm, q))] for arm, q in zip(made, joints)]
        off = [sum(c * c for c in row) - arm[7] ** 2 for row, arm in zip(away, made)]
        step = solve([[2 * c for c in row] for row in away], off)
        at = [x - s for x, s in zip(at, step)]
    return at


def seen(point, frame):
    turn, shift = frame
    at = [sum(turn[r][c] * point[c] for c in range(3)) + shift[r] for r in range(3)]
    sigma = 0.015 + 6e-6 * math.dist(at, (0, 0, 0))
    return [x + rng.gauss(0.0, sigma) for x in at], 2.0 * sigma


def turned(a, b, c):
    ca, sa, cb, sb, cc, sc = math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c)
    return [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]


def comma(value):
    return f"{value:.4f}".replace(".", ",")


def measured(made, plan, frame, plc, tracker):
    with open(plan, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with open(plc, "w", encoding="utf-8") as out:
        repeat = "repeat" in rows[0]
        out.write("Name;" + ("repeat;" if repeat else "") + "q1_deg;q2_deg;q3_deg\n")
        for row in rows:
            joints = ";".join(comma(float(row[f"q{k}_deg"])) for k in (1, 2, 3))
            out.write(row["name"] + ";" + (row["repeat"] + ";" if repeat else "") + joints + "\n")
    with open(tracker, "w", encoding="utf-8") as out:
        out.write("Laser tracker report\nOperator;A. Meier\n\nPoint;Time;X [mm];Y [mm];Z [mm];U (k=2) [mm]\n")
        names = [(f"D{k + 1}", place) for k, place in enumerate(DATUM_AS_MADE)]
        for row in rows:
            joints = [-math.radians(float(row[f"q{k}_deg"]) + rng.gauss(0.0, 0.001)) for k in (1, 2, 3)]
            at = platform(made, joints)
            names.append((row["name"], [x + r for x, r in zip(at, REFLECTOR)]))
        for number, (name, place) in enumerate(names):
            at, expanded = seen(place, frame)
            time = f"{9 + number // 60:02}:{number % 60:02}:00"
            out.write(f"{name};{time};" + ";".join(comma(x) for x in at) + f";{comma(expanded)}\n")


def main():
    plan, check, folder = sys.argv[1:]
    made = arms()
    frame = (turned(0.02, -0.03, 1.1), (2500.0, 400.0, -900.0))
    measured(made, plan, frame, f"{folder}/plc.csv", f"{folder}/tracker.csv")
    frame = (turned(-0.01, 0.02, -0.4), (1800.0, -1500.0, -700.0))
    measured(made, check, frame, f"{folder}/check_plc.csv", f"{folder}/check_tracker.csv")


if __name__ == "__main__":
    main()
