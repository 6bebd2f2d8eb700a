#!/usr/bin/python3
"""An operator for tests, which LinuxCNC starts as its display: homes, sends the lines of a file, writes all."""

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


def send(line: str) -> dict[str, object]:
    """Send one line, wait until the arm stands, and say where."""
    trace.clear()
    command.mdi(line)
    until(lambda: False, 0.08)
    until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and status.queue == 0)
    until(lambda: False, 0.05)
    joints, world = status.joint_position[: status.joints], status.position[:6]
    return {"line": line, "joints": joints, "world": world, "errors": told(), "trace": list(trace)}


def main() -> int:
    """Run the lines; the machine is switched on again after an error."""
    time.sleep(0.5)
    ready()
    results = [
        {
            "line": "",
            "joints": status.joint_position[: status.joints],
            "world": status.position[:6],
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
