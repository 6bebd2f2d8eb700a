"""The call that the example of a package makes which has kernels in integers alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

from kinegen.emit.c.arguments import computed
from kinegen.emit.fixed.kernels import FixedKernels, signed_angle
from kinegen.emit.packages.example import Example, ExampleInput, ExampleResult, joint_vector, result_of, what_of
from kinegen.ir.fixed.program import NUMBER_BITS, FixedProgram
from kinegen.ir.fixed.rounding import nearest_integer
from kinegen.ir.fixed.turns import binary_angle
from kinegen.naming import Q30, c_file, default_params, function, macro
from kinegen.outputs import Quantity
from kinegen.robot.model import JointType


def fixed_example(fixed: FixedKernels) -> Example:
    """The example: the pose where there is one, else the first kernel.

    Args:
        fixed: The robot and its integer programs.

    Returns:
        The call and its text; results are printed as numbers of the file's units.
    """
    robot = fixed.robot
    poses = [each for each in fixed.programs if each.program.quantity == Quantity.POSE]
    program = (poses or fixed.programs)[0]
    exact = program.program
    result = exact.signature.results[0]
    name = function(robot.name, exact.quantity.function, Q30)
    parameters = [f"&{default_params(robot.name, Q30)}"] if robot.runtime_parameters else []
    arguments = [*(["q"] if robot.dof else []), *parameters, result.name]
    return Example(
        what=what_of(exact, name),
        header=c_file(robot.name, "h", Q30),
        real="int32_t",
        inputs=(ExampleInput(f"q[{macro(robot.name, 'DOF')}]", tuple(_joints(fixed))),) if robot.dof else (),
        results=tuple(_scaled(fixed, program, result_of(fixed.kernels, exact, array)) for array in computed(exact)),
        extra=(),
        flag="",
        call=f"{name}({', '.join(arguments)})",
    )


def _scaled(fixed: FixedKernels, program: FixedProgram, result: ExampleResult) -> ExampleResult:
    """A result with what its integers stand for: the last column of a pose is a length, the others are numbers."""
    is_pose = program.program.quantity.is_pose
    columns = range(result.columns)
    bits = [NUMBER_BITS if is_pose and column < result.columns - 1 else fixed.scales.length for column in columns]
    return replace(result, scales=tuple(f"{0.5**each!r}" for each in bits))


def _joints(fixed: FixedKernels) -> Iterator[str]:
    """The joint vector in integers, each entry with its name and unit."""
    robot = fixed.robot
    for variable, value in zip(robot.variables, joint_vector(robot), strict=True):
        is_stroke = variable.type is JointType.PRISMATIC
        unit = f"1/2^{fixed.scales.stroke} {robot.units.length}" if is_stroke else "1/2^32 turn"
        comma = "" if variable is robot.variables[-1] else ","
        yield f"{_integer(value, fixed.scales.stroke if is_stroke else None)}{comma} /* {variable.name} [{unit}] */"


def _integer(value: Fraction, bits: int | None) -> int:
    return signed_angle(binary_angle(value)) if bits is None else nearest_integer(value * 2**bits)
