"""The analysis on programs made up for it: no arithmetic, however unlucky, gets past a bound."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.rows import arm
from kinegen.backends.accuracy import NUMBER_TYPES, fraction_box
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import loads
from kinegen.ir.error_analysis import Ranges, bound
from kinegen.ir.error_analysis.bound import _beyond, _exact_norms
from kinegen.ir.error_analysis.directed_rounding import UPWARDS, largest_cosine, largest_sine, lower, norm, upper
from kinegen.ir.error_analysis.value_graph import all_rows, graph_of, turns
from kinegen.ir.lower import program_of
from kinegen.ir.program import (
    Constant,
    Operand,
    Operator,
    Program,
    RuntimeParameter,
    Statement,
    Temporary,
    Variable,
)
from kinegen.model.outputs import Quantity
from tests.bounds.arithmetic import Adversary, run
from tests.signatures import positions

ZERO = Constant(Fraction(0))
DOF = 3
HALVES = ((Fraction(-1, 2), Fraction(1, 2)),) * DOF
FLOAT = NUMBER_TYPES[ScalarType.FLOAT]
BINARY = (Operator.ADD, Operator.SUB, Operator.MUL)


@dataclass
class Writer:
    """Writes a program, one statement after the other."""

    statements: list[Statement] = field(default_factory=list)
    pairs: dict[Operand, tuple[Temporary, Temporary]] = field(default_factory=dict)

    def add(self, operator: Operator, *operands: Operand) -> Temporary:
        """One more statement."""
        name = Temporary(f"v{len(self.statements)}")
        self.statements.append(Statement((name.name,), operator, operands))
        return name

    def pair(self, angle: Operand) -> tuple[Temporary, Temporary]:
        """The sine and the cosine of an angle; there is one statement for both."""
        if angle not in self.pairs:
            number = len(self.statements)
            self.pairs[angle] = Temporary(f"s{number}"), Temporary(f"c{number}")
            results = tuple(half.name for half in self.pairs[angle])
            self.statements.append(Statement(results, Operator.SINCOS, (angle,)))
        return self.pairs[angle]

    def turn(self, angle: Operand, x: Operand, y: Operand, operators: Sequence[Operator]) -> tuple[Operand, Operand]:
        """`(c x ? s y, s x ? c y)`, which is a rotation only if the two operators differ."""
        s, c = self.pair(angle)
        products = [self.add(Operator.MUL, f, v) for f, v in ((c, x), (s, y), (s, x), (c, y))]
        return self.add(operators[0], *products[:2]), self.add(operators[1], *products[2:])

    def program(self, *results: Operand) -> Program:
        """The program; what nobody uses becomes a result too."""
        used = {operand for statement in self.statements for operand in statement.operands}
        unused = [Temporary(name) for statement in self.statements for name in statement.results]
        outputs = [*results, *(one for one in unused if one not in used and one not in results)]
        outputs += [ZERO] * (-len(outputs) % 3)
        frames = tuple(f"frame{index}" for index in range(len(outputs) // 3))
        return Program(positions(DOF, frames), ("p",), (), tuple(self.statements), tuple(outputs))


def entries(program: Program, ranges: Ranges, real: ScalarType = ScalarType.FLOAT) -> tuple[float, ...]:
    return bound(program, ranges, NUMBER_TYPES[real]).entries


# Single operations, against exact fractions ---------------------------------------------------------------------------

operands = st.one_of(
    st.sampled_from([Variable(index) for index in range(DOF)]),
    st.just(RuntimeParameter("p")),
    st.fractions(-3, 3, max_denominator=1000).map(Constant),
)
numbers = st.floats(-4, 4, width=32)


@st.composite
def arithmetic(draw: st.DrawFn) -> Program:
    """A few sums, products and changes of sign of inputs and earlier results."""
    writer = Writer()
    pool: list[Operand] = []
    for _ in range(draw(st.integers(1, 7))):
        operator = draw(st.sampled_from((*BINARY, *BINARY, Operator.NEG)))
        chosen = [draw(st.one_of(operands, *[st.sampled_from(pool)] * bool(pool))) for _ in range(operator.arity)]
        pool.append(writer.add(operator, *chosen))
    return writer.program()


def exact_results(program: Program, q: Sequence[float], parameter: Fraction) -> list[Fraction]:
    known: dict[Operand, Fraction] = {Variable(index): Fraction(value) for index, value in enumerate(q)}
    known[RuntimeParameter("p")] = parameter

    def value(operand: Operand) -> Fraction:
        return operand.value if isinstance(operand, Constant) else known[operand]

    for statement in program.statements:
        given = [value(operand) for operand in statement.operands]
        match statement.operator:
            case Operator.ADD:
                result = given[0] + given[1]
            case Operator.SUB:
                result = given[0] - given[1]
            case Operator.MUL:
                result = given[0] * given[1]
            case Operator.DIV:
                result = given[0] / given[1]
            case _:
                result = -given[0]
        known[Temporary(statement.name)] = result
    return [value(operand) for operand in program.outputs]


@pytest.mark.parametrize("real", ScalarType)
@settings(max_examples=150)
@given(program=arithmetic(), q=st.tuples(numbers, numbers, numbers), width=st.sampled_from([0, 1, 4]))
def test_arithmetic_stays_within_its_bound(
    real: ScalarType, program: Program, q: tuple[float, ...], width: int
) -> None:
    parameter = Fraction(31, 100)
    ranges = Ranges(tuple((Fraction(value) - width, Fraction(value) + width) for value in q), (parameter,))
    computed = run(program, np.array([q]), (parameter,), real)[:, 0]
    errors = [abs(Fraction(float(one)) - exact) for one, exact in zip(computed, exact_results(program, q, parameter))]

    assert all(error <= Fraction(most) for error, most in zip(errors, entries(program, ranges, real), strict=True))


@pytest.mark.parametrize(
    ("operator", "largest"), [(Operator.ADD, 4), (Operator.SUB, 2), (Operator.MUL, 3), (Operator.DIV, 3)]
)
def test_the_bound_of_one_operation_is_half_a_unit_in_the_last_place(operator: Operator, largest: int) -> None:
    writer = Writer()
    program = writer.program(writer.add(operator, Variable(0), Variable(1)))
    box = ((Fraction(2), Fraction(3)), (Fraction(1), Fraction(1)), (Fraction(0), Fraction(0)))
    below = float(np.nextafter(np.float32(largest), np.float32(0)))

    assert entries(program, Ranges(box, (Fraction(1),)))[0] == (largest - below) / 2


@settings(max_examples=50)
@given(p=st.fractions(Fraction(1, 10), 10, max_denominator=999), q=st.floats(-4, 4, width=32))
def test_a_quotient_of_parameters_stays_within_its_bound(p: Fraction, q: float) -> None:
    writer = Writer()
    inverse = writer.add(Operator.DIV, Constant(Fraction(1)), RuntimeParameter("p"))
    program = writer.program(writer.add(Operator.MUL, inverse, Variable(0)))
    ranges = Ranges(((Fraction(-4), Fraction(4)),) * DOF, (p,))
    computed = float(run(program, np.array([[q, 0, 0]]), (p,), ScalarType.FLOAT)[0, 0])

    assert abs(Fraction(computed) - Fraction(q) / p) <= Fraction(entries(program, ranges)[0])


def test_what_is_exact_has_no_error() -> None:
    program = Writer().program(Variable(0), Constant(Fraction(1, 2)), ZERO)

    assert entries(program, Ranges(HALVES, (Fraction(1),))) == (0.0, 0.0, 0.0)


def test_the_rounding_of_constants_and_parameters_counts() -> None:
    tenth = Fraction(1, 10)
    off = float(abs(Fraction(float(np.float32(0.1))) - tenth))
    program = Writer().program(Constant(tenth), RuntimeParameter("p"), ZERO)

    assert entries(program, Ranges(HALVES, (tenth,))) == pytest.approx((off, off, 0.0), rel=1e-15)


def test_what_may_overflow_has_no_bound() -> None:
    writer = Writer()
    result: Operand = Variable(0)
    for _ in range(8):
        result = writer.add(Operator.MUL, result, result)
    huge = ((Fraction(10) ** 6, Fraction(10) ** 6),) * DOF

    assert set(entries(writer.program(result), Ranges(huge, (Fraction(1),)))) == {math.inf}


def test_a_divisor_that_may_vanish_has_no_bound() -> None:
    writer = Writer()
    result = writer.add(Operator.DIV, Constant(Fraction(1)), Variable(0))

    assert set(entries(writer.program(result), Ranges(HALVES, (Fraction(1),)))) == {math.inf}


# Rotations, against an adversary --------------------------------------------------------------------------------------


@st.composite
def geometry(draw: st.DrawFn) -> Program:
    """Turns, some with the signs of no rotation, with sums, products and scalings among them."""
    writer = Writer()
    pool: list[Operand] = [Constant(Fraction(3, 10)), Constant(Fraction(7, 10)), Constant(Fraction(9, 7))]
    angles: list[Operand] = [Variable(0), Variable(1), writer.add(Operator.ADD, Variable(0), Variable(2))]
    for _ in range(draw(st.integers(1, 6))):
        x, y = draw(st.sampled_from(pool)), draw(st.sampled_from(pool))
        kind = draw(st.sampled_from(["turn", "turn", "turn", "binary", "scale", "fixed turn", "negate"]))
        signs = draw(st.tuples(*[st.sampled_from([Operator.ADD, Operator.SUB])] * 2))
        if kind == "turn":
            pool += writer.turn(draw(st.sampled_from(angles)), x, y, signs)
        elif kind == "binary":
            pool.append(writer.add(draw(st.sampled_from(BINARY)), x, y))
        elif kind == "scale":
            pool += [writer.add(Operator.MUL, one, Constant(Fraction(2, 7))) for one in (x, y)]
        elif kind == "fixed turn":
            parts = [Constant(Fraction(3, 5)), Constant(Fraction(4, 5))]
            products = [writer.add(Operator.MUL, k, v) for k, v in zip((*parts, *parts[::-1]), (x, y, x, y))]
            pool += [writer.add(signs[0], *products[:2]), writer.add(signs[1], *products[2:])]
        else:
            pool.append(writer.add(Operator.NEG, x))
    return writer.program(*pool[-2:])


def slack(program: Program, ranges: Ranges) -> np.ndarray:
    """What the double arithmetic of the adversary may itself be off; NumPy's sines are good to a few units."""
    return 16 * np.array(entries(program, ranges, ScalarType.DOUBLE)) + 1e-15


