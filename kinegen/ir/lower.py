"""From exact expressions to a program: sharing, order and floats are decided here, once.

In: definitions and entries as sympy expressions. Out: a `Program`. Values are numbered, so equal operations are one
statement whatever their sign or the order of their operands; terms and factors are ordered by first use, never by
sympy's own ordering or by hashes. This is the last module that imports sympy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache

import sympy as sp

from kinegen.errors import KinegenError
from kinegen.ir.names import name_values
from kinegen.ir.program import Count, Operator, Program, counted
from kinegen.ir.signs import absorb_signs, live_values
from kinegen.ir.values import Half, Node, Value, Values
from kinegen.outputs import Quantity, Signature
from kinegen.robot.expressions import evaluate
from kinegen.robot.model import Robot
from kinegen.symbolic.derive import derive
from kinegen.symbolic.exact_numbers import exact_number
from kinegen.symbolic.expressions import IN_SINGLE, Expressions
from kinegen.symbolic.transforms import EXACT


@lru_cache(maxsize=256)
def lower(expressions: Expressions) -> Program:
    """Lower one kinematic quantity to straight-line code.

    Args:
        expressions: Definitions and entries, exact.

    Returns:
        The program; sines and cosines come first.

    Raises:
        KinegenError: If an expression needs an operation that a kernel does not have.
    """
    lowering = Lowering.of(expressions.variables, expressions.parameters)
    lowering.number_angles((*(expression for _, expression in expressions.definitions), *expressions.entries))
    for symbol, expression in expressions.definitions:
        lowering.known[symbol] = lowering.value(expression)
    return lowering.program([lowering.value(entry) for entry in expressions.entries], expressions.signature)


@lru_cache(maxsize=256)
def program_of(robot: Robot, quantity: Quantity) -> Program:
    """The program of one quantity of a robot, as a build derives and lowers it.

    Args:
        robot: The robot.
        quantity: The quantity.

    Raises:
        KinegenError: If the robot does not have it, or a kernel cannot evaluate it.
    """
    return lower(derive(robot, quantity))


def runtime_defaults(robot: Robot) -> tuple[Fraction, ...]:
    """The file's values of the runtime parameters, in their order, in kernel units."""
    return tuple(exact_number(evaluate(parameter.value, {}, EXACT)) for parameter in robot.runtime_parameters)


