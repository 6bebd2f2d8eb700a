"""The C function that chooses the solution nearest to a joint vector, as templates print it."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import fields
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import wrapped_prototype
from kinegen.backends.inverse import (
    FARTHEST_STROKE,
    MOST_TURNS,
    NEAREST_FUNCTION,
    End,
    Sharing,
    branches_of,
    end_of,
    free_end_words,
    in_line_words,
    inverse_of,
    sharings,
    turnings,
)
from kinegen.backends.limits import LARGEST
from kinegen.backends.routines import LINE
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.branches import Branches
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import function, macro, params_type, prefix

ROUNDING = {ScalarType.DOUBLE: Fraction(3 * 2**51), ScalarType.FLOAT: Fraction(3 * 2**22)}
"""Adding and subtracting this rounds to a whole number."""


Write = Callable[..., str]
"""Writes a number as a language does, from its value in each number type that a file is for."""


@dataclass(frozen=True, slots=True)
class NearestJoint:
    """Holds one joint: its index, whether it turns, and its numbers as text."""

    index: int
    turns: bool
    turn: str
    per_turn: str
    lowest: str
    highest: str
    farthest: str

    @property
    def number(self) -> int:
        """The joint, counted from 1."""
        return self.index + 1


@dataclass(frozen=True, slots=True)
class NearestPair:
    """Holds two joints that can come in line, and the one between, as indices, with numbers as text.

    The limits are the lower and the upper one of the first joint, of the last one as it counts, and of their sum.
    """

    first: int
    middle: int
    last: int
    sign: str
    at: str
    near: str
    middle_turn: str
    per_middle_turn: str
    turn: str
    per_turn: str
    limits: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NearestPlace:
    """Holds a value of joint `middle` that leaves the last one free."""

    middle: int
    at: str
    near: str
    turn: str
    per_turn: str


@dataclass(frozen=True, slots=True)
class NearestEnd:
    """Holds the first or last joint, where a pose may leave it free, with the numbers of `backends/inverse.py`."""

    joint: int
    is_first: bool
    direction: tuple[str, ...]
    point: tuple[str, ...]
    rate: str
    rest: str
    low: str
    high: str
    lowest: str
    highest: str
    met: tuple[str, ...]
    near: str
    places: tuple[NearestPlace, ...]

    @property
    def number(self) -> int:
        """The joint, counted from 1."""
        return self.joint + 1


@dataclass(frozen=True, slots=True)
class Choice:
    """Holds the numbers of the choice, as any language writes them.

    Attributes:
        plain: Name of the function that gives all solutions, without a prefix.
        given: How many numbers are given besides the target.
        sharings: The joints that can come in line.
        end: The first or last joint, where a pose may leave it free; else None.
        rounding: Added and subtracted, it rounds to a whole number.
    """

    plain: str
    target: str
    given: int
    joints: tuple[NearestJoint, ...]
    sharings: tuple[NearestPair, ...]
    end: NearestEnd | None
    rounding: str
    largest: str


@dataclass(frozen=True, slots=True)
class Nearest(Choice):
    """Adds what the templates `c/_nearest.*.jinja` are given besides; `dof` and `branches` are macros.

    Attributes:
        stem: How names of functions begin that only this one calls.
        turned: C name of the function that adds whole turns; empty where no joint turns.
        params_type: Type of the runtime parameters; empty where there are none.
    """

    name: str
    prototype: str
    declaration: tuple[str, ...]
    inverse: str
    stem: str
    turned: str
    dof: str
    branches: str
    params_type: str
    last: int
    zero: str
    one: str
    half: str
    lines: tuple[str, ...]


def choice_of(kernels: RobotPrograms, reals: Sequence[ScalarType], write: Write) -> Choice | None:
    """Writes the numbers of the choice; None where there is no closed-form inverse.

    The number types are those of a file: all have the same joints in line and the same free end. `write` takes the
    value of a number in each of them.
    """
    found = inverse_of(kernels)
    if found is None:
        return None
    (inverse, branches), robot = found, kernels.robot
    joints = _joints(robot, branches, reals, write)
    pairs = zip(*(sharings(robot, branches, real) for real in reals), strict=True)
    return Choice(
        plain=inverse.quantity.function,
        target=inverse.signature.inputs[0].name,
        given=branches.given,
        joints=joints,
        sharings=tuple(_pair(each, joints, write) for each in pairs),
        end=_end([end_of(robot, branches, real) for real in reals], joints, write),
        rounding=write(*(ROUNDING[real] for real in reals)),
        largest=write(*(LARGEST[real] for real in reals)),
    )


def nearest_of(kernels: RobotPrograms, real: ScalarType, write: Write | None = None) -> Nearest | None:
    """Returns what the templates lay out, with numbers as C writes them; None where there is no closed-form inverse."""
    write = write or real.literal
    choice, robot, branches = choice_of(kernels, (real,), write), kernels.robot, branches_of(kernels)
    if choice is None or branches is None:
        return None
    stem, dof = prefix(robot.name, real), macro(robot.name, "DOF")
    name, params = (
        function(robot.name, NEAREST_FUNCTION, real),
        params_type(robot.name, real) if robot.runtime_parameters else "",
    )
    # The order of other languages: what the inverse takes, then what to be near to.
    arguments = [
        f"const {real} {choice.target}[16]",
        *[f"const {real} redundancy[{choice.given}]"] * bool(choice.given),
        f"const {real} q0[{dof}]",
        *[f"const {params} *params"] * bool(params),
    ]
    prototype = f"int {name}({', '.join([*arguments, f'{real} q[{dof}]'])})"
    return Nearest(
        **{each.name: getattr(choice, each.name) for each in fields(choice)},
        name=name,
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        inverse=function(robot.name, choice.plain, real),
        stem=stem,
        turned=f"{stem}_turned" if any(map(math.isfinite, branches.turns)) else "",
        dof=dof,
        branches=macro(robot.name, "BRANCHES"),
        params_type=params,
        last=robot.dof - 1,
        zero=write(Fraction(0)),
        one=write(Fraction(1)),
        half=write(Fraction(1, 2)),
        lines=_words(robot, branches, real),
    )


def _joints(robot: Robot, branches: Branches, reals: Sequence[ScalarType], write: Write) -> tuple[NearestJoint, ...]:
    found = []
    for index, each in enumerate(zip(*(turnings(robot, branches, real) for real in reals), strict=True)):
        turns = [Fraction(own.turn) for own in each]
        far = [turn * MOST_TURNS[real] or Fraction(FARTHEST_STROKE) for turn, real in zip(turns, reals, strict=True)]
        found.append(
            NearestJoint(
                index=index,
                turns=turns[0] > 0,
                turn=write(*turns),
                per_turn=write(*(1 / turn if turn else turn for turn in turns)),
                lowest=write(*(Fraction(own.lowest) for own in each)),
                highest=write(*(Fraction(own.highest) for own in each)),
                farthest=write(*far),
            )
        )
    return tuple(found)


def _texts(write: Write, *numbers: Sequence[float]) -> tuple[str, ...]:
    """Writes several numbers, given as a row for each number type."""
    return tuple(write(*map(Fraction, each)) for each in zip(*numbers, strict=True))


def _pair(pair: Sequence[Sharing], joints: Sequence[NearestJoint], write: Write) -> NearestPair:
    one = pair[0]
    at, near = _texts(write, *((each.at, each.near) for each in pair))
    ends = ([end for ends in zip(each.low, each.high, strict=True) for end in ends] for each in pair)
    return NearestPair(
        first=one.first,
        middle=one.middle,
        last=one.last,
        sign=write(*(Fraction(-1 if each.are_opposed else 1) for each in pair)),
        at=at,
        near=near,
        middle_turn=joints[one.middle].turn,
        per_middle_turn=joints[one.middle].per_turn,
        turn=joints[one.first].turn,
        per_turn=joints[one.first].per_turn,
        limits=_texts(write, *ends),
    )


def _end(found: Sequence[End | None], joints: Sequence[NearestJoint], write: Write) -> NearestEnd | None:
    ends = [each for each in found if each is not None]
    if not ends:
        return None
    one, own = ends[0], joints[ends[0].joint]
    numbers = ((each.rate, each.rest, *each.limits, each.near) for each in ends)
    rate, rest, low, high, near = _texts(write, *numbers)
    # Types have the same places, with numbers of their own.
    places = []
    for each in zip(*(end.places for end in ends), strict=True):
        at, within = _texts(write, *(place[1:] for place in each))
        before = joints[each[0][0]]
        places.append(NearestPlace(before.index, at, within, before.turn, before.per_turn))
    return NearestEnd(
        joint=one.joint,
        is_first=one.is_first,
        direction=_texts(write, *(each.direction for each in ends)),
        point=_texts(write, *(each.point for each in ends)),
        rate=rate,
        rest=rest,
        low=low,
        high=high,
        lowest=own.lowest,
        highest=own.highest,
        met=_texts(write, *(each.met for each in ends)),
        near=near,
        places=tuple(places),
    )


def _words(robot: Robot, branches: Branches, real: ScalarType) -> tuple[str, ...]:
    # Lengths and angles are added without a weight, and the header has to say so.
    shifting = [f"q0[{index}]" for index, turn in enumerate(branches.turns) if math.isinf(turn)]
    turning = len(shifting) < robot.dof
    units = f"rad and {robot.units.length} count alike" if shifting and turning else "joints are not weighted"
    far = [f"{MOST_TURNS[real]} whole turns"] * turning
    far += [f"1e15 {robot.units.length} ({' and '.join(shifting)})"] * bool(shifting)
    choice = (
        f"The nearest is the one with the least sum of squared differences to q0, joint by joint ({units}). Revolute "
        "joints are first moved by whole turns as near to q0 as their limits allow."
        f"{in_line_words(branches)}{free_end_words(branches)} Of two solutions equally near, the one in the first "
        "branch is selected. Rounding may move a joint at its limit outside it, as above."
    )
    rounds = "There is one loop, with a round for each branch."
    if branches.free_end:
        rounds = "The number of rounds of its loops is fixed; where a joint is free, the inverse is computed twice."
    answer = (
        "Returns 1 if there is a solution, else 0, and q is then NaN in every entry: no branch is valid, or an entry "
        f"of q0 is NaN, infinite, or further from zero than {' or '.join(far)}. q0 may be outside the limits; it may "
        f"be the same array as q. {rounds}"
    )
    return tuple(line for text in (choice, answer) for line in textwrap.wrap(text, LINE, break_on_hyphens=False))
