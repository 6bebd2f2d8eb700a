"""The table as people read it: in the units of the file, joint variables by number, constants as written.

In: a robot. Out: its rows, fixed transforms and parameters as ordered trees, which `notation` prints. What the kernels
take in radians is turned back into the units of the file, exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from kinegen.backends.textbook.closed_form import Reader, Sum, printed_name
from kinegen.derive.transforms import SYMPY, symbols
from kinegen.model.expression_parser import Expression, evaluate, names
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import BASE, TOOL, Convention, JointType, Parameter, Robot, Row, Step, frame_label
from kinegen.support.dataclass import dataclass

COLUMNS = ("alpha", "a", "d", "theta", "beta")
"""The entries of a row, in the order in which they are printed."""

ARCS = (sp.asin, sp.acos, sp.atan, sp.atan2)
"""The functions that give an angle."""

_ANGLES = frozenset({"alpha", "theta", "beta"})


@dataclass(frozen=True, slots=True)
class TableStep:
    """One elementary transform, such as `Rz` with its value."""

    kind: str
    value: Sum


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row.

    `number`: its place, from 1. `name`: joint name. `parent`: frame from which it leads on. `convention`: its
    convention. `entries`: one for each of the table's columns; None where the convention has no such entry. `steps`:
    the elementary sequence; empty for the table conventions.
    """

    number: int
    name: str
    parent: str
    convention: Convention
    entries: tuple[Sum | None, ...]
    steps: tuple[TableStep, ...]


@dataclass(frozen=True, slots=True)
class TableFrame:
    """A fixed transform: base, tool or a named frame, with the frame on which it stands."""

    name: str
    parent: str
    steps: tuple[TableStep, ...]


@dataclass(frozen=True, slots=True)
class TableParameter:
    """A parameter as it is printed, its value, and the unit of that."""

    name: str
    value: Sum
    unit: str
    runtime: bool


@dataclass(frozen=True, slots=True)
class Table:
    """A whole table.

    `columns`: those of `COLUMNS` that occur; none if every row is an elementary sequence. `rows`: in the order of the
    file. `frames`: fixed transforms that do something, and all named frames. `joints`: number and name of every joint
    variable that occurs. `parameters`: those that occur, in the order of the file.
    """

    columns: tuple[str, ...]
    rows: tuple[TableRow, ...]
    frames: tuple[TableFrame, ...]
    joints: tuple[tuple[int, str], ...]
    parameters: tuple[TableParameter, ...]


def read_table(robot: Robot, only: frozenset[str] | None = None) -> Table:
    """Turn a robot back into the table that its owner wrote.

    Args:
        only: Names of the rows and frames that are wanted; all if left out.
    """
    units = _FileUnits(robot)
    rows = tuple(row for row in robot.rows if only is None or row.name in only)
    columns = tuple(column for column in COLUMNS if any(getattr(row, column) is not None for row in rows))
    last = robot.rows[-1].name if robot.rows else robot.root
    fixed = [each for each in (("0", BASE, robot.base), (TOOL, frame_label(last), robot.tool)) if each[2]]
    fixed += [(frame.name, frame.parent, frame.steps) for frame in robot.frames]
    fixed = [each for each in fixed if only is None or each[0] in only]
    used = {name for row in rows for name in _row_names(row)}
    used |= {name for _, _, steps in fixed for step in steps for name in names(step.value)}
    return Table(
        columns=columns,
        rows=tuple(_row(row, columns, units) for row in rows),
        frames=tuple(TableFrame(name, parent, units.steps(steps)) for name, parent, steps in fixed),
        joints=tuple((variable.index + 1, variable.name) for variable in robot.variables if variable.name in used),
        parameters=tuple(_parameter(robot, entry, units) for entry in robot.parameters if entry.name in used),
    )


def _row_names(row: Row) -> Iterator[str]:
    for entry in (row.alpha, row.a, row.d, row.theta, row.beta, *(step.value for step in row.steps)):
        yield from () if entry is None else names(entry)


def _parameter(robot: Robot, parameter: Parameter, units: _FileUnits) -> TableParameter:
    unit = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: robot.units.angle, Dimension.NUMBER: ""}
    return TableParameter(
        name=printed_name(parameter.name),
        value=units.value(parameter.value, parameter.dimension),
        unit=unit[parameter.dimension],
        runtime=parameter.runtime,
    )


def _row(row: Row, columns: tuple[str, ...], units: _FileUnits) -> TableRow:
    entries: list[Sum | None] = []
    for column in columns:
        entry = getattr(row, column)
        dimension = Dimension.ANGLE if column in _ANGLES else Dimension.LENGTH
        entries.append(None if entry is None else units.value(entry, dimension))
    return TableRow(row.number, row.name, row.parent, row.convention, tuple(entries), units.steps(row.steps))


class _FileUnits:
    """Reads expressions in kernel units as the file wrote them."""

    def __init__(self, robot: Robot) -> None:
        self.values = symbols(robot, keep_parameters=True)
        self.reader = Reader(robot)
        self.degrees = robot.units.angle == "deg"
        turning = [variable.name for variable in robot.variables if variable.type is not JointType.PRISMATIC]
        turning += [parameter.name for parameter in robot.parameters if parameter.dimension is Dimension.ANGLE]
        self.angles = {self.values[name]: self.values[name] * sp.pi / 180 for name in turning}

    def value(self, expression: Expression, dimension: Dimension) -> Sum:
        """Return one entry; only what is an angle counts in degrees."""
        exact = sp.expand(evaluate(expression, self.values, SYMPY))
        if self.degrees and dimension is Dimension.ANGLE:
            # An arc is an angle as it stands, and what it is taken of is no angle.
            turned = {arc: arc * sp.pi / 180 for arc in exact.atoms(*ARCS)}
            exact = sp.expand(exact.xreplace(self.angles | turned) * 180 / sp.pi)
        return self.reader.angle(exact)

    def steps(self, steps: tuple[Step, ...]) -> tuple[TableStep, ...]:
        """Return an elementary sequence."""
        return tuple(
            TableStep(step.kind, self.value(step.value, Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH))
            for step in steps
        )
