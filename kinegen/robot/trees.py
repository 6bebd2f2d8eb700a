"""What can be asked of the tree of an exact expression, and what can be replaced in it.

Import these names from `expressions`.
"""

from __future__ import annotations

from collections.abc import Mapping

from kinegen.robot.algebra import (
    ARCS,
    ONE,
    PI,
    ZERO,
    Atan2,
    Call,
    Expression,
    ExpressionError,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    add,
    arc_tangent,
    call,
    multiply,
    power,
)


def is_arc(expression: Expression) -> bool:
    """Whether an expression is one of the functions that give an angle."""
    return isinstance(expression, Atan2) or (isinstance(expression, Call) and expression.function in ARCS)


def arcs(expression: Expression) -> tuple[Expression, ...]:
    """The outermost functions that give an angle, in order of appearance, each once."""
    if is_arc(expression):
        return (expression,)
    match expression:
        case Sum(parts) | Product(parts):
            return tuple(dict.fromkeys(arc for part in parts for arc in arcs(part)))
        case Power(inner, _) | Call(_, inner):
            return arcs(inner)
        case _:
            return ()


def roots(expression: Expression) -> tuple[Expression, ...]:
    """What stands under each square root, those within others too."""
    match expression:
        case Call("sqrt", inner):
            return (inner, *roots(inner))
        case Sum(parts) | Product(parts):
            return tuple(root for part in parts for root in roots(part))
        case Power(inner, _) | Call(_, inner):
            return roots(inner)
        case Atan2(y, x):
            return (*roots(y), *roots(x))
        case _:
            return ()


def without_arcs(expression: Expression) -> tuple[Expression, dict[str, Expression]]:
    """Put names in place of the outermost arcs.

    Returns:
        The expression, and the arc of each name; no file can spell such a name.
    """
    found = {arc: f"arc {place}" for place, arc in enumerate(arcs(expression))}

    def hidden(part: Expression) -> Expression:
        if part in found:
            return Name(found[part])
        match part:
            case Sum(parts):
                return add(*map(hidden, parts))
            case Product(parts):
                return multiply(*map(hidden, parts))
            case Power(base, exponent):
                return power(hidden(base), exponent)
            case Call(function, argument):
                return call(function, hidden(argument))
        return part

    return hidden(expression), {name: arc for arc, name in found.items()}


def names(expression: Expression) -> tuple[str, ...]:
    """The names in an expression, in order of appearance, each once."""
    found: dict[str, None] = {}
    _gather(expression, found)
    return tuple(found)


def _gather(expression: Expression, found: dict[str, None]) -> None:
    match expression:
        case Name(name):
            found[name] = None
        case Sum(parts) | Product(parts):
            for part in parts:
                _gather(part, found)
        case Power(inner, _) | Call(_, inner):
            _gather(inner, found)
        case Atan2(y, x):
            _gather(y, found)
            _gather(x, found)
        case _:
            pass


def largest_number(expression: Expression) -> int:
    """The largest numerator or denominator, without its sign, that an expression holds."""
    match expression:
        case Number(value):
            return max(abs(value.numerator), value.denominator)
        case Sum(parts) | Product(parts):
            return max(largest_number(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return largest_number(inner)
        case Atan2(y, x):
            return max(largest_number(y), largest_number(x))
        case _:
            return 1


def size(expression: Expression) -> int:
    """The number of nodes of an expression."""
    match expression:
        case Sum(parts) | Product(parts):
            return 1 + sum(size(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return 1 + size(inner)
        case Atan2(y, x):
            return 1 + size(y) + size(x)
        case _:
            return 1


def depth(expression: Expression) -> int:
    """The number of levels of an expression."""
    match expression:
        case Sum(parts) | Product(parts):
            return 1 + max(depth(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return 1 + depth(inner)
        case Atan2(y, x):
            return 1 + max(depth(y), depth(x))
        case _:
            return 1


def substitute(expression: Expression, values: Mapping[str, Expression], pi: Expression = PI) -> Expression:
    """Replace names, and `pi` where another value is given, keeping everything exact."""
    match expression:
        case Name(name):
            return values.get(name, expression)
        case Pi():
            return pi
        case Sum(parts):
            return add(*(substitute(part, values, pi) for part in parts))
        case Product(parts):
            return multiply(*(substitute(part, values, pi) for part in parts))
        case Power(base, exponent):
            return power(substitute(base, values, pi), exponent)
        case Call(function, argument):
            return call(function, substitute(argument, values, pi))
        case Atan2(y, x):
            return arc_tangent(substitute(y, values, pi), substitute(x, values, pi))
        case _:
            return expression


def linear(expression: Expression, variables: frozenset[str]) -> tuple[dict[str, Expression], Expression]:
    """Split an expression into the coefficients of some variables and the rest.

    Args:
        expression: The tree.
        variables: Names that may stand in it linearly only.

    Returns:
        The coefficient of each variable that occurs, in order of appearance, and the remaining offset.

    Raises:
        ExpressionError: If a variable stands in a product with another, under a power or in a function.
    """
    match expression:
        case Name(name) if name in variables:
            return {name: ONE}, ZERO
        case Sum(parts):
            halves = [linear(part, variables) for part in parts]
            found: dict[str, list[Expression]] = {}
            for coefficients, _ in halves:
                for name, coefficient in coefficients.items():
                    found.setdefault(name, []).append(coefficient)
            return {name: add(*values) for name, values in found.items()}, add(*(rest for _, rest in halves))
        case Product(parts):
            return _linear_product(parts, variables)
        case _:
            inside = [name for name in names(expression) if name in variables]
            if inside:
                raise ExpressionError(f"joint variable '{inside[0]}' must be linear, as in '2*{inside[0]} + 1'")
            return {}, expression


def _linear_product(
    parts: tuple[Expression, ...], variables: frozenset[str]
) -> tuple[dict[str, Expression], Expression]:
    moving = [part for part in parts if variables.intersection(names(part))]
    fixed = multiply(*(part for part in parts if part not in moving), ONE)
    if not moving:
        return {}, fixed
    if len(moving) > 1:
        raise ExpressionError("a product of two joint variables is not linear")
    coefficients, offset = linear(moving[0], variables)
    return {name: multiply(fixed, value) for name, value in coefficients.items()}, multiply(fixed, offset)