@settings(max_examples=150)
@given(program=geometry(), seed=st.integers(0, 2**32 - 1))
def test_no_adversary_gets_past_the_bound_of_turns(program: Program, seed: int) -> None:
    ranges = Ranges(((Fraction(-3), Fraction(3)),) * DOF, (Fraction(1),))
    q = np.random.default_rng(seed).uniform(-3, 3, (40, DOF)).astype(np.float32)
    adversary = Adversary(program, (Fraction(1),))
    found = np.array([adversary.errors(q, output).max() for output in range(len(program.outputs))])

    assert (found <= np.array(entries(program, ranges)) * (1 + 1e-6) + slack(program, ranges)).all()


@pytest.mark.parametrize("signs", [*itertools.product((Operator.ADD, Operator.SUB), repeat=2)], ids="-".join)
def test_signs_decide_what_is_a_rotation(signs: tuple[Operator, Operator]) -> None:
    writer = Writer()
    first, second = writer.turn(Variable(0), Variable(1), Variable(2), signs)
    graph = graph_of(writer.program(first, second))
    one, other = (all_rows(graph)[number][0] for number in graph.outputs[:2])

    assert turns(one, other, graph) is (signs[0] is not signs[1])


def test_ranges_in_which_sines_and_cosines_reach_as_far_are_analysed_once() -> None:
    writer = Writer()
    x, y = writer.turn(Variable(0), Constant(Fraction(1, 3)), Constant(Fraction(2, 7)), (Operator.SUB, Operator.ADD))
    program = writer.program(*writer.turn(Variable(1), x, y, (Operator.SUB, Operator.ADD)))
    wide, wider, narrow = (
        Ranges(((-half, half),) * DOF, (Fraction(0),)) for half in (Fraction(2), Fraction(3), Fraction(1, 10))
    )
    before = _beyond.cache_info().misses

    assert entries(program, wide) == entries(program, wider)
    assert _beyond.cache_info().misses == before + 1
    assert sum(entries(program, narrow)) < sum(entries(program, wide))
    assert _beyond.cache_info().misses == before + 2


