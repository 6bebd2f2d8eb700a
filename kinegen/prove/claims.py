"""The functions of a robot's C files, each with what is to be shown of it and the program that Frama-C is given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from kinegen.emit.c.arguments import given
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.c.nearest import nearest_of
from kinegen.emit.fixed.kernel import emit_fixed
from kinegen.emit.fixed.kernels import FixedKernels, fixed_kernels
from kinegen.emit.functions import is_straight
from kinegen.emit.kernels import Kernels
from kinegen.emit.nearest import NAME as NEAREST
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import Q30, c_file, default_params, function, macro
from kinegen.prove.companions import limits_driver, nearest_driver
from kinegen.prove.driver import HEAD, Claim, Driver, kernel_driver
from kinegen.prove.ranges import InputRange, input_ranges

LIMITS = ("within_limits", "clamp")
"""The functions about limits that every source has."""

_ENDS = (-(2**31), 2**31 - 1)


@dataclass(frozen=True, slots=True)
class Subject:
    """One function that is analysed.

    Attributes:
        function: Its C name.
        called: The same without the robot's prefix.
        output: The output that it computes; its own name where it belongs to an output or is about limits.
        real: Its number type: `float`, `double` or `q30`.
        ranges: What its inputs may be, where they may not be anything.
        driver: The program that calls it.
    """

    function: str
    called: str
    output: str
    real: str
    ranges: tuple[InputRange, ...]
    driver: Driver


def subjects(kernels: Kernels, reals: tuple[Real, ...], *, integers: bool) -> tuple[Subject, ...]:
    """All functions of the scalar C files of a robot.

    Args:
        kernels: The robot and its programs.
        reals: Number types.
        integers: Whether to analyse the kernels in integers, too.

    Returns:
        The functions: for each number type the outputs in their order, the choice among the solutions of an inverse,
        then those about limits.

    Raises:
        KinegenError: If integers cannot evaluate one of the outputs.
    """
    found = [subject for real in reals for subject in _of_type(kernels, real)]
    return (*found, *(_in_integers(fixed_kernels(kernels)) if integers else ()))


def _of_type(kernels: Kernels, real: Real) -> Iterator[Subject]:
    robot, files = kernels.robot, emit_kernel(kernels, real)
    for program in kernels.programs:
        claim = Claim.FINITE if is_straight(program) else Claim.DEFINED
        driver = kernel_driver(replace(kernels, programs=(program,)), real, files=files, claim=claim)
        name = function(robot.name, program.quantity.function, real)
        ranges = tuple(each for array in given(program) for each in input_ranges(robot, array))
        is_bounded = claim is Claim.FINITE
        called = program.quantity.function
        yield Subject(name, called, str(program.quantity), real, ranges * is_bounded, replace(driver, name=name))
    if nearest := nearest_of(kernels, real):
        driver = nearest_driver(kernels, real, nearest, files)
        yield Subject(driver.name, NEAREST, NEAREST, real, (), driver)
    for name in LIMITS if robot.dof else ():
        driver = limits_driver(kernels, real, name, files)
        yield Subject(driver.name, name, name, real, (), driver)


def _in_integers(fixed: FixedKernels) -> Iterator[Subject]:
    files = emit_fixed(fixed)
    for program in fixed.programs:
        called = program.program.quantity.function
        name = function(fixed.robot.name, called, Q30)
        main = _integer_main(fixed, program.program, name)
        driver = Driver(name, {"main.c": main, **files}, 1, Claim.DEFINED)
        yield Subject(name, called, str(program.program.quantity), Q30, (), driver)


def _integer_main(fixed: FixedKernels, program: Program, name: str) -> str:
    """A program that calls an integer kernel with every joint vector that int32_t holds."""
    robot = fixed.robot
    (result,) = program.signature.results
    total, extent = result.blocks * result.stored, f"[{result.blocks}]" if result.per_frame else ""
    arguments = ["q"] * bool(robot.dof)
    arguments += [f"&{default_params(robot.name, Q30)}"] * bool(robot.runtime_parameters)
    any_value = f"Frama_C_interval({_ENDS[0] + 1} - 1, {_ENDS[1]})"
    lines = [
        *([f"int32_t q[{macro(robot.name, 'DOF')}];"] if robot.dof else []),
        *(f"q[{index}] = {any_value};" for index in range(robot.dof)),
        f"int32_t {result.name}{extent}[{result.stored}];",
        f"{name}({', '.join([*arguments, result.name])});",
        f"const int32_t *const entry = &{result.name}[0]{'[0]' * result.per_frame};",
        f"//@ loop unroll {total};",
        f"for (int i = 0; i < {total}; i++) {{",
        "    /*@ assert \\initialized(&entry[i]); */",
        "}",
        "return 0;",
    ]
    body = "".join(f"    {line}\n" for line in lines)
    return f'{HEAD}#include "{c_file(robot.name, "c", Q30)}"\n\nint main(void)\n{{\n{body}}}\n'
