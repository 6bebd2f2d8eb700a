"""The little expression language: exact, folded, bounded, and never evaluated as anybody's code."""

from __future__ import annotations

import math
import time
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinegen.model.expression_parser import (
    ONE,
    PI,
    ZERO,
    Arithmetic,
    Call,
    Expression,
    ExpressionError,
    Name,
    Power,
    Product,
    Sum,
    evaluate,
    linear,
    names,
    number,
    parse,
    substitute,
    text_names,
)

FLOATS = Arithmetic(float, math.pi, {"sqrt": math.sqrt})
RATIONALS = Arithmetic(Fraction, Fraction(22, 7), {})


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("0.4318", number("4318/10000")),
        ("1/3", number("1/3")),
        ("2**-2", number("1/4")),
        ("-2**2", number(-4)),
        ("1 + 2*3", number(7)),
        ("(1 + 2)*3", number(9)),
        ("+5", number(5)),
        (" 7 ", number(7)),
        ("1.e2", number(100)),
        ("pi/2", Product((number("1/2"), PI))),
        ("90*pi/180", Product((number("1/2"), PI))),
        ("pi/pi", ONE),
        ("q - 90", Sum((Name("q"), number(-90)))),
        ("90 - q", Sum((Product((number(-1), Name("q"))), number(90)))),
        ("-(q + 1)", Sum((Product((number(-1), Name("q"))), number(-1)))),
        ("2*q/4", Product((number("1/2"), Name("q")))),
        ("sqrt(2)*a", Product((Call("sqrt", number(2)), Name("a")))),
        ("a**2", Power(Name("a"), 2)),
        ("1/a", Power(Name("a"), -1)),
        ("1/(1/a)", Name("a")),
        ("0*a", ZERO),
        ("lambda + in", Sum((Name("lambda"), Name("in")))),
        ("a - a + 1 - 1", Sum((Name("a"), Product((number(-1), Name("a")))))),
    ],
)
def test_text_becomes_an_exact_tree(text: str, tree: Expression) -> None:
    assert parse(text) == tree


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "1 2",
        "1 +",
        "(1",
        "1)",
        "()",
        "sqrt",
        "sqrt()",
        "sqrt(1)(2)",
        "sqrt 2",
        "a(1)",
        "2(3)",
        "sin(1)",
        "a.b",
        "1.2.3",
        "0x1F",
        "1_000",
        "1e",
        "1e99",
        "1j",
        "1//2",
        "5 % 3",
        "a ** b",
        "2**0.5",
        "2**65",
        "9**9**9**9",
        "(((1/3)**64)**64)",
        "((a**9)**9)**9",
        "1/0",
        "0**-1",
        "a if b else c",
        "a == b",
        "a and b",
        "not a",
        "lambda: 0",
        "[1]",
        "{1}",
        "'a'",
        "f(x=1)",
        "__import__('os')",
        "a; b",
        "a\nb",
        "a := 1",
        "*a",
        "1,2",
        "π",
        "\uff11",  # a full-width digit
        "1" * 61,
        "1+" * 300 + "1",
        "(" * 41 + "1" + ")" * 41,
        "-" * 400 + "1",
    ],
)
def test_everything_else_is_refused(text: str) -> None:
    start = time.perf_counter()
    with pytest.raises(ExpressionError):
        parse(text)

    assert time.perf_counter() - start < 1


@pytest.mark.parametrize("text", ["\N{MINUS SIGN}90", "2\N{MINUS SIGN}a", "3*(\N{MINUS SIGN} q)"])
def test_the_minus_sign_of_printed_tables_is_a_minus(text: str) -> None:
    assert parse(text) == parse(text.replace("\N{MINUS SIGN}", "-"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("\N{EN DASH}90", "'\N{EN DASH}' is not allowed in an expression; write - for a minus"),
        ("175 mm", "'175 mm' is not an expression; write the number without its unit, which units: or --table sets"),
        ("90deg", "'90deg' is not an expression; write the number without its unit, which units: or --table sets"),
        (
            "90\N{DEGREE SIGN}",
            "is not allowed in an expression; write the number without its unit, which units: or --table sets",
        ),
        ("2 a", "'2 a' is not an expression$"),
        ("7;", "';' is not allowed in an expression$"),
    ],
)
def test_slips_are_named(text: str, reason: str) -> None:
    with pytest.raises(ExpressionError, match=reason):
        parse(text)


