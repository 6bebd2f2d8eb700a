"""Scales of lengths, kinds of values, and what is refused, with the reason and the line."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from kinegen.backends.fixed_point.files import emit_fixed
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.fixed_point.binary_angles import PI, binary_angle
from kinegen.ir.fixed_point.plan import plan_fixed
from kinegen.ir.fixed_point.program import LARGEST, Integer, Operation, Scales, above, nearest_integer
from kinegen.ir.fixed_point.value_classes import find_kinds
from kinegen.ir.fixed_point.writer import write_statements
from kinegen.ir.lower import lower
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.support.naming import Q30, c_file
from tests.fixed import machine
from tests.fixed.kernels import ROBOTS, arm, fixed, planned

ROBOT_FILES = sorted(ROBOTS.glob("*.yaml"))
REFUSED = {"screw"}


@pytest.mark.parametrize("path", ROBOT_FILES, ids=lambda path: path.stem)
def test_every_robot_of_ours_has_integer_kernels_or_a_reason(path: Path) -> None:
    robot = load(path)
    if robot.name in REFUSED:
        with pytest.raises(KinegenError, match="no q30 kernels"):
            planned(robot)
        return
    kernels = planned(robot)
    # A twist that is not a multiple of a right angle is one more rotation, as that of a joint is.
    values = {each.name: float(evaluate(each.value, {}, FLOAT64)) for each in robot.parameters}
    twists = [float(evaluate(row.alpha, values, FLOAT64)) for row in robot.rows if row.alpha is not None]
    oblique = sum(math.sin(2 * twist) ** 2 > 1e-9 for twist in twists)
    for program in kernels.programs:
        # As tight as floating point allows: a few units of the last place for each rotation.
        assert max(program.errors) < 6 * (robot.dof + 1 + oblique)


@pytest.mark.parametrize(
    ("name", "length"), [("puma560", 31), ("puma560_mm", 21), ("thumb", 23), ("panda", 30), ("spherical_wrist", 34)]
)
def test_lengths_have_as_many_bits_as_the_reach_leaves(name: str, length: int) -> None:
    assert fixed(name).scales.length == length


def test_one_bit_more_would_overflow() -> None:
    """Stretched out, three links of 0.9 m together leave the range at 32 bits; the analysis says so, and it happens."""
    kernels = planned(load(ROBOTS / "planar_3r.yaml"))
    finer = Scales(kernels.scales.length + 1, kernels.scales.stroke, kernels.scales.parameter)
    program = kernels.programs[0].program
    draft = write_statements(kernels.robot, program, find_kinds(kernels.robot, program), finer)

    assert kernels.scales.length == 31
    assert draft.overflows()
    broken = replace(kernels, scales=finer, programs=(draft.settled(),), coarse=None)
    code = machine.load(emit_fixed(broken)[c_file("planar_3r", "c", Q30)], split=False)
    with pytest.raises(machine.StoppedError):
        code.kernel("planar_3r_q30_fk", [0, 0, 0], {})


def test_a_stroke_may_be_any_integer() -> None:
    """Strokes are finer than lengths, so that the whole range of an int32_t fits."""
    kernels = fixed("stanford")

    assert kernels.scales.stroke > kernels.scales.length
    assert 2.0 ** (31 - kernels.scales.stroke) >= 1.0
    assert any(each.operator is Operation.ROUND for each in kernels.programs[0].statements)


def test_a_stroke_that_is_tiny_beside_the_reach_gets_no_needless_bits() -> None:
    arms = "{name: j1, theta: q, d: 0, a: 900, alpha: 0}"
    feed = "{name: feed, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 1e-9]}"
    kernels = planned(arm(f"joints: [{arms}, {feed}]"))

    assert kernels.scales.length < kernels.scales.stroke <= kernels.scales.length + 20


def test_parameters_may_double() -> None:
    kernels = fixed("calibrated_2r")

    assert kernels.defaults[0] == round(0.4002 * 2**31)
    assert 2.0 ** (31 - kernels.scales.parameter) >= 2 * 0.4002
    assert kernels.defaults[2:] == tuple(round(degrees * 2**32 / 360) for degrees in (0.03, -0.02, 0.11))


def test_a_value_that_is_a_number_and_a_length_is_converted() -> None:
    """A link as long as the cosine of a twist of 60 degrees: c1/2 is both, and the scales differ."""
    kernels = planned(arm("joints: [{name: j1, theta: q, d: 2.5, a: 0.5, alpha: 60}]"))
    names = {name for program in kernels.programs for each in program.statements for name in each.results}

    assert kernels.scales.length == 29
    assert any(name.endswith(("_length", "_number")) for name in names)


def test_a_length_of_a_kind_that_only_constants_tell_is_found_by_its_size() -> None:
    """In millimetres no position of this arm fits the scale of numbers."""
    rows = "[{name: j1, theta: q, d: 0, a: 300, alpha: 40}, {name: j2, theta: q, d: 0, a: 200, alpha: 25}]"
    kernels = planned(arm(f"joints: {rows}", length="mm"))

    assert 20 <= kernels.scales.length <= 22
    assert all(max(program.errors) < 12 for program in kernels.programs)


def test_links_of_length_one_vanish_from_products_and_are_lengths_all_the_same() -> None:
    """1 + c2 stands where a1 + a2*c2 would."""
    kernels = planned(
        arm("joints: [{name: j1, theta: q, d: 0, a: 1, alpha: 90}, {name: j2, theta: q, d: 0, a: 1, alpha: 0}]")
    )

    assert kernels.scales.length == 29


def test_whole_multiples_of_angles_wrap() -> None:
    kernels = planned(arm("joints: [{name: j1, theta: -3*q + 90, d: 0, a: 1, alpha: 0}]"))
    operations = {each.operator: each for each in kernels.programs[0].statements}

    assert operations[Operation.TURN_TIMES].operands[1] in (Integer(3), Integer(2**32 - 3))


def test_part_of_an_angle_is_taken_where_its_limits_make_it_clear() -> None:
    rows = (
        "joints: [{name: j1, theta: q, d: 0, a: 1, alpha: 90, limits: [-180, 179.9]}, "
        "{name: j2, theta: 0.5*j1, d: 0, a: 1, alpha: 0}]"
    )
    kernels = planned(arm(rows))

    assert any(each.operator is Operation.TURN_PART for each in kernels.programs[0].statements)


LIFT = (
    "joints:\n  - {name: lift, theta: 0, d: q, a: 0, alpha: 0}\n  - {name: turn, theta: 2*lift, d: 0, a: 1, alpha: 0}"
)
FOLLOWER = "  - {name: j2, theta: 0.5*j1, d: 0, a: 1, alpha: 0}"
NUMBER = "parameters:\n  k: {value: 2, dimension: number, runtime: true}\n"
LENGTH = "parameters:\n  a: {value: 2, runtime: true}\n"
HALF = "1/2 of the angle of joint 'j1' is not clear in binary angles; give it limits within half a turn to either side"


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (
            "joints:\n  - {name: spindle, theta: q, d: 0.01*q, a: 0, alpha: 0}",
            6,
            "a length follows the angle of joint 'spindle', and binary angles do not count turns",
        ),
        (LIFT, 6, "an angle follows the shift of joint 'lift', and integers have no scale for that"),
        (f"joints:\n  - {{name: j1, theta: q, d: 0, a: 1, alpha: 90}}\n{FOLLOWER}", 6, HALF),
        (f"joints:\n  - {{name: j1, theta: q, d: 0, a: 1, alpha: 90, limits: [0, 180]}}\n{FOLLOWER}", 6, HALF),
        (
            f"{NUMBER}joints:\n  - {{name: j1, theta: q, d: 0, a: 0.1*k, alpha: 0}}",
            6,
            "runtime parameter 'k' is a plain number; only lengths and angles have a scale",
        ),
        (
            f"{LENGTH}joints:\n  - {{name: j1, theta: q, d: 0, a: 1/a, alpha: 0}}",
            None,
            "a runtime parameter is in a divisor",
        ),
        (
            f"{LENGTH}joints:\n  - {{name: j1, theta: q, d: 0, a: a*a, alpha: 0}}",
            None,
            "runtime parameters multiply two lengths, and a square has no scale",
        ),
        (
            "joints:\n  - {name: j1, theta: q, d: 0, a: 3e9, alpha: 0}",
            None,
            "lengths reach 3e+09 m, which 31 bits do not hold",
        ),
    ],
)
def test_what_integers_cannot_do_is_refused_in_one_line(text: str, line: int | None, message: str) -> None:
    place = "arm.yaml" if line is None else f"arm.yaml:{line}"
    with pytest.raises(KinegenError) as refusal:
        planned(arm(text))

    assert str(refusal.value) == f"{place}: no q30 kernels for arm: {message}"


@pytest.mark.parametrize("output", ["jacobian", "twist_local", "quaternion_wxyz", "inverse_pose"])
def test_what_is_no_pose_is_refused_in_one_line(output: str) -> None:
    robot = load(ROBOTS / "puma560.yaml")
    program = lower(derive(robot, parse_quantity(output)))

    with pytest.raises(KinegenError) as refusal:
        plan_fixed(robot, [program])

    message = f"q30 kernels compute pose, frames and position, not {output}; build the others separately, without q30"
    assert str(refusal.value) == f"puma560.yaml: {message}"


@pytest.mark.parametrize("twists", [(90, -90, 90, 0, 90), (90, -90, 30, 0, 45), (30, 45, 60)], ids=str)
def test_a_worm_of_forty_joints_is_no_problem(twists: tuple[int, ...]) -> None:
    """Bound one by one, values would double from joint to joint."""
    rows = (f"{{name: j{n}, theta: q, d: 0.1, a: 0.1, alpha: {twists[n % len(twists)]}}}" for n in range(40))
    robot = arm(f"joints: [{', '.join(rows)}]")
    scales, (program,) = plan_fixed(robot, [lower(derive(robot, Quantity.POSITION))])

    assert scales.length >= 27
    assert max(program.errors) < 5 * 40


def test_integers_are_nearest_and_opposite_numbers_stay_opposite() -> None:
    assert [nearest_integer(Fraction(n, 2)) for n in (-3, -2, -1, 0, 1, 2, 3)] == [-2, -1, -1, 0, 1, 1, 2]
    assert above(Fraction(1, 3)) > 1 / 3 > above(Fraction(1, 3)) - 1e-16
    assert above(Fraction(1, 2)) == 0.5
    assert LARGEST < 2**31


def test_binary_angles_leave_out_whole_turns() -> None:
    assert binary_angle(PI / 2) == 2**30
    assert binary_angle(-PI / 2) == 3 * 2**30
    assert binary_angle(9 * PI) == 2**31
    assert binary_angle(Fraction(0)) == 0
