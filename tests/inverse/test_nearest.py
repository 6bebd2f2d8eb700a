"""The solution nearest to a joint vector: the C function, its calls from Python and the NumPy form agree to the bit."""

from __future__ import annotations

import ctypes
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.model.outputs import Kind, Quantity
from kinegen.verify import nearest
from tests.builds.workshop import ROBOTS, assemble, set_machine

QUANTITIES = (Quantity.POSE, Quantity(Kind.INVERSE))
ARMS = ("ur5", "puma560", "scara", "cartesian", "al5d")
DTYPES = {ScalarType.DOUBLE: np.float64, ScalarType.FLOAT: np.float32}
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wfloat-equal", "-Werror")


@pytest.fixture(scope="module", params=ARMS)
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("packages")
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        yield assemble(request.param, folder, compiled=True, quantities=QUANTITIES)


def sample(arm: ModuleType, count: int, seed: int = 0) -> tuple[Any, Any]:
    """Joint vectors within limits, and others that are near to some of them, or turns away."""
    generator = np.random.default_rng(seed)
    low, high = np.array([(-1.0, 1.0) if each is None else each for each in arm.LIMITS]).T
    q = generator.uniform(low, high, (count, arm.DOF))
    wanted = q + generator.normal(0, 0.3, q.shape)
    wanted[::2] += 2 * math.pi * generator.integers(-3, 4, q.shape)[::2]
    return q, wanted


def compiled(name: str, folder: Path, real: ScalarType, *flags: str) -> ctypes.CDLL:
    """The kernels of an arm as firmware gets them, by a compiler that warns of everything."""
    kernels = lower_file(ROBOTS / f"{name}.yaml", QUANTITIES)
    for file, text in {**emit_kernel(kernels, real), **emit_batch(kernels, real)}.items():
        (folder / file).write_text(text, encoding="utf-8")
    stem = name if real is ScalarType.DOUBLE else f"{name}_f32"
    command = ["gcc", "-std=c99", "-O1", "-ffreestanding", "-nostdlib", *WARNINGS, *flags, "-shared", "-fPIC"]
    target = folder / f"{stem}.so"
    subprocess.run([*command, f"{stem}.c", "-o", target.name], cwd=folder, check=True)
    return ctypes.CDLL(str(target))


def called(library: ctypes.CDLL, name: str, target: Any, q0: Any) -> tuple[int, Any]:
    """One call of the C function, from arrays of its own."""
    q = np.full_like(q0, 7)
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (np.ascontiguousarray(target), q0, q)]
    return getattr(library, name)(*pointers), q


@pytest.mark.parametrize("real", list(ScalarType))
def test_c_and_python_give_the_same_bits(arm: ModuleType, real: ScalarType, tmp_path: Path) -> None:
    name = arm.__name__.removeprefix("_kinegen_").rpartition("_")[0]
    library = compiled(name, tmp_path, real)
    function = f"{name if real is ScalarType.DOUBLE else f'{name}_f32'}_inverse_nearest"
    q, wanted = (values.astype(DTYPES[real]) for values in sample(arm, 70))
    poses = arm.fk(q)
    poses[5, :3, 3] += 1e3
    wanted[6, 0] = np.nan
    together, exists = arm.inverse(poses, nearest=wanted)

    assert together.dtype == DTYPES[real]
    assert exists.dtype == bool
    assert exists.mean() > 0.8
    for pose, near, row, found in zip(poses, wanted, together, exists, strict=True):
        answer, alone = called(library, function, pose, near.copy())
        quick, is_there = arm.inverse(pose, nearest=near)

        assert answer == found == is_there
        assert np.isnan(alone).all() == (not found)
        np.testing.assert_array_equal(alone, row)
        np.testing.assert_array_equal(quick, row)
        np.testing.assert_array_equal(arm.inverse(pose, nearest=near, check=False)[0], row)
    spread, there = arm.inverse(np.repeat(poses, 200, axis=0), nearest=np.repeat(wanted, 200, axis=0), threads=3)
    np.testing.assert_array_equal(spread, np.repeat(together, 200, axis=0))
    np.testing.assert_array_equal(there, np.repeat(exists, 200, axis=0))


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_numpy_chooses_as_c_does(arm: ModuleType, real: type) -> None:
    """From the same solutions, which NumPy computes with other roots and sines in the last digit."""
    q, wanted = (values.astype(real) for values in sample(arm, 300, 1))
    poses = arm.fk(q)
    solutions, valid = arm.inverse(poses)
    nearest = sys.modules[f"{arm.__name__}._runtime._nearest"]
    rows = [*solutions.reshape(len(q), -1).T, *valid.T.astype(real)]
    chosen = nearest.NearestFormula(lambda *_: rows, arm.inverse.turnings, 1, arm.inverse.sharings)(
        None, np.ascontiguousarray(wanted.T)
    )
    found, exists = arm.inverse(poses, nearest=wanted)

    np.testing.assert_array_equal(np.array(chosen[:-1]).T, found)
    np.testing.assert_array_equal(chosen[-1] != 0, exists)


