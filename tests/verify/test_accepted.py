"""What is accepted is the smaller of two limits, entries without one are counted, tables show the largest errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.backends.accuracy import bound_over, fraction_box
from kinegen.io.load import load, loads
from kinegen.ir.error_analysis import Ranges
from kinegen.ir.lower import program_of, runtime_defaults
from kinegen.model.outputs import Array, Kind, Quantity, parse_quantity
from kinegen.model.robot import Robot
from kinegen.ui.cli.build_record import gaps, table_lines
from kinegen.verify import reference
from kinegen.verify.compare import Judge
from kinegen.verify.expectations import Expectation, Limits, expect
from kinegen.verify.records import Comparison, Invocation, Proof
from kinegen.verify.reference_cache import ReferenceResults
from kinegen.verify.samples import input_samples, proof_samples
from kinegen.verify.tolerances import LOST, accepted, number_type
from tests.verify.test_tolerances import chain

ROBOTS = Path(__file__).parents[2] / "robots"
IIWA, PUMA = load(ROBOTS / "iiwa14.yaml"), load(ROBOTS / "puma560.yaml")
POSE = Comparison(Invocation("C", "double"), Quantity.POSE, 10, 2e-16, 1e-16, 1e-15, 1e-15, (0.1, 0.2), "tool")


def at(robot: Robot, name: str, step: int = 400) -> Expectation:
    """What an output must be at some of the samples."""
    arrays = [Array("q", (robot.dof,)), Array("qd", (robot.dof,)), Array("qdd", (robot.dof,))]
    known = ReferenceResults(robot, input_samples(robot, arrays, proof_samples(robot)[::step]))
    return expect(known, parse_quantity(name))


def flat(limits: Limits, expectation: Expectation) -> tuple[Any, Any]:
    """The limits of lengths and of all other entries, a row each."""
    found = []
    for part in (0, 1):
        pairs = [
            np.broadcast_to(limits[result][frame][part], splits[part].shape).ravel()
            for result, frames in enumerate(expectation.wanted)
            for frame, splits in enumerate(frames)
        ]
        found.append(np.concatenate(pairs))
    return found[0], found[1]


@pytest.mark.parametrize("name", ["hessian", "pose", "jacobian"])
@pytest.mark.parametrize("real", ["double", "float"])
def test_no_limit_is_above_the_proven_bound_or_above_what_rounding_does(name: str, real: str) -> None:
    expectation, program = at(IIWA, name), program_of(IIWA, parse_quantity(name))
    kind = number_type(real)
    found = flat(accepted(expectation, program, kind), expectation)
    spread = flat(accepted(expectation, program, kind, within=False), expectation)
    proven = bound_over(program, Ranges(fraction_box(IIWA), runtime_defaults(IIWA)), kind).entries
    unit, lost = float(kind.unit), 64 * 100 * 2.0**-64

    for both, rounding in zip(found, spread, strict=True):
        assert both.size
        assert both.max() <= max(proven) * 1.001 + lost
        # Sharp bounds are taken as they are; others may not be wider than the spread.
        if max(proven) > 64 * unit * max(expectation.length_scale, expectation.number_scale):
            assert (both <= rounding * (1 + 1e-9)).all()


def test_both_limits_count_somewhere() -> None:
    """In the Hessian of seven joints some proven bounds are wider than what rounding does, and others are not."""
    expectation, program = at(IIWA, "hessian"), program_of(IIWA, parse_quantity("hessian"))
    kind = number_type("double")
    found = flat(accepted(expectation, program, kind), expectation)
    spread = flat(accepted(expectation, program, kind, within=False), expectation)
    less = [np.count_nonzero(one < other * (1 - 1e-6)) for one, other in zip(found, spread, strict=True)]
    same = [np.count_nonzero(one >= other * (1 - 1e-6)) for one, other in zip(found, spread, strict=True)]

    assert sum(less) > 0
    assert sum(same) > 0
    assert all((one <= other * (1 + 1e-9)).all() for one, other in zip(found, spread, strict=True))


def sums(joints: int, turns: int) -> tuple[Robot, Expectation, Limits]:
    """Parallel joints of many turns: their poses in float, which lose digits with the size of the angles."""
    robot = loads(chain(joints, str(360 * turns), "0.1", "m"), "chain.yaml")
    # From no turn at all to the ends of the limits.
    points = np.linspace(0.0, 1.99 * np.pi * turns, 20)[:, None] * np.ones(joints)
    expectation = expect(ReferenceResults(robot, {"q": points}), Quantity.POSE)
    return (
        robot,
        expectation,
        accepted(expectation, program_of(robot, Quantity.POSE), number_type("float"), within=False),
    )


def test_entries_with_few_digits_left_are_compared_all_the_same() -> None:
    """Angles up to ten thousand radians in float: three digits are left, and these have to be right."""
    robot, expectation, limits = sums(16, 100)
    verdict = expectation.judge((reference.fk(robot, expectation.known.joints),), limits)
    _, numbers = flat(limits, expectation)

    assert numbers.max() > 1e-4
    assert numbers.max() < LOST
    assert verdict.uncompared == 0
    assert verdict.compared == 16 * len(expectation.known.joints)


def test_entries_without_any_digit_are_counted() -> None:
    """Beyond 12000 rad the float kernels give NaN, and there is nothing to compare."""
    robot, expectation, limits = sums(64, 100)
    verdict = expectation.judge((reference.fk(robot, expectation.known.joints),), limits)

    assert verdict.uncompared > 0
    assert verdict.compared > 0
    assert verdict.compared + verdict.uncompared == 16 * len(expectation.known.joints)


def test_the_largest_error_is_reported_with_its_own_limit_and_the_worst_share_apart() -> None:
    """One entry is off by more, another is off by a greater part of what is accepted of it."""
    expectation = at(PUMA, "position", 1000)
    known = expectation.known
    limits: Limits = (((np.array([[1e-3, 1e-6, 1e-3]]), np.zeros((1, 0))),),)
    positions = reference.fk(PUMA, known.joints)[:, :3, 3].copy()
    positions[2, 0] += 5e-4
    positions[1, 1] += 9e-7
    verdict = expectation.judge((positions,), limits)

    assert verdict.position_error == pytest.approx(5e-4)
    assert verdict.position_limit == 1e-3
    assert verdict.share == pytest.approx(0.9)
    assert verdict.row == 1


@pytest.mark.parametrize("place", [(2, 0), (1, 1)])
def test_a_nan_or_an_error_above_any_limit_does_not_hold(place: tuple[int, int]) -> None:
    expectation = at(PUMA, "position", 1000)
    judge = Judge(expectation, program_of(PUMA, Quantity.POSITION), "double")
    positions = reference.fk(PUMA, expectation.known.joints)[:, :3, 3]
    assert judge.compare(Invocation("C", "double"), (positions,)).holds

    for wrong in (np.nan, np.inf, positions[place] + 1e-3):
        spoilt = positions.copy()
        spoilt[place] = wrong
        assert not judge.compare(Invocation("C", "double"), (spoilt,)).holds


def test_a_share_above_one_does_not_hold_whatever_the_largest_errors_are() -> None:
    assert replace(POSE, worst_share=0.99).holds
    assert not replace(POSE, worst_share=1.01).holds
    assert not replace(POSE, worst_share=float("nan")).holds
    assert not replace(POSE, position_error=float("nan")).holds


def test_what_is_zero_everywhere_is_marked() -> None:
    expectation = at(PUMA, "position", 1000)
    judge = Judge(expectation, program_of(PUMA, Quantity.POSITION), "double")
    positions = reference.fk(PUMA, expectation.known.joints)[:, :3, 3]
    nothing = replace(expectation, wanted=(((np.zeros_like(positions), positions[:, :0]),),))

    assert not judge.compare(Invocation("C", "double"), (positions,)).is_zero
    assert nothing.judge((np.zeros_like(positions),), judge.limits()).is_zero


def test_tables_name_what_they_do_not_show() -> None:
    position = replace(POSE, quantity=Quantity.POSITION)
    rows = (replace(POSE, compared=90, uncompared=10), replace(position, is_zero=True), replace(position, is_zero=True))

    first, second = gaps(rows)

    assert first.startswith("not compared: 10 of 100 numbers")
    assert second == "0 at every joint vector that was tried, so the comparison shows no more than that: position"
    assert not list(gaps((POSE, position, replace(position, is_zero=True))))


def test_a_row_shows_the_largest_errors_of_its_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel that is nearest to its limit is another than the one with the largest error."""
    monkeypatch.setattr("kinegen.ui.cli.build_record.good", str)
    near = replace(POSE, quantity=Quantity.POSITION, position_error=9e-17, position_tolerance=1e-16)
    far = replace(POSE, position_error=7.6e-5, position_tolerance=9.2e-5, rotation_error=3e-9, rotation_tolerance=1e-8)
    result: Any = type("Result", (), {"robot": PUMA, "proof": Proof(1.0, (near, far))})()
    row = next(line for line in table_lines(result) if "C double" in line).split()

    assert row[2:] == ["20", "7.6e-05", "9.2e-05", "m", "3.0e-09", "1.0e-08", "rad", "90", "%", "position", "pass"]


def test_errors_of_other_units_have_rows_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Jacobian in m/rad is no position, and says so; an output that is 0 everywhere says that."""
    monkeypatch.setattr("kinegen.ui.cli.build_record.good", str)
    jacobian = replace(POSE, quantity=Quantity(Kind.JACOBIAN), position_error=9e-5, position_tolerance=1e-4)
    twist = replace(jacobian, quantity=Quantity(Kind.TWIST), is_zero=True)
    result: Any = type("Result", (), {"robot": PUMA, "proof": Proof(1.0, (POSE, jacobian, twist))})()
    first, second, third = [line.split() for line in table_lines(result) if line.startswith("    C double")]

    assert (first[5], second[5], third[5]) == ("m", "m/rad", "m/s")
    assert (second[3], second[4]) == ("9.0e-05", "1.0e-04")
    assert third[-4:] == ["twist", "(0", "everywhere)", "pass"]
