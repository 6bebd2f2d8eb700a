"""The functions of a robot's C files, each with what is to be shown of it and the program that Frama-C is given.

They have no `Program`; a text calls them with every number of the type, infinities and NaN among them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import Bounds, bounds_of, given
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.nearest import Nearest, nearest_of
from kinegen.backends.fixed_point.files import emit_fixed
from kinegen.backends.fixed_point.kernels import FixedKernels, fixed_kernels
from kinegen.backends.inverse import NEAREST_FUNCTION as NEAREST
from kinegen.backends.routines import is_straight
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, c_file, default_params, function, macro, prefix
from kinegen.verify.frama_c.driver import HEAD, Claim, Driver, any_number_text, kernel_driver
from kinegen.verify.frama_c.ranges import InputRange, input_ranges


def limits_driver(
    kernels: RobotPrograms, real: ScalarType, bounds: Bounds, called: str, files: dict[str, str]
) -> Driver:
    """Returns a program that asks for limits, or clamps, with every vector, infinities and NaN among them.

    `called`: which of their two functions. The first function gives 0 or 1; the second a vector within the
    limits, with NaN where there was one.
    """
    vector, count, (low, high) = bounds.vector, len(bounds.pairs), bounds.names
    if called == bounds.clamp:
        kept = f"\\is_NaN(clamped[i]) || ({low}[i] <= clamped[i] <= {high}[i])"
        body = (
            f"    {real} clamped[{bounds.size}];\n    {called}({vector}, clamped);\n    //@ loop unroll {count};\n"
            f"    for (int i = 0; i < {count}; i++) {{\n        /*@ assert {kept}; */\n    }}\n"
        )
    else:
        body = f"    const int within = {called}({vector});\n    /*@ assert within == 0 || within == 1; */\n"
    values = "".join(f"    {vector}[{index}] = any_number();\n" for index in range(count))
    main = f"int main(void)\n{{\n    {real} {vector}[{bounds.size}];\n{values}{body}    return 0;\n}}\n"
    text = f'{HEAD}{any_number_text(real)}#include "{c_file(kernels.robot.name, "c", real)}"\n\n{main}'
    return Driver(called, {"main.c": text, **files}, 1, Claim.DEFINED)


def nearest_driver(kernels: RobotPrograms, real: ScalarType, nearest: Nearest, files: dict[str, str]) -> Driver:
    """Returns a program that calls the choice among solutions with every target and joint vector.

    The function gives 0 or 1, and sets every joint value, to a number or NaN.
    """
    robot = kernels.robot
    parameters = [f"&{default_params(robot.name, real)}"] * bool(nearest.params_type)
    given = ["redundancy"] * bool(nearest.given)
    call = f"{nearest.name}({', '.join([nearest.target, *given, 'q0', *parameters, 'q'])})"
    # Every number is any number, and each result is read: Frama-C reports what is not set.
    lines = [
        f"{real} {nearest.target}[16];",
        *(f"{real} {name}[{nearest.given}];" for name in given),
        *(f"redundancy[{index}] = any_number();" for index in range(nearest.given)),
        f"{real} q0[{nearest.dof}];",
        *(f"{nearest.target}[{index}] = any_number();" for index in range(16)),
        *(f"q0[{index}] = any_number();" for index in range(robot.dof)),
        f"{real} q[{nearest.dof}];",
        f"const int exists = {call};",
        "/*@ assert exists == 0 || exists == 1; */",
        f"//@ loop unroll {robot.dof};",
        f"for (int i = 0; i < {robot.dof}; i++) {{",
        "    /*@ assert \\initialized(&q[i]); */",
        "}",
        "return 0;",
    ]
    body = "".join(f"    {line}\n" for line in lines)
    text = f'{HEAD}{any_number_text(real)}#include "{c_file(robot.name, "c", real)}"\n\nint main(void)\n{{\n{body}}}\n'
    return Driver(nearest.name, {"main.c": text, **files}, 2, Claim.DEFINED)


_ENDS = (-(2**31), 2**31 - 1)


@dataclass(frozen=True, slots=True)
class Subject:
    """One function that is analysed."""

    function: str  # Its C name
    called: str  # The same without the robot's prefix
    output: str  # The output that it computes; its own name where it belongs to an output or is about limits
    real: str  # Its number type: `float`, `double` or `q30`
    ranges: tuple[InputRange, ...]  # What its inputs may be, where they may not be anything
    driver: Driver  # The program that calls it


def subjects(kernels: RobotPrograms, reals: tuple[ScalarType, ...], *, integers: bool) -> tuple[Subject, ...]:
    """Returns all functions of the scalar C files of a robot.

    `integers`: whether to analyse the kernels in integers, too. They come by number type: the outputs in
    their order, the choice among the solutions of an inverse, then those about limits. Raises `KinegenError` if
    integers cannot evaluate one of the outputs.
    """
    found = [subject for real in reals for subject in _of_type(kernels, real)]
    return (*found, *(_in_integers(fixed_kernels(kernels)) if integers else ()))


def _of_type(kernels: RobotPrograms, real: ScalarType) -> Iterator[Subject]:
    robot, files = kernels.robot, emit_kernel(kernels, real)
    for program in kernels.programs:
        claim = Claim.FINITE if is_straight(program) else Claim.DEFINED
        driver = kernel_driver(kernels.alone(program), real, files=files, claim=claim)
        name = function(robot.name, program.quantity.function, real)
        ranges = tuple(each for array in given(program) for each in input_ranges(robot, array))
        is_bounded = claim is Claim.FINITE
        called = program.quantity.function
        yield Subject(name, called, str(program.quantity), real, ranges * is_bounded, replace(driver, name=name))
    if nearest := nearest_of(kernels, real):
        driver = nearest_driver(kernels, real, nearest, files)
        yield Subject(driver.name, NEAREST, NEAREST, real, (), driver)
    for bounds in bounds_of(kernels, real):
        for called in (bounds.within, bounds.clamp):
            name = called.removeprefix(f"{prefix(robot.name, real)}_")
            yield Subject(called, name, name, real, (), limits_driver(kernels, real, bounds, called, files))


def _in_integers(fixed: FixedKernels) -> Iterator[Subject]:
    files = emit_fixed(fixed)
    for program in fixed.programs:
        called = program.program.quantity.function
        name = function(fixed.robot.name, called, Q30)
        main = _integer_main(fixed, program.program, name)
        driver = Driver(name, {"main.c": main, **files}, 1, Claim.DEFINED)
        yield Subject(name, called, str(program.program.quantity), Q30, (), driver)


def _integer_main(fixed: FixedKernels, program: Program, name: str) -> str:
    """Returns a program that calls an integer kernel with every joint vector that int32_t holds."""
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
