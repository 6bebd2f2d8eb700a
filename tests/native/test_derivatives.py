"""Derivatives made of Jacobians and Hessians, against differences; and what XLA hands to a kernel."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

from kinegen.runtime.vendored import _xla
from kinegen.runtime.vendored._derivatives import (
    NoDerivativeError,
    Part,
    kernels_of,
    partials,
    pulled,
    pushed,
    sources_of,
    stem_of,
)
from kinegen.runtime.vendored._gradients import _BLOCK, gradient, is_quick
from tests.native import plain_arm
from tests.native.plain_arm import MODULE

STEP = 1e-6
KNOWN = ("fk", "jacobian", "hessian", "position", "twist", "fk_jacobian")
Q = np.random.default_rng(8).uniform(-2, 2, (5, 2))
QD = np.random.default_rng(9).uniform(-2, 2, (5, 2))


def evaluate(name: str, *inputs: Any) -> Any:
    """A kernel of the made-up arm."""
    return getattr(plain_arm, name)(*inputs)


def values(name: str, *inputs: Any) -> tuple[Any, ...]:
    """All results as a tuple."""
    found = evaluate(name, *inputs)
    return found if isinstance(found, tuple) else (found,)


def inputs_of(name: str) -> list[Any]:
    return [Q, QD][: len(getattr(plain_arm, name).inputs)]


def moved(inputs: list[Any], place: int, rates: Any, size: float) -> list[Any]:
    return [each + size * rates if index == place else each for index, each in enumerate(inputs)]


@pytest.mark.parametrize("name", ["fk", "jacobian", "position", "twist", "fk_jacobian"])
def test_rates_are_those_of_differences(name: str) -> None:
    inputs = inputs_of(name)
    rates = np.random.default_rng(1).normal(size=Q.shape)
    parts = partials(name, KNOWN, evaluate, inputs)
    for place in range(len(inputs)):
        sides = [values(name, *moved(inputs, place, rates, side * STEP)) for side in (1, -1)]
        for result, (more, less) in enumerate(zip(*sides, strict=True)):
            found = pushed(parts[result][place], rates, more.ndim - 1, np.stack)
            np.testing.assert_allclose(found, (more - less) / (2 * STEP), atol=1e-8)


@pytest.mark.parametrize("name", ["fk", "jacobian", "position", "twist", "fk_jacobian"])
def test_gradients_do_the_work_of_rates(name: str) -> None:
    """For any gradient g of a result and any rates r: g . (dy r) = (dy^T g) . r, along poses that stay poses."""
    inputs, generator = inputs_of(name), np.random.default_rng(2)
    rates = generator.normal(size=Q.shape)
    parts = partials(name, KNOWN, evaluate, inputs)
    for result, value in enumerate(values(name, *inputs)):
        given = generator.normal(size=value.shape)
        for part in parts[result]:
            along = (given * pushed(part, rates, value.ndim - 1, np.stack)).reshape(len(Q), -1).sum(1)
            back = (pulled(part, given, value.ndim - 1, np.stack) * rates).sum(1)
            np.testing.assert_allclose(back, along, atol=1e-12)


def test_rates_and_gradients_of_a_pose_that_turns_about_any_axis() -> None:
    """dR = w x R and dp = v; a gradient does the same work by the pose as its wrench does by the twist."""
    generator = np.random.default_rng(6)
    turned, _ = np.linalg.qr(generator.normal(size=(4, 3, 3)))
    pose = np.concatenate([np.concatenate([turned, generator.normal(size=(4, 3, 1))], 2), np.zeros((4, 1, 4))], 1)
    slopes, rates, given = (generator.normal(size=size) for size in ((4, 6, 3), (4, 3), (4, 4, 4)))
    twist = np.einsum("nij,nj->ni", slopes, rates)
    changed = pushed(Part(slopes, pose), rates, 2, np.stack)

    np.testing.assert_allclose(changed[:, :3, :3], np.cross(twist[:, None, 3:], turned, axisb=1, axisc=1), atol=1e-14)
    np.testing.assert_allclose(changed[:, :3, 3], twist[:, :3], atol=1e-14)
    np.testing.assert_array_equal(changed[:, 3], 0.0)
    np.testing.assert_allclose(
        (pulled(Part(slopes, pose), given, 2, np.stack) * rates).sum(1), (given * changed).sum((1, 2)), atol=1e-12
    )


@pytest.mark.parametrize("name", ["fk", "jacobian", "position"])
@pytest.mark.parametrize("count", [0, 1, 5, _BLOCK + 3])
def test_gradients_in_blocks_are_those_of_the_parts(name: str, count: int) -> None:
    q = np.resize(Q, (count, 2))
    given = np.random.default_rng(4).normal(size=getattr(plain_arm, name)(q).shape)
    (part,), *_ = partials(name, KNOWN, evaluate, [q])
    found = gradient(kernels_of(MODULE), name, q, given, 2)

    assert is_quick(name)
    np.testing.assert_allclose(found, pulled(part, given, given.ndim - 1, np.stack), atol=1e-12)


def test_the_joint_of_a_second_derivative_comes_last() -> None:
    """In numbers that have no symmetry: a kernel gives (..., joint of the derivative, row, joint)."""
    generator = np.random.default_rng(7)
    hessian, rates, given = (generator.normal(size=size) for size in ((5, 2, 6, 2), (5, 2), (5, 6, 2)))

    def numbers(name: str, *_: Any) -> Any:
        return hessian if name == "hessian" else np.zeros((5, 6, 2))

    (second,), *_ = partials("jacobian", KNOWN, numbers, [Q])
    (twist, _), *_ = partials("twist", KNOWN, numbers, [Q, rates])
    np.testing.assert_array_equal(second.slopes, np.einsum("nkij->nijk", hessian))
    np.testing.assert_allclose(twist.slopes, np.einsum("nkij,nj->nik", hessian, rates), atol=1e-14)

    constant = plain_arm.kernel("hessian", lambda _: hessian[0].ravel(), (plain_arm.Q,), (plain_arm.HESSIAN,))
    found = gradient({"jacobian": plain_arm.jacobian, "hessian": constant}, "jacobian", Q, given, 1)
    np.testing.assert_allclose(found, np.einsum("kij,nij->nk", hessian[0], given), atol=1e-12)


def test_what_has_no_derivative_says_which_output_is_missing() -> None:
    with pytest.raises(NoDerivativeError, match="takes the output jacobian, which this package was built without"):
        sources_of("fk", ("fk",))
    with pytest.raises(NoDerivativeError, match="takes the output jacobian@elbow"):
        sources_of("fk_elbow", ("fk_elbow", "jacobian"))
    with pytest.raises(NoDerivativeError, match="hessian: kinegen has no derivative"):
        sources_of("hessian", KNOWN)


def test_runtime_parameters_are_one_more_input() -> None:
    """A table of them (..., P) follows the joint values; the kernels that are asked for are given it as well."""
    generator = np.random.default_rng(3)
    table, slopes = generator.normal(size=(5, 3)), generator.normal(size=(5, 6, 3))

    def numbers(name: str, *inputs: Any) -> Any:
        assert inputs[-1] is table
        return slopes if name == "parameter_jacobian" else evaluate(name, inputs[0])

    known = (*KNOWN, "parameter_jacobian")
    for name, pose in (("position", None), ("fk", plain_arm.fk(Q))):
        ((by_joints, by_parameters),) = partials(name, known, numbers, [Q, table])
        rows = slopes if name == "fk" else slopes[:, :3]
        np.testing.assert_array_equal(by_parameters.slopes, rows)
        assert (by_parameters.pose is None) == (pose is None)
        np.testing.assert_array_equal(by_joints.slopes, plain_arm.jacobian(Q)[:, : rows.shape[1]])
        # What is not wanted is neither computed nor missed.
        assert partials(name, ("fk", "parameter_jacobian"), numbers, [Q, table], [False, True])[0][0] is None
        assert partials(name, KNOWN, numbers, [Q, table], [True, False])[0][1] is None


@pytest.mark.parametrize(
    ("name", "known", "lacking", "message"),
    [
        ("jacobian", KNOWN, (), "jacobian: kinegen has no derivative of this output by runtime parameters"),
        ("fk_elbow", (), (), "by runtime parameters takes the output parameter_jacobian@elbow, which this package was"),
        ("fk", ("parameter_jacobian",), ("a2", "d3"), r"has no column for a2, d3 \(name all .* --wrt, or none\)"),
    ],
)
def test_derivatives_by_parameters_that_no_kernel_has_are_refused(
    name: str, known: tuple[str, ...], lacking: tuple[str, ...], message: str
) -> None:
    with pytest.raises(NoDerivativeError, match=message):
        partials(name, known, evaluate, [Q, np.zeros((5, 3))], [False, True], lacking)


def test_names_of_frames_are_no_part_of_the_output() -> None:
    assert stem_of("fk_elbow") == ("fk", "_elbow")
    assert stem_of("fk_jacobian_local_elbow") == ("fk_jacobian_local", "_elbow")
    assert sources_of("fk_elbow", ("jacobian_elbow",)) == ("jacobian_elbow",)


# XLA ------------------------------------------------------------------------------------------------------------------


def buffers(arrays: list[Any]) -> tuple[Any, list[Any]]:
    """Arrays as XLA lists them, and what has to live as long."""
    kept: list[Any] = []
    places = (ctypes.POINTER(_xla._Buffer) * len(arrays))()
    for index, array in enumerate(arrays):
        extents = (ctypes.c_int64 * array.ndim)(*array.shape)
        buffer: Any = _xla._Buffer()
        buffer.dtype = {np.dtype(np.float32): 11, np.dtype(np.float64): 12}[array.dtype]
        buffer.data, buffer.rank = array.ctypes.data, array.ndim
        buffer.dims = ctypes.cast(extents, ctypes.POINTER(ctypes.c_int64))
        places[index] = ctypes.pointer(buffer)
        kept += [extents, buffer]
    listed: Any = _xla._List()
    listed.size, listed.items = len(arrays), ctypes.cast(places, ctypes.POINTER(ctypes.c_void_p))
    return listed, [*kept, places]


def execute(compute: Any, arguments: list[Any], results: list[Any], stage: int = 3) -> list[tuple[str, int]]:
    """Call a handler as XLA does; the errors that it records."""
    errors: list[tuple[str, int]] = []

    @_xla._Create
    def create(error: Any) -> int:
        errors.append((error.contents.message.decode(), error.contents.code))
        return 1

    api: Any = _xla._Api()
    api.error_create = ctypes.cast(create, ctypes.c_void_p)
    frame: Any = _xla._Frame()
    frame.api, frame.stage = ctypes.pointer(api), stage
    (frame.arguments, kept), (frame.results, also) = buffers(arguments), buffers(results)
    answer = _xla.handler(compute)(ctypes.byref(frame))
    assert bool(answer) == bool(errors)
    assert kept
    assert also
    return errors


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_a_handler_computes_from_and_into_the_memory_of_xla(real: Any) -> None:
    q, found = Q.astype(real), np.zeros((5, 4, 4), real)

    def compute(arguments: list[Any], results: list[Any]) -> None:
        plain_arm.fk(arguments[0], out=results[0])

    assert execute(compute, [q], [found]) == []
    np.testing.assert_array_equal(found, plain_arm.fk(q))


def test_a_handler_computes_in_one_stage_alone() -> None:
    for stage in (0, 1, 2):
        assert execute(lambda *_: pytest.fail("computed"), [Q], [Q.copy()], stage) == []


def test_arguments_of_xla_cannot_be_written_and_errors_reach_it() -> None:
    def compute(arguments: list[Any], _results: list[Any]) -> None:
        arguments[0][0] = 1.0

    ((message, code),) = execute(compute, [Q.copy()], [Q.copy()])

    assert message == "ValueError: assignment destination is read-only"
    assert code == 13
