"""Real arms become standard and modified tables with the same poses."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io.format import ReadOptions
from kinegen.io.load import load
from kinegen.model.dh_conversion import to_convention
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Convention, Robot
from kinegen.verify import reference
from tests.imports.files import shown, urdf_files

pytestmark = pytest.mark.imports


def arms() -> list[tuple[str, Robot]]:
    """The chains of five to eight joints among the descriptions; several tips end at the last moving link."""
    found = []
    for path in urdf_files():
        try:
            robot = load(path, ReadOptions())
        except KinegenError:
            continue
        if robot.is_arm and 5 <= robot.dof <= 8:
            found.append((shown(path), robot))
    return found


ARMS = arms() if urdf_files() else []
FILES = {shown(path): path for path in urdf_files()}


def test_there_are_enough_arms() -> None:
    assert len(ARMS) >= 12, [name for name, _ in ARMS]


@pytest.mark.parametrize("convention", [Convention.STANDARD, Convention.MODIFIED], ids=str)
@pytest.mark.parametrize(("name", "robot"), ARMS, ids=[name for name, _ in ARMS])
def test_an_arm_becomes_a_table(name: str, robot: Robot, convention: Convention) -> None:
    try:
        table = to_convention(robot, convention).robot
    except KinegenError as error:
        # Axes whose angles are noise of a drawing program: the message names the option that takes them as parallel.
        if "--snap" not in str(error):
            raise
        robot = load(FILES[name], ReadOptions(snap=1e-6))
        table = to_convention(robot, convention).robot

    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(3).uniform(low, high, (100, robot.dof))
    wanted, found = reference.pose(robot, q), reference.pose(table, q)
    lengths = {"m": 1.0, "mm": 1e3, "cm": 1e2, "in": 39.4}[robot.units.length]
    np.testing.assert_allclose(found[..., :3, :3], wanted[..., :3, :3], rtol=0, atol=1e-13)
    np.testing.assert_allclose(found[..., :3, 3] / lengths, wanted[..., :3, 3] / lengths, rtol=0, atol=1e-13)
