"""Kinematic calibration of Delta parallel robots.

Arrays in, arrays out: millimetres and radians, a row a pose. A robot is read from its file or made from a data sheet,
calibrated from measured positions, heights or distances, validated, and exported to its controller::

    import delta_cal as dc

    robot = dc.Robot.read("robot.toml")
    result = dc.calibrate(robot, dc.read_samples("samples.csv"))
    result.robot.write("calibrated.toml")

A calibration that cannot be trusted raises :class:`Refused`; an argument that cannot be used raises ``ValueError`` or
``TypeError``, whose message begins with its name. The results are those of the command ``delta-cal``, to the bit.
"""

from ._calibration import Calibration, CalibrationWarning, Unknown, calibrate
from ._errors import Refused
from ._native import __version__
from ._robot import Robot, Samples, read_samples
from ._tasks import (
    Comparison,
    Export,
    Imported,
    Plan,
    Validation,
    Workspace,
    compare,
    export,
    import_,
    plan,
    simulate,
    validate,
    workspace,
)

__all__ = [
    "Calibration",
    "CalibrationWarning",
    "Comparison",
    "Export",
    "Imported",
    "Plan",
    "Refused",
    "Robot",
    "Samples",
    "Unknown",
    "Validation",
    "Workspace",
    "__version__",
    "calibrate",
    "compare",
    "export",
    "import_",
    "plan",
    "read_samples",
    "simulate",
    "validate",
    "workspace",
]