def test_without_limits_joints_follow_for_many_turns(arm: ModuleType) -> None:
    q, _ = sample(arm, 40, 2)
    free = [each is None and arm.inverse.turnings[0][index][0] > 0 for index, each in enumerate(arm.LIMITS)]
    q[:, free] += 2 * math.pi * 500
    found, exists = arm.inverse(arm.fk(q), nearest=q)

    assert exists.all()
    np.testing.assert_allclose(arm.fk(found), arm.fk(q), atol=1e-8)
    np.testing.assert_allclose(found[:, free], q[:, free], atol=1e-3)


def test_a_limit_exactly_met(arm: ModuleType) -> None:
    """A joint at its upper limit comes back there, not a turn away; within the room that the header states."""
    q, _ = sample(arm, 60, 3)
    high = np.array([math.inf if each is None else each[1] for each in arm.LIMITS])
    q[:, 0] = np.where(math.isinf(high[0]), q[:, 0], high[0])
    found, exists = arm.inverse(arm.fk(q), nearest=q)

    assert exists.all()
    np.testing.assert_allclose(found[:, 0], q[:, 0], atol=1e-6)
    assert (found < high + 1e-6).all()


def test_parameters_lists_and_other_ways_in(arm: ModuleType) -> None:
    q, wanted = sample(arm, 4, 4)
    poses = arm.fk(q)
    together, exists = arm.inverse(poses, nearest=wanted)

    for index in range(4):
        for pose, near in (
            (poses[index].tolist(), wanted[index].tolist()),
            (np.asfortranarray(poses[index]), wanted[index]),
            (poses[index], np.repeat(wanted[index], 2)[::2]),
        ):
            found, is_there = arm.inverse(pose, nearest=near)
            np.testing.assert_array_equal(found, together[index])
            assert is_there == exists[index]
            assert is_there.dtype == bool
    one_for_all = arm.inverse(poses, nearest=wanted[0])[0]
    np.testing.assert_array_equal(one_for_all, arm.inverse(poses, nearest=np.repeat(wanted[:1], 4, axis=0))[0])
    empty, none = arm.inverse(poses[:0], nearest=wanted[:0])
    assert (empty.shape, none.shape) == ((0, arm.DOF), (0,))
    with pytest.raises(ValueError, match="nearest has shape"):
        arm.inverse(poses[0], nearest=wanted)
    with pytest.raises(TypeError, match="plain real numbers"):
        arm.inverse(poses[0], nearest=["a"] * arm.DOF)
    with pytest.raises(TypeError, match="params is given, but the robot has no runtime parameters"):
        arm.inverse(poses[0], nearest=wanted[0], params=(1.0,))


