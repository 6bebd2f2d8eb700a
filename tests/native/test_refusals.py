"""What the array handling refuses, and what it hands on: on kernels of a made-up arm, without a build."""

from __future__ import annotations

import math
import operator
import pickle
import warnings
from typing import Any

import numpy as np
import pytest

from kinegen.runtime.vendored._engines import real_array, table_of
from kinegen.runtime.vendored._measures import condition_number, manipulability
from kinegen.runtime.vendored._overlap import check_apart, overlaps_itself
from kinegen.runtime.vendored._targets import checked_targets, is_pose
from tests.native import plain_arm
from tests.native.plain_arm import Params, fk, fk_jacobian, jacobian, single, twist, varied

Q = np.random.default_rng(5).uniform(-2, 2, (7, 2))


def frozen(shape: tuple[int, ...]) -> Any:
    """An array that cannot be written to."""
    array = np.empty(shape)
    array.flags.writeable = False
    return array


OUTS: dict[str, tuple[Any, type[Exception], str]] = {
    "read-only": (frozen((7, 4, 4)), ValueError, "fk: out is read-only"),
    "of another shape": (np.empty((6, 4, 4)), ValueError, r"fk: out has shape \(6, 4, 4\), expected \(7, 4, 4\)"),
    "of upper rows": (np.empty((7, 3, 4)), ValueError, r"fk: out has shape \(7, 3, 4\), expected \(7, 4, 4\)"),
    "of another type": (np.empty((7, 4, 4), np.float32), TypeError, "fk: out is of type float32, expected float64"),
    "of whole numbers": (np.empty((7, 4, 4), int), TypeError, "fk: out is of type int64, expected float64"),
    "masked": (np.ma.zeros((7, 4, 4)), TypeError, "fk: out is a MaskedArray, expected a plain NumPy array"),
    "a list": ([[0.0] * 4] * 4, TypeError, "fk: out is a list, expected a plain NumPy array"),
    "one row for all": (np.lib.stride_tricks.as_strided(np.empty((4, 4)), (7, 4, 4), (0, 32, 8)), ValueError, "itself"),
}


@pytest.mark.parametrize("case", OUTS)
def test_an_out_that_cannot_hold_the_result_is_refused(case: str) -> None:
    out, kind, message = OUTS[case]
    with pytest.raises(kind, match=message):
        fk(Q, out=out)


def test_an_out_in_the_memory_of_the_input_is_refused() -> None:
    room = np.zeros(7 * 16)
    with pytest.raises(ValueError, match="fk: out shares memory with q"):
        fk(room[:14].reshape(7, 2), out=room.reshape(7, 4, 4))


def test_results_that_share_memory_are_refused() -> None:
    room = np.zeros(28)
    with pytest.raises(ValueError, match="out for jacobian shares memory with base_T_tool"):
        fk_jacobian(Q[0], out=(room[:16].reshape(4, 4), room[10:22].reshape(6, 2)))


INPUTS: dict[str, tuple[Any, type[Exception], str]] = {
    "objects": (np.array([0.1, 0.2], object), TypeError, "fk: q has entries of type object"),
    "complex numbers": (np.array([0.1, 0.2j]), TypeError, "fk: q has entries of type complex128"),
    "dates": (np.array(["2026-01-01", "2026-01-02"], "M8[D]"), TypeError, "fk: q has entries of type datetime64"),
    "strings": (["a", "b"], TypeError, "fk: q has strings"),
    "masked": (np.ma.masked_array([0.1, 0.2], [False, True]), TypeError, "fk: q is a masked array"),
    "lists of different lengths": ([[0.1, 0.2], [0.3]], ValueError, "fk: q holds lists of different lengths"),
    "a joint too many": (np.zeros(3), ValueError, r"fk: q has shape \(3,\), expected \(..., 2\)"),
    "no axis": (0.5, ValueError, r"fk: q has shape \(\), expected \(..., 2\)"),
}


@pytest.mark.parametrize("case", INPUTS)
def test_inputs_that_are_no_joint_vectors_are_refused(case: str) -> None:
    given, kind, message = INPUTS[case]
    with pytest.raises(kind, match=message):
        fk(given)


def test_other_numbers_of_arrays_are_refused() -> None:
    with pytest.raises(TypeError, match=r"twist takes 2 arrays \(q, qd\), 1 given"):
        twist(Q)
    with pytest.raises(TypeError, match=r"fk takes 1 array \(q\), 2 given"):
        fk(Q, Q)


@pytest.mark.parametrize("layout", ["3x3", "joint", "", "4X4"])
def test_layouts_that_do_not_exist_are_refused(layout: Any) -> None:
    with pytest.raises(ValueError, match="no layout"):
        fk(Q, layout=layout)


def test_types_of_results_follow_those_of_inputs() -> None:
    kinds = {np.float16: np.float32, np.float32: np.float32, np.float64: np.float64, int: np.float64, bool: np.float64}
    for given, wanted in kinds.items():
        assert fk(Q.astype(given)).dtype == wanted
    assert single(Q).dtype == np.float32
    assert fk([0.1, 0.2]).dtype == np.float64


