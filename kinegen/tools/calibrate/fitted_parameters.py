"""Selects what is varied: entries, parameters of the file, base, tool, and second twists of nearly parallel rows.

Between parallel axes a small error of direction moves the common normal by metres. Hayati and Mirmirani (1985) describe
such a link by two twists, alpha and beta, and need no d. A standard row whose twist is exactly 0 or 180 degrees becomes
a row of their convention, and its d moves to the next row, where it means the same. Any other row becomes the
elementary sequence of its own convention with a turn by beta in it.
"""

from __future__ import annotations

import math
from dataclasses import replace

from kinegen.errors import KinegenError, did_you_mean, quote
from kinegen.model.expression_parser import ZERO, Expression, Name, add, evaluate, linear, names, negate, substitute
from kinegen.model.expression_values import FLOAT64, Dimension, join
from kinegen.model.joint_bounds import parameter_values
from kinegen.model.robot import (
    ANGLE_ENTRIES,
    ROW_ENTRIES,
    TOOL,
    WRIST,
    Convention,
    JointType,
    Parameter,
    Robot,
    Row,
    Step,
    StepKind,
)
from kinegen.model.row_transforms import ROW_TRANSFORMS
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import check_name
from kinegen.tools.calibrate.options import BASE_WORD, TABLE, TOOL_WORD

MOUNT_NUMBERS = ("x", "y", "z", "rx", "ry", "rz")
"""The numbers of base and tool: a shift, and a rotation vector, of the correction to what the file says."""

BASE_NAMES = tuple(f"base_{number}" for number in MOUNT_NUMBERS)
TOOL_NAMES = tuple(f"tool_{number}" for number in MOUNT_NUMBERS)


@dataclass(frozen=True, slots=True)
class Choice:
    """The numbers that are varied, those of base and tool by name.

    Attributes:
        parameters: Parameters of the file, in its order.
        entries: Entries of the table, as row and key, in the order of the table; beta only where a row has one.
        twists: Rows whose second twist is wanted too, if they are between nearly parallel axes.
    """

    parameters: tuple[str, ...]
    entries: tuple[tuple[str, str], ...]
    twists: tuple[str, ...]
    base: tuple[str, ...]
    tool: tuple[str, ...]


def choose(robot: Robot, words: tuple[str, ...], frame: str = "") -> Choice:
    """Find out what the words of `--fit` mean, in the order of the file; refuse words and frames that name nothing."""
    frame = measured_frame(robot, frame)
    own = tuple(parameter.name for parameter in robot.parameters)
    rows = [row for row in robot.rows if moves(robot, row, frame)]
    every = [(row, key) for row in rows for key in ROW_ENTRIES[row.convention]]
    entries = {f"{key}_{row.name}": (row.name, key) for row, key in every}
    known = (*TABLE, BASE_WORD, TOOL_WORD, *own, *entries, *BASE_NAMES, *TOOL_NAMES)
    for word in words:
        if word not in known:
            raise KinegenError(f"--fit {quote(word)} names nothing {_expected(word, known)}")
    wanted = frozenset(words)
    # A second twist goes with alpha, as the first one.
    kinds = wanted | ({"beta"} if "alpha" in wanted else set())
    picked = tuple(
        place for name, place in entries.items() if (name in wanted and name not in own) or place[1] in kinds
    )
    choice = Choice(
        parameters=tuple(name for name in own if name in wanted),
        entries=picked,
        twists=tuple(row for row, key in picked if key == "alpha"),
        base=tuple(name for name in BASE_NAMES if name in wanted or BASE_WORD in wanted),
        tool=tuple(name for name in TOOL_NAMES if name in wanted or TOOL_WORD in wanted),
    )
    _check(robot, choice, words, frame)
    return choice


def measured_frame(robot: Robot, frame: str) -> str:
    """Return the measured frame, empty for the tool; refuse an unknown one, or none where there are several tips."""
    if frame == TOOL and not robot.is_tree:
        return ""
    if frame and frame not in robot.frame_names:
        raise KinegenError(f"there is no frame '{frame}' (expected {', '.join(robot.frame_names)})")
    if not frame and robot.is_tree:
        raise KinegenError(f"{robot.name} has {len(robot.tips)} tips; name one with --frame ({', '.join(robot.tips)})")
    return frame


