"""What the compiled kernels compute: the same bits from every compiler, in every layout, at every place of a batch."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import USUAL, Quantity
from kinegen.verify import reference
from kinegen.verify.reference_cache import quantity_frames
from tests.emit.emitted import COMPILERS, kernels, tile
from tests.emit.libraries import DTYPES, LAYOUTS, Floats, Library, bits, compile_library, full, rows

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

# gcc 12 fuses a product into a sum and a difference side by side even with contraction off; the headers say so.
FASTEST = ("-O3", "-march=native", "-fno-tree-slp-vectorize")
LEVELS = {"gcc": (("-O0",), ("-O1",), ("-O2",), ("-O3",), FASTEST), "clang": (("-O0",), ("-O2",), FASTEST)}
WAYS = [(compiler, level) for compiler in COMPILERS for level in LEVELS[compiler]]
TOLERANCE = {ScalarType.DOUBLE: 1e-13, ScalarType.FLOAT: 2e-6}
"""As in a proof."""


@pytest.fixture(scope="module")
def library(folder_of: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Library]:
    """The library of a robot, as a quick build makes it."""
    folder = tmp_path_factory.mktemp("libraries")

    @cache
    def get(name: str) -> Library:
        return compile_library(folder, folder_of(name), name, COMPILERS[0], "-O1")

    return get


def configurations(name: str, real: ScalarType, count: int) -> Floats:
    """Random joint vectors, the first one all zeros."""
    q = np.random.default_rng(5).uniform(-4, 4, (count, kernels(name).robot.dof)).astype(DTYPES[real])
    q[:1] = 0
    return q


@pytest.mark.parametrize("quantity", list(USUAL))
def test_scalar_kernels_agree_with_the_reference(
    quantity: Quantity, name: str, real: ScalarType, library: Callable[[str], Library]
) -> None:
    robot, q = kernels(name).robot, configurations(name, real, 50)
    known = reference.frames(robot, q.astype(float))
    expected = np.stack([known[frame] for frame in quantity_frames(robot, quantity)], axis=1)
    found = library(name).scalar(quantity, q)
    if quantity.is_pose:
        np.testing.assert_array_equal(found[..., 12:], np.broadcast_to([0, 0, 0, 1], (*found.shape[:2], 4)))
        found, expected = found[..., :12], expected[:, :, :3].reshape(*found.shape[:2], 12)
    else:
        expected = expected[:, :, :3, 3]
    # Strokes of four metres, and frames further out than the tips.
    scale = max(1.0, reach(robot, robot.frame_names)) + 4 * robot.dof

    np.testing.assert_allclose(found, expected, rtol=0, atol=TOLERANCE[real] * scale)


@pytest.mark.parametrize("arm", ["puma560", "calibrated_2r"])
def test_compilers_and_levels_give_the_same_bits(arm: str, tmp_path: Path) -> None:
    """Scalar and batch alike, in whole tiles and in the rest of one; contraction is off."""
    given = kernels(arm)
    pose = RobotPrograms(
        given.robot, given.programs[:1], given.defaults
    )  # the others would only take longer to compile
    for real in ScalarType:
        for file, text in (emit_kernel(pose, real) | emit_batch(pose, real)).items():
            (tmp_path / file).write_text(text, encoding="utf-8")
    seen: dict[ScalarType, set[bytes]] = {real: set() for real in ScalarType}
    for compiler, level in WAYS:
        compiled = compile_library(tmp_path, tmp_path, arm, compiler, *level)
        for real, found in seen.items():
            q = configurations(arm, real, tile(arm, real) + 5)
            found.add(bits(compiled.scalar(Quantity.POSE, q)).tobytes())
            found.add(bits(compiled.batch(Quantity.POSE, q)).tobytes())

    assert {real: len(results) for real, results in seen.items()} == dict.fromkeys(ScalarType, 1)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("quantity", list(USUAL))
def test_every_layout_of_a_batch_holds_the_results_of_the_scalar_kernel(
    quantity: Quantity, layout: int, name: str, real: ScalarType, library: Callable[[str], Library]
) -> None:
    compiled = library(name)
    q = configurations(name, real, 2 * tile(name, real) + 3)
    scalar = compiled.scalar(quantity, q)
    expected = (scalar, full(scalar), rows(scalar))[layout]

    np.testing.assert_array_equal(bits(compiled.batch(quantity, q, layout)), bits(expected))
    np.testing.assert_array_equal(bits(compiled.batch(quantity, q, layout, gap=5)), bits(expected))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_joint_values_may_lie_anyhow(layout: int, real: ScalarType, library: Callable[[str], Library]) -> None:
    """C order, Fortran order, backwards, every third, and one for all."""
    compiled, q = library("puma560"), configurations("puma560", real, tile("puma560", real) + 9)
    wide = np.zeros((3 * len(q), 11), q.dtype)
    wide[::3, 1:7] = q
    expected = bits(compiled.batch(Quantity.POSE, q, layout))

    for view in (np.asfortranarray(q), q[::-1].copy()[::-1], q[:, ::-1].copy()[:, ::-1], wide[::3, 1:7]):
        np.testing.assert_array_equal(bits(compiled.batch(Quantity.POSE, view, layout)), expected)
    repeated = np.broadcast_to(q[:1], q.shape)
    found = compiled.batch(Quantity.POSE, repeated, layout)
    np.testing.assert_array_equal(
        bits(found), bits(compiled.batch(Quantity.POSE, np.ascontiguousarray(repeated), layout))
    )


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_result_does_not_depend_on_its_place(
    layout: int, real: ScalarType, library: Callable[[str], Library]
) -> None:
    compiled, whole = library("calibrated_2r"), tile("calibrated_2r", real)
    q = configurations("calibrated_2r", real, 3 * whole)
    scalar = full(compiled.scalar(Quantity.FRAMES, q))
    for count in (0, 1, whole - 1, whole, whole + 1, 3 * whole):
        expected = scalar[len(q) - count :]
        found = compiled.batch(Quantity.FRAMES, q[len(q) - count :], layout)
        matrices = found.T.reshape(expected.shape) if layout == 2 else full(found)

        np.testing.assert_array_equal(bits(matrices), bits(expected), err_msg=f"{count} configurations")


@pytest.mark.parametrize("arm", ["puma560", "hand", "scara"])
@pytest.mark.parametrize("bad", ["nan", "inf", "-inf", "beyond"])
def test_a_bad_angle_gives_nan_in_its_own_pose_and_where_it_matters(
    bad: str, arm: str, real: ScalarType, library: Callable[[str], Library]
) -> None:
    """An entry that depends on the angle is NaN; all others, and all other poses, are as they were."""
    compiled, q = library(arm), configurations(arm, real, tile(arm, real) + 3)
    angles = [v.index for v in kernels(arm).robot.variables if v.type.value == "revolute"]
    value = SINCOS[real].limit * 1.01 if bad == "beyond" else float(bad)
    clean = compiled.batch(Quantity.FRAMES, q)
    for joint in angles:
        place = (7 * joint) % len(q)
        spoilt, moved = q.copy(), q.copy()
        spoilt[place, joint] = value
        moved[place, joint] += 1
        found, other = compiled.batch(Quantity.FRAMES, spoilt), compiled.batch(Quantity.FRAMES, moved)
        alone = compiled.scalar(Quantity.FRAMES, spoilt[place : place + 1])[0]
        matters = clean[place] != other[place]

        np.testing.assert_array_equal(bits(np.delete(found, place, 0)), bits(np.delete(clean, place, 0)))
        np.testing.assert_array_equal(bits(found[place]), bits(alone))
        assert np.isnan(alone[matters]).all()
        assert matters.any()
        # A product with zero, such as 0 * sin, may have been folded or not; a number that is there is the right one.
        np.testing.assert_array_equal(alone[~np.isnan(alone)], clean[place][~np.isnan(alone)])


def test_the_limit_itself_is_still_an_angle(real: ScalarType, library: Callable[[str], Library]) -> None:
    limit = SINCOS[real].limit
    q = np.zeros((1, 6), DTYPES[real])
    q[0, 0] = limit

    assert np.isfinite(library("puma560").scalar(Quantity.POSE, q)).all()


def test_runtime_parameters_move_the_tip(library: Callable[[str], Library], real: ScalarType) -> None:
    """The struct has the fields in the order of the file, and the kernel reads each."""
    compiled, robot = library("calibrated_2r"), kernels("calibrated_2r").robot
    assert re.fullmatch("L1 L2 tilt skew zero_2", " ".join(p.name for p in robot.runtime_parameters))
    function, _ = compiled._function(Quantity.POSITION, configurations("calibrated_2r", real, 1))
    q, out = np.zeros((1, 2), DTYPES[real]), np.zeros(3, DTYPES[real])
    params = np.array([2.0, 3.0, 0.0, 0.0, 0.0], DTYPES[real])
    pointers = [array.ctypes.data for array in (q, params, out)]
    function.argtypes = [np.ctypeslib.ctypes.c_void_p] * 3
    function(*pointers)

    assert out.tolist() == [5.0, 0.0, 0.0]
