"""The search for fewer operations: what is shared, taken out, multiplied out, and never lost."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from kinegen.ir.common_subexpressions import Rewriting
from kinegen.ir.polynomials import polynomials_of
from kinegen.ir.program import Constant, Count, Operator, Variable
from kinegen.ir.sign_propagation import propagate_signs
from kinegen.ir.value_numbering import Node, SinOrCos, Value, ValueTable, count_of


class Algebra:
    """Values written as formulas."""

    def __init__(self, inputs: int) -> None:
        self.values = ValueTable()
        self.inputs: list[Value] = [(1, self.values.variable(index)) for index in range(inputs)]

    def number(self, value: Fraction | int) -> Value:
        """A constant."""
        return self.values.constant(Fraction(value))

    def times(self, *factors: Value) -> Value:
        """A product."""
        return self.values.product(factors)

    def plus(self, *terms: Value) -> Value:
        """A sum."""
        return self.values.total(terms)

    def minus(self, left: Value, right: Value) -> Value:
        """A difference."""
        return self.values.total([left, (-right[0], right[1])])

    def sine(self, angle: Value) -> Value:
        """A sine, with the sign of its angle."""
        return angle[0], self.values.apply(SinOrCos.SIN, angle[1])

    def cosine(self, angle: Value) -> Value:
        """A cosine."""
        return 1, self.values.apply(SinOrCos.COS, angle[1])


def searched(algebra: Algebra, *outputs: Value) -> tuple[ValueTable, list[Value]]:
    rewriting = Rewriting.of(algebra.values, outputs)
    assert rewriting
    return rewriting.searched().values()


def counted(values: ValueTable, outputs: list[Value]) -> Count:
    return count_of(*propagate_signs(values, outputs))


def evaluated(values: ValueTable, outputs: list[Value], inputs: list[float]) -> list[float]:
    """The outputs, operation by operation."""
    found: list[float] = []
    for node in values.nodes:
        if isinstance(node, Variable):
            found.append(inputs[node.index])
        elif isinstance(node, Constant):
            found.append(float(node.value))
        else:
            assert isinstance(node, Node)
            operands = [found[operand] for operand in node.operands]
            found.append(
                {
                    Operator.ADD: lambda a, b: a + b,
                    Operator.SUB: lambda a, b: a - b,
                    Operator.MUL: lambda a, b: a * b,
                    Operator.NEG: lambda a: -a,
                    SinOrCos.SIN: math.sin,
                    SinOrCos.COS: math.cos,
                }[node.operator](*operands)
            )
    return [sign * found[number] for sign, number in outputs]


def assert_same(algebra: Algebra, outputs: list[Value], inputs: list[float]) -> Count:
    """The search keeps what the outputs are; its count."""
    values, found = searched(algebra, *outputs)
    assert evaluated(values, found, inputs) == pytest.approx(
        evaluated(algebra.values, outputs, inputs), rel=1e-14, abs=1e-14
    )
    return counted(values, found)


def test_a_factor_of_two_terms_is_taken_out() -> None:
    a = Algebra(3)
    x, y, z = a.inputs

    count = assert_same(a, [a.plus(a.times(x, z), a.times(y, z))], [0.3, 1.7, -2.5])

    assert (count.multiplications, count.additions) == (1, 1)


def test_constants_of_one_value_become_one() -> None:
    """Two lengths on both sides of a slide."""
    a = Algebra(2)
    x, y = a.inputs
    near, far = a.times(x, a.number(Fraction(1, 5))), a.times(x, a.number(Fraction(3, 10)))

    count = assert_same(a, [a.plus(a.plus(near, y), far)], [0.3, 1.7])

    assert (count.multiplications, count.additions) == (1, 1)


def test_a_constant_of_several_terms_is_taken_out() -> None:
    a = Algebra(2)
    x, y = a.inputs
    half = a.number(Fraction(1, 3))

    count = assert_same(a, [a.minus(a.times(x, half), a.times(y, half))], [0.3, 1.7])

    assert (count.multiplications, count.additions) == (1, 1)


def test_constants_meet_across_signs_and_sums() -> None:
    a = Algebra(1)
    inner = a.plus(a.inputs[0], a.number(Fraction(3, 10)))

    count = assert_same(a, [a.minus(a.number(Fraction(5, 2)), inner)], [0.3])

    assert (count.multiplications, count.additions) == (0, 1)


def test_a_rotation_of_three_angles_takes_twelve_multiplications() -> None:
    a = Algebra(3)
    (c1, c2, c3), (s1, s2, s3) = map(a.cosine, a.inputs), map(a.sine, a.inputs)
    x, y = a.times(c2, c3), a.times(c2, s3)
    outputs = [
        a.minus(a.times(c1, x), a.times(s1, s3)),
        a.plus(a.times(s1, x), a.times(c1, s3)),
        a.times((-s2[0], s2[1]), c3),
        a.minus(a.times((-1, c1[1]), y), a.times(s1, c3)),
        a.minus(a.times(c1, c3), a.times(s1, y)),
        a.times(s2, s3),
        a.times(c1, s2),
        a.times(s1, s2),
        c2,
    ]
    as_written = counted(a.values, outputs)

    count = assert_same(a, outputs, [0.3, 1.7, -2.5])

    assert as_written.multiplications == 14
    assert (count.multiplications, count.additions) == (12, 4)


def test_a_sum_and_its_negative_are_one() -> None:
    """An angle of antiparallel axes is summed up once, and has one sine and one cosine."""
    a = Algebra(3)
    x, y, z = a.inputs
    forwards, backwards = a.plus(a.minus(x, y), z), a.minus(a.minus(y, z), x)

    count = assert_same(a, [a.sine(forwards), a.sine(backwards), a.cosine(backwards)], [0.3, 1.7, -2.5])

    assert (count.additions, count.sine_cosines) == (2, 1)


@pytest.mark.parametrize(("first", "second"), [(1, 2), (1, 3), (2, 3), (Fraction(1, 2), 1), (-1, 2)])
def test_multiples_of_an_angle_share_a_sine_and_cosine(first: Fraction | int, second: Fraction | int) -> None:
    a = Algebra(1)
    angles = [a.times(a.inputs[0], a.number(size)) for size in (first, second)]
    outputs = [half(angle) for angle in angles for half in (a.sine, a.cosine)]

    for angle in (0.0, 0.3, -1.2, math.pi / 2, 3.0):
        assert assert_same(a, outputs, [angle]).sine_cosines == 1


def test_angles_with_constants_are_no_multiples() -> None:
    a = Algebra(1)
    x = a.inputs[0]
    outputs = [a.sine(x), a.sine(a.plus(x, x, a.number(Fraction(1, 7))))]

    assert assert_same(a, outputs, [0.3]).sine_cosines == 2


def test_what_cancels_vanishes() -> None:
    a = Algebra(2)
    x, y = a.inputs

    count = assert_same(a, [a.minus(a.plus(x, y), x), a.minus(y, y)], [0.3, 1.7])

    assert (count.multiplications, count.additions) == (0, 0)


def test_a_program_of_two_number_types_is_left_alone() -> None:
    a = Algebra(1)
    tolerance = a.values.constant(Fraction(1, 10**9), Fraction(1, 10**4))

    assert Rewriting.of(a.values, [a.times(a.inputs[0], tolerance)]) is None


def test_a_sum_that_several_read_stays_an_atom() -> None:
    a = Algebra(4)
    x, y, z, u = a.inputs
    shared = a.times(a.plus(a.times(x, y), z), u)
    polynomials = polynomials_of(a.values, [a.plus(shared, x), a.plus(shared, y)])

    assert [len(each) for each in polynomials.sums.values()] == [2, 2, 2]
