"""Every form that a textbook prints is equal, exactly, to what kinegen derives; and every misprint is one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import pytest
import sympy as sp

from kinegen.backends.textbook.jacobian import jacobian
from kinegen.derive import pose
from kinegen.io.load import loads
from kinegen.model.expression_parser import names, parse
from kinegen.model.outputs import Reference
from kinegen.model.robot import Robot
from tests.textbook import exact
from tests.textbook.books import BOOKS, reading, table
from tests.textbook.catalog import NAMED_PLACES, Form, Misprint, Product, System, misprints, products, robot, systems
from tests.textbook.notation import read
from tests.textbook.prove import are_equal, is_zero

Transform = Callable[[Robot, str | int, str | int], sp.Matrix]

FORMS = [
    pytest.param(system, name, form, id=f"{name}-{form.name}")
    for system in systems()
    for name in system.robots
    for form in system.forms
]
WAYS = [pytest.param(pose.transform, id="symbolic"), pytest.param(exact.transform, id="links")]
PRODUCTS = [pytest.param(product, id=product.name) for product in products()]
PROVABLE = [pytest.param(misprint, id=misprint.place) for misprint in misprints() if misprint.entry]


@cache
def derived(transform: Transform, name: str, form_start: str | int, form_end: str | int) -> sp.Matrix:
    return transform(robot(name), form_start, form_end)


def differing(system: System, name: str, form: Form, ours: sp.Matrix) -> Iterator[tuple[int, int]]:
    """The places in which a form differs from a matrix of ours."""
    zero = {sp.Symbol(variable.name, real=True): 0 for variable in robot(name).variables} if form.at_zero else {}
    for place, text in form.entries.items():
        if not is_zero(ours[place].xreplace(zero) - system.read(text, robot(name))):
            yield place


def inline(product: Product) -> Robot:
    """A robot without joints whose one row is the product; its symbols become parameters."""
    if product.row:
        angles, lengths = {"theta", "alpha"}, {"a", "d"}
        row = f"{{name: link, convention: {product.row}, theta: theta, alpha: alpha, a: a, d: d}}"
        if product.row == "hayati":
            angles, lengths = {"theta", "alpha", "beta"}, {"a"}
            row = "{name: link, convention: hayati, theta: theta, alpha: alpha, a: a, beta: beta}"
    else:
        found = [(step[0], name) for step in product.steps for name in names(parse(step[3:-1]))]
        angles = {name for kind, name in found if kind == "R"}
        lengths = {name for kind, name in found if kind == "T"}
        row = f"{{name: link, ets: [{', '.join(product.steps)}]}}"
    parameters = [f"  {name}: {{value: 1, dimension: angle}}" for name in sorted(angles)]
    parameters += [f"  {name}: {{value: 1, dimension: length}}" for name in sorted(lengths)]
    head = "kinegen: 1\nname: product\nconvention: standard\nunits: {length: m, angle: rad}\n"
    table = f"joints:\n  - {row}\n"
    return loads(head + ("parameters:\n" + "\n".join(parameters) + "\n" if parameters else "") + table, "product.yaml")


def read_product(product: Product, text: str) -> sp.Expr:
    known = {parameter.name: sp.Symbol(parameter.name, real=True) for parameter in inline(product).parameters}
    angles = [sp.Symbol(name, real=True) for name in product.angles]
    return read(text, known, angles, product.first)


@pytest.mark.parametrize("transform", WAYS)
@pytest.mark.parametrize(("system", "name", "form"), FORMS)
def test_published_form_equals_ours(system: System, name: str, form: Form, transform: Transform) -> None:
    ours = derived(transform, name, form.start, form.end)

    assert list(differing(system, name, form, ours)) == []


@pytest.mark.parametrize("product", PRODUCTS)
def test_published_product_equals_ours(product: Product) -> None:
    start, end = ("tool", "base") if product.inverse else ("base", "tool")
    ours = pose.transform(inline(product), start, end)

    assert [
        place for place, text in product.entries.items() if not is_zero(ours[place] - read_product(product, text))
    ] == []


def forms_of(misprint: Misprint) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """An entry as kinegen derives it, as it stands in print, and as it is right."""
    entry, texts = misprint.entry or "", (misprint.printed, misprint.correct)
    if misprint.product:
        product = next(item for item in products() if item.name == misprint.product)
        ours = pose.transform(inline(product), "base", "tool")[NAMED_PLACES[entry]]
        return ours, *(read_product(product, text) for text in texts)
    if misprint.book:
        arm = table(next(item for item in BOOKS if item["name"] == misprint.book))
        if entry.startswith("J"):
            ours = jacobian(arm, "base", "tool", Reference.LOCAL_WORLD_ALIGNED)[int(entry[1]) - 1, int(entry[2]) - 1]
        else:
            ours = pose.transform(arm, "base", "tool")[NAMED_PLACES[entry]]
        return ours, *(read(text, *reading(arm)) for text in texts)
    system = next(item for item in systems() if item.key == misprint.system)
    form = next(item for item in system.forms if item.name == misprint.form)
    ours = derived(pose.transform, system.robots[0], form.start, form.end)[NAMED_PLACES[entry]]
    return ours, *(system.read(text, robot(system.robots[0])) for text in texts)


@pytest.mark.parametrize("misprint", PROVABLE)
def test_misprint_is_wrong_and_its_correction_right(misprint: Misprint) -> None:
    ours, printed, correct = forms_of(misprint)

    assert not is_zero(ours - printed)
    assert is_zero(ours - correct)


def test_the_eight_assignments_have_one_pose() -> None:
    """Equal to each other, and not only to the printed form."""
    first, *others = (pose.transform(robot(f"rrr_nonplanar_{k}"), "base", "tool") for k in range(1, 9))

    assert [are_equal(first, other) for other in others] == [[]] * 7


def test_bare_products_of_the_assignments_differ() -> None:
    """Leaving out base and tool is the mistake to avoid."""
    first, *others = (pose.transform(robot(f"rrr_nonplanar_{k}"), 0, 3) for k in range(1, 9))

    assert all(are_equal(first, other) for other in others)


def symbols(*names: str) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(name, real=True) for name in names)


def test_both_tables_of_the_puma_are_one_arm() -> None:
    """Craig's table with elbow - 180, flange + 180 deg and the other sign of a3, then d6, is the standard table."""
    elbow, flange, a3, d2, d3, d6 = symbols("elbow", "flange", "a3", "d2", "d3", "d6")
    craig = pose.transform(robot("puma560"), 0, 6).xreplace(
        {elbow: elbow - sp.pi, flange: flange + sp.pi, a3: -a3, d3: d2}
    )
    hand = sp.eye(4)
    hand[2, 3] = d6

    assert are_equal(pose.transform(robot("puma560_mm"), 0, 6), craig * hand) == []


