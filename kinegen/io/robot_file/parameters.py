"""`parameters` -> raw parameters, what each measures, and their closed values in kernel units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from kinegen.errors import quote
from kinegen.io.messages import accept_name, expected, fail, refuse_twin, within
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.expression_fields import OWN, ExpressionField, read_slot
from kinegen.io.robot_file.tree import Mapping as MappingNode
from kinegen.io.robot_file.tree import Node, choice, mapping, named
from kinegen.model.expression_parser import (
    FUNCTIONS,
    PI,
    Atan2,
    Call,
    Expression,
    ExpressionError,
    Name,
    Power,
    Product,
    Sum,
    checked_depth,
    is_arc,
    largest_number,
    linear,
    names,
    parts_of,
    size,
    substitute,
)
from kinegen.model.expression_values import Dimension, checked_value, radians
from kinegen.model.robot import Parameter
from kinegen.support.dataclass import dataclass

MAX_VALUE_SIZE = 500
MAX_VALUE_BITS = 2000


@dataclass(frozen=True, slots=True)
class RawParameter:
    """A parameter as written; the dimension of its slot means nothing yet."""

    name: str
    slot: ExpressionField
    runtime: bool
    declared: Dimension | None
    line: int

    @property
    def where(self) -> str:
        """Return how messages name it."""
        return f"parameter '{self.name}'"


def read_parameters(node: Node | None, joints: Mapping[str, int]) -> tuple[RawParameter, ...]:
    """Read the parameters; `joints` has the line of each joint name, which no parameter may take."""
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
            refuse_twin(key.text, "parameter", read)
            read[key.text] = _read_parameter(key.text, value, key.line)
            # Its value may name what stands above; checked here, where the order is known.
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
    """Put earlier parameters into later ones and convert angles to radians."""
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
        raise ExpressionError("the value is too long after substitution of earlier parameters")
    return checked_depth(value)


def find_dimensions(
    parameters: tuple[RawParameter, ...],
    slots: Iterable[tuple[str, ExpressionField]],
    joints: frozenset[str],
    formulas: Iterable[tuple[str, ExpressionField]] = (),
) -> dict[str, Dimension]:
    """Find the dimension of every parameter, given or from its uses.

    A name in a product with a joint variable, or in a divisor, is a number; a name that is added in an angle slot is an
    angle, in a length slot a length. A product of several names is settled by those that are known from elsewhere.

    `slots` are those of rows and frames, each with the name of its row or frame; `formulas` are those of the
    actuators, in which joints and readings may stand in any way.

    Raises:
        RobotFileError: If a parameter is unused, or its uses contradict each other or what is declared.
    """
    uses = _Uses({parameter.name: parameter.declared for parameter in parameters})
    used: set[str] = set()
    for where, slot in slots:
        used.update(slot.words)
        with within(f"{where}: {slot.label}", slot.line):
            factors, offset = linear(slot.expression, joints | {OWN})
            for factor in factors.values():
                uses.note_all(factor, Dimension.NUMBER, slot.line)
            uses.visit(offset, slot.dimension, slot.line)
    for _, slot in formulas:
        used.update(slot.words)
        uses.visit_formula(slot.expression, slot.dimension, slot.line)
    uses.settle()
    # From the last to the first, since a value names earlier parameters only.
    found: dict[str, Dimension] = {}
    for parameter in reversed(parameters):
        with within(parameter.where, parameter.line):
            if parameter.name not in used:
                fail("it is not used; use it or remove it")
            found[parameter.name] = dimension = uses.decide(parameter.name)
            used.update(parameter.slot.words)
            uses.visit(parameter.slot.expression, dimension, parameter.slot.line)
            uses.settle()
    return found


_OPPOSITE = {Dimension.LENGTH: Dimension.ANGLE, Dimension.ANGLE: Dimension.LENGTH}
"""What a declared parameter may not be used as; a number may stand anywhere."""


class _Uses:
    """The uses of each parameter, gathered slot by slot."""

    def __init__(self, declared: Mapping[str, Dimension | None]) -> None:
        self._declared = declared
        self._lines: dict[str, dict[Dimension, int]] = {name: {} for name in declared}
        self._open: list[tuple[list[Expression], Dimension, int]] = []

    def note_all(self, expression: Expression, dimension: Dimension, line: int) -> None:
        """Note that every name in an expression is used in one way."""
        for name in names(expression):
            self._lines[name].setdefault(dimension, line)

    def visit(self, expression: Expression, dimension: Dimension, line: int) -> None:
        """Note the uses in a constant expression that stands where a dimension is wanted."""
        match expression:
            case Name():
                self.note_all(expression, dimension, line)
            case Sum(terms):
                for term in terms:
                    self.visit(term, dimension, line)
            case Product(factors):
                self._visit_product(factors, dimension, line)
            case Call() | Atan2() if is_arc(expression):
                self.note_all(expression, Dimension.NUMBER, line)
            case _:
                # A power or a root of an angle is no angle; that of a length may be one, as in sqrt(a*a + b*b).
                divisor = isinstance(expression, Power) and expression.exponent < 0
                keep = dimension is Dimension.LENGTH and not divisor
                self.note_all(expression, Dimension.LENGTH if keep else Dimension.NUMBER, line)

    def _visit_product(self, factors: tuple[Expression, ...], dimension: Dimension, line: int) -> None:
        named = [factor for factor in factors if names(factor)]
        divisors = [factor for factor in named if isinstance(factor, Power) and factor.exponent < 0]
        for divisor in divisors:
            self.note_all(divisor, Dimension.NUMBER, line)
        candidates = [factor for factor in named if factor not in divisors]
        turned = PI in factors or any(map(is_arc, factors))
        if dimension is Dimension.NUMBER or (dimension is Dimension.ANGLE and turned):
            for factor in candidates:
                self.note_all(factor, Dimension.NUMBER, line)
        elif len(candidates) == 1:
            self.visit(candidates[0], dimension, line)
        elif candidates:
            self._open.append((candidates, dimension, line))

    def visit_formula(self, expression: Expression, dimension: Dimension, line: int) -> None:
        """Note the uses in an expression in which other names than parameters, and functions of angles, may stand."""
        number = Dimension.NUMBER
        match expression:
            case Sum(parts):
                for part in parts:
                    self.visit_formula(part, dimension, line)
            case Product(parts) if moving := [part for part in parts if self._is_moving(part)]:
                for part in parts:
                    self.visit_formula(part, dimension if moving == [part] else number, line)
            case Call(function, argument) if function != "sqrt":
                self.visit_formula(argument, Dimension.ANGLE if function in ("sin", "cos") else number, line)
            case Atan2(y, x):
                self.visit_formula(y, number, line)
                self.visit_formula(x, number, line)
            case Power(inner, _) | Call(_, inner) if self._is_moving(inner):
                self.visit_formula(inner, dimension if dimension is Dimension.LENGTH else number, line)
            case Name(name) if name not in self._declared:
                pass
            case _:
                self.visit(expression, dimension, line)

    def _is_moving(self, expression: Expression) -> bool:
        """Tell whether something other than parameters, numbers and roots stands in an expression."""
        match expression:
            case Name(name):
                return name not in self._declared
            case Call(function, _) if function != "sqrt":
                return True
            case Atan2():
                return True
        return any(map(self._is_moving, parts_of(expression)))

    def settle(self) -> None:
        """Decide which factor of each product of several names has the dimension of the slot."""
        while self._open:
            candidates, dimension, line = self._open.pop(0)
            known = [frozenset[Dimension]().union(*map(self._known, names(factor))) for factor in candidates]
            fitting = [i for i, found in enumerate(known) if dimension in found]
            unknown = [i for i, found in enumerate(known) if not found]
            if not fitting and len(unknown) > 1 and dimension is Dimension.ANGLE:
                words = dict.fromkeys(f"'{name}'" for i in unknown for name in names(candidates[i]))
                fail(f"cannot decide which is the angle, {' or '.join(words)}; give the parameters a dimension", line)
            chosen = (fitting or unknown)[-1:]
            for i, factor in enumerate(candidates):
                if i in chosen:
                    self.visit(factor, dimension, line)
                elif i in unknown:
                    self.note_all(factor, Dimension.NUMBER, line)

    def _known(self, name: str) -> frozenset[Dimension]:
        declared = self._declared[name]
        return frozenset({declared} if declared is not None else self._lines[name])

    def decide(self, name: str) -> Dimension:
        """Return the dimension of one parameter, once every use of it is known."""
        lines, declared = self._lines[name], self._declared[name]
        if declared is not None:
            other = _OPPOSITE.get(declared)
            if other is not None and other in lines:
                fail(f"it is declared {_article(declared)}, but line {lines[other]} uses it as {_article(other)}")
            return declared
        others = [dimension for dimension in lines if dimension is not Dimension.ANGLE]
        if Dimension.ANGLE in lines and others:
            angle, another = (f"{_article(use)} on line {lines[use]}" for use in (Dimension.ANGLE, others[0]))
            fail(f"it is used as {angle} and as {another}; give it a dimension, as in {{value: ..., dimension: angle}}")
        for dimension in (Dimension.ANGLE, Dimension.LENGTH):
            if dimension in lines:
                return dimension
        return Dimension.NUMBER


def _article(dimension: Dimension) -> str:
    return f"an {dimension}" if dimension is Dimension.ANGLE else f"a {dimension}"
