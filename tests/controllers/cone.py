"""A frustum of a cone with a leaning tool on the trunnion mill in LinuxCNC, against a product of turns and shifts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from tests.controllers.machine_run import PERIOD, run_package
from tests.controllers.modules import Numbers, shift, turn

TOOL = 50.0
"""Length of tool 1 of the emitted table."""

LEAN = 25.0
FEED = 3000.0
CENTRE = np.array([0.0, 12.0, 95.0])
"""The origin of the workpiece's frame in the world."""

HOME = (0.0, 0.0, 400.0, 0.0, 0.0)


def trunnion(j: Numbers, tool: float = 120.0) -> Numbers:
    """The pose (4, 4) of the trunnion mill's cutter in the frame of the workpiece, by LinuxCNC's joints."""
    table = turn(0, -j[3]) @ shift(0, 12, 70) @ turn(2, -j[4]) @ shift(0, 0, 25)
    return np.asarray(np.linalg.inv(table) @ shift(j[0], j[1], j[2]) @ shift(0, 0, -tool))


def motors(axes: Numbers, pitch: float = 5.0) -> Numbers:
    """LinuxCNC's joints of `coupled_mill` by X, Y, Z, A, C: a crossed belt, a screw, a differential."""
    x, y, z, a, c = np.moveaxis(np.asarray(axes, dtype=float), -1, 0)
    return np.stack([x - y, x + y, -360 * z / pitch, 30 * (c - a + 30), -600 * (c + a - 30)], axis=-1)


def axes(joints: Numbers) -> Numbers:
    """The other way round."""
    left, right, screw, upper, lower = np.moveaxis(np.asarray(joints, dtype=float), -1, 0)
    total, apart = -lower / 600 + 30, upper / 30 - 30
    return np.stack([(left + right) / 2, (right - left) / 2, -5 * screw / 360, (total - apart) / 2,
                     (total + apart) / 2], axis=-1)  # fmt: skip


def tips(joints: Numbers) -> tuple[Numbers, Numbers]:
    """Tips (N, 3) in the words of the program, and tool axes (N, 3)."""
    poses = np.array([trunnion(row, TOOL) for row in joints])
    return poses[:, :3, 3] - trunnion(np.zeros(5), 0.0)[:3, 3], poses[:, :3, 2]


def ring(radius: float, height: float, begin: float, end: float, steps: int) -> list[tuple[float, ...]]:
    """Words X Y Z A C around the cone, with the tool leaning outwards."""
    found = []
    for phi in np.linspace(begin, end, steps + 1):
        x, y = radius * math.cos(math.radians(phi)), radius * math.sin(math.radians(phi))
        found.append((*(CENTRE + np.array([x, y, height])), LEAN, phi + 90.0))
    return found


def frustum() -> list[tuple[float, ...]]:
    """Around the upper edge of the frustum of a cone, down its side, and back around the lower edge."""
    return [*ring(30.0, 40.0, -180.0, 180.0, 48), *ring(45.0, 10.0, 180.0, -180.0, 48)]


def off(points: Numbers, corners: Numbers) -> float:
    """The largest distance of points from a line with corners."""
    best = np.full(len(points), np.inf)
    for begin, end in pairwise(corners):
        along = end - begin
        part = np.clip((points - begin) @ along / (along @ along), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - begin - part[:, None] * along, axis=1))
    return float(best.max())


def _line(words: tuple[float, ...]) -> str:
    return " ".join(f"{letter}{value:.12f}" for letter, value in zip("XYZAC", words, strict=True))


def cone_cases(folder: Path, axes_of: Callable[[Numbers], Numbers] = np.asarray) -> Iterator[tuple[str, float, float]]:
    """Run the cone in the package of the trunnion mill.

    Args:
        folder: The package.
        axes_of: X, Y, Z, A and C by LinuxCNC's joints, which are motors where the machine has some.

    Yields:
        What was measured, the number, and the largest that is allowed.
    """
    words = frustum()
    program = ["G21 G90 G94 G61", f"F{FEED}", *(f"G1 {_line(each)}" for each in words[1:]), "M2"]
    lines = ["M429", "T1 M6", "G43", "M428", f"G0 {_line(words[0])}", "@run cone.ngc"]
    lines += [
        f"G91 G1 X60 F{FEED}",
        "G2 X-30 Y0 I-15 J0",
        "G1 X-30 A-10 C20",
        "G1 X90000",
        "G1 X300 A20",
        "@jog Z 20 80 1.0",
    ]
    done = run_package(folder, lines, files={"cone.ngc": "\n".join(program) + "\n"})
    yield "errors of a line", float(sum(len(step["errors"]) for step in [*done.steps[:10], done.steps[12]])), 0
    still = axes_of(np.array([step["joints"] for step in done.steps[1:5]])) - HOME
    yield "joints moved by G43 and switches, units", float(np.abs(still).max()), 1e-9
    path = axes_of(done.moving(6))
    points, axes = tips(path)
    yield "tip off the path of the cone, mm", off(points, np.array(words)[:, :3]), 1e-9
    yield "lean of the tool, deg", float(np.abs(np.degrees(np.arccos(axes[:, 2])) - LEAN).max()), 1e-9
    for kind, step in (("line", 7), ("arc", 8), ("line with a turning table", 9)):
        points = tips(axes_of(done.moving(step)))[0]
        speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / PERIOD * 60
        middle = speeds[len(speeds) * 3 // 10 : len(speeds) * 7 // 10]
        yield f"{kind}: speed, %", float(100 * np.abs(middle / FEED - 1).max()), 2
    refused = done.steps[10]
    yield "targets out of reach that are not refused", float(not refused["errors"]), 0
    yield (
        "joints that moved before that, units",
        float(np.ptp([done.steps[9]["joints"], refused["joints"]], 0).max()),
        1e-9,
    )
    jogged = tips(axes_of(np.array([done.steps[11]["joints"], done.steps[12]["joints"]])))[0]
    yield "way of a jog beside that at its cancel, mm", float(abs(jogged[1, 2] - jogged[0, 2] - 20.0)), 10
    yield "that aside, mm", float(np.abs(jogged[1, :2] - jogged[0, :2]).max()), 1e-9
