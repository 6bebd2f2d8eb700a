"""What a simulated arm does in LinuxCNC, and how far from what it was told: speeds, ends, refusals, a jog."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.controllers.machine import Machine
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.controllers.machine_run import PERIOD, Run, run_package
from tests.controllers.paths import joints_of

Numbers = NDArray[np.float64]

FEEDS = (600, 3000)
JOG = 20.0
"""Speed of a jog, in mm a second."""


def tool_of(robot: Robot, machine: Machine, joints: Sequence[Sequence[float]] | Numbers) -> Numbers:
    """Positions (N, 3) of the tool in mm by the table of the robot, from LinuxCNC's joints."""
    values = joints_of(robot, machine, np.array(joints))
    return np.asarray(reference.pose(robot, values)[:, 0, :3, 3] * machine.millimetres)


def tried(folder: Path, robot: Robot, machine: Machine) -> Iterator[tuple[str, float, float]]:
    """Run the simulation of a package.

    Args:
        folder: The package.
        robot: The robot.
        machine: The arm as LinuxCNC sees it.

    Yields:
        What was measured, the number, and the largest that is allowed.
    """
    side = float(f"{machine.reach * machine.millimetres / 20:.1g}")
    lines = ["G91 G61"]
    for feed in FEEDS:
        lines += [f"G1 X{side} F{feed}", f"G2 X{-side} Y0 I{-side / 2} J0"]
    lines += ["G1 X90000", f"@jog Y {JOG} {4 * JOG} 1.0", f"G1 Z{-side / 4}"]
    done = run_package(folder, lines)
    home = tool_of(robot, machine, [done.steps[0]["joints"]])[0]
    yield "home beside that of the INI file, mm", float(np.abs(home - machine.home[:3]).max()), 1e-3
    yield from _speeds(done, robot, machine)
    step = np.array([side, 0.0, 0.0])
    places = [home, home + step, home, home + step, home]
    ends = tool_of(robot, machine, [each["joints"] for each in done.steps[1:6]])
    yield "ends of lines and arcs, mm", float(np.abs(ends - places).max()), 1e-6
    refused, jogged, after = done.steps[6:9]
    words = f"{robot.name}: out of reach, or outside joint limits"
    yield "targets out of reach that are not refused", float(words not in refused["errors"]), 0
    still = np.abs(np.array(refused["joints"]) - done.steps[5]["joints"]).max()
    yield "joints that moved before that, units", float(still), 1e-9
    # Cancelled after a second: it ends soon after, and not at the end of its way.
    way = tool_of(robot, machine, [refused["joints"], jogged["joints"]])
    yield "way of a jog beside that at its cancel, mm", float(abs(way[1, 1] - way[0, 1] - JOG)), 0.5 * JOG
    yield "errors of other lines", float(sum(len(each["errors"]) for each in (*done.steps[:6], jogged, after))), 0


def _speeds(done: Run, robot: Robot, machine: Machine) -> Iterator[tuple[str, float, float]]:
    for number, feed in enumerate(FEEDS):
        for kind, step in (("line", 2 * number + 2), ("arc", 2 * number + 3)):
            points = tool_of(robot, machine, done.moving(step))
            rates = np.linalg.norm(np.diff(points, axis=0), axis=1) / PERIOD * 60
            middle = rates[len(rates) * 3 // 10 : len(rates) * 7 // 10]
            yield f"{kind} at F{feed}: speed, %", float(100 * np.abs(middle / feed - 1).max()), 2
