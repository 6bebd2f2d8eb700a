"""C programs for Frama-C: emitted kernels, called with every input of a range.

The kernels are included as they were emitted. A driver puts a function of its own in the place of their sine-cosine
pair, by the macro that boards use for theirs: it compares the angle with the cuts of `pieces.py` and, in every branch,
calls the emitted pair with what it was given. The program computes what the kernels compute; but Frama-C analyses the
pair once for each piece.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinegen.emit.c.arguments import declared
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS
from kinegen.ir.program import Program
from kinegen.naming import c_file, function, macro, prefix, sincos_macro
from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot
from tests.prove.angles import Box, angle_range, rounded
from tests.prove.pieces import cuts, pair_text

TURNS = 2
"""How far a revolute joint without limits is taken to turn, to either side."""

FARTHEST = 5 * 2 * math.pi
"""Angles beyond this are analysed in one piece: nothing is proved of them, and the program stays small."""

HEAD = '#include "__fc_builtin.h"\n\n'


@dataclass(frozen=True, slots=True)
class Driver:
    """A program for Frama-C.

    Attributes:
        name: What it proves, as a file name.
        files: The C files of the program by name; `main.c` includes the others.
        assertions: How many assertions it holds.
    """

    name: str
    files: dict[str, str]
    assertions: int


def joint_range(robot: Robot) -> Box:
    """What is proved of which joint values: the limits, or what stands for them.

    Returns:
        Lower and upper bound of each joint variable, in radians or the file's length unit. Without limits: `TURNS`
        turns to either side, or for a prismatic joint the sum of the robot's lengths.
    """
    half = TURNS * 2 * math.pi
    return tuple(
        (-half, half) if variable.limits is None and variable.type is not JointType.PRISMATIC else bounds
        for variable, bounds in zip(robot.variables, joint_box(robot), strict=True)
    )


def kernel_driver(kernels: Kernels, real: Real, box: Box | None = None, files: dict[str, str] | None = None) -> Driver:
    """A program that calls all kernels of a number type with every joint vector of a box.

    Args:
        kernels: The robot and its programs.
        real: The number type.
        box: The box; `joint_range` if left out.
        files: Other files in place of the emitted ones, for tests.

    Returns:
        The program. It shows the hull of the rotation entries and of the positions of each kernel.
    """
    robot = kernels.robot
    stem = prefix(robot.name, real)
    ranges = box or joint_range(robot)
    source = c_file(robot.name, "c", real)
    lines = [HEAD, _pair_in_pieces(kernels, real, ranges), f'#include "{source}"\n\nint main(void)\n{{\n']
    lines += [f"    {real} q[{macro(robot.name, 'DOF')}];\n"] if robot.dof else []
    lines += [f"    q[{index}] = {any_between(real, *bounds)};\n" for index, bounds in enumerate(ranges)]
    for program in kernels.programs:
        lines.append(_call(kernels, program, real))
    lines.append("    return 0;\n}\n")
    emitted = emit_kernel(kernels, real)
    return Driver(stem, {"main.c": "".join(lines), **(files or emitted)}, len(kernels.programs))


def pair_driver(real: Real) -> Driver:
    """A program that calls the pair with every angle of its stated range at once."""
    limit = SINCOS[real].limit
    body = f"    const {real} x = {any_between(real, -limit, limit)};\n{_pair_call(real)}"
    body += "    /*@ assert \\is_finite(s) && \\is_finite(c); */\n"
    return Driver(f"pair_{real}", {"main.c": _pair_program(real, body)}, 1)


def guard_driver(real: Real) -> Driver:
    """A program that calls the pair with everything outside its stated range: larger angles, infinities, NaN."""
    limit = SINCOS[real].limit
    kind = np.float32 if real is Real.FLOAT else np.float64
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
    return Driver(f"guard_{real}", {"main.c": _pair_program(real, body)}, len(outside))


def any_between(real: Real, low: float, high: float) -> str:
    """An expression that may be any number of the type from low to high; the ends are rounded outwards."""
    return f"Frama_C_{real}_interval({literal(real, low, -math.inf)}, {literal(real, high, math.inf)})"


def literal(real: Real, value: float, towards: float | None = None) -> str:
    """A number of the type, exactly; one that the type does not hold is rounded to nearest, or else outwards."""
    return f"{rounded(real, value, towards).hex()}{_suffix(real)}"


def _suffix(real: Real) -> str:
    return "f" if real is Real.FLOAT else ""


def _pair_program(real: Real, body: str) -> str:
    return f"{HEAD}{pair_text('pair', real)}\n\nint main(void)\n{{\n{body}    return 0;\n}}\n"


def _pair_call(real: Real) -> str:
    return f"    {real} s;\n    {real} c;\n    pair_sincos(x, &s, &c);\n"


def _pair_in_pieces(kernels: Kernels, real: Real, ranges: Box) -> str:
    """The emitted pair, the function that calls it in pieces, and the macro that puts this one in its place."""
    robot = kernels.robot.name
    stem = prefix(robot, real)
    low, high = angle_range(kernels, real, ranges)
    places = cuts(real, max(low, -FARTHEST), min(high, FARTHEST))
    return (
        f"{pair_text(stem, real)}\n\n"
        f"static void {stem}_sincos_in_pieces(const {real} x, {real} *s, {real} *c)\n{{\n"
        f"    {real} sine;\n    {real} cosine;\n"
        f"{_branches(places, f'{stem}_sincos(x, &sine, &cosine);', real, '    ')}"
        f"    *s = sine;\n    *c = cosine;\n}}\n\n"
        f"#define {sincos_macro(robot, real)}(x, s, c) {stem}_sincos_in_pieces((x), (s), (c))\n\n"
    )


def _branches(places: Sequence[float], call: str, real: Real, indent: str) -> str:
    """Finds the piece of an angle by halving; the same call stands in every leaf."""
    if not places:
        return f"{indent}{call}\n"
    middle = len(places) // 2
    low = _branches(places[:middle], call, real, f"{indent}  ")
    high = _branches(places[middle + 1 :], call, real, f"{indent}  ")
    return f"{indent}if (x < {literal(real, places[middle])}) {{\n{low}{indent}}} else {{\n{high}{indent}}}\n"


def _call(kernels: Kernels, program: Program, real: Real) -> str:
    """A block that calls one kernel, asserts that its output is finite and shows what it may be."""
    robot = kernels.robot
    name = function(robot.name, program.quantity.function, real)
    (result,) = program.signature.results
    output, total = result.name, result.blocks * result.stored
    arguments = (["q"] if robot.dof else []) + (
        [f"&{prefix(robot.name, real)}_default_params"] if robot.runtime_parameters else []
    )
    place = f"{output}[Frama_C_interval(0, {result.blocks - 1})]" if result.per_frame else output
    position = "4 * Frama_C_interval(0, 2) + 3" if program.quantity.is_pose else "Frama_C_interval(0, 2)"
    shows = [f"Frama_C_show_each_{program.quantity.function}_position({place}[{position}]);"]
    if program.quantity.is_pose:
        rotation = "4 * Frama_C_interval(0, 2) + Frama_C_interval(0, 2)"
        shows.append(f"Frama_C_show_each_{program.quantity.function}_rotation({place}[{rotation}]);")
    lines = [
        "{",
        f"    {real} {declared(kernels, program, result)};",
        f"    {name}({', '.join([*arguments, output])});",
        f"    const {real} *const entry = {f'&{output}[0][0]' if result.per_frame else f'&{output}[0]'};",
        f"    //@ loop unroll {total};",
        f"    for (int i = 0; i < {total}; i++) {{",
        "        /*@ assert \\is_finite(entry[i]); */",
        "    }",
        *(f"    {show}" for show in shows),
        "}",
    ]
    return "".join(f"    {line}\n" for line in lines)