def test_poses_have_their_last_row() -> None:
    for found in (fk(Q), fk(Q.T, layout="joint_major").T.reshape(-1, 3, 4)):
        rows = found if found.shape[1] == 4 else np.concatenate([found, np.tile([[[0, 0, 0, 1]]], (7, 1, 1))], 1)
        np.testing.assert_array_equal(rows[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (7, 1)))
        np.testing.assert_allclose(np.linalg.det(rows), 1.0)


def test_kernels_unpickle_as_themselves() -> None:
    for kernel in (plain_arm.fk, plain_arm.jacobian, plain_arm.twist):
        assert pickle.loads(pickle.dumps(kernel)) is kernel  # noqa: S301 - ours


def test_what_is_bound_keeps_layout_and_parameters() -> None:
    out = np.empty((12, 7))
    fk.bind(np.ascontiguousarray(Q.T), out, layout="joint_major")()
    np.testing.assert_array_equal(out, fk(Q.T, layout="joint_major"))
    upper = np.empty((7, 3, 4))
    fk.bind(Q, upper, layout="3x4")()
    np.testing.assert_array_equal(upper, fk(Q)[:, :3])
    whole = np.empty((7, 4, 4))
    varied.bind(Q, whole, params=Params(2.0))()
    np.testing.assert_array_equal(whole, varied(Q, params=Params(2.0)))
    assert not np.allclose(whole, varied(Q))


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ((Q,), "bind takes 2 arrays"),
        ((Q, np.empty((7, 4, 4)), np.empty(3)), "bind takes 2 arrays"),
        ((Q.astype(int), np.empty((7, 4, 4))), "bind needs q as an array of float64 or float32"),
        ((Q.tolist(), np.empty((7, 4, 4))), "bind needs q as an array of float64 or float32"),
        ((Q.astype(np.float16), np.empty((7, 4, 4), np.float32)), "bind needs q as an array"),
    ],
)
def test_what_cannot_be_bound_is_refused(arrays: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        fk.bind(*arrays)


def test_parameters_of_each_configuration_are_its_own() -> None:
    offsets = np.linspace(0.0, 3.0, 7)
    found = varied(Q, params=Params(offsets))  # type: ignore[arg-type]
    for row, offset in enumerate(offsets):
        np.testing.assert_array_equal(found[row], varied(Q[row], params=Params(float(offset))))
    table = table_of([offsets, np.broadcast_to(np.float64(4.0), 7)], np.dtype(float))
    np.testing.assert_array_equal(table, np.stack([offsets, np.full(7, 4.0)], 1))


def test_masked_numbers_are_no_numbers_in_any_role() -> None:
    with pytest.raises(TypeError, match=r"arm: params\.L1 is a masked array"):
        real_array("arm", "params.L1", np.ma.masked_array([1.0], [True]))


# Memory ---------------------------------------------------------------------------------------------------------------


def test_parts_of_one_array_overlap_where_they_share_entries() -> None:
    room = np.zeros(20)
    check_apart("fk", "out", room[:10], [("q", room[10:]), ("qd", np.zeros(3))])
    check_apart("fk", "out", room[::2], [("q", room[1::2])])
    with pytest.raises(ValueError, match="fk: out shares memory with q"):
        check_apart("fk", "out", room[:10], [("q", room[9:])])


def test_what_takes_too_long_to_tell_counts_as_overlap(monkeypatch: pytest.MonkeyPatch) -> None:
    def tired(*_: Any, **__: Any) -> bool:
        raise np.exceptions.TooHardError if hasattr(np, "exceptions") else RuntimeError

    monkeypatch.setattr(np, "shares_memory", tired)
    with pytest.raises(ValueError, match="shares memory"):
        check_apart("fk", "out", np.zeros(3), [("q", np.zeros(3))])


def test_an_array_overlaps_itself_only_where_entries_share_memory() -> None:
    room = np.zeros((6, 4, 4))
    own = (room, room[::2], room[::-1], room.T, room[:, :3], room[..., ::2], room[:0], np.zeros(()), room[:1])
    shared = (
        np.broadcast_to(room[0], (3, 4, 4)),
        np.lib.stride_tricks.as_strided(room, (5, 4, 4), (64, 32, 8)),
        np.lib.stride_tricks.as_strided(room.ravel(), (4,), (4,)),
    )
    one_of_none = np.lib.stride_tricks.as_strided(room, (1, 4, 4), (0, 32, 8))

    assert not any(map(overlaps_itself, (*own, one_of_none)))
    assert all(map(overlaps_itself, shared))


# Measures -------------------------------------------------------------------------------------------------------------


def test_measures_are_those_of_the_singular_values() -> None:
    turned, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(6, 6)))
    matrix = turned @ np.diag([5.0, 4.0, 3.0, 2.0, 1.5, 0.5])

    assert manipulability(matrix) == pytest.approx(90.0)
    assert condition_number(matrix) == pytest.approx(10.0)
    assert manipulability(matrix[:, :2]) == pytest.approx(20.0)


