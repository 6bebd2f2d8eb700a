"""What can be told of the expressions of `actuators` by numbers: parts without a value, matrices without an inverse.

Nothing computed here goes into a robot; the exact expressions do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Context, Decimal, localcontext

from kinegen.robot.expressions import (
    Atan2,
    Call,
    Expression,
    ExpressionError,
    Power,
    Product,
    Sum,
    evaluate,
    names,
)
from kinegen.robot.floats import FLOATS
from kinegen.robot.values import MAX_VALUE, is_zero


def check_constants(expression: Expression, values: Mapping[str, Decimal]) -> None:
    """See that every part in which neither joint nor reading stands is a number of sensible size.

    Args:
        expression: Any expression.
        values: The values of the parameters.

    Raises:
        ExpressionError: If a part has no value or a huge one.
    """
    if any(name not in values for name in names(expression)):
        for part in _parts(expression):
            check_constants(part, values)
        return
    try:
        value = evaluate(expression, {name: float(value) for name, value in values.items()}, FLOATS)
    except ZeroDivisionError:
        raise ExpressionError("it divides by zero") from None
    except ValueError:
        raise ExpressionError("it holds a root, asin or acos of a number that has none") from None
    except OverflowError:
        value = math.inf
    if not abs(value) <= MAX_VALUE:
        raise ExpressionError(f"a value in it is too large (at most {MAX_VALUE:.0e})")


def _parts(expression: Expression) -> tuple[Expression, ...]:
    match expression:
        case Sum(parts) | Product(parts):
            return parts
        case Power(inner, _) | Call(_, inner):
            return (inner,)
        case Atan2(y, x):
            return (y, x)
    return ()


def is_singular(matrix: list[list[Decimal]]) -> bool:
    """Whether a square matrix has no inverse, by elimination with the largest pivot of each column."""
    with localcontext(Context(prec=50)):
        return _eliminates([list(row) for row in matrix])


def _eliminates(rows: list[list[Decimal]]) -> bool:
    """Whether elimination meets a column of zeros; `rows` is used up."""
    for column in range(len(rows)):
        pivot = max(range(column, len(rows)), key=lambda row: abs(rows[row][column]))
        if is_zero(rows[pivot][column]):
            return True
        rows[column], rows[pivot] = rows[pivot], rows[column]
        for row in range(column + 1, len(rows)):
            factor = rows[row][column] / rows[column][column]
            rows[row] = [entry - factor * above for entry, above in zip(rows[row], rows[column], strict=True)]
    return False
