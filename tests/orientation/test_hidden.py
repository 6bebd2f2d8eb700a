"""Joints that only one of the entries behind an angle depends on, and rotations without a joint."""

from __future__ import annotations

import time

import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.derive.orientation import FORMS, JACOBIANS
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify.reference import pose
from kinegen.verify.reference import rotations as rotations_of
from tests.evaluation import Floats, run

ARMS = (((90, 30, 90), "[0, 0, 0]"), ((-90, 90, 0), "[90, 0, 0]"))

GANTRIES = {
    "sines of degrees": ("12.5", "72", "15", "33.3", "[10, 20, 30]"),
    "roots in arc tangents": ('"acos(1/3)"', "72", '"atan(1/2)"', "54", "[0, 0, 36]"),
    "half a turn": ("45", "90", "45", "90", "[0, 0, 0]"),
    "no turn": ("0", "0", "0", "0", "[0, 0, 0]"),
}


def arm(twists: tuple[float, ...], tool: str) -> Robot:
    """Three joints that turn."""
    rows = [f"  - {{name: j{i}, theta: q, d: 0, a: 0.2, alpha: {twist}}}" for i, twist in enumerate(twists)]
    return read(rows, tool)


def gantry(first: str, tilt: str, second: str, lean: str, tool: str) -> Robot:
    """Two joints that shift."""
    rows = [
        f"  - {{name: rail, theta: {first}, d: q, a: 0, alpha: {tilt}}}",
        f"  - {{name: lift, theta: {second}, d: q, a: 0.1, alpha: {lean}}}",
    ]
    return read(rows, tool)


def read(rows: list[str], tool: str) -> Robot:
    """A standard table in degrees."""
    head = ["kinegen: 1", "name: arm", "convention: standard", "units: {length: m, angle: deg}", "joints:"]
    return loads("\n".join([*head, *rows, f"tool: {{rpy: {tool}}}"]), "arm.yaml")


def entries(robot: Robot, kind: Kind, q: Floats) -> Floats:
    """The numbers of a kernel."""
    return run(robot, lower(derive(robot, Quantity(kind))), q)


@pytest.mark.parametrize("kind", [*FORMS, *JACOBIANS])
def test_a_joint_without_a_number_leaves_none_in_what_depends_on_it(kind: Kind) -> None:
    """Where its tool or its last axis hides a joint from one of two entries, the other one has to carry NaN."""
    for twists, tool in ARMS:
        robot = arm(twists, tool)
        program = lower(derive(robot, Quantity(kind)))
        q = np.random.default_rng(3).uniform(-3, 3, (8, robot.dof))
        for joint in range(robot.dof):
            turned, lost = np.tile(q[:1], (8, 1)), q[:1].copy()
            turned[:, joint], lost[0, joint] = q[:, joint], np.nan
            depends = np.ptp(run(robot, program, turned), axis=0) > 1e-9

            assert np.all(np.isnan(run(robot, program, lost))[0, depends]), (twists, tool, joint)


@pytest.mark.parametrize("kind", FORMS)
@pytest.mark.parametrize("name", GANTRIES)
def test_a_constant_orientation_is_derived_without_an_analysis_of_its_numbers(kind: Kind, name: str) -> None:
    robot = gantry(*GANTRIES[name])
    began = time.process_time()
    program = lower(derive(robot, Quantity(kind)))

    assert time.process_time() - began < 1
    assert not program.statements
    found = run(robot, program, np.zeros((1, 2)))
    np.testing.assert_allclose(rotations_of(kind, found), pose(robot, np.zeros((1, 2)))[:, 0, :3, :3], atol=1e-15)
    if kind is Kind.QUATERNION_WXYZ:
        assert found[0, np.flatnonzero(found[0])[0]] > 0