def test_one_plain_target_never_enters_python(arm: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    q, wanted = sample(arm, 5, 5)
    poses = arm.fk(q)
    together, exists = arm.inverse(poses, nearest=wanted)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr(type(arm.inverse).__base__, "__call__", refuse)
    for pose, near, row, found in zip(poses, wanted, together, exists, strict=True):
        alone, is_there = arm.inverse(pose, nearest=near)
        np.testing.assert_array_equal(alone, row)
        assert is_there is (np.True_ if found else np.False_)


def test_the_start_may_be_the_result(tmp_path: Path) -> None:
    library = compiled("ur5", tmp_path, ScalarType.DOUBLE)
    generator = np.random.default_rng(6)
    for start in generator.uniform(-6, 6, (20, 6)):
        target, q = np.zeros(16), start.copy()
        for function, arrays in (("ur5_fk", (start, target)), ("ur5_inverse_nearest", (target, q, q))):
            getattr(library, function)(*(array.ctypes.data_as(ctypes.c_void_p) for array in arrays))
        np.testing.assert_allclose(q, start, atol=1e-9)


def test_of_two_solutions_equally_near_the_first_is_taken(tmp_path: Path) -> None:
    """A planar arm, its target on the axis of symmetry: elbow up and down are as far from the stretched arm."""
    library = compiled("scara", tmp_path, ScalarType.DOUBLE)
    target, solutions, valid = np.eye(4), np.zeros((2, 3)), np.zeros(2, np.uint8)
    target[:3, 3] = 0.5, 0.0, 0.4
    arrays = [array.ctypes.data_as(ctypes.c_void_p) for array in (target, solutions, valid)]
    library.scara_inverse(*arrays)
    answer, q = called(library, "scara_inverse_nearest", target, np.zeros(3))

    assert valid.tolist() == [1, 1]
    assert (solutions[0] ** 2).sum() == (solutions[1] ** 2).sum()
    assert answer == 1
    np.testing.assert_array_equal(q, solutions[0])


@pytest.mark.parametrize("real", list(ScalarType))
def test_it_is_free_of_libraries_and_warnings(real: ScalarType, tmp_path: Path) -> None:
    compiled("ur5", tmp_path, real, "-Wl,--no-undefined")
    stem = "ur5" if real is ScalarType.DOUBLE else "ur5_f32"
    command = ["gcc", "-std=c99", "-O3", *WARNINGS, "-Wno-overlength-strings", "-c", f"{stem}_batch.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
    (tmp_path / "use.cpp").write_text(f'#include "{stem}_batch.h"\nint main() {{ return 0; }}\n')
    subprocess.run(["g++", "-std=c++11", *WARNINGS, "-c", "use.cpp"], cwd=tmp_path, check=True)
    header = (tmp_path / f"{stem}.h").read_text()
    turns = 10000 if real is ScalarType.DOUBLE else 100
    assert f"further from zero than {turns} whole turns" in " ".join(header.replace("\n *", " ").split())


def test_ctypes_gives_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    package = assemble("ur5", tmp_path, compiled=True, quantities=QUANTITIES)
    q, wanted = sample(package, 9, 7)
    poses = package.fk(q)
    found = package.inverse(poses, nearest=wanted)[0]
    np.savez(tmp_path / "given.npz", poses=poses, wanted=wanted)
    script = (
        "import sys; sys.modules['_cffi_backend'] = sys.modules['cffi'] = None\n"
        f"sys.path.insert(0, {str(tmp_path)!r})\n"
        "import numpy as np, ur5\n"
        f"given = np.load({str(tmp_path / 'given.npz')!r})\n"
        "both = ur5.inverse(given['poses'], nearest=given['wanted'])[0]\n"
        "alone = [ur5.inverse(*pair[:1], nearest=pair[1])[0] for pair in zip(given['poses'], given['wanted'])]\n"
        "assert ur5.inverse.backend == 'c' and (both == alone).all()\n"
        "print(both.tobytes().hex())\n"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)

    assert run.stdout.strip() == found.tobytes().hex()


def test_halfway_between_two_whole_turns_either_one_is_nearest() -> None:
    """A joint at half a turn, and 0 is asked for: half a turn to either side is as near."""
    joint = nearest._Joint(-math.pi, math.pi, is_limited=False, turn=2 * math.pi, room=0.0)
    judge = nearest._Judge("arm", load(ROBOTS / "ur5.yaml"), (joint,), (), "double")
    for found in (math.pi, -math.pi):
        judge._require_nearest(np.array([found]), np.zeros(1), np.array([[math.pi]]), np.eye(4))
    with pytest.raises(ProofError, match="none of the solutions"):
        judge._require_nearest(np.array([math.pi - 1e-3]), np.zeros(1), np.array([[math.pi]]), np.eye(4))