@dataclass(slots=True)
class Lowering:
    """Numbers the values of expressions.

    Attributes:
        parameters: Names of the runtime parameters.
        values: The values so far.
        known: The values that symbols stand for.
    """

    parameters: tuple[str, ...]
    values: Values = field(default_factory=Values)
    known: dict[sp.Symbol, Value] = field(default_factory=dict)
    _constants: dict[sp.Basic, bool] = field(default_factory=dict)

    @classmethod
    def of(cls, variables: Sequence[sp.Symbol], parameters: Sequence[sp.Symbol]) -> Lowering:
        """Begin with the symbols of the inputs and of the runtime parameters."""
        lowering = cls(tuple(parameter.name for parameter in parameters))
        for index, variable in enumerate(variables):
            lowering.known[variable] = (1, lowering.values.variable(index))
        for parameter in parameters:
            lowering.known[parameter] = (1, lowering.values.parameter(parameter.name))
        return lowering

    def program(self, outputs: Sequence[Value], signature: Signature) -> Program:
        """The program of some values: order, signs and names are decided here."""
        values, numbers = absorb_signs(self.values, outputs)
        return name_values(values, numbers, signature=signature, parameters=self.parameters)

    def count(self, outputs: Sequence[Value]) -> Count:
        """The operations of that program, of which nothing is ordered or named."""
        values, numbers = absorb_signs(self.values, outputs)
        operators: list[Operator] = []
        angles = set()
        for number in live_values(values, numbers):
            match values.nodes[number]:
                case Node(Half(), (angle,)):
                    angles.add(angle)
                case Node(Operator() as operator):
                    operators.append(operator)
        return counted([*operators, *[Operator.SINCOS] * len(angles)])

    def value(self, expression: sp.Expr) -> Value:
        """The numbered value of an expression, with its sign."""
        if expression.is_Symbol and expression != IN_SINGLE:
            return self.known[expression]
        if self._is_constant(expression):
            return self._number(expression)
        if isinstance(expression, sp.Add):
            return self.values.total([self.value(term) for term in sorted(expression.args, key=self._rank)])
        if isinstance(expression, sp.Mul):
            return self._product(expression)
        if isinstance(expression, sp.Pow) and expression.exp.is_Rational and expression.exp.q <= 2:
            return self._power(expression)
        if isinstance(expression, sp.sin):
            sign, angle = self.value(expression.args[0])
            return sign, self.values.apply(Half.SIN, angle)
        if isinstance(expression, sp.cos):
            return 1, self.values.apply(Half.COS, self.value(expression.args[0])[1])
        if isinstance(expression, sp.atan2):
            return self._arc_tangent(*expression.args)
        if isinstance(expression, sp.atan):
            return self._arc_tangent(expression.args[0], sp.S.One)
        if isinstance(expression, sp.Piecewise):
            return self._selection(expression)
        if isinstance(expression, sp.Abs):
            number = self.value(expression.args[0])[1]
            return self.values.select((1, number), self.values.constant(Fraction(0)), (-1, number), (1, number))
        raise KinegenError(
            f"a kernel cannot evaluate '{expression}': it has + - * /, powers, sin, cos, sqrt, atan2 and selections"
        )

    def number_angles(self, expressions: Iterable[sp.Expr]) -> None:
        """Number all sines and cosines, by the joints in their angles, before anything is made of them."""
        found = {atom for expression in expressions for atom in expression.atoms(sp.sin, sp.cos) if atom.free_symbols}
        found = {atom for atom in found if atom.free_symbols <= self.known.keys()}  # the others come with definitions
        for atom in sorted(found, key=lambda atom: (self._angle_rank(atom.args[0]), isinstance(atom, sp.cos))):
            self.value(atom)

    def _angle_rank(self, angle: sp.Expr) -> list[tuple[int, str]]:
        """The place of an angle among others: by its joint variables and what they are multiplied by."""
        terms = (term.as_coeff_Mul() for term in sp.Add.make_args(angle))
        return sorted((max(self._rank(core)), str(coefficient)) for coefficient, core in terms)

    def _rank(self, expression: sp.Expr) -> tuple[int, ...]:
        """The place of a term or factor among others: by the values in it, whatever sympy's own order is."""
        if self._is_constant(expression):
            return (-1,)
        if expression.is_Symbol:
            return (self.known[expression][1],)
        if isinstance(expression, (sp.sin, sp.cos)):
            angle = self.value(expression.args[0])[1]
            return (self.values.apply(Half.SIN if isinstance(expression, sp.sin) else Half.COS, angle),)
        return tuple(sorted(number for argument in expression.args for number in self._rank(argument)))

    def _product(self, expression: sp.Mul) -> Value:
        """Constant factors are one constant, so that exact numbers are rounded once."""
        moving = [factor for factor in expression.args if not self._is_constant(factor)]
        factors = [self.value(factor) for factor in sorted(moving, key=self._rank)]
        if len(moving) < len(expression.args):
            factors.append(self._number(sp.Mul(*filter(self._is_constant, expression.args))))
        return self.values.product(factors)

    def _is_constant(self, expression: sp.Basic) -> bool:
        """Whether no variable and no parameter is in an expression; sympy would look through all of it each time."""
        if (known := self._constants.get(expression)) is None:
            is_leaf = expression.is_Symbol and expression != IN_SINGLE
            known = self._constants[expression] = not is_leaf and all(map(self._is_constant, expression.args))
        return known

    def _number(self, expression: sp.Expr) -> Value:
        """A constant, of each number type its own."""
        if not expression.has_xfree({IN_SINGLE}):
            return self.values.constant(exact_number(expression))
        return self.values.constant(*(exact_number(expression.subs(IN_SINGLE, kind)) for kind in (0, 1)))

    def _power(self, expression: sp.Pow) -> Value:
        base, exponent = self.value(expression.base), Fraction(int(expression.exp.p), int(expression.exp.q))
        whole, half = divmod(abs(exponent), 1)
        factors = [base] * int(whole)
        if half:
            factors.append((1, self.values.apply(Operator.SQRT, self.values.signed(base))))
        raised = self.values.product(factors)
        return raised if exponent > 0 else self.values.quotient((1, self.values.constant(Fraction(1))[1]), raised)

    def _arc_tangent(self, y: sp.Expr, x: sp.Expr) -> Value:
        """Not an odd function of y: on the negative x axis it is pi."""
        return 1, self.values.apply(Operator.ATAN2, *(self.values.signed(self.value(part)) for part in (y, x)))

    def _selection(self, expression: sp.Piecewise) -> Value:
        (less, condition), (other, otherwise) = expression.args if len(expression.args) == 2 else ((None, None),) * 2
        if otherwise != sp.true or not isinstance(condition, (sp.StrictLessThan, sp.StrictGreaterThan)):
            raise KinegenError(f"a kernel cannot evaluate '{expression}': selections are (x, a < b), (y, True)")
        return self.values.select(*(self.value(part) for part in (condition.lts, condition.gts, less, other)))
