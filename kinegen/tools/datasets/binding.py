"""Binds columns to the inputs of kernels, and gives their numbers as arrays."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.io.columns import METRES, RADIANS, check_units, named_so, no_column, numbered, unit_of, unit_of_values
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Units
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.csv_text import PURPOSE, require_numbers
from kinegen.tools.datasets.results import START, TARGET, Searching, kernel_of
from kinegen.tools.datasets.sources import Source

JOINTS = "q"
"""The input that is bound to columns with the names of the joints."""

RESULT = b"kernel"
"""What the metadata of a column of results has."""

_BY_JOINT = (JOINTS, "qd", "qdd", START)
"""Inputs with one number for each joint variable."""

_RATES = {"qd": ("/s",), "qdd": ("/s2", "/s^2", "/s²")}
"""What follows the unit of a joint value in that of its rate."""

_OF_RATES = {
    "qd": {Kind.TWIST, Kind.BIAS_ACCELERATION, Kind.ACCELERATION},
    "qdd": {Kind.ACCELERATION},
    START: {Kind.NUMERIC_INVERSE},
}
"""What takes rates of joints, and where a search begins."""

_OF_POSES = (Kind.INVERSE, Kind.NUMERIC_INVERSE, Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE)
_OF_OTHERS = (Kind.AXIS_INVERSE, Kind.ACTUATORS_TO_JOINTS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS)
"""What is computed from poses, and from neither poses nor joint values."""

_OF_POINTS = (Kind.AXIS_INVERSE, Kind.TRANSFORM_POINT)
"""What takes points and directions, which are its inputs of three numbers."""


@dataclass(frozen=True, slots=True)
class Binding:
    """The columns of one input: one column of vectors, or one for each number.

    Attributes:
        name: The input, such as `q`, `qd` or `base_T_tool`.
        size: Numbers that the columns hold for a row: of a pose 12, or 16 with the last row.
        shape: What a kernel takes for a row; of a pose the upper three rows.
        factors: What each number is multiplied by when it is read; none where they are read as they are.
        has_angles: Whether angles may be among the numbers: no pose, no point and no direction.
    """

    name: str
    columns: tuple[str, ...]
    size: int
    shape: tuple[int, ...]
    factors: tuple[float, ...] = ()
    has_angles: bool = False


def bind(
    module: ModuleType, quantities: Sequence[Quantity], schema: Any, chosen: Mapping[str, tuple[str, ...]]
) -> tuple[Binding, ...]:
    """Find the columns of each input of the kernels; none for an optional one without columns."""
    takers = {quantity: kernel_of(module, quantity.function) for quantity in quantities}
    inputs = {given.name: (quantity.kind, given) for quantity, taker in takers.items() for given in taker.inputs}
    optional = {name for taker in takers.values() if isinstance(taker, Searching) for name in taker.optional}
    for name in chosen:
        if name not in inputs:
            raise KinegenError(f"--columns: there is no input {quote(name)} (there are {', '.join(inputs)})")
    # Each input is bound once, whichever outputs take it.
    found = []
    for name, (kind, given) in inputs.items():
        if name in optional and name not in chosen and name not in schema.names:
            continue
        columns = chosen.get(name) or _usual(tuple(module.JOINTS), name, schema.names)
        size = sum(_numbers(column, schema) for column in columns)
        # A pose may come with its last row or without it.
        sizes = sorted({given.size, math.prod(given.shape)})
        if size not in sizes:
            raise KinegenError(
                f"{name}: the columns {', '.join(map(quote, columns))} hold {size} numbers; "
                f"{name} takes {' or '.join(map(str, sizes))}"
            )
        is_point = kind in _OF_POINTS and given.shape == (3,)
        has_angles = not (given.is_pose or is_point)
        found.append(Binding(name, columns, size, given.laid_out("3x4"), has_angles=has_angles))
    return tuple(found)


class _NotNumbersError(KinegenError):
    """A column that has no numbers."""

    def __init__(self, column: str, kind: Any) -> None:
        super().__init__(f"column {quote(column)} is of type {kind}; expected numbers")
        self.column = column


@contextmanager
def placed(sources: Iterable[Source]) -> Iterator[None]:
    """Report errors about a column without numbers with file and line, where it is one of text files."""
    try:
        yield
    except _NotNumbersError as error:
        for source in sources:
            if source.kind == "csv":
                require_numbers(source.path, [error.column])
        raise


def takes_angles(binding: Binding) -> bool:
    """Tell whether an input is joint values or their rates, whose angles have the unit that the user states."""
    return binding.name in _BY_JOINT


def in_kernel_units(
    bindings: Iterable[Binding], units: Units, turns: Mapping[str, bool], schema: Any
) -> tuple[Binding, ...]:
    """Return bindings with the factors of their units; results of an earlier run stay in radians.

    `units` are those of columns whose titles state none, and lengths are computed in that one; `turns` says of each
    joint whether its variable is an angle.

    Raises:
        KinegenError: If an input is neither a pose nor joint values or their rates, so that no unit is known, or a
            title states a unit that is not one of its input.
    """
    found = []
    for each in bindings:
        if units.angle == "deg" and not takes_angles(each) and each.has_angles:
            raise KinegenError(
                f"angles in degrees are for joint values and their rates; the output takes {each.name}, whose angles "
                "are in radians: add --angle rad"
            )
        is_result = _is_result(each, schema)
        if not (is_result or takes_angles(each)):
            _check_other(each, units.length)
        factors = () if is_result or not takes_angles(each) else _factors(each, units, turns, schema)
        found.append(replace(each, factors=() if all(factor == 1.0 for factor in factors) else factors))
    return tuple(found)


def units_of_angles(
    bindings: Iterable[Binding], units: Units, turns: Mapping[str, bool], schema: Any, *, is_asked: bool
) -> tuple[str, str]:
    """Return the unit of angles of joint values whose titles state none, and what other titles state: `deg and rad`.

    Each is empty where there are no such titles; columns of lengths and results of an earlier run do not count.

    Args:
        bindings: As `in_kernel_units` returns them.
        units: Those of titles without a unit.
        turns: Whether the variable of each joint is an angle.
        schema: That of the columns.
        is_asked: Whether an option states the unit of angles.

    Raises:
        KinegenError: If titles leave the unit of another one open, or contradict the option.
    """
    found = set[str | None]()
    for each in bindings:
        if takes_angles(each) and not _is_result(each, schema):
            angles, lengths = _stated(each, turns, schema)
            check_units(angles, units.angle, "--angle", is_asked=is_asked)
            check_units(lengths, units.length, "")
            found |= {*angles.values()}
    return units.angle if None in found else "", " and ".join(sorted(filter(None, found)))


def _stated(
    binding: Binding, turns: Mapping[str, bool], schema: Any
) -> tuple[dict[str, str | None], dict[str, str | None]]:
    """Return the units that titles of columns with angles state, and those of columns of lengths."""
    is_angle, place = [*turns.values()], 0
    angles, lengths = dict[str, str | None](), dict[str, str | None]()
    for title in binding.columns:
        size = _numbers(title, schema)
        group, known = (angles, RADIANS) if any(is_angle[place : place + size]) else (lengths, METRES)
        group[title] = _known(title, binding, turns, known)
        place += size
    return angles, lengths


def _is_result(binding: Binding, schema: Any) -> bool:
    """Tell whether the columns are marked as results of an earlier run, which are in radians."""
    return all(RESULT in (schema.field(name).metadata or {}) for name in binding.columns)


def _unit(title: str, binding: Binding, joints: Collection[str]) -> str | None:
    return unit_of_values(title, (*joints, *numbered(len(joints)), binding.name))


def _factors(binding: Binding, units: Units, turns: Mapping[str, bool], schema: Any) -> tuple[float, ...]:
    """Return what each number is multiplied by; in a column of vectors, the unit of the title is that of its angles."""
    is_angle, found = [*turns.values()], list[float]()
    for title in binding.columns:
        angles = is_angle[len(found) : len(found) + _numbers(title, schema)]
        known, usual = (RADIANS, units.angle) if any(angles) else (METRES, units.length)
        unit = _known(title, binding, turns, known) or usual
        factor = known[unit] if any(angles) else 1.0 if unit == usual else known[unit] / known[usual]
        found += [factor if angle == any(angles) else 1.0 for angle in angles]
    return tuple(found)


def _known(title: str, binding: Binding, joints: Collection[str], known: Iterable[str]) -> str | None:
    """Return the unit that a title states, of a rate without its time; None where it states none."""
    stated, ends = _unit(title, binding, joints), _RATES.get(binding.name, ("",))
    unit = next((unit for unit in known for end in ends if stated == unit + end), None)
    if stated and unit is None:
        expected = ", ".join(unit + ends[0] for unit in known)
        raise KinegenError(f"column {quote(title)} is in {stated!r} (expected {expected})")
    return unit


def _check_other(binding: Binding, length: str) -> None:
    """Refuse a unit that a title states for an input which is read in the units of the kernels."""
    for title in binding.columns:
        stated = unit_of(title)[1] if title.endswith(("]", ")")) else None
        unit = (stated or "").partition("/")[0]
        if unit in METRES | RADIANS and unit not in (length, "rad"):
            raise KinegenError(f"column {quote(title)} is in {stated!r}; {binding.name} is read in {length} and rad")


def check_columns(
    joints: tuple[str, ...], kinds: Iterable[Kind], schema: Any, chosen: Mapping[str, tuple[str, ...]]
) -> None:
    """Refuse columns that are missing or not of numbers before anything is compiled; `bind` checks the rest."""
    for column in (column for columns in chosen.values() for column in columns):
        _numbers(column, schema)
    for kind in kinds:
        name = TARGET if kind in _OF_POSES else "" if kind in _OF_OTHERS else JOINTS
        if name and name not in chosen:
            for column in _usual(joints, name, schema.names):
                _numbers(column, schema)


def joint_bindings(
    joints: tuple[str, ...], quantities: Iterable[Quantity], schema: Any, chosen: Mapping[str, tuple[str, ...]]
) -> tuple[Binding, ...]:
    """Return the joint values and their rates that outputs take, known before anything is compiled."""
    kinds = {each.kind for each in quantities}
    wanted = [JOINTS] if kinds - {*_OF_POSES, *_OF_OTHERS} else []
    there = {*chosen, *schema.names}
    wanted += [name for name, takers in _OF_RATES.items() if kinds & takers and name in there]
    found = []
    for name in wanted:
        columns = chosen.get(name) or _usual(joints, name, schema.names)
        size = sum(_numbers(column, schema) for column in columns)
        if size == len(joints):
            found.append(Binding(name, columns, size, (size,), has_angles=True))
    return tuple(found)


def _usual(joints: tuple[str, ...], name: str, there: Sequence[str]) -> tuple[str, ...]:
    """The columns of an input where the user named none: those called as the joints, as the input, or q1, q2, ..."""
    if name == JOINTS and joints and (found := named_so(joints, there)):
        return found
    if name in there:
        return (name,)
    if name == JOINTS and joints:
        # The name of the input may have a unit too, as in `q[rad]`; one that is not known is reported where it is read.
        names = (numbered(len(joints)), (JOINTS,))
        ways = [(each, False) for each in names] + [(each, True) for each in (joints, *names)]
        if found := next(filter(None, (named_so(each, there, in_any_unit=way) for each, way in ways)), None):
            return found
    wanted = quote(name)
    if name == JOINTS and joints:
        wanted = f"the joints {', '.join(map(quote, joints))}, or q1 to q{len(joints)}, or {wanted}"
    option = "j1,j2,..." if name == JOINTS else f"{name}=c1,c2,..."
    raise KinegenError(
        f"there is no column for {name}: expected {wanted}, or --columns {option} "
        f"(there are {', '.join(map(quote, there)) or 'none'})"
    )


def _numbers(column: str, schema: Any) -> int:
    """Return numbers of a row of a column."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    places = schema.get_all_field_indices(column)
    if len(places) != 1:
        there = ", ".join(map(quote, schema.names)) or "none"
        raise KinegenError(
            f"there are {len(places)} columns {quote(column)} (there are {there})"
            if places
            else no_column(column, schema.names)
        )
    kind = schema.field(places[0]).type
    inner = kind.value_type if types.is_fixed_size_list(kind) else kind
    if types.is_list(kind) or types.is_large_list(kind):
        raise KinegenError(f"column {quote(column)} has lists of any length; expected lists of one fixed size")
    # A text file without rows, or without values in a column, does not say what they are.
    if not (types.is_floating(inner) or types.is_integer(inner) or types.is_decimal(inner) or types.is_null(inner)):
        raise _NotNumbersError(column, kind)
    return int(kind.list_size) if types.is_fixed_size_list(kind) else 1