def one_after_the_other(program: Program, asked: Iterable[tuple[Ranges, ScalarType]]) -> list[tuple[float, ...]]:
    """Bounds of a program, with nothing known before the first ones."""
    _beyond.cache_clear()
    _exact_norms.cache_clear()
    return [entries(program, ranges, real) for ranges, real in asked]


def require_independence(program: Program, asked: Sequence[tuple[Ranges, ScalarType]]) -> None:
    for each, found in zip(asked, one_after_the_other(program, asked), strict=True):
        assert one_after_the_other(program, [each]) == [found]


@settings(max_examples=60)
@given(program=st.one_of(arithmetic(), geometry()))
def test_bounds_do_not_depend_on_what_was_asked_before(program: Program) -> None:
    wide, narrow = (Ranges(((-half, half),) * DOF, (Fraction(31, 100),)) for half in (Fraction(3), Fraction(1, 10)))

    require_independence(program, [*itertools.product((wide, narrow), ScalarType)])


def test_nor_do_those_of_long_chains_in_which_groups_are_left_out() -> None:
    robot = loads(arm(40), "rows40.yaml")
    box = Ranges(fraction_box(robot), ())

    require_independence(program_of(robot, Quantity.POSE), [(box, real) for real in ScalarType])


def test_turning_to_and_fro_adds_errors_and_does_not_multiply_them() -> None:
    """Twenty turns of a vector: entry by entry the error would double with every other turn."""
    writer = Writer()
    x: Operand = Constant(Fraction(3, 5))
    y: Operand = Constant(Fraction(4, 5))
    z: Operand = Constant(Fraction(0))
    for _ in range(10):
        x, y = writer.turn(Variable(0), x, y, (Operator.SUB, Operator.ADD))
        y, z = writer.turn(Variable(1), y, z, (Operator.SUB, Operator.ADD))
    proven = entries(writer.program(x, y, z), Ranges(((Fraction(-3), Fraction(3)),) * DOF, (Fraction(1),)))

    assert max(proven) < 20 * 4 * 2.0**-24


