"""Nothing overflows, nothing is left to the implementation, and errors stay below their bounds, for any chain."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kinegen.backends.fixed_point.files import emit_fixed
from kinegen.backends.fixed_point.kernels import FixedKernels
from kinegen.errors import KinegenError
from kinegen.ir.fixed_point.binary_angles import TURN
from kinegen.ir.fixed_point.program import FixedProgram
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.naming import Q30, c_file, function
from kinegen.verify import reference
from kinegen.verify.reference_cache import quantity_frames
from tests.chains import robots
from tests.fixed.kernels import NAMES, fixed, planned, texts
from tests.fixed.machine import Machine, load

ENDS = (-(2**31), 2**31 - 1, 0, -(2**30), 2**30, 2**29, -(2**29) - 1)
REFUSALS = (
    "binary angles do not count turns",
    "is not clear in binary angles",
    "integers have no scale for that",
)


def inputs(draw: random.Random, dof: int) -> list[int]:
    """A joint vector from anywhere, often from the ends of the range."""
    return [draw.choice(ENDS) if draw.random() < 0.3 else draw.randrange(-(2**31), 2**31) for _ in range(dof)]


def result(machine: Machine, kernels: FixedKernels, program: FixedProgram, q: list[int]) -> list[int]:
    """The entries of one call in order, without the last rows."""
    robot, quantity = kernels.robot, program.program.quantity
    params = dict(zip((each.name for each in robot.runtime_parameters), kernels.defaults, strict=True))
    found = machine.kernel(function(robot.name, quantity.function, Q30), q, params)
    numbers = sorted(found, key=lambda place: [int(part) for part in place.replace("]", "").split("[")[1:]])
    entries = [found[place] for place in numbers]
    return [entry for place, entry in enumerate(entries) if not quantity.is_pose or place % 16 < 12]


def exact(kernels: FixedKernels, quantity: Quantity, q: list[int]) -> list[float]:
    """What the table gives for the same integers."""
    robot, scales = kernels.robot, kernels.scales
    units = [
        0.5**scales.stroke if variable.type is JointType.PRISMATIC else 2 * math.pi / TURN
        for variable in robot.variables
    ]
    known = reference.frames(robot, np.array(q) * np.array(units), parameters(kernels))
    columns = slice(None) if quantity.is_pose else slice(3, 4)
    return [entry for frame in quantity_frames(robot, quantity) for entry in known[frame][0, :3, columns].ravel()]


def parameters(kernels: FixedKernels) -> dict[str, float]:
    """The values that the integers of the parameters stand for."""
    units = {"length": 0.5**kernels.scales.parameter, "angle": 2 * math.pi / TURN}
    pairs = zip(kernels.robot.runtime_parameters, kernels.defaults, strict=True)
    return {parameter.name: value * units[parameter.dimension] for parameter, value in pairs}


def check(kernels: FixedKernels, source: str, seed: int, count: int) -> None:
    """Run all kernels on both kinds of products; hold every entry to its bound."""
    machines = [load(source, split=split) for split in (False, True)]
    draw = random.Random(seed)
    for _ in range(count):
        q = inputs(draw, kernels.robot.dof)
        for program in kernels.programs:
            long, halves = (result(machine, kernels, program, q) for machine in machines)
            assert long == halves
            expected = exact(kernels, program.program.quantity, q)
            for found, true, bits, error in zip(long, expected, program.bits, program.errors, strict=True):
                # Rounding in the reference shows where lengths have many fraction bits.
                assert abs(found - true * 2.0**bits) <= error + 1e-14 * 2.0**bits


@pytest.mark.parametrize("name", NAMES)
def test_the_robots_of_ours(name: str) -> None:
    kernels = fixed(name)
    check(kernels, texts(name)[c_file(name, "c", Q30)], seed=1, count=2 if kernels.robot.dof > 7 else 6)


@given(robot=robots(most_rows=5), seed=st.integers(0, 2**32))
@settings(max_examples=20, suppress_health_check=list(HealthCheck))
def test_random_chains(robot: Robot, seed: int) -> None:
    try:
        kernels = planned(robot)
    except KinegenError as error:
        reason = error.message
        kernels = None
    if kernels is None:
        assert reason.startswith(f"no q30 kernels for {robot.name}: ")
        assert any(each in reason for each in REFUSALS), reason
        return
    check(kernels, emit_fixed(kernels)[c_file(robot.name, "c", Q30)], seed, count=2)
