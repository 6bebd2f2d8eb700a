"""Machines of the standard types: the printed transformations, and both ways back by plain substitution in NumPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse.five_axis import machine_for
from kinegen.derive.inverse.five_axis_geometry import Arrangement
from kinegen.io.load import load, loads
from kinegen.model.outputs import parse_quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.machine_tools.machines import MACHINES, Machine, trunnion_by_manual

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
QUANTITY = parse_quantity("axis_inverse@cutter/workpiece")


def robot_of(machine: Machine) -> Robot:
    return loads(machine.text, f"{machine.name}.yaml")


def test_the_trunnion_of_a_manual() -> None:
    robot = load(ROBOTS / "trunnion_mill.yaml")
    for q in np.random.default_rng(8).uniform(-1, 1, (20, 5)) * [2, 3, 200, 200, 200]:
        a, c, x, y, z = map(float, q)
        pose = np.asarray(reference.Kinematics(robot, q).pose("cutter/workpiece"))[0]
        # The axes of the file turn the other way; C is 12 beside A, the workpiece 95 above it, the tool 120 long.
        wanted = trunnion_by_manual(-a, -c, (x, y - 12, z - 120 - 95), -12, -95)
        np.testing.assert_allclose(pose[:3, 3], wanted, atol=1e-11)


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.name)
def test_printed_transformation(machine: Machine) -> None:
    robot = robot_of(machine)
    order = [variable.name for variable in robot.variables]
    q = np.random.default_rng(3).uniform(-2, 2, (50, 5)) * [1, 1, 100, 100, 100]
    columns = [q[:, ("first", "second", "x", "y", "z").index(name)] for name in order]
    pose = np.asarray(reference.Kinematics(robot, np.stack(columns, axis=1)).pose("cutter/workpiece"))
    points, axes = machine.motion(q)
    np.testing.assert_allclose(pose[:, :3, 3], points, atol=1e-12 * 1e3)
    np.testing.assert_allclose(pose[:, :3, 2], axes, atol=1e-14)


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.name)
def test_recognised_by_geometry(machine: Machine) -> None:
    found = machine_for(robot_of(machine), QUANTITY)
    places = {"table": Arrangement.TABLE, "head": Arrangement.HEAD, "mixed": Arrangement.MIXED}
    assert found.arrangement is next(value for word, value in places.items() if word in machine.name)
    assert (found.first.name, found.second.name) == ("first", "second")
    assert found.is_square == ("nutating" not in machine.name)
