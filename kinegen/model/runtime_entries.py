"""Parameters that a calibration varies: a robot in, the same robot with more runtime parameters out.

Named parameters of the file become runtime parameters, and so do entries of the table, each under a name of its own:
`a_elbow` is entry a of row elbow. The new robot with its default values is the old robot, exactly.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from kinegen.errors import KinegenError, did_you_mean, quote
from kinegen.model.expression_parser import Expression, ExpressionError, Name, arcs, linear, names, substitute
from kinegen.model.expression_values import Dimension, check_roots, checked_value, join
from kinegen.model.robot import ANGLE_ENTRIES, BASE, ROW_ENTRIES, TOOL, Parameter, Robot, Row
from kinegen.model.variants import digest, expressions_in, used_names
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import check_name

DH = "dh"
"""Stands for every entry of every row."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One number of the table: what stands in an entry besides joint variables.

    Attributes:
        key: `a`, `alpha`, `d`, `theta` or `beta`.
        factors: What each joint variable in the entry is multiplied by, by joint name.
        offset: The rest: in theta of a revolute joint the offset of the angle, in a fixed entry all of it.
    """

    row: str
    key: str
    factors: Mapping[str, Expression]
    offset: Expression
    line: int

    @property
    def name(self) -> str:
        """Return what the parameter in its place is called."""
        return f"{self.key}_{self.row}"

    @property
    def dimension(self) -> Dimension:
        """Return what the parameter measures."""
        return Dimension.ANGLE if self.key in ANGLE_ENTRIES else Dimension.LENGTH


def with_runtime_entries(robot: Robot, wrt: tuple[str, ...]) -> Robot:
    """Make parameters and entries of the table runtime parameters, and choose them for `parameter_jacobian`.

    An entry keeps its joint variables: `theta: 90 - q` becomes `theta_elbow - q`, where `theta_elbow` is 90 degrees by
    default, in radians. A parameter of the file that nothing names any more goes. An elementary sequence has no
    entries; name parameters in its steps instead, and those of `base` and `tool` likewise.

    Args:
        wrt: Names of parameters of the file, of entries (`a_elbow`), or `DH` for all entries.

    Returns:
        The robot, whose default values are exactly those of the file. The parameters stand in the order of the file,
        then entries in the order of the table, whatever the order of `wrt`.

    Raises:
        KinegenError: If a name does not exist, or cannot be a runtime parameter.
    """
    entries = tuple(entry for row in robot.rows for entry in _entries(row, robot))
    own = {parameter.name: parameter for parameter in robot.parameters}
    _check_wrt(wrt, own, entries)
    wanted = frozenset((*wrt, *(entry.name for entry in entries if DH in wrt)))
    replaced = tuple(entry for entry in entries if entry.name in wanted and entry.name not in own)
    for entry in entries:
        if entry in replaced or DH in wrt:
            _check_entry(entry, robot)
    _check_made_of(robot, wanted)
    # Names stand in the table from now on, with the values of the file as defaults.
    left = replace(robot, rows=tuple(_with_names(row, replaced) for row in robot.rows))
    _check_arcs(left, wanted)
    _check_roots(left, wanted)
    # A parameter whose entries were all replaced moves nothing any more.
    used = used_names(left)
    kept = tuple(_chosen(parameter, wanted) for parameter in robot.parameters if parameter.name in used)
    _check_kept(kept, [name for name in wrt if name in own], replaced)
    values = {name: parameter.value for name, parameter in own.items()}
    found = replace(left, parameters=(*kept, *(_parameter(entry, values) for entry in replaced)))
    return replace(found, digest=digest(found))


def _entries(row: Row, robot: Robot) -> Iterator[Entry]:
    """Return the entries of one row, in the order in which its convention lists them."""
    joints = frozenset(variable.name for variable in robot.variables)
    for key in ROW_ENTRIES[row.convention]:
        factors, offset = linear(getattr(row, key), joints)
        yield Entry(row.name, key, factors, offset, row.line)


def _parameter(entry: Entry, values: Mapping[str, Expression]) -> Parameter:
    """Return the runtime parameter that stands in an entry from now on."""
    value = substitute(entry.offset, values)
    return Parameter(entry.name, value, entry.dimension, runtime=True, line=entry.line, chosen=True)


def _with_names(row: Row, replaced: Iterable[Entry]) -> Row:
    """Return a row with parameters in some of its entries."""
    mine: dict[str, Any] = {
        entry.key: join(entry.factors, Name(entry.name)) for entry in replaced if entry.row == row.name
    }
    return replace(row, **mine)


def _chosen(parameter: Parameter, wanted: frozenset[str]) -> Parameter:
    if parameter.name not in wanted:
        return parameter
    check_name("runtime parameter", parameter.name)
    return replace(parameter, runtime=True, chosen=True)


def _check_wrt(wrt: tuple[str, ...], own: Collection[str], entries: tuple[Entry, ...]) -> None:
    """Refuse a name that is neither a parameter nor an entry, and `DH` where there are no entries."""
    known = [*own, *(entry.name for entry in entries), *([DH] if entries else [])]
    for name in wrt:
        if name == DH and not entries:
            raise KinegenError("the table has no entries, only elementary sequences; name parameters of the file")
        if name not in known:
            listed = "; ".join([", ".join(own) or "no parameter of the file", *_listed(entries)])
            raise KinegenError(f"there is no parameter {quote(name)} (expected {listed}{did_you_mean(name, known)})")


def _listed(entries: tuple[Entry, ...]) -> list[str]:
    """Return what to say of the entries: their names are all pairs of a key and a row."""
    if not entries:
        return []
    rows = ", ".join(dict.fromkeys(entry.row for entry in entries))
    return [f"an entry, such as {entries[0].name}, of rows {rows}", f"{DH} for all entries"]


def _check_entry(entry: Entry, robot: Robot) -> None:
    """Refuse a name that something else has, or that no output can use."""
    check_name("parameter", entry.name)
    taken = (("parameter", robot.parameters), ("joint", robot.rows), ("actuator", robot.actuators.readings))
    for kind, others in taken:
        for other in others:
            same = other.name.upper() == entry.name.upper()
            if same and not (kind == "parameter" and entry.offset == Name(entry.name)):
                what = f"entry {entry.key} of joint '{entry.row}' would be called '{entry.name}'"
                raise KinegenError(
                    f"{what}, too close to {kind} '{other.name}'; give that another name", line=other.line
                )


def _check_made_of(robot: Robot, wanted: frozenset[str]) -> None:
    """Refuse a parameter from which another was computed, which would keep its old value."""
    for parameter in robot.parameters:
        for name in parameter.made_of:
            if name in wanted:
                reason = f"is computed from '{name}', which is to be set at run time"
                raise KinegenError(
                    f"parameter '{parameter.name}' {reason}; write the expression in the row", line=parameter.line
                )


def _check_arcs(robot: Robot, wanted: frozenset[str]) -> None:
    """Refuse a parameter in an arc of the table, which kernels get as a constant."""
    for expression in expressions_in((robot.rows, robot.base, robot.tool, robot.frames)):
        for name in (name for arc in arcs(expression) for name in names(arc) if name in wanted):
            raise KinegenError(f"parameter '{name}' is in asin, acos, atan or atan2; make the angle a parameter")


def _check_roots(robot: Robot, wanted: frozenset[str]) -> None:
    """Refuse a parameter in a square root that is zero, where no derivative exists."""
    values = {parameter.name: checked_value(parameter.value, {}) for parameter in robot.parameters}
    places = [
        *((f"joint {row.number} ({row.name})", row.line, row) for row in robot.rows),
        *((f"frame '{frame.name}'", frame.line, frame) for frame in robot.frames),
        *((name, None, steps) for name, steps in ((BASE, robot.base), (TOOL, robot.tool))),
    ]
    for where, line, place in places:
        for expression in expressions_in(place):
            try:
                check_roots(expression, values, wanted)
            except ExpressionError as error:
                raise KinegenError(f"{where}: {error}", line=line) from None


def _check_kept(kept: tuple[Parameter, ...], named: list[str], replaced: tuple[Entry, ...]) -> None:
    """Refuse a parameter that moves nothing, because entries take its place or because none ever used it."""
    for name in named:
        if name not in (parameter.name for parameter in kept):
            instead = [entry.name for entry in replaced if name in names(entry.offset)]
            reason = f"is replaced by {', '.join(instead)}; leave it out" if instead else "moves nothing"
            raise KinegenError(f"parameter '{name}' {reason}")
