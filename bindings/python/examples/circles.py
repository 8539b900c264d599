"""The laboratory robot of host/examples/circle-sheet: 44 circles of a printed sheet, touched by a real robot.

    python bindings/python/examples/circles.py
"""

from pathlib import Path

import numpy as np

import delta_cal as dc

HERE = Path(__file__).parents[3] / "host" / "examples" / "circle-sheet"

robot = dc.Robot.read(HERE / "robot.toml")
samples = dc.read_samples(HERE / "samples.csv")

# The sheet lies anywhere: its frame is that of a sensor.
try:
    dc.calibrate(robot, samples, frame="sensor")
except dc.Refused as refused:
    for finding in refused.findings:
        print(finding["text"], finding["remedy"], sep="\n  ")

# Nothing is known of the joint zeros: σ = 6°.
result = dc.calibrate(robot, samples, frame="sensor", zero=np.deg2rad(6))
print(result)
_, _, _, _, _, along, up, _ = result.parameters.T
print("joint zeros, °:", np.rad2deg(np.arctan2(up, along)).round(1))
print("residuals, mm rms:", np.sqrt(np.nanmean(result.residuals**2)).round(2))

# Nine heights that its camera saw took no part in it.
print(dc.validate(result.robot, dc.read_samples(HERE / "camera_heights.csv"), limit=20))
