"""Results by name: parts of arrays that a kernel gave, on a made-up arm with two tips, without a build."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kinegen.runtime.vendored._engines import Array
from kinegen.runtime.vendored._names import NamedKernel
from tests.native import plain_arm

POSES, JACOBIANS = Array("base_T_tips", (2, 4, 4), is_pose=True), Array("jacobians", (2, 6, 2))
Q = np.random.default_rng(3).uniform(-2, 2, (5, 2))


def _poses(q: Any) -> Any:
    """The tip of the arm, and one that is 1 m above it."""
    pose = plain_arm._pose(q)
    return *pose, *pose[:11], pose[11] + 1.0


def _both(q: Any) -> Any:
    jacobian = plain_arm._jacobian(q)
    return *_poses(q), *jacobian, *(2 * each for each in jacobian)


def made(name: str, formula: Any, results: tuple[Array, ...]) -> NamedKernel[Any]:
    """A kernel with the tips `low` and `high`."""
    options: Any = {"module": __name__, "symbol": "", "inputs": (plain_arm.Q,), "reals": ("float64", "float32")}
    return NamedKernel(name, names=("low", "high"), results=results, formula=formula, **options)


fk, fk_jacobian = made("fk", _poses, (POSES,)), made("fk_jacobian", _both, (POSES, JACOBIANS))


@pytest.mark.parametrize("layout", ["4x4", "3x4", "joint_major"])
def test_a_part_is_what_the_arm_of_one_tip_gives(layout: Any) -> None:
    q = np.ascontiguousarray(Q.T) if layout == "joint_major" else Q
    alone, parts = plain_arm.fk(q, layout=layout), fk.by_name(q, layout=layout)

    assert np.array_equal(parts["low"], alone)
    assert not np.array_equal(parts["high"], alone)
    assert parts["high"].base is parts.result.base or parts["high"].base is parts.result


def test_parts_of_several_results_are_of_the_same_tip() -> None:
    pose, jacobian = fk_jacobian.by_name(Q)["high"]

    assert np.array_equal(pose[:, 2, 3], plain_arm.fk(Q)[:, 2, 3] + 1.0)
    assert np.array_equal(jacobian, 2 * plain_arm.jacobian(Q))


@pytest.mark.parametrize("result", [(np.zeros((2, 4, 4)),), (np.zeros((2, 4, 4)),) * 2, ()], ids=len)
def test_one_array_is_not_taken_from_a_tuple(result: tuple[Any, ...]) -> None:
    with pytest.raises(TypeError, match=r"^fk: the result is not an array$"):
        fk.named(result)


@pytest.mark.parametrize("count", [0, 1, 3])
def test_two_arrays_are_taken_from_a_tuple_of_two_alone(count: int) -> None:
    room = (np.zeros((2, 4, 4)), np.zeros((2, 6, 2)), np.zeros((2, 6, 2)))
    with pytest.raises(TypeError, match=r"^fk_jacobian: the result is not a tuple of 2 arrays$"):
        fk_jacobian.named(room[:count])
    with pytest.raises(TypeError, match=r"^fk_jacobian: the result is not a tuple of 2 arrays$"):
        fk_jacobian.named(room[0])


WRONG = {
    "another number of tips": (
        np.zeros((3, 4, 4)),
        "4x4",
        ValueError,
        r"has shape \(3, 4, 4\), expected \(..., 2, 4, 4\)",
    ),
    "matrices of another layout": (np.zeros((5, 2, 3, 4)), "4x4", ValueError, r"expected \(..., 2, 4, 4\)"),
    "rows for columns": (np.zeros((5, 24)), "joint_major", ValueError, r"has shape \(5, 24\), expected \(24, N\)"),
    "one column": (np.zeros(24), "joint_major", ValueError, r"expected \(24, N\)"),
    "a list": ([[0.0]], "4x4", TypeError, "base_T_tips is a list, expected a NumPy array"),
    "no layout": (np.zeros((2, 4, 4)), "rows", ValueError, "no layout 'rows'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_arrays_that_the_kernel_cannot_have_given_are_refused(case: str) -> None:
    result, layout, kind, message = WRONG[case]
    with pytest.raises(kind, match=message):
        fk.named(result, layout=layout)  # type: ignore[arg-type]


def test_an_unknown_name_is_told_with_the_known_ones() -> None:
    parts = fk.by_name(Q)

    assert (list(parts), len(parts), repr(parts)) == (["low", "high"], 2, "<results of 2 tips: low, high>")
    with pytest.raises(KeyError, match=r"there is no tip 'middle' \(there are low, high\)"):
        parts["middle"]


def test_options_reach_the_kernel() -> None:
    out = np.empty((5, 2, 4, 4))

    assert fk.by_name(Q, out=out, threads=2).result is out
    assert np.array_equal(out, fk(Q))
