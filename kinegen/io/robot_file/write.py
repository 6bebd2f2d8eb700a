"""`Robot` -> the text of a robot file, which reads back as the same robot.

In: any robot, from a file of any format or from a conversion. Out: YAML with exact values, in the units of the robot
where that is possible: an angle that is a plain number of radians cannot be written in degrees, so such a file is in
radians. What is written is read again before it is returned.
"""

from __future__ import annotations

import json
from dataclasses import replace

import mpmath

from kinegen.errors import KinegenError, RobotFileError, shown
from kinegen.io.load import loads
from kinegen.io.robot_file.entry_text import Cells, actuator_lines, aligned, flow, in_degrees, quoted, spell
from kinegen.model.expression_parser import ZERO, Expression, Name, substitute
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import (
    ANGLE_ENTRIES,
    BASE,
    ROOT,
    ROW_ENTRIES,
    Convention,
    Frame,
    JointType,
    Parameter,
    Robot,
    Row,
    Step,
    Units,
    root_name,
)
from kinegen.model.variants import digest, used_names
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference import DIGITS, frames_mp

_ORDER = ("Tx", "Ty", "Tz", "Rz", "Ry", "Rx")
"""The steps of `xyz` and `rpy`, in the order in which they apply."""

_RADIANS = "rad"


def write(robot: Robot) -> str:
    """Write a robot file.

    Args:
        robot: The robot; parameters that no entry uses are left out, because a robot file may not have them.

    Returns:
        YAML text. It reads back as the same robot, with the same digest where its units can be kept.

    Raises:
        KinegenError: If the robot has something that a robot file cannot hold, in one line.
    """
    return _written(robot)[0]


def entries_of(robot: Robot) -> Entries:
    """Return what writes the entries of a robot as text, in the angle unit that its file would have."""
    return _written(robot)[1]


def _written(robot: Robot) -> tuple[str, Entries]:
    used = _without_unused(robot)
    wanted = _content(used)
    # Most parameters need no dimension, and most robots no other unit: the first text that reads as the same robot.
    for unit in dict.fromkeys((used.units.angle, _RADIANS)):
        tried = [Entries(used, unit, declared) for declared in (False, True)]
        for entries in tried:
            text = _text(robot, entries)
            if _content_of(text) == wanted:
                return text, entries
        # Terms in another order make another digest, not other poses.
        if _same_poses(used, _read(text, robot.name)):
            return text, tried[-1]
    raise KinegenError(f"robot {robot.name} cannot be written as a robot file without changing its poses")


def _read(text: str, name: str) -> Robot:
    try:
        return loads(text, f"{name}.yaml")
    except RobotFileError as error:
        place = f"line {error.line} of what was written: " if error.line else ""
        raise KinegenError(f"robot {name} cannot be written as a robot file: {place}{error.message}") from None


def _content_of(text: str) -> str | None:
    """Return the digest of what a text says, units aside; None where it is not a robot file."""
    try:
        return _content(loads(text, "written"))
    except RobotFileError:
        return None


def _content(robot: Robot) -> str:
    convention = Convention.STANDARD if _is_elementary(robot) else robot.convention
    return digest(replace(robot, units=Units(robot.units.length, _RADIANS), convention=convention))


def _is_elementary(robot: Robot) -> bool:
    """Tell whether no row has entries of a table, so that the convention of the file means nothing."""
    return all(row.convention is Convention.ETS for row in robot.rows)


def _same_poses(left: Robot, right: Robot) -> bool:
    """Tell whether all frames are in the same places at three joint vectors, with 50 digits."""
    for start in (0.0, -1.3):
        q = [start + 0.1 * place for place in range(left.dof)]
        first, second = frames_mp(left, q), frames_mp(right, q)
        with mpmath.workdps(DIGITS):
            scale = 1 + max(abs(entry) for matrix in first.values() for entry in matrix)
            moved = [first[name] - second[name] for name in first if name in second]
            if len(moved) < len(first) or max(abs(entry) for matrix in moved for entry in matrix) > 1e-40 * scale:
                return False
    return True


def _without_unused(robot: Robot) -> Robot:
    """Return the robot without the parameters that only served the values of others."""
    used = used_names(robot)
    return replace(robot, parameters=tuple(parameter for parameter in robot.parameters if parameter.name in used))


def _entries(row: Row) -> tuple[tuple[str, Expression], ...]:
    found = ((key, getattr(row, key)) for key in ROW_ENTRIES[row.convention])
    return tuple((key, ZERO if entry is None else entry) for key, entry in found)


@dataclass(frozen=True, slots=True)
class Entries:
    """Writes single entries of a robot without unused parameters.

    Attributes:
        angle: The angle unit of the file.
        declared: Whether every parameter says what it measures.
    """

    robot: Robot
    angle: str
    declared: bool

    def text(self, expression: Expression, dimension: Dimension, own: str = "") -> str:
        """Return one entry in the units of the file; the row's own variable is written q."""
        if self.angle != _RADIANS:
            expression = in_degrees(expression, dimension, self.angles)
        return quoted(spell(substitute(expression, {own: Name("q")}) if own else expression))

    @property
    def angles(self) -> frozenset[str]:
        """Everything that is an angle: joints that turn, parameters, and what motors read."""
        joints = [each.name for each in self.robot.variables if each.type is not JointType.PRISMATIC]
        joints += [each.name for each in self.robot.parameters if each.dimension is Dimension.ANGLE]
        joints += [each.name for each in self.robot.actuators.readings if each.dimension is Dimension.ANGLE]
        return frozenset(joints)

    def step(self, step: Step, own: str = "") -> str:
        """Return an elementary transform, such as `Rz(q)`."""
        dimension = Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH
        text = self.text(step.value, dimension, own)
        return f'"{step.kind}({text[1:-1]})"' if text.startswith('"') else f"{step.kind}({text})"