def test_long_products_of_long_numbers_can_still_be_refused_by_power() -> None:
    """Python refuses to print integers of more than 4300 digits, so the check may not print them."""
    with pytest.raises(ExpressionError, match="the number is too long"):
        parse("(" + "*".join(["1e64**18"] * 40) + ")**2")


def test_names_are_found_in_text_even_where_they_fold_away() -> None:
    assert text_names("0*q + 1e3*a2 + sqrt(pi)*q - b**0") == ("q", "a2", "b")
    assert names(parse("0*q + a2 - b**0")) == ("a2",)


@pytest.mark.parametrize(
    ("text", "coefficients", "offset"),
    [
        ("q - 90", {"q": "1"}, "-90"),
        ("90 - q/2", {"q": "-1/2"}, "90"),
        ("2*(q + a)", {"q": "2"}, "2*a"),
        ("a*q + b*p + c", {"q": "a", "p": "b"}, "c"),
        ("q + q", {"q": "2"}, "0"),
        ("q - q", {"q": "0"}, "0"),
        ("a**2", {}, "a**2"),
    ],
)
def test_linear_splits_variables_from_the_rest(text: str, coefficients: dict[str, str], offset: str) -> None:
    found, rest = linear(parse(text), frozenset({"p", "q"}))

    assert found == {name: parse(value) for name, value in coefficients.items()}
    assert rest == parse(offset)


@pytest.mark.parametrize("text", ["q*q", "q**2", "1/q", "sqrt(q)", "q*p", "(q + 1)*(p + 1)", "sqrt(2*q + 1)*a"])
def test_linear_refuses_the_rest(text: str) -> None:
    with pytest.raises(ExpressionError):
        linear(parse(text), frozenset({"p", "q"}))


A, B, PI_HERE = Fraction(3, 5), Fraction(-2, 3), Fraction(22, 7)
VALUES = {"a": A, "b": B}
Valued = tuple[str, Fraction]
LEAVES: st.SearchStrategy[Valued] = st.sampled_from(
    [("1", Fraction(1)), ("2.5", Fraction(5, 2)), ("0.1", Fraction(1, 10)), ("pi", PI_HERE), ("a", A), ("b", B)]
)


def grow(inner: st.SearchStrategy[Valued]) -> st.SearchStrategy[Valued]:
    """Texts made of smaller ones, each with its value worked out beside it."""
    pairs = st.tuples(inner, inner)
    return st.one_of(
        pairs.map(lambda p: (f"({p[0][0]} + {p[1][0]})", p[0][1] + p[1][1])),
        pairs.map(lambda p: (f"({p[0][0]} - {p[1][0]})", p[0][1] - p[1][1])),
        pairs.map(lambda p: (f"{p[0][0]}*{p[1][0]}", p[0][1] * p[1][1])),
        inner.map(lambda p: (f"(-{p[0]})", -p[1])),
        inner.map(lambda p: (f"({p[0]})**2", p[1] ** 2)),
        inner.map(lambda p: (f"{p[0]}/3", p[1] / 3)),
    )


TEXTS = st.recursive(LEAVES, grow, max_leaves=12)


@given(TEXTS)
def test_folding_keeps_the_value(pair: Valued) -> None:
    text, expected = pair

    assert evaluate(parse(text), VALUES, RATIONALS) == expected


@given(TEXTS, TEXTS)
def test_substitution_keeps_the_value(outer: Valued, inner: Valued) -> None:
    put_in = substitute(parse(outer[0]), {"a": parse(inner[0])})
    expected = evaluate(parse(outer[0]), VALUES | {"a": inner[1]}, RATIONALS)

    assert evaluate(put_in, VALUES, RATIONALS) == expected


def test_evaluation_in_floats() -> None:
    assert evaluate(parse("sqrt(2)*a/pi**2"), {"a": 3.0}, FLOATS) == pytest.approx(3 * math.sqrt(2) / math.pi**2)
    with pytest.raises(KeyError):
        evaluate(parse("b"), {}, FLOATS)
