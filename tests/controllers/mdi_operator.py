#!/usr/bin/python3
"""An operator for tests, which LinuxCNC starts as its display: homes, sends the lines of a file, writes all.

A line is sent as it stands, but for those that begin with @:

    @run FILE                     runs a program
    @jog AXIS SPEED WAY SECONDS   jogs an axis by a way, and cancels the jog after a time
"""

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import linuxcnc

command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
trace = []


def until(done: Callable[[], bool], seconds: float = 15.0) -> bool:
    """Wait for a condition of the machine."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        status.poll()
        trace.append(status.joint_position[: status.joints])
        if done():
            return True
        time.sleep(0.005)
    return False


def told() -> list[str]:
    """The messages that the machine shows."""
    found = []
    while True:
        message = errors.poll()
        if message is None:
            return found
        found.append(message[1].strip())


def ready() -> None:
    """Switch the machine on, and home it if it is not."""
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.state(linuxcnc.STATE_ON)
    until(lambda: status.task_state == linuxcnc.STATE_ON)
    if not all(status.homed[: status.joints]):
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.teleop_enable(0)
        command.wait_complete()
        command.home(-1)
        until(lambda: all(status.homed[: status.joints]))
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()


def stands() -> bool:
    """Whether the joints have been at one place for ten looks."""
    last = trace[-10:]
    return len(last) == 10 and all(row == last[0] for row in last)


def jog(axis: str, speed: str, way: str, seconds: str) -> None:
    """Jog an axis of the world, and cancel that after a time."""
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(1)
    command.wait_complete()
    until(lambda: status.motion_mode == linuxcnc.TRAJ_MODE_TELEOP)
    number = "XYZABCUVW".index(axis)
    command.jog(linuxcnc.JOG_INCREMENT, False, number, float(speed), float(way))
    until(lambda: False, float(seconds))
    command.jog(linuxcnc.JOG_STOP, False, number)
    command.wait_complete()
    until(lambda: False, 0.5)
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()


def program(name: str) -> None:
    """Run a program."""
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(str(Path(os.environ["INI_FILE_NAME"]).parent / name))
    command.auto(linuxcnc.AUTO_RUN, 0)
    until(lambda: status.interp_state != linuxcnc.INTERP_IDLE, 2.0)
    until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and status.queue == 0, 100.0)
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()


def send(line: str) -> dict[str, object]:
    """Do what one line says, wait until the arm stands, and say where."""
    trace.clear()
    if line.startswith("@jog"):
        jog(*line.split()[1:])
    elif line.startswith("@run"):
        program(line.split()[1])
    else:
        command.mdi(line)
        until(lambda: status.echo_serial_number >= command.serial and status.state != linuxcnc.RCS_EXEC)
    until(lambda: False, 0.08)
    until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and status.queue == 0)
    until(lambda: False, 0.05)
    until(stands, 2.0)
    joints, world = status.joint_position[: status.joints], status.position[:9]
    return {"line": line, "joints": joints, "world": world, "errors": told(), "trace": list(trace)}


def main() -> int:
    """Run the lines; the machine is switched on again after an error."""
    time.sleep(0.5)
    ready()
    results = [
        {
            "line": "",
            "joints": status.joint_position[: status.joints],
            "world": status.position[:9],
            "errors": told(),
            "trace": [],
        }
    ]
    for line in Path(os.environ["OPERATOR_LINES"]).read_text().splitlines():
        results.append(send(line))
        if results[-1]["errors"]:
            ready()
    Path(os.environ["OPERATOR_TOLD"]).write_text(json.dumps(results))
    return 0


if __name__ == "__main__":
    sys.exit(main())