def taken(batch: Any, binding: Binding, real: Any) -> tuple[Any, Any]:
    """Return the numbers of an input, (numbers, n), NaN where one is null, and the rows that have a null, or None."""
    numbers = np.empty((binding.size, batch.num_rows), real)
    nulls, place = None, 0
    for column in map(batch.column, binding.columns):
        rows, size = _rows(column)
        factors = binding.factors[place : place + size]
        numbers[place : place + size] = (rows * factors if factors else rows).T
        place += size
        if column.null_count or (hasattr(column.type, "list_size") and column.flatten().null_count):
            missing = np.isnan(rows).any(axis=1) & _null_rows(column, size)
            nulls = missing if nulls is None else nulls | missing
    return numbers[: math.prod(binding.shape)], nulls


def _rows(column: Any) -> tuple[Any, int]:
    """Return a column as an array (n, numbers of a row), with NaN for null."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    inner = getattr(column.type, "value_type", column.type)
    if types.is_decimal(inner) or types.is_null(inner):
        pyarrow = library("pyarrow", PURPOSE, "fleet")
        real, length = pyarrow.float64(), getattr(column.type, "list_size", None)
        column = column.cast(real if length is None else pyarrow.list_(real, length))
    # A null in a vector makes its numbers NaN, and the row null.
    size = getattr(column.type, "list_size", 1)
    if size == 1 and not hasattr(column.type, "list_size"):
        return column.to_numpy(zero_copy_only=False).reshape(-1, 1), 1
    if not column.null_count:
        return column.flatten().to_numpy(zero_copy_only=False).reshape(-1, size), size
    rows = np.full((len(column), size), np.nan)
    rows[column.is_valid().to_numpy(zero_copy_only=False)] = (
        column.drop_null().flatten().to_numpy(zero_copy_only=False).reshape(-1, size)
    )
    return rows, size


def _null_rows(column: Any, size: int) -> Any:
    """Return which rows are null, or hold a null."""
    missing = column.is_null().to_numpy(zero_copy_only=False)
    if hasattr(column.type, "list_size"):
        inner = np.zeros((len(column), size), bool)
        inner[~missing] = column.drop_null().flatten().is_null().to_numpy(zero_copy_only=False).reshape(-1, size)
        missing = missing | inner.any(axis=1)
    return missing
