"""Fixed transforms between joints keep what they do and lose turns."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray

from kinegen.derive.chain_forms import forms, without_last_turns
from kinegen.derive.transforms import Elementary, Shift, Turn

JOINTS = sp.symbols("q0:4", real=True)
RPY = (Turn(2, sp.Rational(1, 3)), Turn(1, -sp.pi / 5), Turn(0, sp.pi / 6))


def matrix(steps: Sequence[Elementary], values: dict[sp.Expr, float]) -> NDArray[np.float64]:
    """The product by its definition."""
    whole = np.eye(4)
    for step in steps:
        part = np.eye(4)
        if isinstance(step, Turn):
            angle = float(step.angle.subs(values))
            i, j = (step.axis + 1) % 3, (step.axis + 2) % 3
            part[i, i] = part[j, j] = np.cos(angle)
            part[i, j], part[j, i] = -np.sin(angle), np.sin(angle)
        else:
            part[step.axis, 3] = float(step.length.subs(values))
        whole = whole @ part
    return whole


def inclined(steps: Sequence[Elementary]) -> list[int]:
    """How many fixed turns that are no quarter turns stand before, between and behind turning joints.

    Those about the axis of a joint beside them are part of its turn.
    """
    found, last = [0], None
    for place, step in enumerate(steps):
        if not isinstance(step, Turn):
            continue
        if step.angle.free_symbols:
            found.append(0)
            last = step.axis
            continue
        follows = next((each for each in steps[place + 1 :] if isinstance(each, Turn)), None)
        beside = follows is not None and bool(follows.angle.free_symbols) and follows.axis == step.axis
        if not (2 * step.angle / sp.pi).is_Integer and step.axis != last and not beside:
            found[-1] += 1
        last = None
    return found


def chain(seed: int) -> list[Elementary]:
    draw = random.Random(f"chain {seed}")
    joints = list(JOINTS)
    steps: list[Elementary] = []
    for _ in range(draw.randint(4, 14)):
        kind, axis = draw.random(), draw.randrange(3)
        if kind < 0.25 and joints:
            q = joints.pop(0)
            steps.append(draw.choice((Turn, Turn, Shift))(axis, draw.choice((q, -q, q + sp.pi / 6))))
        elif kind < 0.7:
            angle = draw.choice(
                (sp.pi / 2, sp.pi / 6, sp.pi, -sp.pi / 3, sp.Rational(3, 10), sp.atan(sp.Rational(1, 2)))
            )
            steps.append(Turn(axis, angle))
        else:
            steps.append(Shift(axis, sp.Rational(draw.randint(1, 9), 10)))
    return steps


@pytest.mark.parametrize("seed", range(60))
def test_every_form_is_the_same_transform(seed: int) -> None:
    steps = chain(seed)
    values = dict(zip(JOINTS, np.random.default_rng(seed).uniform(-3, 3, 4).tolist(), strict=True))

    for (form,) in forms([steps]):
        np.testing.assert_allclose(matrix(form, values), matrix(steps, values), atol=1e-13, rtol=0)


@pytest.mark.parametrize("seed", range(20))
def test_every_form_of_several_chains_is_the_same_transforms(seed: int) -> None:
    trunk = chain(seed)
    chains = [trunk, [*trunk, *chain(seed + 100)], [*trunk, *chain(seed + 200)]]
    values = dict(zip(JOINTS, np.random.default_rng(seed).uniform(-3, 3, 4).tolist(), strict=True))

    for form in forms(chains):
        for found, steps in zip(form, chains, strict=True):
            np.testing.assert_allclose(matrix(found, values), matrix(steps, values), atol=1e-13, rtol=0)


ARMS = (*RPY, Turn(2, JOINTS[1]), *RPY, Turn(2, JOINTS[2]))


def test_where_chains_part_their_common_joint_has_one_offset() -> None:
    """Mounts behind the first joint stay: an offset of this joint for each arm would take a sine and cosine more."""
    arms = [(Turn(2, JOINTS[0]), Turn(2, tilt), *ARMS) for tilt in map(sp.Integer, (1, 2))]

    came, found = forms(arms)

    assert [arm[:5] for arm in found] == [arm[:5] for arm in came]
    assert [inclined(each)[2] for each in (came[0], found[0])] == [2, 1]


def test_chains_that_part_at_the_base_have_short_mounts_everywhere() -> None:
    arms = [(Turn(1, JOINTS[first]), *RPY, Turn(2, JOINTS[first + 1])) for first in (0, 2)]

    came, found = forms(arms)

    assert [[inclined(arm)[1] for arm in form] for form in (came, found)] == [[3, 3], [1, 1]]


def test_several_chains_have_no_form_that_takes_more() -> None:
    fingers = [(Turn(2, JOINTS[0]), Turn(2, tilt), Turn(0, JOINTS[1])) for tilt in map(sp.Integer, (1, 2))]

    assert list(forms(fingers)) == [tuple(fingers)]


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("before", range(3))
def test_a_mount_between_two_joints_has_one_turn_and_at_an_end_two(before: int, axis: int) -> None:
    steps = (*RPY, Turn(before, JOINTS[0]), Shift(0, sp.S.One), *RPY, Turn(axis, JOINTS[1]), *RPY)

    *_, (found,) = forms([steps])

    assert [number <= most for number, most in zip(inclined(found), (2, 1, 2), strict=True)] == [True] * 3


def test_slides_stay_where_they_are_in_one_form_and_are_moved_in_the_other() -> None:
    steps = (Turn(2, JOINTS[0]), *RPY, Shift(2, JOINTS[1]), *RPY, Turn(2, JOINTS[2]))

    _, (kept,), (moved,) = forms([steps])

    assert Shift(2, JOINTS[1]) in kept
    assert Shift(2, JOINTS[1]) not in moved
    assert inclined(moved) == [0, 1, 0]


@pytest.mark.parametrize("angle", [sp.pi / 6, sp.pi / 7, -sp.pi / 90])
def test_parts_of_pi_are_recognised(angle: sp.Expr) -> None:
    steps = (Turn(2, JOINTS[0]), Turn(1, sp.pi / 4), Turn(1, angle - sp.pi / 4), Shift(0, sp.S.One), Turn(2, JOINTS[1]))

    *_, (found,) = forms([steps])

    assert abs(next(step.angle for step in found if isinstance(step, Turn) and step.axis != 2)) == abs(angle)


@pytest.mark.parametrize("steps", [(), RPY, (Turn(0, JOINTS[0]), Turn(1, sp.pi / 2), Turn(2, JOINTS[1]))])
def test_a_chain_without_joints_or_with_quarter_turns_stays_as_it_is(steps: tuple[Elementary, ...]) -> None:
    assert list(forms([steps])) == [(steps,)]


def test_a_long_chain_stays_as_it_is() -> None:
    steps = [part for number in range(31) for part in (Turn(2, sp.Symbol(f"a{number}", real=True)), *RPY)]

    assert list(forms([steps])) == [(tuple(steps),)]


def test_fixed_turns_at_the_end_are_left_out() -> None:
    steps = (Turn(2, JOINTS[0]), Shift(0, sp.S.One), *RPY)

    assert without_last_turns(steps) == steps[:2]
    assert without_last_turns((Turn(0, JOINTS[0]),)) == (Turn(0, JOINTS[0]),)
    assert without_last_turns(RPY) == ()


def test_a_row_of_a_table_is_no_other_form() -> None:
    steps = [
        step
        for q in JOINTS
        for step in (Turn(2, q), Shift(2, sp.Rational(1, 3)), Shift(0, sp.Rational(1, 7)), Turn(0, 173 * sp.pi / 1800))
    ]

    assert list(forms([steps])) == [(tuple(steps),)]
