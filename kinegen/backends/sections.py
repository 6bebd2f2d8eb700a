"""The sections of a kernel, with a title each, so that a reviewer finds the position in a hundred statements.

A title names the results that its statements are needed for first, and the joints that they depend on where these are
not all. Sections are long rather than many: what one joint contributes to one result is scattered, since results share
what they have in common. The order of the statements stays as it is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache, reduce
from operator import itemgetter, or_

from kinegen.backends.limits import ARRAY as ACTUATORS
from kinegen.errors import listed
from kinegen.ir.program import Operator, Program, Statement, Temporary, Variable
from kinegen.model.outputs import REDUNDANCY, Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

PAIRS = "Sines and cosines"
CONSTANT = "Entries that need no computing"

FEWEST = 4
"""Numbers that a section computes at least."""

_SIX = ("jacobian", "twist", "bias_acceleration", "acceleration", "hessian")
"""Results whose first axis counts a linear velocity or acceleration and an angular one."""

_MOST_NAMES = 2
"""Joints, frames, tips or sums that a title lists; of more joints, frames or tips it names the first and the last."""


@dataclass(frozen=True, slots=True)
class Section:
    """Neighbouring statements of a program.

    `title`: what they compute; plain text on one line. `statements`: the statements.
    """

    title: str
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class _Run:
    """Neighbouring statements with what they have in common, as sets of bits.

    `joints`: the joints that they depend on. `labels`: the results that need them first. `size`: the numbers that they
    compute.
    """

    statements: tuple[Statement, ...]
    joints: int
    labels: int
    size: int

    def joined(self, other: _Run) -> _Run:
        """Return this run and the one after it as one."""
        return _Run(
            self.statements + other.statements,
            self.joints | other.joints,
            self.labels | other.labels,
            self.size + other.size,
        )


@lru_cache(maxsize=8)
def sections(robot: Robot, program: Program) -> tuple[Section, ...]:
    """Split a program into sections, no two of them with the same title; all languages have the same.

    Returns:
        The sections, which hold all statements in their order; none if there would be one.
    """
    angles, titles = _angles(program), _Titles(robot, program)
    # A few angles are no section of their own.
    first = angles if sum(len(each.results) for each in angles) >= FEWEST else ()
    runs = _parted(_runs(program.statements[len(first) :], titles), titles)
    found = [Section(_angle_title(first), first)] if first else []
    found += [Section(titles.title(run), run.statements) for run in runs]
    is_long = len(found) > 1 and all(run.size >= FEWEST for run in runs)
    return tuple(found) if is_long else ()


def angle_names(statements: Sequence[Statement]) -> frozenset[str]:
    """Return the temporaries that are angles: whatever leads to a sine and cosine, back to the one before."""
    found: set[str] = set()
    for statement in reversed(statements):
        if statement.operator is Operator.SINCOS or not found.isdisjoint(statement.results):
            found.update(operand.name for operand in statement.operands if isinstance(operand, Temporary))
    halves = (name for each in statements if each.operator is Operator.SINCOS for name in each.results)
    return frozenset(found.difference(halves))


def _angles(program: Program) -> tuple[Statement, ...]:
    """Return the statements at the beginning that take sines and cosines, or lead to the angles of these."""
    angles = angle_names(program.statements)
    for place, each in enumerate(program.statements):
        if each.operator is not Operator.SINCOS and each.results[0] not in angles:
            return program.statements[:place]
    return program.statements


def _angle_title(angles: Sequence[Statement]) -> str:
    others = [each for each in angles if each.operator is not Operator.SINCOS]
    if not others:
        return PAIRS
    if len(others) > _MOST_NAMES or not all(each.operator in (Operator.ADD, Operator.SUB) for each in others):
        return f"Angles, {PAIRS.lower()}"
    return f"{_range('Angle sum', [each.name for each in others])}, {PAIRS.lower()}"


class _Titles:
    """Words for the results and the joints of one program, and how much a title of some statements leaves open."""

    def __init__(self, robot: Robot, program: Program) -> None:
        self.program = program
        of_each = tuple(_output_labels(robot, program))
        self.labels = tuple(dict.fromkeys(of_each))
        self.needed = _needed_first(program, [self.labels.index(label) for label in of_each])
        self.depends = _dependences(program, tuple(_joint_places(robot, program)))
        self.joints = reduce(or_, self.depends.values(), 0)

    def openness(self, run: _Run) -> float:
        """Return how little a title says of these statements: joints and results that each of them may have."""
        joints = _span(run.joints) / max(1, _span(self.joints))
        return run.size * ((joints if joints == 1 else joints / 2) + run.labels.bit_count() / len(self.labels))

    def title(self, run: _Run) -> str:
        """Return the results, behind the joints where these are not all."""
        named = [label for place, label in enumerate(self.labels) if run.labels >> place & 1]
        labels = "all results" if len(named) == len(self.labels) > _MOST_NAMES else _result_words(named)
        last, span = run.joints.bit_length(), _span(run.joints)
        if 0 < span < _span(self.joints) and self.program.quantity.kind is not Kind.FRAMES:
            reads = any(each.name == ACTUATORS for each in self.program.signature.inputs)
            numbers = [str(number) for number in range(last - span + 1, last + 1)]
            return f"{_range('Reading' if reads else 'Joint', numbers)}: {labels}"
        # The name of an array keeps its letters.
        is_name = labels.split(",")[0].split(" and ")[0] in {each.name for each in self.program.signature.results}
        return labels if is_name else labels[0].upper() + labels[1:]


def _runs(statements: Sequence[Statement], titles: _Titles) -> list[_Run]:
    runs = []
    for each in statements:
        labels = reduce(or_, (1 << titles.needed[name] for name in each.results if name in titles.needed), 0)
        runs.append(_Run((each,), titles.depends[each.results[0]], labels, len(each.results)))
    return runs


def _parted(runs: list[_Run], titles: _Titles) -> list[_Run]:
    """Join neighbours, first those of which one title says most, until the sections are few, long and distinct."""
    most = max(1, round(math.sqrt(sum(run.size for run in runs)) / 2))
    # Passes over the whole program leave a few runs, of which each pair is weighed.
    fewest = 1
    while len(runs) > 4 * most:
        fewest *= 2
        runs = _without_short(runs, fewest, titles)
    while len(runs) > 1:
        costs = [_cost(*pair, titles) for pair in itertools.pairwise(runs)]
        short = [k for k in range(len(costs)) if min(runs[k].size, runs[k + 1].size) < FEWEST]
        places: Sequence[int] = short or (range(len(costs)) if len(runs) > most else _between_equal(runs, titles))
        if not places:
            break
        place = min(places, key=costs.__getitem__)
        runs[place : place + 2] = [runs[place].joined(runs[place + 1])]
    return runs


def _without_short(runs: Sequence[_Run], fewest: int, titles: _Titles) -> list[_Run]:
    """Join each run that is short with the neighbour that it resembles."""
    found: list[_Run] = []
    for place, run in enumerate(runs):
        after = runs[place + 1] if place + 1 < len(runs) else None
        is_short = found and min(found[-1].size, run.size) < fewest
        if is_short and (after is None or _cost(found[-1], run, titles) <= _cost(run, after, titles)):
            found[-1] = found[-1].joined(run)
        else:
            found.append(run)
    return found


def _cost(one: _Run, other: _Run, titles: _Titles) -> float:
    """Return how much less a title says of two runs together than titles of both."""
    return titles.openness(one.joined(other)) - titles.openness(one) - titles.openness(other)


def _between_equal(runs: Sequence[_Run], titles: _Titles) -> list[int]:
    """Return the places of runs that lie between two with one title, the first of these among them."""
    names = [titles.title(run) for run in runs]
    spans = (range(names.index(name), place) for place, name in enumerate(names))
    return sorted({place for span in spans for place in span})


def _span(bits: int) -> int:
    """Count the places from the first one to the last."""
    return (bits // (bits & -bits)).bit_length() if bits else 0


def _dependences(program: Program, joints: Sequence[int]) -> dict[str, int]:
    """Return the joints that each temporary depends on, from the bits of each number of the inputs."""
    found: dict[str, int] = {}
    for statement in program.statements:
        bits = 0
        for operand in statement.operands:
            match operand:
                case Variable(index):
                    bits |= joints[index]
                case Temporary(name):
                    bits |= found[name]
        found.update(dict.fromkeys(statement.results, bits))
    return found


def _needed_first(program: Program, labels: Sequence[int]) -> dict[str, int]:
    """Return for each temporary, of the labels of results that depend on it, the one that takes the fewest statements.

    The others build on that: a frame on those before it, the solutions of a wrist on those of the arm.
    """
    leads: dict[str, int] = {}
    for operand, label in zip(program.outputs, labels, strict=True):
        if isinstance(operand, Temporary):
            leads[operand.name] = leads.get(operand.name, 0) | 1 << label
    for statement in reversed(program.statements):
        bits = reduce(or_, (leads.get(name, 0) for name in statement.results))
        for operand in statement.operands:
            if isinstance(operand, Temporary):
                leads[operand.name] = leads.get(operand.name, 0) | bits
    places = sorted(set(labels), key=lambda label: sum(bits >> label & 1 for bits in leads.values()))
    return {name: next(place for place in places if bits >> place & 1) for name, bits in leads.items()}


def _joint_places(robot: Robot, program: Program) -> Iterator[int]:
    """Yield the bit of the joint, or of the reading, that each number of the inputs belongs to; 0 for others."""
    for array in program.signature.inputs:
        is_joint = array.name == ACTUATORS or (array.name != REDUNDANCY.name and array.shape == (robot.dof,))
        for place in range(array.size):
            yield 1 << place if is_joint else 0


def _output_labels(robot: Robot, program: Program) -> Iterator[tuple[str, str]]:
    """Yield what each number of the results belongs to: a noun and a name of which there is an order, or words."""
    for array in program.signature.results:
        for place in range(array.size):
            yield _label(robot, program, array, place)


def _label(robot: Robot, program: Program, array: Array, place: int) -> tuple[str, str]:
    block, within = divmod(place, array.size // array.blocks)
    if array.per_frame and array.blocks > 1:
        return "frame" if program.quantity.kind is Kind.FRAMES else "tip", program.frames[block]
    if array.is_pose:
        return "", "position" if place % 4 == 3 else "rotation"
    if array.name == "solutions":
        return "solutions of joint", str(place % robot.dof + 1)
    rows = array.shape[1:] if array.in_blocks else array.shape
    if rows[:1] == (6,) and array.name in _SIX:
        return "", "linear part" if within * 6 // (array.size // array.blocks) < 3 else "angular part"
    return "", "position" if array.is_point else array.name


def _result_words(labels: Sequence[tuple[str, str]]) -> str:
    """Return `rotation and position`, `frames waist to elbow`, `solutions of joints 1 and 2, valid`."""
    words: list[str] = []
    for noun, group in itertools.groupby(labels, key=itemgetter(0)):
        names = [name for _, name in group]
        words += [_range(noun, names)] if noun else names
    has_range = any(noun for noun, _ in labels)
    return ", ".join(words) if has_range else listed(words)


def _range(noun: str, names: Sequence[str]) -> str:
    """Return `joint 1`, `joints 2 and 3`, `joints 2 to 4`."""
    between = "and" if len(names) == _MOST_NAMES else "to"
    return f"{noun} {names[0]}" if len(names) == 1 else f"{noun}s {names[0]} {between} {names[-1]}"
