"""Entries as books print them: which brackets, which order, which signs; that they are right is proved elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest

from kinegen.backends.textbook.closed_form import ClosedForm, closed_form
from kinegen.backends.textbook.jacobian import jacobian_form
from kinegen.backends.textbook.notation import NOTATIONS, entry_names, entry_texts
from kinegen.backends.textbook.trees import Power, Sum, Symbol, Term
from kinegen.io.load import load, loads
from kinegen.model.outputs import Reference
from kinegen.model.robot import Robot
from tests.textbook.catalog import ROBOTS
from tests.textbook.formulas import FILES, NO_JACOBIAN

SQUARE = re.compile(r"\b[cs](m?[0-9]+_?)+\*\*2")

# Name, parameters, rows of theta, d, a, alpha in the standard convention.
TABLES = {
    "slide_between": ("a1: 0.3, d3: 0.2, a3: 0.1", "q 0 a1 90", "90 q 0 90", "q d3 a3 0"),
    "two_slides": ("a1: 0.3, a2: 0.2, d3: 0.1, a4: 0.05", "q 0 a1 90", "90 q a2 -90", "90 q d3 90", "q 0 a4 0"),
    "slide_after": ("d2: 0.3, a3: 0.2, d4: 0.1", "q 0 0 90", "q 0 a3 90", "90 q d2 90", "q d4 0 0"),
    "metres": ("", "q 0.25 0 90", "q 0 0.5 0", "q 0 0.25 0", "q 0 0.2 0"),
    "upside_down": ("a1: 0.5, a2: 0.4, a3: 0.3", "q 0 a1 180", "q 0 a2 0", "q 0 a3 0"),
    "universal": (
        "d1: 0.09, a2: 0.42, a3: 0.39, d4: 0.11, d5: 0.09, d6: 0.08",
        *("q d1 0 90", "q 0 a2 0", "q 0 a3 0", "q d4 0 90", "q d5 0 -90", "q d6 0 0"),
    ),
    "slanted": ("a: 0.3", "q 0 0 45", "q 0 0 -45", "q 0 a 0"),
    "sixty": ("d1: 0.3, d2: 0.2, d3: 0.1", "q d1 0 60", "q d2 0 60", "q d3 0 0"),
    "slope": ("d1: 0.3, d2: 0.2, d3: 0.1", "q d1 0 atan(1/2)", "q d2 0 -atan(1/2)", "q d3 0 0"),
    "bent": ("e: 0.3, f: 0.2", "q 0 0 60", "q sqrt(3)*e/3+f 0 60", "q 0 0 0"),
    "thirty": ("d1: 0.3, a2: 0.2, a3: 0.1", "q d1 0 30", "q 0 a2 0", "q 0 a3 0"),
    "link": ("d: 0.3, a: 0.2, alpha: {value: 30, dimension: angle}", "q d a alpha"),
    "clash": ("alpha1: {value: 30, dimension: angle}, ca1: 0.3", "q ca1 0 alpha1", "q 0 0 0"),
    "named_twist": ("alpha1: {value: 30, dimension: angle}", "q 0 0 alpha1", "q 0 0 -alpha1", "q 0 0 0"),
}


def table(name: str) -> Robot:
    """One of the small tables."""
    parameters, *rows = TABLES[name]
    lines = [f"kinegen: 1\nname: {name}\nconvention: standard\nunits: {{length: m, angle: deg}}"]
    lines += [f"parameters: {{{parameters}}}"] if parameters else []
    entries = [dict(zip(("theta", "d", "a", "alpha"), row.split(), strict=True)) for row in rows]
    places = [", ".join(f"{key}: {value}" for key, value in entry.items()) for entry in entries]
    return loads(
        "\n".join([*lines, "joints:", *(f"- {{name: j{i}, {place}}}" for i, place in enumerate(places))]), name
    )


def texts(form: ClosedForm, notation: str = "text") -> dict[str, str]:
    """The entries by name."""
    pairs = zip(entry_names(form), entry_texts(form, NOTATIONS[notation]), strict=True)
    return {name: text for row in pairs for name, text in zip(*row, strict=True)}


def pose(name: str) -> dict[str, str]:
    return texts(closed_form(table(name), "base", "tool"))


@pytest.mark.parametrize(
    ("name", "entries"),
    [
        # Lengths before and behind a slide stand beside the same sine.
        ("slide_between", {"px": "c1*(a1 + d3) + s1*(q2 + a3*s3)", "py": "s1*(a1 + d3) - c1*(q2 + a3*s3)"}),
        ("two_slides", {"px": "c1*(a1 - q3) + s1*(q2 - d3) - a4*s14"}),
        ("slide_after", {"px": "c1*(c2*(a3 + d4) + q3*s2) + d2*s1", "pz": "s2*(a3 + d4) - q3*c2"}),
        # Lengths are decimals, all of them, and follow the chain.
        ("metres", {"px": "c1*(0.5*c2 + 0.25*c23 + 0.2*c234)", "pz": "0.25 + 0.5*s2 + 0.25*s23 + 0.2*s234"}),
        # The first joint of a difference is positive.
        ("upside_down", {"px": "a1*c1 + a2*c1m2 + a3*c1m2m3", "r21": "s1m2m3", "r12": "s1m2m3"}),
        # Signs of the data sheet, from the base outwards.
        (
            "universal",
            {
                "px": "c1*(a2*c2 + a3*c23 + d5*s234 - d6*c234*s5) + s1*(d4 + d6*c5)",
                "pz": "d1 + a2*s2 + a3*s23 - d5*c234 - d6*s234*s5",
            },
        ),
        # Numbers of twists meet each other, and what is common stands in front.
        (
            "slanted",
            {
                "r31": "(s3*(c2 - 1) + sqrt(2)*s2*c3)/2",
                "r13": "(s1*(1 - c2) - sqrt(2)*c1*s2)/2",
                "r33": "(c2 + 1)/2",
                "pz": "a*(s3*(c2 - 1) + sqrt(2)*s2*c3)/2",
            },
        ),
        (
            "sixty",
            {
                "r13": "sqrt(3)*(s1*(c2 + 1) + 2*c1*s2)/4",
                "r33": "(1 - 3*c2)/4",
                "pz": "d1 + d2/2 + d3*(1 - 3*c2)/4",
            },
        ),
        (
            "slope",
            {
                "r33": "(c2 + 4)/5",
                "r13": "(2*s1*(1 - c2) - sqrt(5)*c1*s2)/5",
                "pz": "d1 + (2*sqrt(5)*d2 + d3*(c2 + 4))/5",
            },
        ),
        # A number before a bracket meets the numbers in it.
        ("bent", {"px": "s1*(e + sqrt(3)*f)/2", "pz": "(sqrt(3)*e + 3*f)/6"}),
        # What some terms have in common stands in front of these.
        ("thirty", {"pz": "d1 + (a2*s2 + a3*s23)/2", "r33": "sqrt(3)/2"}),
        ("link", {"r12": "-ca*s1", "r13": "sa*s1", "r32": "sa", "r33": "ca", "px": "a*c1"}),
        ("named_twist", {"r13": "sa1*(ca1*s1*(1 - c2) - c1*s2)", "r31": "sa1*(ca1*s3*(c2 - 1) + s2*c3)"}),
    ],
)
def test_entries_are_printed_as_in_a_book(name: str, entries: dict[str, str]) -> None:
    found = pose(name)

    assert {entry: found[entry] for entry in entries} == entries


def test_the_cosine_of_a_parameter_has_its_name() -> None:
    form = closed_form(table("named_twist"), "base", "tool")

    assert [label for label, _ in form.angles] == ["1", "2", "3", "alpha1"]
    assert texts(form, "latex")["r32"].startswith(r"s_{\alpha_{1}}")
    assert "<msub><mi>s</mi><msub><mi>α</mi><mn>1</mn></msub></msub>" in texts(form, "mathml")["r32"]


def test_a_name_that_means_something_else_is_not_given_to_a_cosine() -> None:
    assert pose("clash")["r33"] == "cu1"


LEVEL = """\
kinegen: 1
name: level
convention: standard
units: {length: m, angle: deg}
parameters: {a1: 0.13, a2: 0.23, a3: 0.33, a4: 0.43, d1: 0.22, d5: 0.62}
joints:
- {name: j1, theta: q, d: d1, a: a1, alpha: 90}
- {name: j2, theta: q, d: 0, a: a2, alpha: 0}
- {name: j3, theta: q, d: 0, a: a3, alpha: 0}
- {name: level, theta: -j2 - j3, d: 0, a: a4, alpha: -90}
- {name: j5, theta: q, d: d5, a: 0, alpha: 0}
"""


def test_a_level_tool_has_no_length_that_cancels() -> None:
    """What the followers keep level moves as the wrist does: neither the tool nor the shoulder is in these columns."""
    form = texts(jacobian_form(loads(LEVEL, "level"), "base", "tool", Reference.LOCAL))

    assert [form[f"J{row}2"] for row in range(1, 7)] == [
        "-c4*(a2*s2 + a3*s23)",
        "s4*(a2*s2 + a3*s23)",
        "a2*c2 + a3*c23",
        *("0", "0", "0"),
    ]


@pytest.mark.parametrize(
    ("name", "reference", "entries"),
    [
        ("panda", Reference.LOCAL, {"J36": "-a7"}),
        ("ur5", Reference.WORLD, {"J33": "-a2*c2", "J34": "-a2*c2 - a3*c23"}),
        ("puma560", Reference.WORLD, {"J33": "a2*c2"}),
        ("xarm6", Reference.LOCAL, {"J35": "76"}),
        (
            "palletiser",
            Reference.LOCAL,
            {"J32": "-900*c2 - 950*c23", "J33": "-950*c23", "J12": "-c4*(900*s2 + 950*s23)"},
        ),
        # What cancels by the addition theorems, alone and behind the sine and cosine of one angle.
        ("puma560", Reference.WORLD, {"J14": "-s1*(a2*c3 + a3) - d3*c1*c23"}),
        ("al5d", Reference.LOCAL, {"J11": "s5*(a3*c2 + a4*c23 + d5*c234)", "J32": "a3*s34 + a4*s4"}),
        ("hanging_arm", Reference.LOCAL, {"J33": "-0.6*c4 - 0.5*c45"}),
        ("palletiser", Reference.WORLD, {"J12": "-c1*(900*s2 + 950*s23)", "J13": "-950*c1*s23"}),
    ],
)
def test_what_cancels_in_a_jacobian_is_not_printed(name: str, reference: Reference, entries: dict[str, str]) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    found = texts(jacobian_form(robot, robot.root, robot.tips[0], reference))

    assert {entry: found[entry] for entry in entries} == entries


def sums_in(entry: Sum) -> Iterator[Sum]:
    """A sum and all that stand in brackets in it."""
    yield entry
    for term in entry.terms:
        for factor in term.factors:
            inside = factor.base if isinstance(factor, Power) else factor
            if isinstance(inside, Sum):
                yield from sums_in(inside)


def make_one(left: Term, right: Term) -> bool:
    """Whether two terms are a sine or cosine of a sum of two angles, times the same."""
    own, other = set(left.factors) - set(right.factors), set(right.factors) - set(left.factors)
    angles = [sorted(part.name for part in parts if isinstance(part, Symbol)) for parts in (own, other)]
    are_waves = all(isinstance(part, Symbol) and part.kind in ("sine", "cosine") for part in own | other)
    return are_waves and len(own) == len(other) == len(set(angles[0])) == 2 and angles[0] == angles[1]


@pytest.mark.parametrize("path", [path for path in FILES if path.stem not in NO_JACOBIAN], ids=lambda path: path.stem)
def test_no_theorem_makes_a_jacobian_shorter(path: Path) -> None:
    """Neither a square of a sine nor two terms that make one by the addition theorems are left."""
    robot = load(path)
    forms = [jacobian_form(robot, robot.root, tip, reference) for tip in robot.tips for reference in Reference]
    sums = {each for form in forms for row in form.entries for entry in row for each in sums_in(entry)}

    assert [text for form in forms for text in texts(form).values() if SQUARE.search(text)] == []
    assert [each for each in sums if any(make_one(*pair) for pair in combinations(each.terms, 2))] == []