def moves(robot: Robot, row: Row, frame: str) -> bool:
    """Tell whether a row is between the base and the measured frame."""
    links, parents = robot.frame_links, {each.name: each.parent for each in robot.rows}
    last = robot.rows[-1].name if robot.rows else ""
    link = links.get(frame, frame)
    link = link if link in parents else last if link in ("", TOOL, WRIST) else ""
    while link in parents:
        if link == row.name:
            return True
        link = parents[link]
    return False


def _check(robot: Robot, choice: Choice, words: tuple[str, ...], frame: str) -> None:
    if not (choice.parameters or choice.entries or choice.base or choice.tool):
        instead = "name parameters of the file"
        if all(row.convention is Convention.ETS for row in robot.rows):
            instead += ", or make a table first (kinegen convert FILE -o OUT.yaml --convention standard)"
        raise KinegenError(f"--fit {','.join(words)} varies nothing: the table has no such entries; {instead}")
    # Parameters inside of a mount say what it is made of, and vary themselves.
    for name, steps, varied in ((BASE_WORD, robot.base, choice.base), (TOOL_WORD, robot.tool, choice.tool)):
        inside = list(dict.fromkeys(name for step in steps for name in names(step.value)))
        if varied and inside:
            raise KinegenError(
                f"{name} is made of parameters here; name them instead of {name} (--fit {','.join(inside)})"
            )
    if choice.tool and frame:
        raise KinegenError(f"frame '{frame}' was measured, which the tool does not move; leave tool out of --fit")


def _expected(word: str, known: tuple[str, ...]) -> str:
    hint = did_you_mean(word, known)
    return f"(expected {', '.join(TABLE)}, base, tool, an entry such as theta_elbow, or a parameter of the file{hint})"


NEARLY = math.radians(5)
"""Axes that differ by less count as nearly parallel."""


def sequence_with_beta(convention: Convention) -> tuple[tuple[StepKind, str], ...]:
    """Return the transforms of a row of a table, with a second twist at the link between the two axes."""
    transforms = ROW_TRANSFORMS[convention]
    # A modified row begins with the link before its axis, a standard one ends with the link behind it.
    at = [entry for _, entry in transforms].index("theta") or len(transforms)
    return (*transforms[:at], (StepKind.RY, "beta"), *transforms[at:])


@dataclass(frozen=True, slots=True)
class Parallel:
    """A row that got a second twist, because the axes of two neighbouring joints are nearly parallel.

    Attributes:
        angle: The angle between these axes in the file, in radians, up to 90 degrees.
        hayati: Whether it is a row of the Hayati convention now; otherwise an elementary sequence.
        heir: The row that takes over its d, if it is a Hayati row; empty if its d was zero.
        sign: The factor of d there, 1 or -1.
    """

    row: str
    neighbours: tuple[str, str]
    angle: float
    hayati: bool
    heir: str = ""
    sign: int = 1


@dataclass(frozen=True, slots=True)
class Prepared:
    """A robot with second twists in the rows `parallels`, equal in all poses of its tips, and what is varied of it."""

    robot: Robot
    parallels: tuple[Parallel, ...]
    names: tuple[str, ...]


def prepare(robot: Robot, choice: Choice) -> Prepared:
    """Give second twists to the rows whose alpha is varied and whose axes are nearly parallel."""
    own = {parameter.name: parameter.value for parameter in robot.parameters}
    floats = parameter_values(robot)
    rows, parallels = {row.name: row for row in robot.rows}, list[Parallel]()
    for name in (row.name for row in robot.rows):
        neighbours = _neighbours(robot, rows[name])
        if name not in choice.twists or neighbours is None or rows[name].convention is Convention.HAYATI:
            continue
        # A common normal between axes that are far from parallel is defined well.
        alpha = evaluate(rows[name].alpha or ZERO, floats, FLOAT64)
        angle = abs(math.remainder(alpha, math.pi))
        if angle > NEARLY:
            continue
        held = any(frame.parent == name for frame in robot.frames)
        found = _as_hayati(rows, name, neighbours, alpha, floats, held=held)
        parallels.append(found or Parallel(name, neighbours, angle, hayati=False))
    # Sequences come after all Hayati rows, which may hand on their d.
    left = replace(robot, rows=tuple(rows[row.name] for row in robot.rows))
    sequences = {parallel.row for parallel in parallels if not parallel.hayati}
    for name in (row.name for row in robot.rows if row.name in sequences):
        varied = frozenset((*(key for row, key in choice.entries if row == name), "beta"))
        left = _as_sequence(left, name, own, varied)
    return Prepared(left, tuple(parallels), _parameter_names(choice, parallels))


