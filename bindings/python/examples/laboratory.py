"""From a data sheet to a validated robot; the measurements are simulated, as a tracker would give them.

    python bindings/python/examples/laboratory.py
"""

import numpy as np

import delta_cal as dc

# The data sheet, what is known of the parts as made (σ: 0.5 mm, 0.2°), and the tracker (0.02 mm; encoders 0.002°).
robot = dc.Robot.nominal(
    base_radius=194,
    platform_radius=30,
    upper_arm=260,
    forearm=480,
    limits=(-1.05, 1.57),
    tolerance=(0.5, np.deg2rad(0.2)),
    noise=(0.02, np.deg2rad(0.002)),
)

# What to measure, and what that will be worth.
plan = dc.plan(robot, 20)
print(plan)

# In place of a robot and a tracker: one robot within the tolerance.
rng = np.random.default_rng(1)
lengths, angles = 0.5, np.deg2rad(0.2)
sigma = np.array([lengths, lengths, lengths, angles, angles, lengths, lengths, lengths])
made = dc.Robot.from_parameters(robot.parameters + sigma * rng.standard_normal((3, 8)), limits=robot.limits)


def track(q: np.ndarray) -> np.ndarray:
    return made.forward(q) + 0.02 * rng.standard_normal(q.shape)


result = dc.calibrate(robot, plan.q, track(plan.q))
print(result)
for finding in result.findings:
    print(finding["level"], finding["text"])

# Poses that the calibration has not seen.
check = rng.uniform(-0.6, 1.1, (30, 3))
verdict = dc.validate(result.robot, check, track(check), limit=0.1)
print(verdict)
if verdict.passed:
    result.robot.write("calibrated.toml")
    result.write("report.html")