def test_the_error_of_an_angle_reaches_its_sine_undiminished() -> None:
    writer = Writer()
    angle = writer.add(Operator.ADD, Variable(0), Variable(1))
    program = writer.program(writer.pair(angle)[0])
    ranges = Ranges(((Fraction(0), Fraction(1000)),) * DOF, (Fraction(1),))

    assert entries(program, ranges)[0] == pytest.approx(2.0**-14 + FLOAT.sine_error)


def test_the_error_of_an_angle_turns_a_vector_by_as_much() -> None:
    """A unit vector, turned by a sum up to 1000 rad: half a unit of that, and roundings that are small beside it."""
    writer = Writer()
    angle = writer.add(Operator.ADD, Variable(0), Variable(1))
    turned = writer.turn(angle, Constant(Fraction(3, 5)), Constant(Fraction(4, 5)), (Operator.SUB, Operator.ADD))
    proven = entries(writer.program(*turned), Ranges(((Fraction(0), Fraction(1000)),) * DOF, (Fraction(1),)))

    assert all(2.0**-14 <= error < 1.1 * 2.0**-14 for error in proven[:2])


def test_an_angle_counts_no_further_than_the_range_of_its_sine() -> None:
    """Beyond it the result is NaN; half a unit of 12000 is 2^-11, of 24000 it is 2^-10."""
    writer = Writer()
    program = writer.program(writer.pair(writer.add(Operator.ADD, Variable(0), Variable(1)))[0])
    limit = Fraction(FLOAT.angle_limit)

    assert entries(program, Ranges(((-limit, limit),) * DOF, (Fraction(1),)))[0] < 2.0**-11 * 1.001


# The arithmetic of bounds ---------------------------------------------------------------------------------------------


@given(st.lists(st.fractions(0, 5), max_size=4), st.integers(-60, 60))
def test_norms_are_rounded_upwards_and_hardly_at_all(vector: list[Fraction], power: int) -> None:
    with localcontext(UPWARDS):
        found = norm(*(upper(entry * Fraction(10) ** power) for entry in vector))

    exact = sum(entry**2 for entry in vector) * Fraction(10) ** (2 * power)
    assert exact <= Fraction(found) ** 2 <= exact * (1 + Fraction(1, 10**17))


@given(st.fractions(0, 5))
def test_fractions_lie_between_their_decimals(number: Fraction) -> None:
    with localcontext(UPWARDS):
        assert Fraction(lower(number)) <= number <= Fraction(upper(number))


@settings(max_examples=300)
@given(st.floats(0, 1e30, exclude_min=True), st.sampled_from(list(ScalarType)))
def test_rounding_is_off_by_half_a_unit_at_most_and_never_passes_the_bound(size: float, real: ScalarType) -> None:
    number = NUMBER_TYPES[real]
    exact = Fraction(size) * Fraction(2**60 + 1, 2**60)
    rounded = Fraction(real.round(exact))
    with localcontext(UPWARDS):
        assert abs(rounded - exact) <= Fraction(number.half_ulp(upper(exact)))
        assert rounded <= Fraction(number.rounded(upper(exact)))


def test_half_a_unit_at_a_power_of_two_is_that_below_it() -> None:
    with localcontext(UPWARDS):
        assert FLOAT.half_ulp(Decimal(1)) == Decimal(2) ** -25
        assert FLOAT.half_ulp(Decimal(1).next_plus()) == Decimal(2) ** -24


@given(st.floats(-20, 20), st.floats(0, 4))
def test_sines_and_cosines_of_a_range_are_not_underrated(low: float, width: float) -> None:
    high = low + width  # rounded, as the last angle is
    ends = Fraction(low), Fraction(high)
    angles = np.linspace(low, high, 50)
    with localcontext(UPWARDS):
        assert float(largest_cosine(*ends)) >= np.abs(np.cos(angles)).max() - 1e-15
        assert float(largest_sine(*ends)) >= np.abs(np.sin(angles)).max() - 1e-15


def test_narrow_ranges_give_smaller_sines() -> None:
    ends = Fraction(-1, 10), Fraction(1, 5)
    with localcontext(UPWARDS):
        assert float(largest_sine(*ends)) == pytest.approx(math.sin(0.2))
        assert float(largest_cosine(Fraction(1), Fraction(2))) == pytest.approx(math.cos(1.0))
        assert largest_cosine(*ends) == 1
