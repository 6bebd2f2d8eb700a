"""From exact expressions to numbered values, and the count of a plain product of link matrices.

In: definitions and entries as sympy expressions. Out: values with numbers, so that equal operations are one whatever
their sign or the order of their operands; terms and factors are ordered by first use, never by sympy's own ordering or
by hashes. This is the last module that imports sympy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from fractions import Fraction

import sympy as sp

from kinegen.derive.expressions import IN_SINGLE, Candidate, exact_number, joint_symbols, parameter_symbols
from kinegen.derive.pose import product
from kinegen.derive.transforms import links_between, symbols
from kinegen.errors import KinegenError
from kinegen.ir.program import Count, Operator
from kinegen.ir.sign_propagation import propagate_signs
from kinegen.ir.value_numbering import SinOrCos, Value, ValueTable, count_of
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass


@dataclass(slots=True)
class Lowering:
    """Numbers the values of expressions.

    `known`: the values that symbols stand for.
    """

    parameters: tuple[str, ...]
    values: ValueTable = field(default_factory=ValueTable)
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

    def outputs(self, way: Candidate) -> list[Value]:
        """Return the numbered entries of one way to compute a quantity; sines and cosines come first."""
        self.number_angles((*(expression for _, expression in way.definitions), *way.entries))
        for symbol, expression in way.definitions:
            self.known[symbol] = self.value(expression)
        return [self.value(entry) for entry in way.entries]

    def value(self, expression: sp.Expr) -> Value:
        """Return the numbered value of an expression, with its sign."""
        # Leaves and constants first: they are the most frequent.
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
        # The sine is odd and the cosine even, so both are taken of the angle without its sign.
        if isinstance(expression, sp.sin):
            sign, angle = self.value(expression.args[0])
            return sign, self.values.apply(SinOrCos.SIN, angle)
        if isinstance(expression, sp.cos):
            return 1, self.values.apply(SinOrCos.COS, self.value(expression.args[0])[1])
        if isinstance(expression, sp.atan2):
            return self._arc_tangent(*expression.args)
        if isinstance(expression, sp.atan):
            return self._arc_tangent(expression.args[0], sp.S.One)
        if isinstance(expression, sp.Piecewise):
            return self._selection(expression)
        # A selection by sign; the sign of the argument itself does not matter.
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
        """Return the place of an angle among others: by its joint variables and what they are multiplied by."""
        terms = (term.as_coeff_Mul() for term in sp.Add.make_args(angle))
        return sorted((max(self._rank(core)), str(coefficient)) for coefficient, core in terms)

    def _rank(self, expression: sp.Expr) -> tuple[int, ...]:
        """Return the place of a term or factor among others: by the values in it, whatever sympy's own order is."""
        if self._is_constant(expression):
            return (-1,)
        if expression.is_Symbol:
            return (self.known[expression][1],)
        if isinstance(expression, (sp.sin, sp.cos)):
            angle = self.value(expression.args[0])[1]
            return (self.values.apply(SinOrCos.SIN if isinstance(expression, sp.sin) else SinOrCos.COS, angle),)
        return tuple(sorted(number for argument in expression.args for number in self._rank(argument)))

    def _product(self, expression: sp.Mul) -> Value:
        """Constant factors are one constant, so that exact numbers are rounded once."""
        moving = [factor for factor in expression.args if not self._is_constant(factor)]
        factors = [self.value(factor) for factor in sorted(moving, key=self._rank)]
        if len(moving) < len(expression.args):
            factors.append(self._number(sp.Mul(*filter(self._is_constant, expression.args))))
        return self.values.product(factors)

    def _is_constant(self, expression: sp.Basic) -> bool:
        """Tell whether no variable and no parameter is in an expression; sympy would look through it each time."""
        if (known := self._constants.get(expression)) is None:
            is_leaf = expression.is_Symbol and expression != IN_SINGLE
            known = self._constants[expression] = not is_leaf and all(map(self._is_constant, expression.args))
        return known

    def _number(self, expression: sp.Expr) -> Value:
        """Return a constant, of each number type its own."""
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


def plain_count(robot: Robot) -> Count:
    """Count the pose of every tip as a product of link matrices, as one gets it without folding.

    Returns the operations of a program with twelve outputs for each tip, in which equal operations are one.
    """
    names = symbols(robot, keep_parameters=False)
    lowering = Lowering.of(joint_symbols(robot, names), parameter_symbols(robot, names))
    values = lowering.values
    zero, one = (values.constant(Fraction(number)) for number in (0, 1))
    outputs: list[Value] = []
    for tip in robot.tips:
        whole = [[one, zero, zero, zero], [zero, one, zero, zero], [zero, zero, one, zero]]
        for link in links_between(robot, robot.root, tip, names):
            rows = product(link).tolist()[:3]
            lowering.number_angles(entry for row in rows for entry in row)
            right = [[lowering.value(entry) for entry in row] for row in rows]
            # The lowest row of every matrix is (0, 0, 0, 1).
            whole = [
                [
                    values.total([values.product([row[k], right[k][j]]) for k in range(3)] + row[3:] * (j == 3))
                    for j in range(4)
                ]
                for row in whole
            ]
        outputs += [entry for row in whole for entry in row]
    return count_of(*propagate_signs(values, outputs))