def test_arm_and_wrist_need_a_turn_between_them() -> None:
    """The naive product of the printed matrices of arm and wrist is another pose; with the turn it is the right one."""
    elbow, a3, d4 = symbols("elbow", "a3", "d4")
    arm = pose.transform(robot("anthropomorphic_arm"), 0, 3).xreplace({a3: d4})
    wrist = pose.transform(robot("spherical_wrist"), 0, 3)
    whole = pose.transform(robot("anthropomorphic_wrist"), 0, 6)
    turn = sp.Matrix([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])

    assert are_equal(whole, arm * wrist)
    assert are_equal(whole, arm.xreplace({elbow: elbow - sp.pi / 2}) * turn * wrist) == []


def test_stanford_is_arm_times_wrist() -> None:
    (stroke, third) = symbols("stroke", "joint_3")
    arm = pose.transform(robot("spherical_arm"), 0, 3)
    arm = arm.xreplace(dict(zip(symbols("turn", "lift"), symbols("joint_1", "joint_2"))) | {stroke: third})

    assert (
        are_equal(pose.transform(robot("stanford"), 0, 6), arm * pose.transform(robot("spherical_wrist"), 0, 3)) == []
    )


def test_craig_and_the_offsets_of_the_row_before_agree() -> None:
    """The same two joints in both tables: other frames between, one tip."""
    head = (
        "kinegen: 1\nname: two\nunits: {length: m, angle: rad}\nparameters: {p1: 0.1, p2: 0.2, a1: 1, d1: 2, d2: 3}\n"
    )
    craig = loads(
        head + "convention: modified\njoints:\n"
        "  - {name: one, alpha: p1, a: 0, d: d1, theta: q}\n  - {name: two, alpha: p2, a: a1, d: d2, theta: q}\n",
        "two.yaml",
    )
    before = loads(
        head + "convention: modified_prev_d\njoints:\n"
        "  - {name: one, alpha: p1, a: a1, d: d1, theta: q}\n  - {name: two, alpha: p2, a: 0, d: d2, theta: q}\n",
        "two.yaml",
    )

    assert are_equal(pose.transform(craig, "base", "tool"), pose.transform(before, "base", "tool")) == []


def test_arm_of_the_body_is_its_last_nine_rows() -> None:
    for row in range(1, 10):
        assert (
            are_equal(
                pose.transform(robot("human_body"), 11 + row, 12 + row),
                pose.transform(robot("human_arm"), row - 1, row),
            )
            == []
        )
