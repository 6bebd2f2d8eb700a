"""Ordered trees in every notation: numbers as people write them, names that stay apart, signs and brackets."""

from __future__ import annotations

import pytest
import sympy as sp

from kinegen.backends.textbook.closed_form import Reader, printed_name
from kinegen.backends.textbook.notation import NOTATIONS, TableText
from kinegen.backends.textbook.products import UNIT
from kinegen.io.load import loads
from kinegen.model.robot import Robot

NAMES = ("a2", "p", "l_1", "lT1", "lambda", "width", "q3", "math")


def robot() -> Robot:
    """Three joints, and parameters of many names."""
    parameters = ", ".join(f"{name}: 1" for name in NAMES)
    lengths = " + ".join(NAMES)
    return loads(
        "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\n"
        f"parameters: {{{parameters}}}\njoints:\n"
        f"  - {{name: one, alpha: 0, a: {lengths}, d: 0, theta: q}}\n"
        "  - {name: two, alpha: 0, a: 0, d: 0, theta: q}\n"
        "  - {name: three, alpha: 0, a: 0, d: 0, theta: q}\n",
        "arm.yaml",
    )


ROBOT = robot()
SYMBOLS = {name: sp.Symbol(name, real=True) for name in (*NAMES, "one", "two", "three")}


def printed(text: str, notation: str) -> str:
    """An expression in a notation."""
    expression = sp.sympify(text.replace("lambda", "lambda_"), locals={**SYMBOLS, "lambda_": SYMBOLS["lambda"]})
    return NOTATIONS[notation].entry(Reader(ROBOT).sum(expression))


@pytest.mark.parametrize(
    ("expression", "text", "latex", "python"),
    [
        ("0", "0", "0", "0"),
        ("-1", "-1", "-1", "-1"),
        ("a2/2", "a2/2", r"\frac{a_{2}}{2}", "a2/2"),
        ("3*a2/4", "3*a2/4", r"\frac{3 \, a_{2}}{4}", "3*a2/4"),
        ("a2/10", "0.1*a2", r"0.1 \, a_{2}", "0.1*a2"),
        ("Rational(4318, 10000)", "0.4318", "0.4318", "0.4318"),
        ("Rational(3, 2)", "3/2", r"\frac{3}{2}", "3/2"),
        ("Rational(25, 2)", "12.5", "12.5", "12.5"),
        ("-Rational(1, 3)", "-1/3", r"-\frac{1}{3}", "-1/3"),
        ("Rational(1, 2**40)", f"1/{2**40}", rf"\frac{{1}}{{{2**40}}}", f"1/{2**40}"),
        ("p*one/(2*pi)", "p*q1/(2*pi)", r"\frac{p \, q_{1}}{2 \, \pi}", "p*q1/(2*math.pi)"),
        ("sqrt(2)*a2/2", "sqrt(2)*a2/2", r"\frac{\sqrt{2} \, a_{2}}{2}", "math.sqrt(2)*a2/2"),
        ("2**Rational(1, 4)", "sqrt(sqrt(2))", r"\sqrt{\sqrt{2}}", "math.sqrt(math.sqrt(2))"),
        ("p**Rational(-1, 2)", "1/sqrt(p)", r"\frac{1}{\sqrt{p}}", "1/math.sqrt(p)"),
        ("p**2", "p**2", "{p}^{2}", "p**2"),
        ("cos(pi/7)", "cos(pi/7)", r"\cos\left(\frac{\pi}{7}\right)", "math.cos(math.pi/7)"),
        ("sqrt(p**2)", "abs(p)", r"\left|p\right|", "abs(p)"),
        ("sin(one + two)", "s12", "s_{12}", "s12"),
        ("cos(one - two)", "c1m2", "c_{1-2}", "c1m2"),
        ("a2*(sin(one) - cos(two))", "-a2*(c2 - s1)", r"-a_{2} \, (c_{2} - s_{1})", "-a2*(c2 - s1)"),
        ("l_1 + lT1", "lT1 + l_1", r"l_{T1} + l_{1}", "lT1 + l_1"),
        ("lambda", "lambda", r"\lambda", "lambda_"),
        ("width", "width", r"\mathrm{width}", "width"),
        ("math", "math", r"\mathrm{math}", "math_"),
        ("q3 + three", "q3 + q3_", r"q_{3} + \mathrm{q3\_}", "q3 + q3_"),
    ],
)
def test_notations(expression: str, text: str, latex: str, python: str) -> None:
    found = tuple(printed(expression, notation) for notation in ("text", "latex", "python"))

    assert found == (text, latex, python)


def test_mathml_is_made_of_elements() -> None:
    assert printed("a2/2 - lambda", "mathml") == (
        "<mfrac><mrow><msub><mi>a</mi><mn>2</mn></msub></mrow><mrow><mn>2</mn></mrow></mfrac><mo>\u2212</mo><mi>λ</mi>"
    )


@pytest.mark.parametrize("name", ["c1", "s23", "c_1", "c1m2", "cu1", "s1_12", "q3", "q_3", "r12", "px"])
def test_names_of_printed_things_get_an_underscore(name: str) -> None:
    assert printed_name(name) == f"{name}_"


@pytest.mark.parametrize("name", ["a2", "d1", "cx", "s", "c", "q", "radius", "r1", "r44", "p1", "step1", "c1a"])
def test_other_names_stay(name: str) -> None:
    assert printed_name(name) == name


def test_numbers_of_a_table_are_decimals() -> None:
    half = Reader(ROBOT).sum(sp.Rational(1, 2))

    assert (TableText().entry(half), NOTATIONS["text"].entry(half)) == ("0.5", "1/2")


def test_terms_can_be_printed_one_by_one() -> None:
    entry = Reader(ROBOT).sum(SYMBOLS["a2"] * sp.cos(SYMBOLS["one"]) - SYMBOLS["p"])

    assert NOTATIONS["text"].terms(entry) == ("a2*c1", " - p")


def test_numbers_that_are_no_lengths_are_fractions() -> None:
    """What twists make stays a fraction, before a bracket where that is shorter; lengths are decimals."""
    reader, one = Reader(ROBOT), sp.cos(SYMBOLS["one"])
    length = sp.Symbol(f"{UNIT}0", real=True)

    entries = [
        NOTATIONS["text"].entry(reader.sum(value))
        for value in (
            SYMBOLS["a2"] * one + length / 2,
            one / 2 - sp.Rational(3, 4),
            one / 2 + sp.Rational(1, 2),
            one + 1,
            one + sp.Rational(1, 3),
            length * one / 4 + 3 * length / 2,
            sp.sqrt(5) * one * 2 / 5,
            sp.sqrt(2) * (SYMBOLS["a2"] * one / 2 + one * sp.sin(SYMBOLS["one"]) * length / 10 + length / 20),
        )
    ]

    assert entries == [
        "0.5 + a2*c1",
        "(2*c1 - 3)/4",
        "(c1 + 1)/2",
        "c1 + 1",
        "c1 + 1/3",
        "0.25*c1 + 1.5",
        "2*sqrt(5)*c1/5",
        "sqrt(2)*(c1*(0.2*s1 + a2) + 0.1)/2",
    ]
