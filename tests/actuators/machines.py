"""Short robot files with actuators, and their kernels as NumPy computes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.derive.dispatch import derive
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.actuator_limits import reading_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from tests.chains import exact_defaults
from tests.evaluation import run

Floats = NDArray[np.float64]

ROWS = (
    "{name: waist, a: 0, alpha: 90, d: 0.4, theta: q}",
    "{name: shoulder, a: 0.5, alpha: 0, d: 0, theta: q}",
    "{name: elbow, a: 0.3, alpha: 0, d: 0.1, theta: q}",
)


def machine(
    readings: str,
    *entries: str,
    rows: tuple[str, ...] = ROWS,
    angle: str = "deg",
    inverse: str = "",
    parameters: str = "",
) -> Robot:
    """Load a file.

    Args:
        readings: The value of `readings`, as YAML in braces.
        entries: The entries of `actuators: joints`.
        rows: The table.
        angle: Angle unit.
        inverse: The value of `inverse`, as YAML in braces.
        parameters: The value of `parameters`, as YAML in braces.
    """
    lines = ["kinegen: 1", "name: arm", "convention: standard", f"units: {{length: m, angle: {angle}}}"]
    lines += [f"parameters: {parameters}"] * bool(parameters)
    lines += ["joints:", *(f"  - {row}" for row in rows)]
    lines += ["actuators:", f"  readings: {readings}", "  joints:", *(f"    - {entry}" for entry in entries)]
    lines += [f"  inverse: {inverse}"] * bool(inverse)
    return loads("\n".join(lines) + "\n", "arm.yaml")


def one(entry: str, reading: str = "angle", **options: Any) -> Robot:
    """One joint, `turn`, driven by one actuator, `m`."""
    row = "{name: turn, a: 0.3, alpha: 0, d: 0, theta: q}"
    return machine(f"{{m: {reading}}}", f"{{joint: turn, {entry}}}", rows=(row,), **options)


def computed(robot: Robot, kind: Kind, inputs: Floats) -> Floats:
    """What a kernel gives for inputs (N, n), as (N, entries)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return run(robot, lower(derive(robot, Quantity(kind))), np.atleast_2d(inputs), exact_defaults(robot))


def joints(robot: Robot, *readings: float) -> Floats:
    """The joints at one actuator vector."""
    return computed(robot, Kind.ACTUATORS_TO_JOINTS, np.array(readings, dtype=float))[0]


def readings_of(robot: Robot, *values: float) -> Floats:
    """The readings at one joint vector."""
    return computed(robot, Kind.JOINTS_TO_ACTUATORS, np.array(values, dtype=float))[0]


def samples(robot: Robot, count: int = 40, seed: int = 5) -> Floats:
    """Random actuator vectors within their box, with both its ends."""
    box = np.array(reading_box(robot))
    random = np.random.default_rng(seed).uniform(box[:, 0], box[:, 1], (count, len(box)))
    return np.vstack([random, box.T])