def _text(robot: Robot, writer: Entries) -> str:
    """Return the whole file."""
    convention = Convention.STANDARD if robot.convention is Convention.ETS else robot.convention
    lines = [f"# From {shown(robot.source)}."] if robot.source else []
    dropped = [parameter.name for parameter in robot.parameters if parameter not in writer.robot.parameters]
    lines += [f"# Left out, since no entry uses it: parameter {name}." for name in dropped]
    # The order in which people read a robot: what it is, what it needs, its table, its frames.
    lines += ["kinegen: 1", f"name: {robot.name}"]
    lines += [f"description: {json.dumps(robot.description, ensure_ascii=False)}"] if robot.description else []
    lines += [f'version: "{robot.version}"'] if robot.version else []
    given = ", ".join(robot.given)
    lines += [f"redundancy: {f'[{given}]' if len(robot.given) > 1 else given}"] if given else []
    lines += [f"convention: {convention}", f"units: {{length: {robot.units.length}, angle: {writer.angle}}}"]
    if writer.robot.parameters:
        lines += ["parameters:", *(_parameter(each, writer) for each in writer.robot.parameters)]
    lines += ["joints:" if robot.rows else "joints: []"]
    # Lines of the source lead back to the file that was converted.
    comments = [f"line {row.line}" if row.line and robot.source else "" for row in robot.rows]
    lines += aligned([_row(robot, place, writer, convention) for place in range(len(robot.rows))], comments)
    for key, steps in (("base", robot.base), ("tool", robot.tool)):
        lines += [f"{key}: {flow(_transform(steps, writer))}"] if steps else []
    if robot.frames:
        lines += ["frames:", *(_frame(robot, frame, writer) for frame in robot.frames)]
    lines += _links(robot)
    return "\n".join([*lines, *actuator_lines(robot, writer.text, degrees=writer.angle != _RADIANS)]) + "\n"


def _parameter(parameter: Parameter, writer: Entries) -> str:
    value = writer.text(parameter.value, parameter.dimension)
    cells = {"value": value}
    if writer.declared:
        cells["dimension"] = str(parameter.dimension)
    if parameter.runtime:
        cells["runtime"] = "true"
    return f"  {parameter.name}: {flow(cells) if len(cells) > 1 else value}"


def _row(robot: Robot, place: int, writer: Entries, convention: Convention) -> Cells:
    """Return the keys of one row with their texts."""
    row = robot.rows[place]
    cells = {"name": row.name}
    if row.parent != (robot.rows[place - 1].name if place else robot.root):
        cells["parent"] = _parent(robot, row.parent)
    if row.convention is Convention.ETS:
        cells["ets"] = f"[{', '.join(writer.step(step, row.name) for step in row.steps)}]"
    elif row.convention is not convention:
        cells["convention"] = str(row.convention)
    for key, entry in _entries(row):
        dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
        cells[key] = writer.text(entry, dimension, row.name)
    for variable in robot.variables:
        if variable.name == row.variable and variable.limits:
            kind = Dimension.LENGTH if variable.type is JointType.PRISMATIC else Dimension.ANGLE
            cells["limits"] = f"[{', '.join(writer.text(limit, kind) for limit in variable.limits)}]"
    return cells


def _parent(robot: Robot, parent: str) -> str:
    """Return the name of a parent as a file spells it."""
    if parent != robot.root:
        return parent
    if root_name(row.name for row in robot.rows) == ROOT:
        raise KinegenError(
            f"robot {robot.name} has a joint named {BASE} and several rows or frames on its root frame, which no robot "
            "file can spell; rename the joint"
        )
    return BASE


def _links(robot: Robot) -> list[str]:
    """Return the names of links; a name that means the frame that is called so anyway needs no line."""
    is_spelled = robot.root != ROOT
    there = {*robot.frame_names, *([robot.root] if is_spelled else [])}
    named = [(link, frame) for link, frame in robot.links if frame in there and link.isprintable()]
    if all(link == frame for link, frame in named):
        return []
    return ["links:", *(f"  {json.dumps(link, ensure_ascii=False)}: {frame}" for link, frame in named)]


def _frame(robot: Robot, frame: Frame, writer: Entries) -> str:
    cells = {"parent": _parent(robot, frame.parent)} | _transform(frame.steps, writer)
    return f"  {frame.name}: {flow(cells | ({'tip': 'true'} if frame.tip else {}))}"


def _transform(steps: tuple[Step, ...], writer: Entries) -> Cells:
    """Return a fixed transform as xyz and rpy where it has that form, else step by step."""
    kinds = [str(step.kind) for step in steps]
    if kinds != [kind for kind in _ORDER if kind in kinds] or any(step.value == ZERO for step in steps):
        return {"ets": f"[{', '.join(map(writer.step, steps))}]"}
    found = {str(step.kind): step for step in steps}
    cells: Cells = {}
    for key, triple, dimension in (
        ("xyz", ("Tx", "Ty", "Tz"), Dimension.LENGTH),
        ("rpy", ("Rx", "Ry", "Rz"), Dimension.ANGLE),
    ):
        if any(kind in found for kind in triple):
            values = (found[kind].value if kind in found else ZERO for kind in triple)
            cells[key] = f"[{', '.join(writer.text(value, dimension) for value in values)}]"
    return cells
