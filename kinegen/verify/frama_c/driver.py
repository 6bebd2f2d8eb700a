"""C programs for Frama-C: emitted kernels, called with every input of a range.

The kernels are included as they were emitted. A driver puts a function of its own in the place of their sine-cosine
pair, by the macro that boards use for theirs: it compares the angle with the cuts of `sincos_pieces.py` and, in every
branch, calls the emitted pair with what it was given. The program computes what the kernels compute; but Frama-C
analyses the pair once for each piece.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import computed, declared, given, number_type
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.outputs import Array
from kinegen.model.robot import Robot
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, default_params, function, prefix, sincos_macro
from kinegen.verify.frama_c.ranges import Box, angle_range, cuts, input_ranges, joint_range, pair_text, rounded

FARTHEST = 5 * 2 * math.pi
"""Angles beyond this are analysed in one piece: nothing is proved of them, and the program stays small."""

HEAD = '#include "__fc_builtin.h"\n\n'


class Claim(StrEnum):
    """What is to be shown of a function."""

    FINITE = "finite"
    """No run-time error, no infinity and no NaN on the way, and finite results."""
    DEFINED = "defined"
    """No run-time error, whatever the inputs are, infinities and NaN among them; every result is set, to some number,
    infinity or NaN."""


@dataclass(frozen=True, slots=True)
class Driver:
    """A program for Frama-C."""

    name: str  # What it proves, as a file name
    files: dict[str, str]  # The C files of the program by name; `main.c` includes the others
    assertions: int  # How many assertions it holds
    claim: Claim = Claim.FINITE  # What is to be shown; it decides which operations raise an alarm
    special: bool = False  # Whether infinities and NaN are wanted on the way, though the claim is `FINITE` otherwise


def kernel_driver(
    kernels: RobotPrograms,
    real: ScalarType,
    box: Box | None = None,
    files: dict[str, str] | None = None,
    claim: Claim = Claim.FINITE,
) -> Driver:
    """Returns a program that calls kernels of a number type with every input of a box.

    `kernels`: the robot and the programs that are called; `box`: the joint values, where the claim is `FINITE`;
    `joint_range` if left out; `files`: other files in place of those that are emitted for these programs; `claim`: what
    is to be shown of each. It shows the hull of the rotation entries and of the positions of each kernel,
    or of its results.
    """
    robot = kernels.robot
    source = c_file(robot.name, "c", real)
    inputs = {array.name: (array, program) for program in kernels.programs for array in given(program)}
    ranges = {name: _bounds(robot, array, box) for name, (array, _) in inputs.items()}
    lines = [HEAD, any_number_text(real) if claim is Claim.DEFINED else "", _pair_in_pieces(kernels, real, ranges)]
    lines.append(f'#include "{source}"\n\nint main(void)\n{{\n')
    for name, (array, program) in inputs.items():
        lines.append(f"    {real} {declared(kernels, program, array)};\n")
        lines += [
            f"    {name}[{place}] = {any_between(real, *ends) if claim is Claim.FINITE else 'any_number()'};\n"
            for place, ends in enumerate(ranges[name])
        ]
    for program in kernels.programs:
        lines.append(_call(kernels, program, real, claim))
    lines.append("    return 0;\n}\n")
    count = sum(len(computed(program)) for program in kernels.programs)
    return Driver(
        prefix(robot.name, real), {"main.c": "".join(lines), **(files or emit_kernel(kernels, real))}, count, claim
    )


def pair_driver(real: ScalarType) -> Driver:
    """Returns a program that calls the pair with every angle of its stated range at once."""
    limit = SINCOS[real].limit
    body = f"    const {real} x = {any_between(real, -limit, limit)};\n{_pair_call(real)}"
    body += "    /*@ assert \\is_finite(s) && \\is_finite(c); */\n"
    return Driver(f"pair_{real}", {"main.c": _pair_program(real, body)}, 1)


def guard_driver(real: ScalarType) -> Driver:
    """A program that calls the pair with everything outside its stated range: larger angles, infinities, NaN."""
    limit = SINCOS[real].limit
    kind = np.float32 if real is ScalarType.FLOAT else np.float64
    beyond, largest = float(np.nextafter(kind(limit), kind(np.inf))), float(np.finfo(kind).max)
    outside = {
        "above": any_between(real, beyond, largest),
        "below": any_between(real, -largest, -beyond),
        "infinite": f"{literal(real, largest)} * {literal(real, 2.0)}",
        "minus infinite": f"-{literal(real, largest)} * {literal(real, 2.0)}",
        "not a number": f"0.0{_suffix(real)} / 0.0{_suffix(real)}",
    }
    body = ""
    for place, value in outside.items():
        call = _pair_call(real).replace("    ", "        ")
        check = "        /*@ assert \\is_NaN(s) && \\is_NaN(c); */\n"
        body += f"    /* {place} */\n    {{\n        const {real} x = {value};\n{call}{check}    }}\n"
    return Driver(f"guard_{real}", {"main.c": _pair_program(real, body)}, len(outside), special=True)


def any_between(real: ScalarType, low: float, high: float) -> str:
    """Returns an expression that may be any number of the type from low to high; the ends are rounded outwards."""
    return f"Frama_C_{real}_interval({literal(real, low, -math.inf)}, {literal(real, high, math.inf)})"


def literal(real: ScalarType, value: float, towards: float | None = None) -> str:
    """A number of the type, exactly; one that the type does not hold is rounded to nearest, or else outwards."""
    return f"{rounded(real, value, towards).hex()}{_suffix(real)}"


def _suffix(real: ScalarType) -> str:
    return "f" if real is ScalarType.FLOAT else ""


def _pair_program(real: ScalarType, body: str) -> str:
    return f"{HEAD}{pair_text('pair', real)}\n\nint main(void)\n{{\n{body}    return 0;\n}}\n"


def _pair_call(real: ScalarType) -> str:
    return f"    {real} s;\n    {real} c;\n    pair_sincos(x, &s, &c);\n"


def any_number_text(real: ScalarType) -> str:
    """Returns a function that may give every number of the type, infinities and NaN among them."""
    largest = float(np.finfo(np.float32 if real is ScalarType.FLOAT else np.float64).max)
    end, zero = literal(real, largest), f"0.0{_suffix(real)}"
    cases = (
        f"case 0: return {end} * {literal(real, 2.0)};",
        f"case 1: return -{end} * {literal(real, 2.0)};",
        f"case 2: return {zero} / {zero};",
        f"default: return {any_between(real, -largest, largest)};",
    )
    body = "".join(f"    {case}\n" for case in cases)
    return f"static {real} any_number(void)\n{{\n    switch (Frama_C_interval(0, 3)) {{\n{body}    }}\n}}\n\n"


def _bounds(robot: Robot, array: Array, box: Box | None) -> Box:
    """Lower and upper bound of each number of an input."""
    if array.name == "q":
        return box or joint_range(robot)
    return tuple((each.low, each.high) for each in input_ranges(robot, array))


def _numbers(program: Program, ranges: dict[str, Box]) -> Iterator[tuple[float, float]]:
    """Yields the bounds of the inputs of a program as its variables count them: of matrices the upper three rows."""
    for array in given(program):
        yield from ranges[array.name][: array.size]


def _pair_in_pieces(kernels: RobotPrograms, real: ScalarType, ranges: dict[str, Box]) -> str:
    """Returns the emitted pair, the function that calls it in pieces, and the macro that puts this one in its place."""
    robot = kernels.robot.name
    stem = prefix(robot, real)
    found = [
        angle_range(kernels.alone(program), real, tuple(_numbers(program, ranges)), FARTHEST)
        for program in kernels.programs
    ]
    low, high = min(low for low, _ in found), max(high for _, high in found)
    places = cuts(real, max(low, -FARTHEST), min(high, FARTHEST))
    return (
        f"{pair_text(stem, real)}\n\n"
        f"static void {stem}_sincos_in_pieces(const {real} x, {real} *s, {real} *c)\n{{\n"
        f"    {real} sine;\n    {real} cosine;\n"
        f"{_branches(places, f'{stem}_sincos(x, &sine, &cosine);', real, '    ')}"
        f"    *s = sine;\n    *c = cosine;\n}}\n\n"
        f"#define {sincos_macro(robot, real)}(x, s, c) {stem}_sincos_in_pieces((x), (s), (c))\n\n"
    )


def _branches(places: Sequence[float], call: str, real: ScalarType, indent: str) -> str:
    """Finds the piece of an angle by halving; the same call stands in every leaf."""
    if not places:
        return f"{indent}{call}\n"
    middle = len(places) // 2
    low = _branches(places[:middle], call, real, f"{indent}  ")
    high = _branches(places[middle + 1 :], call, real, f"{indent}  ")
    return f"{indent}if (x < {literal(real, places[middle])}) {{\n{low}{indent}}} else {{\n{high}{indent}}}\n"


def _call(kernels: RobotPrograms, program: Program, real: ScalarType, claim: Claim) -> str:
    """Returns a block that calls one kernel, asserts what is claimed of its results and shows what they may be."""
    robot = kernels.robot
    results = computed(program)
    arguments = [array.name for array in given(program)]
    arguments += [f"&{default_params(robot.name, real)}"] if robot.runtime_parameters else []
    arguments += [array.name for array in results]
    lines = ["{", *(f"    {number_type(array, real)} {declared(kernels, program, array)};" for array in results)]
    lines.append(f"    {function(robot.name, program.quantity.function, real)}({', '.join(arguments)});")
    for place, result in enumerate(results):
        total, entry = result.blocks * result.stored, f"entry{place or ''}"
        first = f"&{result.name}[0]{'[0]' * result.in_blocks}"
        claimed = _claimed(result, claim)
        lines += [
            f"    const {number_type(result, real)} *const {entry} = {first};",
            f"    //@ loop unroll {total};",
            f"    for (int i = 0; i < {total}; i++) {{",
            f"        /*@ assert \\{claimed.replace('entry', entry)}; */",
            "    }",
        ]
    if claim is Claim.FINITE:
        lines += [f"    {show}" for result in results for show in _shows(program, result)]
    return "".join(f"    {line}\n" for line in [*lines, "}"])


def _claimed(result: Array, claim: Claim) -> str:
    """Returns what is asserted of each number of a result; a truth value has two."""
    if result.is_truth:
        return "initialized(&entry[i]) && entry[i] <= 1"
    return "is_finite(entry[i])" if claim is Claim.FINITE else "initialized(&entry[i])"


def _shows(program: Program, result: Array) -> Iterator[str]:
    """Yields what makes Frama-C print the hull of a result."""
    name = program.quantity.function
    place = f"{result.name}[Frama_C_interval(0, {result.blocks - 1})]" if result.in_blocks else result.name
    if result.is_pose:
        yield f"Frama_C_show_each_{name}_position({place}[4 * Frama_C_interval(0, 2) + 3]);"
        yield f"Frama_C_show_each_{name}_rotation({place}[4 * Frama_C_interval(0, 2) + Frama_C_interval(0, 2)]);"
    elif result.is_point:
        yield f"Frama_C_show_each_{name}_position({place}[Frama_C_interval(0, 2)]);"
    else:
        yield f"Frama_C_show_each_{name}_{result.name}({place}[Frama_C_interval(0, {result.stored - 1})]);"
