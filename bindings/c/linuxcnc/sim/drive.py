#!/usr/bin/python3
"""Drives LinuxCNC to positions and writes the joint angles that it commands.

drive.py RESULT.csv FILE...   as the DISPLAY of an INI file, in its folder.

Each FILE is either positions (x_mm,y_mm,z_mm) to drive to, or a HAL file, which is read while the machine is off, or on
if its name ends with .on.hal. The result is a samples file of delta-cal: joint angles, and the position where the
controller's forward kinematics has the robot. A move that LinuxCNC refuses becomes a comment with LinuxCNC's reason.
"""

import csv
import subprocess
import sys
import time

import linuxcnc

# A move takes less than a second; a controller that hangs must not hang this program.
LONGEST = 10


def until(what, condition):
    """Waits until the controller's status meets the condition."""
    end = time.time() + LONGEST
    while time.time() < end:
        status.poll()
        if condition():
            return
        time.sleep(0.005)
    raise SystemExit(f"drive.py: LinuxCNC did not get ready: {what}")


def switch_on():
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.state(linuxcnc.STATE_ON)
    until("on", lambda: status.task_state == linuxcnc.STATE_ON)
    if not all(status.homed[:3]):
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.home(-1)
        until("homed", lambda: all(status.homed[:3]))
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()


def messages():
    """What LinuxCNC has complained of since the last call."""
    found = []
    while True:
        message = errors.poll()
        if message is None:
            return " ".join(found)
        found.append(message[1].strip())


def settle(position):
    """Waits for the last points of the path, which are still interpolated: a busy computer is late with them."""
    end, before = time.time() + 2, None
    while time.time() < end:
        status.poll()
        joints = status.joint_position[:3]
        if joints == before and all(abs(a - b) < 1e-7 for a, b in zip(status.actual_position, position)):
            return
        before = joints
        time.sleep(0.01)


def drive(position, result):
    messages()
    command.mdi("G0 X{:.9f} Y{:.9f} Z{:.9f}".format(*position))
    if command.wait_complete(LONGEST) == -1:
        raise SystemExit("drive.py: LinuxCNC does not end a move")
    until("in position", lambda: status.inpos and status.interp_state == linuxcnc.INTERP_IDLE)
    time.sleep(0.03)
    refusal = messages()
    if not refusal:
        settle(position)
    if refusal:
        result.write("# {}, {}, {}: {}\n".format(*position, refusal))
        return
    row = list(status.joint_position[:3]) + list(status.actual_position[:3])
    result.write(",".join(repr(value) for value in row) + "\n")


def main(result, files):
    until("started", lambda: status.task_state == linuxcnc.STATE_ESTOP and status.linear_units > 0)
    with open(result, "w", encoding="utf-8") as to:
        to.write("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n")
        for name in files:
            if name.endswith(".hal"):
                if not name.endswith(".on.hal"):
                    command.state(linuxcnc.STATE_OFF)
                    until("off", lambda: status.task_state != linuxcnc.STATE_ON)
                subprocess.run(["halcmd", "-f", name], check=False)
                continue
            switch_on()
            with open(name, encoding="utf-8") as positions:
                for row in csv.DictReader(positions):
                    drive([float(row[axis]) for axis in ("x_mm", "y_mm", "z_mm")], to)


command = linuxcnc.command()
status = linuxcnc.stat()
errors = linuxcnc.error_channel()
# LinuxCNC puts its own INI file between.
arguments = [value for value in sys.argv[1:] if value != "-ini" and not value.endswith(".ini")]
try:
    main(arguments[0], arguments[1:])
except OSError as error:
    raise SystemExit(f"drive.py: {error}") from None
except (KeyError, TypeError, ValueError) as error:
    raise SystemExit(f"drive.py: positions need the columns x_mm,y_mm,z_mm and numbers in them: {error}") from None