def _neighbours(robot: Robot, row: Row) -> tuple[str, str] | None:
    """Return the two revolute joints whose axes the twist of a row is between, if there are two."""
    by_name = {each.name: each for each in robot.rows}
    first: Row | None = row
    second = by_name.get(row.parent)
    if row.convention in (Convention.MODIFIED, Convention.MODIFIED_PREV_D):
        first, second = second, row
    else:
        children = [each for each in robot.rows if each.parent == row.name]
        second = children[0] if len(children) == 1 else None
    if first is None or second is None or {first.type, second.type} != {JointType.REVOLUTE}:
        return None
    return first.name, second.name


def _as_hayati(
    rows: dict[str, Row],
    name: str,
    neighbours: tuple[str, str],
    alpha: float,
    floats: dict[str, float],
    *,
    held: bool,
) -> Parallel | None:
    """Turn a standard row into a Hayati row; None where that is not exact, or would move frames that the row holds."""
    row, heir = rows[name], rows[neighbours[1]]
    angle = abs(math.remainder(alpha, math.pi))
    flat = angle < 1e-15
    if row.convention is not Convention.STANDARD or row.d is None:
        return None
    free = evaluate(row.d, floats, FLOAT64) == 0.0
    # d of the row can pass along parallel axes, to a row that has a d and begins with its own axis.
    passes = flat and not held and heir.convention is Convention.STANDARD and heir.d is not None
    if not (free or passes):
        return None
    sign = 1 if math.cos(alpha) > 0 else -1
    rows[name] = replace(row, convention=Convention.HAYATI, d=None, beta=ZERO)
    if free or heir.d is None:
        return Parallel(name, neighbours, angle, hayati=True)
    rows[heir.name] = replace(heir, d=add(heir.d, row.d if sign > 0 else negate(row.d)))
    return Parallel(name, neighbours, angle, hayati=True, heir=heir.name, sign=sign)


def _as_sequence(robot: Robot, name: str, own: dict[str, Expression], varied: frozenset[str]) -> Robot:
    """Turn a row into an elementary sequence with a second twist; its varied numbers become parameters."""
    joints = frozenset(variable.name for variable in robot.variables)
    (row,) = (each for each in robot.rows if each.name == name)
    added, steps = list[Parameter](), list[Step]()
    for kind, key in sequence_with_beta(row.convention):
        entry: Expression = ZERO if key == "beta" else getattr(row, key)
        if key in varied:
            factors, offset = linear(entry, joints)
            called = f"{key}_{name}"
            check_name("parameter", called)
            dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
            added.append(Parameter(called, substitute(offset, own), dimension, runtime=False, line=row.line))
            entry = join(factors, Name(called))
        steps.append(Step(kind, entry))
    new = replace(row, convention=Convention.ETS, alpha=None, a=None, d=None, theta=None, beta=None, steps=tuple(steps))
    rows = tuple(new if each is row else each for each in robot.rows)
    return replace(robot, rows=rows, parameters=(*robot.parameters, *added))


def _parameter_names(choice: Choice, parallels: list[Parallel]) -> tuple[str, ...]:
    """Return the varied names of the prepared robot; a Hayati row has no d."""
    lost = {(parallel.row, "d") for parallel in parallels if parallel.hayati}
    entries = [f"{key}_{row}" for row, key in choice.entries if (row, key) not in lost]
    return (*choice.parameters, *entries, *(f"beta_{parallel.row}" for parallel in parallels))
