"""Simulates the measurements of docs/tutorial.md, with the kinematics of generate_plant.py.

    python3 generate_tutorial.py tracker PLAN SEED      # a plan with names: what a tracker in its own frame exports
    python3 generate_tutorial.py plate PLAN             # a plan of touches: what a dial gauge reads, as heights
"""

import csv
import math
import random
import sys

from generate_plant import platform, turned


def arms(rng, radius, upper, fore, length, angle, zero):
    """A robot made to these σ; a joint zero turns its upper arm."""
    made = []
    for azimuth in (0.0, 120.0, 240.0):
        theta = math.radians(azimuth)
        off = lambda: rng.gauss(0.0, length)
        turn = lambda of: rng.gauss(0.0, math.radians(of))
        down, arm = turn(zero), upper + off()
        made.append((
            radius * math.cos(theta) + off(), radius * math.sin(theta) + off(), off(), theta + turn(angle), turn(angle),
            arm * math.cos(down), -arm * math.sin(down), fore + off(),
        ))
    return made


def joints(rng, row):
    return [math.radians(float(row[f"q{k}_deg"]) + rng.gauss(0.0, 0.002)) for k in (1, 2, 3)]


def tracker(plan, seed):
    rng = random.Random(58)
    made = arms(rng, 155.0, 235.0, 600.0, 0.05, 0.05, 1.0)
    reflector = [at + rng.gauss(0.0, 0.03) for at in (0.0, 0.0, -52.0)]
    bores = [(350.0, 0.0, -100.0), (-175.0, 303.11, -100.0), (-175.0, -303.11, -100.0), (350.0, 0.0, -900.0)]
    points = [(f"D{k}", [c + rng.gauss(0.0, 0.05) for c in bore]) for k, bore in enumerate(bores, 1)]
    rng = random.Random(int(seed))
    turn = turned(rng.gauss(0.0, 0.01), rng.gauss(0.0, 0.01), rng.uniform(-3.0, 3.0))
    shift = [rng.uniform(-2500.0, 2500.0), rng.uniform(-2500.0, 2500.0), -900.0]
    for row in plan:
        at = platform(made, joints(rng, row))
        points.append((row["name"], [x + r for x, r in zip(at, reflector)]))
    print("name,x_mm,y_mm,z_mm")
    for name, point in points:
        at = [sum(turn[r][c] * point[c] for c in range(3)) + shift[r] + rng.gauss(0.0, 0.02) for r in range(3)]
        print(name + "," + ",".join(f"{x:.3f}" for x in at))


def plate(plan):
    rng = random.Random(59)
    made = arms(rng, 164.0, 260.0, 480.0, 0.5, 0.2, 0.2)
    normal = (0.002, -0.003, math.sqrt(1.0 - 0.002**2 - 0.003**2))
    print("q1_deg,q2_deg,q3_deg,height_mm,plane")
    for row in plan:
        x, y, z = platform(made, joints(rng, row))
        tip = (x, y, z - 50.0)
        height = sum(n * t for n, t in zip(normal, tip)) + 561.3 + rng.gauss(0.0, 0.02)
        print(",".join(row[f"q{k}_deg"] for k in (1, 2, 3)) + f",{height:.3f},plate")


def main():
    kind, plan, *seed = sys.argv[1:]
    with open(plan, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    {"tracker": tracker, "plate": plate}[kind](rows, *seed)


main()
