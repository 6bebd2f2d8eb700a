"""A whole LinuxCNC run of the simulation in a package: G0, G1, G2, targets out of reach, lines through wrists."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.machine import angles
from kinegen.backends.scalar_types import ScalarType
from kinegen.verify import reference
from tests.controllers.halrun import SERIAL
from tests.controllers.machine_run import Run, run_package
from tests.controllers.packages import Follower, kernels, machine, write_package

pytestmark = [pytest.mark.controllers, SERIAL]


def run_machine(place: Path, name: str, lines: Sequence[str], home: Sequence[float] = ()) -> Run:
    """Run the simulation of a package, from another home if given."""
    return run_package(write_package(place, name, Controller.LINUXCNC), lines, home)


def joints_of(name: str, values: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint values of the kernels from degrees and millimetres."""
    return np.array([v * joint.scale for v, joint in zip(values, machine(name, Controller.LINUXCNC).joints)])


def world_of(name: str, q: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Position in millimetres and angles in degrees."""
    made = machine(name, Controller.LINUXCNC)
    pose = reference.pose(kernels(name).robot, [q])[0, 0]
    return np.array([*(pose[:3, 3] * made.millimetres), *np.degrees(angles(pose))])


def require_close(name: str, step: dict[str, Any], world: NDArray[np.float64]) -> None:
    """The arm stands where it was sent."""
    found = world_of(name, joints_of(name, step["joints"]))
    letters = machine(name, Controller.LINUXCNC).coordinates
    assert step["errors"] == []
    np.testing.assert_allclose(found[:3], world[:3], atol=1e-4)
    if letters == "XYZABC":
        np.testing.assert_allclose(found[3:], world[3:], atol=1e-3)


@pytest.mark.parametrize("name", ["puma560", "ur5", "scara4", "palletiser3"])
def test_the_example_moves_of_a_package_and_a_target_out_of_reach(name: str, tmp_path: Path) -> None:
    """Every move of `sim/moves.ngc`, then a refusal with the message of the machine, and the arm goes on."""
    example = write_package(tmp_path / "read", name, Controller.LINUXCNC) / "sim" / "moves.ngc"
    moves = [line for line in example.read_text().splitlines() if re.match(r"[GF]", line)]
    moves = [line.split("(")[0].strip() for line in moves]
    done = run_machine(tmp_path, name, [*moves, "G1 X90000 F1000", *moves])
    home = np.array([joint.home for joint in machine(name, Controller.LINUXCNC).joints])
    start, *after = done.steps

    np.testing.assert_allclose(start["joints"], home, atol=1e-5)
    assert {step["line"][:2] for step in after} >= {"G0", "G1", "G2"}
    refused = after[len(moves)]
    assert f"{name}: out of reach, or outside joint limits" in refused["errors"]
    assert "Linear move on line 0 fails kinematicsInverse" in refused["errors"]
    for step in (*after[: len(moves)], *after[len(moves) + 1 :]):
        assert step["errors"] == []
    require_close(name, after[-1], world_of(name, joints_of(name, home)))
    assert np.abs(np.diff(done.joints, axis=0)).max() < 10.0
    assert len(np.unique(done.joints.round(3), axis=0)) > 300


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_a_line_through_the_wrist_singularity(name: str, tmp_path: Path) -> None:
    """From one side to the other and back; q5 passes zero, and no joint leaps."""
    q = joints_of(name, [joint.home for joint in machine(name, Controller.LINUXCNC).joints])
    q[4] = 0.0
    shift = np.array([31.0, 17.0, 23.0]) * 0.5
    it = Follower(write_package(tmp_path / "host", name, Controller.LINUXCNC), name, ScalarType.DOUBLE)
    start = it.pose(q)
    start[:3, 3] += shift / machine(name, Controller.LINUXCNC).millimetres
    found, home = it.follow(start, q + 0.3)
    assert found == 1
    degrees = [value / joint.scale for value, joint in zip(home, machine(name, Controller.LINUXCNC).joints)]
    there = " ".join(f"{letter}{-2 * value:.9f}" for letter, value in zip("XYZ", shift))
    back = " ".join(f"{letter}{2 * value:.9f}" for letter, value in zip("XYZ", shift))

    done = run_machine(tmp_path, name, ["G91", "F2000", f"G1 {there}", f"G1 {back}", f"G1 {there}"], degrees)

    assert all(step["errors"] == [] for step in done.steps)
    passed = done.joints[:, 4]
    assert np.sum(np.diff(np.sign(passed[np.abs(passed) > 1e-3])) != 0) >= 2
    assert np.abs(np.diff(done.joints, axis=0)).max() < 10.0
    reached = world_of(name, joints_of(name, done.steps[-1]["joints"]))[:3]
    np.testing.assert_allclose(reached, world_of(name, q)[:3] - shift, atol=1e-4)


def test_a_move_beyond_the_limit_of_a_joint_stops_there(tmp_path: Path) -> None:
    """A circle about axis 1 with the tool turned along moves the waist alone, whose limit is 160 degrees.

    Behind the limit the arm could reach the places backwards, half a turn away; that branch is not taken.
    """
    name = "puma560"
    q = joints_of(name, [joint.home for joint in machine(name, Controller.LINUXCNC).joints])
    behind = q.copy()
    behind[0] += np.radians(175.0)
    world, other = world_of(name, q), world_of(name, behind)
    step = other - world
    arc = f"G3 X{step[0]:.9f} Y{step[1]:.9f} I{-world[0]:.9f} J{-world[1]:.9f} C175 F20000"
    done = run_machine(tmp_path, name, ["G91", arc])

    assert f"{name}: a joint would jump, at its limit or near a singularity" in done.steps[2]["errors"]
    assert 159.0 < done.joints[:, 0].max() <= 160.0 + 1e-4
    others = done.joints[:, 1:]
    np.testing.assert_allclose(others, np.broadcast_to(np.degrees(q)[1:], others.shape), atol=0.01)
