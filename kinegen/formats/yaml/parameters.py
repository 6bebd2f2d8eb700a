"""`parameters` -> raw parameters, and their closed values in kernel units once their dimensions are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kinegen.errors import quote
from kinegen.formats.messages import accept_name, expected, fail, within
from kinegen.formats.yaml import keys
from kinegen.formats.yaml.nodes import choice, mapping, named
from kinegen.formats.yaml.slots import OWN, Slot, read_slot
from kinegen.formats.yaml.tree import Mapping as MappingNode
from kinegen.formats.yaml.tree import Node
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import (
    FUNCTIONS,
    Expression,
    ExpressionError,
    checked_depth,
    largest_number,
    size,
    substitute,
)
from kinegen.robot.model import Parameter
from kinegen.robot.units import radians
from kinegen.robot.values import checked_value

MAX_VALUE_SIZE = 500
MAX_VALUE_BITS = 2000


@dataclass(frozen=True, slots=True)
class RawParameter:
    """A parameter as written; the dimension of its slot means nothing yet."""

    name: str
    slot: Slot
    runtime: bool
    declared: Dimension | None
    line: int

    @property
    def where(self) -> str:
        """How messages name it."""
        return f"parameter '{self.name}'"


def read_parameters(node: Node | None, joints: Mapping[str, int]) -> tuple[RawParameter, ...]:
    """Read the parameters.

    Args:
        node: The value of `parameters`, if the file has one.
        joints: Line of each joint name, which no parameter may take.
    """
    if node is None:
        return ()
    with within("parameters", node.line):
        entries = named(node, "entries such as a2: 0.4318", keys.MAX_PARAMETERS)
    read: dict[str, RawParameter] = {}
    for key, value in entries:
        accept_name("parameter", key.text, key.line)
        with within(f"parameter {quote(key.text)}", key.line):
            if key.text in FUNCTIONS:
                fail("this is a function; choose another name")
            if key.text in joints:
                fail(f"a joint has this name too (line {joints[key.text]})")
            for other in read:
                if other.upper() == key.text.upper():
                    fail(f"differs from parameter '{other}' in upper and lower case only, which macros lose")
            read[key.text] = _read_parameter(key.text, value, key.line)
            _check_names(read[key.text], list(read)[:-1], [name.text for name, _ in entries], joints)
    return tuple(read.values())


def _read_parameter(name: str, node: Node, line: int) -> RawParameter:
    runtime, declared = False, None
    if isinstance(node, MappingNode):
        fields = mapping(node, keys.PARAMETER, "a value")
        if "value" not in fields:
            fail("key 'value' is missing", node.line)
        if "runtime" in fields:
            with within("runtime", fields["runtime"].line):
                runtime = choice(fields["runtime"], "value", keys.BOOLEANS) == "true"
        if "dimension" in fields:
            declared = Dimension(choice(fields["dimension"], "dimension", keys.DIMENSIONS))
        node = fields["value"]
    return RawParameter(name, read_slot(node, "value", Dimension.NUMBER), runtime, declared, line)


def _check_names(parameter: RawParameter, above: list[str], every: list[str], joints: Mapping[str, int]) -> None:
    for name in parameter.slot.words:
        if name in above:
            continue
        if name == parameter.name:
            fail("its value names itself")
        if name in every:
            fail(f"'{name}' is below; a value may use only the parameters above it")
        if name in joints or name == OWN:
            fail(f"a parameter is constant and cannot follow joint variable '{name}'")
        fail(f"undefined name {quote(name)} {expected(name, above)}" if above else f"undefined name {quote(name)}")


def close_parameters(
    raw: tuple[RawParameter, ...], dimensions: Mapping[str, Dimension], *, degrees: bool
) -> tuple[Parameter, ...]:
    """Put earlier parameters into later ones and convert angles to radians.

    Args:
        raw: The parameters of the file.
        dimensions: What each measures.
        degrees: Whether the angles of the file count in degrees.
    """
    closed: dict[str, Parameter] = {}
    runtime = [parameter.name for parameter in raw if parameter.runtime]
    for parameter in raw:
        if parameter.runtime:
            accept_name("runtime parameter", parameter.name, parameter.line)
        with within(parameter.where, parameter.line):
            for name in parameter.slot.words:
                if name in runtime:
                    fail(f"it cannot depend on '{name}', which is set at run time; write the expression in the row")
            value = _closed(parameter, closed, dimensions, degrees=degrees)
            checked_value(value, {})
        closed[parameter.name] = Parameter(
            parameter.name, value, dimensions[parameter.name], parameter.runtime, parameter.line, parameter.slot.words
        )
    return tuple(closed.values())


def _closed(
    parameter: RawParameter, closed: Mapping[str, Parameter], dimensions: Mapping[str, Dimension], *, degrees: bool
) -> Expression:
    expression = parameter.slot.expression
    if degrees and dimensions[parameter.name] is Dimension.ANGLE:
        angles = frozenset(name for name in closed if dimensions[name] is Dimension.ANGLE)
        expression = radians(expression, angles)
    value = substitute(expression, {name: earlier.value for name, earlier in closed.items()})
    if size(value) > MAX_VALUE_SIZE or largest_number(value) >= 1 << MAX_VALUE_BITS:
        raise ExpressionError("the value is too long once earlier parameters are put in")
    return checked_depth(value)
