"""Kernels of any kind, of any robot, return what the reference expects."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kinegen.derive.dispatch import derive
from kinegen.ir.lower import lower
from kinegen.ir.program import Program
from kinegen.model.outputs import SOLVERS, Kind, Quantity, every_quantity
from kinegen.model.robot import Robot
from kinegen.verify.expectations import expect
from kinegen.verify.reference_cache import ReferenceResults
from kinegen.verify.samples import input_samples, singular_samples, vector_samples
from kinegen.verify.tolerances import accepted_error
from tests.chains import exact_defaults, robots
from tests.evaluation import run

ELSEWHERE = (Kind.FRAMES, Kind.INVERSE, Kind.PARAMETER_JACOBIAN, *(solver.kind for solver in SOLVERS))
"""Kinds that not every robot has, that are not of single frames, or that have no program."""

quantities = st.sampled_from(
    [each for each in every_quantity() if each.kind not in ELSEWHERE and "actuator" not in each.kind]
)


def results(robot: Robot, program: Program, inputs: dict[str, Any]) -> list[Any]:
    """What the printed NumPy form returns, as arrays (N, ...)."""
    upper = [inputs[array.name][:, :3] if array.is_pose else inputs[array.name] for array in program.signature.inputs]
    numbers = [values.reshape(len(values), -1) for values in upper]
    rows = run(robot, program, numbers[0], exact_defaults(robot), tuple(numbers[1:]))
    found, first = [], 0
    for array in program.signature.results:
        flat = rows[:, first : first + array.size]
        first += array.size
        if array.is_pose:
            matrices = np.zeros((len(rows), *array.shape))
            matrices[..., :3, :] = flat.reshape(len(rows), *array.shape[:-2], 3, 4)
            matrices[..., 3, 3] = 1
            found.append(matrices)
        else:
            found.append(flat.reshape(len(rows), *array.shape))
    return found


@given(robots(most_rows=5), quantities, st.data())
@settings(max_examples=60, deadline=None)
def test_a_kernel_returns_what_the_reference_expects(robot: Robot, quantity: Quantity, data: st.DataObject) -> None:
    """At random, extreme and singular poses, for the tips or for one frame."""
    if quantity.kind not in (Kind.INVERSE_POSE, Kind.TRANSFORM_POINT, Kind.ADJOINT):
        frame = data.draw(st.sampled_from(["", "station", robot.rows[-1].name]))
        quantity = Quantity(quantity.kind, quantity.reference, frame)
    assume(robot.dof > 0)
    program = lower(derive(robot, quantity))
    points = np.concatenate([vector_samples(robot), singular_samples(robot)])
    inputs = input_samples(robot, program.signature.inputs, points)
    expectation = expect(ReferenceResults(robot, inputs), quantity)
    lengths, numbers = expectation.errors(results(robot, program, inputs))

    assert lengths.max() <= accepted_error(robot, "double") * expectation.length_scale
    assert numbers.max() <= accepted_error(robot, "double") * expectation.number_scale
