"""The parts of a kernel, with a title each, so that a reviewer finds the elbow in a hundred statements.

Nothing is asserted here that the program does not say: a title names the joints whose sines and cosines are multiplied
in, and the results that the statements lead to. The order of the statements stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

from kinegen.backends.limits import ARRAY as ACTUATORS
from kinegen.ir.program import Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.model.outputs import REDUNDANCY, Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

ANGLES, PAIRS, LONG = "Angle sums", "Sines and cosines", "Square roots and arc tangents"
FIXED = "Entries that need no computing"

_SIX = ("jacobian", "twist", "bias_acceleration", "acceleration", "hessian")
"""Results whose first axis counts a linear velocity or acceleration and an angular one."""

FEWEST = 4
"""Statements of a part; what is shorter is joined with its neighbours."""

_PARTS = 24
"""Parts of a long program, roughly."""

_PARTS_OF_A_POSE = 2
"""A rotation and a position, which are named; more results than these are all results where all are meant."""

_STEPS = {Operator.SINCOS: PAIRS, Operator.SQRT: LONG, Operator.ATAN2: LONG}

_LISTED = 6
"""Names that a title lists; more are counted."""


@dataclass(frozen=True, slots=True)
class Section:
    """Neighbouring statements of a program.

    `title`: what they are about; plain text on one line. `statements`: the statements.
    """

    title: str
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class _Run:
    """Statements of one part.

    `step`: `ANGLES`, `PAIRS`, `LONG` or empty for all others. `turns`: places of the angles that are applied, by the
    order of the inputs. `leads`: places of the results that are reached. `statements`: the statements.
    """

    step: str
    turns: frozenset[int]
    leads: frozenset[int]
    statements: tuple[Statement, ...]

    def joined(self, other: _Run) -> _Run:
        return _Run(self.step, self.turns | other.turns, self.leads | other.leads, self.statements + other.statements)


@lru_cache(maxsize=8)
def sections(robot: Robot, program: Program) -> tuple[Section, ...]:
    """Split a program into parts with titles, no two neighbours with the same one; all languages have the same.

    `robot`: the robot, for the names of its joints.
    """
    names, labels = tuple(_input_names(robot, program)), tuple(_output_labels(robot, program))
    turns, reached = _turns(program), _reached(program, labels)
    runs: list[_Run] = []
    angles = angle_names(program.statements)
    for statement in program.statements:
        step = _STEPS.get(statement.operator, ANGLES if statement.results[0] in angles else "")
        leads = frozenset().union(*(reached.get(name, frozenset()) for name in statement.results))
        run = _Run(step, turns[statement.results[0]], frozenset() if step else leads, (statement,))
        if runs and runs[-1].step == step and (step or (runs[-1].turns, runs[-1].leads) == (run.turns, run.leads)):
            runs[-1] = runs[-1].joined(run)
        else:
            runs.append(run)
    kinds = tuple(dict.fromkeys(labels))
    found: list[Section] = []
    for run in _joined(runs, max(FEWEST, len(program.statements) // _PARTS)):
        title = _title(run, names, kinds)
        before = found.pop().statements if found and found[-1].title == title else ()
        found.append(Section(title, before + run.statements))
    return tuple(found)


def angle_names(statements: Sequence[Statement]) -> frozenset[str]:
    """Return the temporaries that are angles: whatever leads to a sine and cosine, back to the one before."""
    found: set[str] = set()
    for statement in reversed(statements):
        if statement.operator is Operator.SINCOS or not found.isdisjoint(statement.results):
            found.update(operand.name for operand in statement.operands if isinstance(operand, Temporary))
    halves = (name for each in statements if each.operator is Operator.SINCOS for name in each.results)
    return frozenset(found.difference(halves))


def _joined(runs: Sequence[_Run], fewest: int) -> list[_Run]:
    """Return short runs as one, as long as they do not become long."""
    parts: list[_Run] = []
    for run in runs:
        last = parts[-1] if parts else run
        is_short = min(len(last.statements), len(run.statements)) < fewest and len(last.statements) < 3 * fewest
        if parts and last.step == run.step and is_short:
            parts[-1] = last.joined(run)
        else:
            parts.append(run)
    return parts


def _turns(program: Program) -> dict[str, frozenset[int]]:
    """The inputs under the angle that a statement applies last: of a pair that it multiplies, or as its operands do."""
    found: dict[str, frozenset[int]] = {}
    size: dict[str, int] = {}
    angles = angle_names(program.statements)
    halves: dict[Operand, frozenset[int]] = {}

    def inputs(operand: Operand) -> frozenset[int]:
        match operand:
            case Variable(index):
                return frozenset({index})
            case RuntimeParameter(name):
                return frozenset({-1 - program.parameters.index(name)})
            case Temporary(name):
                return found[name]
            case _:
                return frozenset()

    for place, statement in enumerate(program.statements):
        computed = [each for each in statement.operands if isinstance(each, Temporary)]
        if statement.operator is Operator.SINCOS or statement.name in angles:
            turns = frozenset().union(*map(inputs, statement.operands))
        elif any(operand in halves for operand in computed):
            turns = frozenset().union(*(halves.get(operand, frozenset()) for operand in computed))
        else:
            turns = found[max(computed, key=lambda each: size[each.name]).name] if computed else frozenset()
        for name in statement.results:
            found[name], size[name] = turns, place
            if statement.operator is Operator.SINCOS:
                halves[Temporary(name)] = turns
    return found


def _reached(program: Program, labels: Sequence[str]) -> dict[str, frozenset[int]]:
    """For each temporary the results that depend on it, as places among the different labels."""
    places = {label: place for place, label in enumerate(dict.fromkeys(labels))}
    found: dict[str, frozenset[int]] = {}
    for operand, label in zip(program.outputs, labels, strict=True):
        if isinstance(operand, Temporary):
            found[operand.name] = found.get(operand.name, frozenset()) | {places[label]}
    for statement in reversed(program.statements):
        leads = frozenset().union(*(found.get(name, frozenset()) for name in statement.results))
        for operand in statement.operands:
            if isinstance(operand, Temporary):
                found[operand.name] = found.get(operand.name, frozenset()) | leads
    if program.quantity.kind is Kind.FRAMES:
        # What a frame needs all frames after it need too.
        return {name: frozenset({min(leads)}) if leads else leads for name, leads in found.items()}
    return found


def _title(run: _Run, names: Sequence[str], labels: Sequence[str]) -> str:
    turns = _listed(tuple(dict.fromkeys(names[place] for place in sorted(run.turns, key=lambda p: p % len(names)))))
    if run.step == ANGLES:
        sums = (f"{each.name} of {_listed(_inputs_of(run, each, names))}" for each in run.statements)
        return f"{ANGLES}: {'; '.join(sums)}" if len(run.statements) <= _LISTED else ANGLES
    if run.step:
        return run.step
    everything = len(run.leads) == len(labels) > _PARTS_OF_A_POSE
    leads = "all results" if everything else _listed(tuple(labels[place] for place in sorted(run.leads)))
    return f"{turns}: {leads}" if turns else leads


def _inputs_of(run: _Run, statement: Statement, names: Sequence[str]) -> tuple[str, ...]:
    """Return the inputs in an angle, through the sums before it."""
    known = {each.name: each for each in run.statements}
    found: list[str] = []
    for operand in statement.operands:
        if isinstance(operand, Temporary) and operand.name in known:
            found += _inputs_of(run, known[operand.name], names)
        elif isinstance(operand, Variable):
            found.append(names[operand.index])
        elif isinstance(operand, RuntimeParameter):
            found.append(operand.name)
    return tuple(name for name in names if name in found)


def _listed(words: Sequence[str]) -> str:
    """Return `a`, `a and b`, `a, b and c`."""
    if len(words) > _LISTED:
        return f"{words[0]}, {words[1]} and {len(words) - 2} more"
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else "".join(words)


def _input_names(robot: Robot, program: Program) -> Iterator[str]:
    """The name of each number of the inputs, then of each runtime parameter in reverse, so that -1 is the first."""
    for array in program.signature.inputs:
        if array.name == ACTUATORS:
            yield from (reading.name for reading in robot.actuators.readings)
        elif array.name == REDUNDANCY.name:
            yield from robot.given
        elif array.shape == (robot.dof,):
            yield from (variable.name for variable in robot.variables)
        else:
            yield from (array.name,) * array.size
    yield from reversed(program.parameters)


def _output_labels(robot: Robot, program: Program) -> Iterator[str]:
    """Yield what each number of the results belongs to."""
    for array in program.signature.results:
        for place in range(array.size):
            yield _label(robot, program, array, place)


def _label(robot: Robot, program: Program, array: Array, place: int) -> str:
    if program.quantity.kind is Kind.FRAMES:
        return f"frame {program.frames[place * array.blocks // array.size]}"
    if array.is_pose:
        return "position" if place % 4 == 3 else "rotation"
    if array.name == "solutions":
        return robot.variables[place % robot.dof].name
    rows = array.shape[1:] if array.per_frame else array.shape
    if rows[:1] == (6,) and array.name in _SIX:
        within = place % (array.size // array.blocks)
        return "linear part" if within * 6 // (array.size // array.blocks) < 3 else "angular part"
    return "position" if array.is_point else array.name
