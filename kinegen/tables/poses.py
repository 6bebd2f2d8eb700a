"""Fixed transforms as a rotation in numbers and a shift in linear forms of lengths.

The rotation has 150 digits. A shift keeps the terms of the table, `d4` or `D4/sqrt(3)`, each with a factor that is a
number, so that names survive, and runtime lengths stay what they are.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from kinegen.robot.expressions import Expression, Pi, is_arc, multiply, names
from kinegen.robot.model import Step
from kinegen.tables.numbers import ARITHMETIC, MP, Found, identified, is_small, settled, value_of
from kinegen.tables.steps import terms, total

Form = dict[Expression, Any]
"""Terms of lengths with factors of 150 digits."""

Matrix = tuple[tuple[Any, Any, Any], tuple[Any, Any, Any], tuple[Any, Any, Any]]


class NotNumeric(Exception):  # noqa: N818 - not an error: another way is taken
    """An angle or a decision depends on a runtime parameter."""


@dataclass(frozen=True, slots=True)
class Values:
    """The values of the parameters, and which of them are set at run time."""

    values: tuple[tuple[str, Any], ...]
    runtime: frozenset[str]

    def angle(self, expression: Expression) -> Any:
        """An angle as a number."""
        if self.runtime.intersection(names(expression)):
            raise NotNumeric
        return value_of(expression, dict(self.values))

    def length(self, form: Form) -> Any:
        """The value of a linear form."""
        return sum((factor * value_of(term, dict(self.values)) for term, factor in form.items()), MP.mpf(0))

    def is_zero(self, form: Form) -> bool:
        """Whether a linear form is zero, whatever the runtime parameters."""
        if all(is_small(factor) for factor in form.values()):
            return True
        return not self.varies(form) and is_small(self.length(form))

    def varies(self, form: Form) -> bool:
        """Whether a linear form depends on a runtime parameter."""
        used = (term for term, factor in form.items() if not is_small(factor))
        return any(self.runtime.intersection(names(term)) for term in used)


@dataclass(frozen=True, slots=True)
class Pose:
    """A fixed transform; `algebraic` says whether its numbers can be roots of fractions."""

    rotation: Matrix
    shift: tuple[Form, Form, Form]
    algebraic: bool


IDENTITY = Pose(
    tuple(tuple(MP.mpf(int(i == j)) for j in range(3)) for i in range(3)),  # type: ignore[arg-type]
    ({}, {}, {}),
    algebraic=True,
)


def pose_of(steps: Iterable[Step], values: Values, start: Pose = IDENTITY) -> Pose:
    """Multiply elementary transforms.

    Args:
        steps: From left to right, without joint variables.
        values: The parameters.
        start: What stands before them.

    Raises:
        NotNumeric: If an angle depends on a runtime parameter.
    """
    columns = [[start.rotation[i][j] for i in range(3)] for j in range(3)]
    shift: list[Form] = [dict(form) for form in start.shift]
    algebraic = start.algebraic
    for step in steps:
        axis = step.kind.axis
        if not step.kind.is_rotation:
            for place in range(3):
                for term, factor in terms(step.value).items():
                    moved = columns[axis][place] * ARITHMETIC.number(factor)
                    shift[place][term] = settled_sum(shift[place].get(term, MP.mpf(0)), moved)
            continue
        angle = values.angle(step.value)
        algebraic = algebraic and all(_is_special(term) for term in terms(step.value))
        cosine, sine = settled(MP.cos(angle)), settled(MP.sin(angle))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        first, second = columns[i], columns[j]
        columns[i] = [settled(cosine * a + sine * b) for a, b in zip(first, second, strict=True)]
        columns[j] = [settled(cosine * b - sine * a) for a, b in zip(first, second, strict=True)]
    rows = tuple(tuple(columns[j][i] for j in range(3)) for i in range(3))
    return Pose(rows, (shift[0], shift[1], shift[2]), algebraic)  # type: ignore[arg-type]


def _is_special(term: Expression) -> bool:
    """Whether the sine of an angle can be a root: shares of pi and arcs, not plain radians."""
    return isinstance(term, Pi) or is_arc(term)


def settled_sum(left: Any, right: Any) -> Any:
    """A sum that is zero where it cancels."""
    value = left + right
    return MP.mpf(0) if is_small(value) else value


def scaled(factor: Any, form: Form) -> Form:
    """A multiple of a linear form."""
    return {term: factor * value for term, value in form.items()}


def combined(*forms: Form) -> Form:
    """The sum of linear forms."""
    found: Form = {}
    for form in forms:
        for term, factor in form.items():
            found[term] = settled_sum(found.get(term, MP.mpf(0)), factor)
    return found


def expression_of(form: Form, *, algebraic: bool) -> Found:
    """A linear form as an expression, and whether all its factors are exact."""
    parts = []
    exact = True
    for term, factor in form.items():
        if is_small(factor):
            continue
        found = identified(factor, algebraic=algebraic)
        exact = exact and found.exact
        parts.append(multiply(found.expression, term))
    return Found(total(*parts), exact)
