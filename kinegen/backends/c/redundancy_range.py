"""The ranges of a redundancy: `panda_joint_7_redundancy_range.h` and `.c`, and the nearest solution over all of it."""

from __future__ import annotations

import math
import textwrap
from fractions import Fraction
from typing import Any

from kinegen.backends import redundancy_range as numbers
from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import braced, wrapped_prototype
from kinegen.backends.c.kernel import model_macro
from kinegen.backends.c.nearest import ROUNDING
from kinegen.backends.inverse import NEAREST_FUNCTION, branches_of
from kinegen.backends.limits import LARGEST
from kinegen.backends.routines import LINE, ROUTINES, Routine
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.branches import Branches
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import POSE_AND_JACOBIAN, REDUNDANCY_RANGE, Kind
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, comment_text, function, guard, macro, prefix, range_file

_NEAREST_WORDS = (
    "Near is what it is for the choice with a given redundancy, and q0 may be the same array as q. "
    f"{numbers.SAMPLES} values in each interval of each branch are tried, ends among them, more where the range is "
    "longer than a turn, and that of q0 itself. A "
    f"golden section of {numbers.STEPS} steps follows between the neighbours of each that is nearer than both. No "
    "value that was tried is nearer, and where distances are continuous the result is a local minimum. A nearer one "
    "between the values that were tried may be missed. Returns 1 if there is a solution, else 0, and q is then NaN in "
    "every entry."
)


@dataclass(frozen=True, slots=True)
class RangeContext:
    """Holds what the templates `c/redundancy_range.h.jinja` and `c/redundancy_range.c.jinja` are given."""

    header: str
    source: str
    kernel_header: str
    guard: str
    most: str
    provenance: str
    title: str
    description: str
    prefix: str
    model: tuple[str, str]
    real: str
    format: str
    redundancy: str
    unit: str
    lines: tuple[str, ...]
    nearest_lines: tuple[str, ...]
    function: str
    inverse: str
    choice: str
    kernel: str
    prototype: str
    declaration: tuple[str, ...]
    nearest: str
    nearest_prototype: str
    nearest_declaration: tuple[str, ...]
    routines: tuple[Routine, ...]
    is_circle: bool
    dof: int
    branches: int
    most_ranges: int
    samples: int
    steps: int
    given: int
    parts: int
    depth: int
    budget: int
    lowest: str
    highest: str
    is_limited: str
    turns: str
    per_turn: str
    rounding: str
    sweeps: str
    per_sweep: str
    least_off: str
    per_reach: str
    shortest: str
    gap: str
    start: str
    end: str
    step: str
    per_sample: str
    golden: str
    beside: str
    half: str
    one: str
    largest: str
    half_turn: str
    turn: str


