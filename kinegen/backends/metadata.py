"""What files say of the robot itself: its table, tips and parameters, and the command that makes them again."""

from __future__ import annotations

import math
import textwrap
from functools import lru_cache

from kinegen.backends.bundle import RobotPrograms, joint_lines, provenance
from kinegen.backends.descriptions import subject
from kinegen.backends.inverse import branches_of
from kinegen.backends.limits import actuator_lines, actuator_names
from kinegen.backends.routines import LINE
from kinegen.model.expression_parser import Expression, ExpressionError, evaluate, linear, names, substitute
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.outputs import Kind
from kinegen.model.robot import ANGLE_ENTRIES, Convention, JointType, Robot, Row, Step, frame_label
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import comment_text, macro


@dataclass(frozen=True, slots=True)
class Metadata:
    """Holds what a file says of the robot itself, whatever its language; templates have it in `robot`.

    A language whose templates need one more of these things adds a field here, not to its own context.

    Attributes:
        version: Version of the robot file.
        provenance: The line that says what reproduces a file.
        description: The line of the robot file, safe in comments.
        subject: What its kernels compute, in words.
        length: The file's length unit.
        dof: Number of joint variables.
        joints: Names of the joints.
        joint_lines: One line for each entry of the joint vector.
        frames: The frames in the order of the output `frames`; none where it is not built.
        tips: The tips of a tree; none for a chain.
        branches: The branches of the closed-form inverse; none where it is not built.
        varied: The columns of `parameter_jacobian`; none where it is not built.
        actuators: The actuators; none where no kernel takes or gives their readings.
        actuator_lines: One line for each of them.
    """

    name: str
    version: str
    provenance: str
    description: str
    subject: str
    length: str
    dof: int
    joints: tuple[str, ...]
    joint_lines: tuple[str, ...]
    frames: tuple[str, ...]
    tips: tuple[str, ...]
    branches: tuple[str, ...]
    varied: tuple[str, ...]
    actuators: tuple[str, ...]
    actuator_lines: tuple[str, ...]

    @property
    def upper(self) -> str:
        """Return what its macros begin with."""
        return self.name.upper()


@lru_cache(maxsize=8)
def metadata_of(kernels: RobotPrograms) -> Metadata:
    """Gather it once for all languages and packages of a build."""
    robot, branches = kernels.robot, branches_of(kernels)
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    return Metadata(
        name=robot.name,
        version=robot.release,
        provenance=provenance(robot),
        description=comment_text(robot.description),
        subject=subject(program.quantity for program in kernels.programs),
        length=robot.units.length,
        dof=robot.dof,
        joints=tuple(variable.name for variable in robot.variables),
        joint_lines=joint_lines(robot),
        frames=robot.frame_names if has_frames else (),
        tips=robot.tips if robot.is_tree else (),
        branches=branches.names if branches else (),
        varied=varied_names(kernels),
        actuators=actuator_names(kernels),
        actuator_lines=actuator_lines(kernels),
    )


def varied_names(kernels: RobotPrograms) -> tuple[str, ...]:
    """Return the parameters that the columns of `parameter_jacobian` stand for; none where it is not built."""
    if not any(program.quantity.kind is Kind.PARAMETER_JACOBIAN for program in kernels.programs):
        return ()
    return tuple(parameter.name for parameter in kernels.robot.varied_parameters)


_COLUMNS = ("alpha", "a", "d", "theta", "beta")


def table_lines(robot: Robot) -> tuple[str, ...]:
    """Return the table, one line for each row, with the fixed transforms below; empty for a robot without rows."""
    columns = tuple(key for key in _COLUMNS if any(getattr(row, key) is not None for row in robot.rows))
    head = ("row", *columns, "")
    rows = [head, *(_row(robot, row, columns) for row in robot.rows)] if robot.rows else []
    widths = [max(len(row[place]) for row in rows) for place in range(len(head))] if rows else []
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:]))])
        + ("  " + row[-1] if row[-1] else "")
        for row in rows
    ]
    fixed = (("base", "", robot.base), ("tool", "", robot.tool))
    named = ((frame.name, f" on {frame_label(frame.parent)}", frame.steps) for frame in robot.frames)
    lines += [f"{name}{parent}: {_steps(robot, steps)}" for name, parent, steps in (*fixed, *named) if steps]
    return tuple(line.rstrip() for line in lines)


def table_title(robot: Robot) -> str:
    """Return what the lines are: convention and units."""
    used = dict.fromkeys(row.convention for row in robot.rows if row.convention is not Convention.ETS)
    what = f"{', '.join(used)} convention" if used else "elementary transforms"
    units = f"lengths in {robot.units.length}, angles in {robot.units.angle}"
    return f"Table of {comment_text(robot.source)}, {what}, {units}:"


