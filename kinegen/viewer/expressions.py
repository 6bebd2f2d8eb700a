"""Exact expressions as JSON, which the page evaluates: lists with an operation and its operands.

A number is itself; `["q", 2]` is the third joint variable, `["p", 0]` the first runtime parameter. The other operations
are `+`, `*`, `^` with a whole exponent, and the functions of the file by name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from kinegen.robot.expressions import (
    Atan2,
    Call,
    Expression,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    evaluate,
    names,
)
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot

Tree = Any
"""A number, or a list with an operation and its operands."""


class Trees:
    """Turns the expressions of a robot into JSON.

    Args:
        robot: The robot, whose constants become numbers.
    """

    def __init__(self, robot: Robot) -> None:
        runtime = robot.runtime_parameters
        self._places: dict[str, Tree] = {each.name: ["q", each.index] for each in robot.variables}
        self._places |= {each.name: ["p", index] for index, each in enumerate(runtime)}
        self._values: Mapping[str, float] = {
            each.name: float(evaluate(each.value, {}, FLOATS)) for each in robot.parameters if not each.runtime
        }

    def tree(self, expression: Expression | None) -> Tree:
        """One expression; what has a value that never changes becomes that number."""
        if expression is None:
            return None
        if not any(name in self._places for name in names(expression)):
            return float(evaluate(expression, self._values, FLOATS))
        match expression:
            case Name(name):
                return self._places[name]
            case Sum(parts):
                return ["+", *map(self.tree, parts)]
            case Product(parts):
                return ["*", *map(self.tree, parts)]
            case Power(base, exponent):
                return ["^", self.tree(base), exponent]
            case Call(function, argument):
                return [function, self.tree(argument)]
            case Atan2(y, x):
                return ["atan2", self.tree(y), self.tree(x)]
            case Number(value):
                return float(value)
            case Pi():
                return math.pi