def emit_redundancy_range(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Prints the header and the source of the ranges of a redundancy.

    The inverse and the kernel of pose and Jacobian are among the programs.
    """
    context = range_context(kernels, real)
    templates = {context.header: "c/redundancy_range.h", context.source: "c/redundancy_range.c"}
    return rendered(templates, k=context, prefix=context.prefix, qualifier="static")


def range_context(kernels: RobotPrograms, real: ScalarType) -> RangeContext:
    """Returns everything the templates lay out, as finished text."""
    robot, branches = kernels.robot, branches_of(kernels)
    if branches is None or len(branches.names) > numbers.BRANCHES:
        raise ValueError(f"{robot.name} has no inverse with at most {numbers.BRANCHES} branches among its kernels")
    header, source = (range_file(robot.name, suffix, real) for suffix in "hc")
    most, dof = (macro(robot.name, word) for word in ("RANGES", "DOF"))
    name = function(robot.name, REDUNDANCY_RANGE.function, real)
    # An arm angle goes round a circle, a joint along a line: two searches.
    is_circle = numbers.range_of(robot, branches, real).given < 0
    rows = macro(robot.name, "BRANCHES")
    target = f"const {real} base_T_tool[16]"
    prototype = f"int {name}({target}, {real} intervals[{rows}][{most}][2], uint8_t counts[{rows}])"
    nearest = f"int {function(robot.name, numbers.ANY, real)}({target}, const {real} q0[{dof}], {real} q[{dof}])"
    return RangeContext(
        **_texts(robot, branches, real),
        **_counts(robot, branches, real),
        **_literals(robot, branches, real),
        header=header,
        source=source,
        kernel_header=c_file(robot.name, "h", real),
        guard=guard(header),
        most=most,
        prefix=prefix(robot.name, real),
        model=model_macro(robot),
        function=name,
        inverse=function(robot.name, Kind.INVERSE, real),
        choice=function(robot.name, NEAREST_FUNCTION, real),
        kernel=function(robot.name, POSE_AND_JACOBIAN.function, real),
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        nearest=function(robot.name, numbers.ANY, real),
        nearest_prototype=nearest,
        nearest_declaration=wrapped_prototype(nearest),
        routines=tuple(ROUTINES[real][operator] for operator in (Operator.SQRT, Operator.ATAN2)[: 1 + is_circle]),
        is_circle=is_circle,
    )


def _texts(robot: Robot, branches: Branches, real: ScalarType) -> dict[str, Any]:
    is_circle = numbers.range_of(robot, branches, real).given < 0
    shifts = any(each.name == robot.redundancy and each.type is JointType.PRISMATIC for each in robot.variables)
    redundancy = "the arm angle" if is_circle else f"joint {robot.redundancy}"
    return {
        "provenance": provenance(robot),
        "title": f"Ranges of {redundancy} of {robot.name}, {real.precision} precision",
        "description": comment_text(robot.description),
        "real": real.value,
        "format": "f64" if real is ScalarType.DOUBLE else "f32",
        "redundancy": redundancy,
        "unit": robot.units.length if shifts else "rad",
        "lines": _wrapped(_circle_words() if is_circle else _line_words(robot, branches, real)),
        "nearest_lines": _wrapped(_NEAREST_WORDS),
    }


def _circle_words() -> str:
    return (
        "The ends are in closed form (Shimizu et al., Analytical inverse kinematic computation for 7-DOF redundant "
        "manipulators with joint limits, IEEE Transactions on Robotics 24(5), 2008): a joint is at a limit where "
        "a sin(psi) + b cos(psi) + c = 0. The roots divide the circle; the inverse for the middle of each part says "
        "for which branches it is valid. The margin at limits counts as inside. Intervals are within -pi to pi: one "
        "that passes pi is given in two, the first of which begins at -pi and the last of which ends at pi; a whole "
        "circle is -pi to pi. At single values inside an interval axes 1 and 3 or 5 and 7 may coincide. There "
        "joints jump by half a turn, and the inverse may be invalid in that point. There is no heap or library, and "
        "all loops are bounded: 60 solutions of the inverse."
    )


def _line_words(robot: Robot, branches: Branches, real: ScalarType) -> str:
    found = numbers.range_of(robot, branches, real)
    width = numbers.finest_part(found.low, found.high, real)
    return (
        f"A bounded search: {numbers.PARTS} parts of the range are halved until, for each branch, the inverse at both "
        "ends and in the middle leaves no doubt: each joint is farther from its limits, or outside one, and the target "
        "is farther out of reach, or branches are farther apart than they move in the part, and no joint moves by more "
        f"than {numbers.SWEEP} rad. Both ends of an interval are values for which the inverse is valid, "
        f"the margin at limits counting as inside; the true end is less than {width:.1e} farther out. Intervals that "
        f"are less than {numbers.gap_of(found, real):.1e} apart are given as one: rounding makes such gaps where a "
        "joint touches a limit. Narrower intervals may be missed, and so may wider ones and gaps where joints reverse "
        "twice within a part that looks "
        f"settled. No more than {numbers.BUDGET} parts are halved for a target; after that, ends and gaps are as "
        f"coarse as the parts are. No more than {numbers.RANGES} intervals of a branch, the lowest ones, are given. "
        f"There is no heap or library. About {_stack(real)} bytes of stack are needed."
    )


def _stack(real: ScalarType) -> int:
    """Estimates the bytes of stack of a call: samples of eight branches."""
    number = real.size
    return -(-(numbers.FINENESS[real].depth + 8) * (64 * number + 16) // 1000) * 1000


def _wrapped(text: str) -> tuple[str, ...]:
    return tuple(textwrap.wrap(text, LINE, break_on_hyphens=False))


def _counts(robot: Robot, branches: Branches, real: ScalarType) -> dict[str, Any]:
    return {
        "dof": robot.dof,
        "branches": len(branches.names),
        "most_ranges": numbers.RANGES,
        "samples": numbers.samples_of(robot, branches, real),
        "steps": numbers.STEPS,
        "given": numbers.range_of(robot, branches, real).given,
        "parts": numbers.PARTS,
        "depth": numbers.FINENESS[real].depth,
        "budget": numbers.BUDGET,
    }


def _literals(robot: Robot, branches: Branches, real: ScalarType) -> dict[str, Any]:
    found, fineness, largest = numbers.range_of(robot, branches, real), numbers.FINENESS[real], float(LARGEST[real])
    bounds = numbers.bounds_of(robot, branches, real)
    width, size = found.high - found.low, reach(robot, robot.tips)
    sweeps = numbers.sweeps_of(robot, branches)
    turns = [turn if math.isfinite(turn) else 0.0 for turn in branches.turns]
    # Joints without limits, or without turns, have numbers that change nothing.
    arrays = {
        "lowest": [-largest if each is None else each[0] for each in bounds],
        "highest": [largest if each is None else each[1] for each in bounds],
        "turns": turns,
        "sweeps": sweeps,
        "per_sweep": [1 / sweep for sweep in sweeps],
        "per_turn": [1 / turn if turn else 0.0 for turn in turns],
    }
    single: dict[str, Any] = {
        "rounding": ROUNDING[real],
        "least_off": fineness.least_off,
        "per_reach": 1 / size,
        "shortest": fineness.shortest * size,
        "gap": numbers.gap_of(found, real),
        "start": found.low,
        "end": found.high,
        "step": width / numbers.PARTS,
        "per_sample": 1 / (numbers.samples_of(robot, branches, real) - 1),
        "golden": numbers.GOLDEN,
        "beside": numbers.BESIDE * width,
        "half": 0.5,
        "one": 1,
        "largest": largest,
        "half_turn": real.round(Fraction(math.pi)),
        "turn": real.round(Fraction(2 * math.pi)),
    }
    texts = {name: real.literal(Fraction(value)) for name, value in single.items()}
    texts |= {name: braced(real.literal(Fraction(value)) for value in values) for name, values in arrays.items()}
    return texts | {"is_limited": braced(str(int(each is not None)) for each in bounds)}