def tip_lines(robot: Robot) -> tuple[str, ...]:
    """Return one line for each tip of a tree: its macro, its place in the results, and the row that it is on."""
    if not robot.is_tree:
        return ()
    links = robot.frame_links
    rows = [
        (macro(robot.name, f"TIP_{tip}"), f"{place}", tip, f"on {links[tip]}" if tip in links else "")
        for place, tip in enumerate(robot.tips)
    ]
    widths = [max(len(row[place]) for row in rows) for place in range(4)]
    return tuple("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)


def command_lines(kernels: RobotPrograms, *more: str) -> tuple[str, ...]:
    """The command that makes the kernels of a header again, in lines of a comment; `more` are further options."""
    text = command_line(kernels, *more)
    return tuple(textwrap.wrap(text, LINE - 4, break_long_words=False, break_on_hyphens=False))


def command_line(kernels: RobotPrograms, *more: str) -> str:
    """Return the same in one line."""
    outputs = [str(program.quantity) for program in kernels.programs]
    outputs += map(str, kernels.solvers)
    further = further_options(kernels.robot)
    options = [f"--outputs {_listed(outputs)}"]
    options += [f"--{name} {_listed(value.split(','))}".rstrip() for name, value in further.items()]
    return " ".join([f"kinegen build {comment_text(kernels.robot.source)}", *options, *more])


def further_options(robot: Robot) -> dict[str, str]:
    """Options that a build of a robot needs besides its outputs, without dashes; empty text where one has no value."""
    chosen = ",".join(parameter.name for parameter in robot.parameters if parameter.chosen)
    values = {"wrt": chosen, "redundancy": robot.redundancy}
    return {name: value for name, value in values.items() if value} | (
        {"strict-limits": ""} if robot.strict_limits else {}
    )


def _listed(words: list[str]) -> str:
    """Return a list for the command line, with spaces to be broken at where it is long."""
    plain = ",".join(words)
    return plain if len(plain) < LINE // 2 else f'"{", ".join(words)}"'


def _row(robot: Robot, row: Row, columns: tuple[str, ...]) -> tuple[str, ...]:
    cells = []
    for key in columns:
        entry = getattr(row, key)
        dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
        cells.append("" if entry is None else _value(robot, entry, dimension))
    above = robot.root if row.number == 1 else robot.rows[row.number - 2].name
    parent = "" if row.parent == above else f"on {frame_label(row.parent)}"
    sequence = _steps(robot, row.steps) if row.convention is Convention.ETS else ""
    return (row.name, *cells, "  ".join(part for part in (sequence, parent) if part))


def _steps(robot: Robot, steps: tuple[Step, ...]) -> str:
    def value(step: Step) -> str:
        return _value(robot, step.value, Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH)

    return " ".join(f"{step.kind}({value(step)})" for step in steps)


def _value(robot: Robot, expression: Expression, dimension: Dimension) -> str:
    """Return one entry: joint variables as q[0], runtime parameters by name, the rest as one number."""
    runtime = {parameter.name: parameter for parameter in robot.runtime_parameters}
    values = {entry.name: entry.value for entry in robot.parameters if entry.name not in runtime}
    closed = substitute(expression, values)
    places = {variable.name: f"q[{variable.index}]" for variable in robot.variables}
    degrees = math.degrees(1) if robot.units.angle == "deg" and dimension is Dimension.ANGLE else 1.0
    try:
        factors, rest = linear(closed, frozenset(places) | frozenset(runtime))
    except ExpressionError:  # a runtime parameter in a product or under a root
        return f"f({', '.join(places.get(name, name) for name in names(closed))})"
    slides = {variable.name for variable in robot.variables if variable.type is JointType.PRISMATIC}
    lengths = slides | {name for name, entry in runtime.items() if entry.dimension is not Dimension.ANGLE}
    text = ""
    for name, factor in factors.items():
        size = float(evaluate(factor, {}, FLOAT64)) * (degrees if name in lengths else 1.0)
        text = _joined(text, size, places.get(name, name))
    constant = float(evaluate(rest, {}, FLOAT64)) * degrees
    return _joined(text, constant, "") if constant or not text else text


def _joined(text: str, size: float, name: str) -> str:
    """Return a term behind others."""
    number = f"{abs(size):.10g}"
    term = name if name and number == "1" else f"{number}*{name}" if name else number
    if not text:
        return f"-{term}" if size < 0 else term
    return f"{text} {'-' if size < 0 else '+'} {term}"
