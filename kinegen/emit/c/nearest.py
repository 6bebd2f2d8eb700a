"""The C function that chooses the solution nearest to a joint vector, as templates print it."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.arguments import wrapped_prototype
from kinegen.emit.functions import LINE
from kinegen.emit.inverse import inverse_of
from kinegen.emit.kernels import Kernels
from kinegen.emit.limits import LARGEST
from kinegen.emit.nearest import FARTHEST_STROKE, MOST_TURNS, NAME, Turning, turnings
from kinegen.emit.reals import Real
from kinegen.naming import function, macro, params_type, prefix
from kinegen.outputs import Branches
from kinegen.robot.model import Robot

ROUNDING = {Real.DOUBLE: Fraction(3 * 2**51), Real.FLOAT: Fraction(3 * 2**22)}
"""Adding and subtracting this rounds to a whole number."""


@dataclass(frozen=True, slots=True)
class NearestJoint:
    """One joint as the templates print it: its index, whether it turns, and C literals."""

    index: int
    turns: bool
    turn: str
    per_turn: str
    lowest: str
    highest: str
    farthest: str


@dataclass(frozen=True, slots=True)
class Nearest:
    """What the templates `c/_nearest.*.jinja` are given.

    Attributes:
        name: C name of the function.
        prototype: Its declaration.
        declaration: The same in lines.
        inverse: C name of the function that gives all solutions.
        plain: Its name without the prefix of the robot, as other languages have it.
        target: Name of the pose.
        turned: C name of the function that adds whole turns; empty where no joint turns.
        dof: Macro of the number of joints.
        branches: Macro of the number of solutions.
        params_type: Type of the runtime parameters; empty where there are none.
        given: How many numbers are given besides the target.
        joints: The joints.
        last: Index of the last one.
        rounding: What is added and subtracted to round to a whole number.
        largest: The largest number of the type.
        zero: 0 as a number of the type.
        one: 1 likewise.
        lines: The words of the header.
    """

    name: str
    prototype: str
    declaration: tuple[str, ...]
    inverse: str
    plain: str
    target: str
    turned: str
    dof: str
    branches: str
    params_type: str
    given: int
    joints: tuple[NearestJoint, ...]
    last: int
    rounding: str
    largest: str
    zero: str
    one: str
    lines: tuple[str, ...]


def nearest_of(kernels: Kernels, real: Real) -> Nearest | None:
    """What the templates lay out; None where there is no closed-form inverse."""
    found = inverse_of(kernels)
    if found is None:
        return None
    (inverse, branches), robot = found, kernels.robot
    stem, dof = prefix(robot.name, real), macro(robot.name, "DOF")
    name, params = function(robot.name, NAME, real), params_type(robot.name, real) if robot.runtime_parameters else ""
    arguments = [
        f"const {real} {inverse.signature.inputs[0].name}[16]",
        *[f"const {real} redundancy[{branches.given}]"] * bool(branches.given),
        f"const {real} q0[{dof}]",
        *[f"const {params} *params"] * bool(params),
    ]
    prototype = f"int {name}({', '.join([*arguments, f'{real} q[{dof}]'])})"
    return Nearest(
        name=name,
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        inverse=function(robot.name, inverse.quantity.function, real),
        plain=inverse.quantity.function,
        target=inverse.signature.inputs[0].name,
        turned=f"{stem}_turned" if any(map(math.isfinite, branches.turns)) else "",
        dof=dof,
        branches=macro(robot.name, "BRANCHES"),
        params_type=params,
        given=branches.given,
        joints=tuple(_joint(index, each, real) for index, each in enumerate(turnings(robot, branches, real))),
        last=robot.dof - 1,
        rounding=real.literal(ROUNDING[real]),
        largest=real.literal(LARGEST[real]),
        zero=real.literal(Fraction(0)),
        one=real.literal(Fraction(1)),
        lines=_words(robot, branches, real),
    )


def _joint(index: int, each: Turning, real: Real) -> NearestJoint:
    turn = Fraction(each.turn)
    return NearestJoint(
        index=index,
        turns=turn > 0,
        turn=real.literal(turn),
        per_turn=real.literal(1 / turn if turn else turn),
        lowest=real.literal(Fraction(each.lowest)),
        highest=real.literal(Fraction(each.highest)),
        farthest=real.literal(turn * MOST_TURNS[real] if turn else Fraction(FARTHEST_STROKE)),
    )


def _words(robot: Robot, branches: Branches, real: Real) -> tuple[str, ...]:
    """What the header says of the result, as lines of a comment."""
    shifting = [f"q0[{index}]" for index, turn in enumerate(branches.turns) if math.isinf(turn)]
    turning = len(shifting) < robot.dof
    units = f"rad and {robot.units.length} count alike" if shifting and turning else "no joint is weighed"
    far = [f"{MOST_TURNS[real]} whole turns"] * turning
    far += [f"1e15 {robot.units.length} ({' and '.join(shifting)})"] * bool(shifting)
    choice = (
        f"The nearest is the one with the least sum of squared differences to q0, joint by joint ({units}). Joints "
        "that turn first take the whole turns that bring them nearest to q0, as far as their limits allow. Of two "
        "solutions equally near, the one in the first branch is taken. A joint at its limit may be found outside it by "
        "rounding, as above."
    )
    answer = (
        "Returns 1 if there is a solution, else 0, and q is then NaN in every entry: no branch is valid, or an entry "
        f"of q0 is NaN, infinite, or further from zero than {' or '.join(far)}. q0 may be outside the limits; it may "
        "be the same array as q. There is one loop, with a round for each branch."
    )
    return tuple(line for text in (choice, answer) for line in textwrap.wrap(text, LINE, break_on_hyphens=False))