def test_measures_of_singular_and_of_spoilt_jacobians() -> None:
    matrices = np.stack([np.eye(3), np.diag([1.0, 1.0, 0.0]), np.full((3, 3), np.nan), np.diag([1.0, np.inf, 1.0])])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(manipulability(matrices), [1.0, 0.0, math.nan, math.nan])
        np.testing.assert_array_equal(condition_number(matrices), [1.0, math.inf, math.nan, math.nan])


@pytest.mark.parametrize("wrong", [np.zeros(6), np.zeros((0, 3)), np.zeros((2, 3, 0)), np.eye(2) * 1j])
def test_measures_of_what_is_no_jacobian_are_refused(wrong: Any) -> None:
    for measure in (manipulability, condition_number):
        with pytest.raises(ValueError, match="a Jacobian has the shape"):
            measure(wrong)


# Targets --------------------------------------------------------------------------------------------------------------


def target(**changes: float) -> Any:
    """A pose of the arm with some entries replaced: `r01=0.5` is row 0, column 1."""
    found = fk(np.array([0.3, 0.7]))
    for place, value in changes.items():
        found[int(place[1]), int(place[2])] = value
    return found


def turned(matrix: Any, scale: Any) -> Any:
    """A target whose rotation is multiplied from the right."""
    found = matrix.copy()
    found[:3, :3] = found[:3, :3] @ np.asarray(scale)
    return found


NO_POSES: dict[str, tuple[Any, str]] = {
    "scaled": (turned(target(), np.eye(3) * 1.001), "columns are not orthonormal"),
    "scaled column": (turned(target(), np.diag([1.0, 1.001, 1.0])), "columns are not orthonormal"),
    "first column": (turned(target(), np.diag([1.001, 1.0, 1.0])), "columns are not orthonormal"),
    "scaled rows": (
        np.diag([1.001, 1.0, 1.001, 1.0]) @ target(r03=0.0, r13=0.0, r23=0.0),
        "columns are not orthonormal",
    ),
    "skew": (turned(target(), [[1, 1e-3, 0], [0, 1, 0], [0, 0, 1]]), "columns are not orthonormal"),
    "skew about x": (turned(target(), [[1, 0, 0], [0, 1, 1e-3], [0, 0, 1]]), "columns are not orthonormal"),
    "reflection": (turned(target(), np.diag([1.0, 1.0, -1.0])), "reflection"),
    "last row": (target(r30=0.1), "last row"),
    "last row, middle": (target(r32=0.1), "last row"),
    "last entry": (target(r33=2.0), "last row"),
    "NaN position": (target(r13=math.nan), "not finite"),
    "NaN rotation": (target(r11=math.nan), "not finite"),
    "infinite position": (target(r03=math.inf), "not finite"),
}


@pytest.mark.parametrize("case", NO_POSES)
def test_targets_that_are_no_poses_are_refused_alone_and_among_others(case: str) -> None:
    matrix, words = NO_POSES[case]
    good = np.stack([target()] * 5)

    with pytest.raises(ValueError, match=words):
        checked_targets("inverse", matrix)
    with pytest.raises(ValueError, match=rf"inverse: base_T_tool\[3\].*{words}"):
        checked_targets("inverse", np.concatenate([good[:3], matrix[None], good]))
    assert not is_pose(matrix)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_rounded_poses_are_targets(real: Any) -> None:
    poses = fk(Q).astype(real)

    np.testing.assert_array_equal(checked_targets("inverse", poses), poses, strict=True)
    assert all(map(is_pose, poses))
    np.testing.assert_array_equal(checked_targets("inverse", np.round(fk(Q), 5).astype(np.float32)).shape, (7, 4, 4))


@pytest.mark.parametrize(("digits", "real", "allowed"), [(4, np.float64, "1e-06"), (3, np.float32, "1e-04")])
def test_a_rounded_rotation_is_refused_with_its_deviation_and_the_line_that_mends_it(
    digits: int, real: Any, allowed: str
) -> None:
    poses = np.round(fk(Q), digits).astype(real)
    columns = poses[1, :3, :3].astype(float).T.tolist()
    off = max(abs(sum(map(operator.mul, a, b)) - (a is b)) for a in columns for b in columns)
    words = rf"an entry of R\^T R is off by {off:.1e}, and {allowed} is allowed in {np.dtype(real)}; "
    with pytest.raises(ValueError, match=words) as refused:
        checked_targets("inverse", poses[1])
    line = str(refused.value).partition("; ")[2].partition(" gives")[0]
    known = {"np": np, "R": poses[..., :3, :3]}
    exec(line, known)  # noqa: S102 - the line that the message gives
    poses[..., :3, :3] = known["R"]

    assert line == "u, _, vt = np.linalg.svd(R); R = u @ vt"
    np.testing.assert_array_equal(checked_targets("inverse", poses), poses)
    np.testing.assert_allclose(poses, fk(Q), atol=2 * 10.0**-digits)


def test_jacobians_of_the_arm_are_no_targets() -> None:
    with pytest.raises(ValueError, match=r"has shape \(7, 6, 2\), expected \(..., 4, 4\)"):
        checked_targets("inverse", jacobian(Q))
