"""Runtime parameters along a batch: arrays that broadcast with the joint vectors, in C and in NumPy."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN, USUAL, Kind, Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import closed_form_inverse, numeric_inverse
from tests.builds.workshop import make, set_machine, write_robot

SCARA = """\
kinegen: 1
name: scara_4
convention: standard
units: {length: mm, angle: deg}
parameters:
  a1: {value: 225, runtime: true}
  a2: {value: 175, runtime: true}
  lean: {value: 0.5, dimension: angle, runtime: true}
joints:
  - {name: shoulder, theta: q, d: 150, a: a1, alpha: 0, limits: [-132, 132]}
  - {name: elbow, theta: q, d: 0, a: a2, alpha: 180, limits: [-141, 141]}
  - {name: stroke, theta: lean, d: q, a: 0, alpha: 0, limits: [0, 150]}
  - {name: roll, theta: q, d: 0, a: 0, alpha: 0, limits: [-360, 360]}
"""
COUNT = 41
KERNELS = "fk", "frames", "position", "fk_jacobian", "inverse"
QUANTITIES = (*USUAL, POSE_AND_JACOBIAN, Quantity(Kind.INVERSE), NUMERIC_INVERSE)
REALS = np.float64, np.float32


@pytest.fixture(scope="module", params=["c", "numpy"])
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A SCARA with three parameters at run time, for both ways to compute."""
    folder = tmp_path_factory.mktemp(request.param)
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        for module in (closed_form_inverse, numeric_inverse):
            patch.setattr(module, "TARGETS", 200)
            patch.setattr(module, "FEWER", 40)
        path = write_robot(folder, SCARA, "scara_4.yaml")
        make(path, folder, quantities=QUANTITIES, compile=request.param == "c")
    package = load_package(folder / "scara_4")

    assert package.backend == request.param
    return package


def sample(arm: ModuleType, real: Any) -> tuple[Any, Any]:
    """Joint vectors, and parameters along them: of each a value of its own, or a number."""
    random = np.random.default_rng(5)
    q = random.uniform((-2, 0.3, 5, -3), (2, 2.2, 140, 3), (COUNT, 4)).astype(real)
    return q, arm.Params(a1=random.uniform(200, 240, COUNT), lean=random.uniform(-0.1, 0.1, COUNT))


def own(arm: ModuleType, params: Any, place: int) -> Any:
    """The parameters of one configuration."""
    return arm.Params(*(float(np.broadcast_to(value, COUNT)[place]) for value in params))


def as_tuple(found: Any) -> tuple[Any, ...]:
    return found if isinstance(found, tuple) else (found,)


def given(arm: ModuleType, name: str, real: Any) -> tuple[Any, Any]:
    q, params = sample(arm, real)
    return (arm.fk(q, params=params), params) if name == "inverse" else (q, params)


def same(arm: ModuleType, found: Any, wanted: Any) -> bool:
    """Whether they have the same bits; NumPy promises no more than the last digits."""
    if arm.backend == "c" or found.dtype == bool:
        return np.array_equal(found, wanted, equal_nan=True)
    digits = 600 * 64 * np.finfo(found.dtype).eps
    return bool(np.allclose(found, wanted, rtol=0, atol=digits, equal_nan=True))


@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("name", KERNELS)
def test_a_batch_gives_what_each_row_gives_with_its_own_parameters(arm: ModuleType, name: str, real: Any) -> None:
    kernel = getattr(arm, name)
    x, params = given(arm, name, real)
    rows = [as_tuple(kernel(x[i : i + 1], params=own(arm, params, i))) for i in range(COUNT)]

    for place, found in enumerate(as_tuple(kernel(x, params=params))):
        assert found.dtype in (real, bool)
        assert same(arm, found, np.concatenate([row[place] for row in rows]))
    assert not same(arm, as_tuple(kernel(x, params=params))[0], as_tuple(kernel(x))[0])


@pytest.mark.parametrize("real", REALS)
def test_the_axes_of_parameters_and_of_joint_vectors_broadcast(arm: ModuleType, real: Any) -> None:
    q, params = sample(arm, real)
    every = arm.fk(q, params=arm.Params(a1=params.a1[:7, None], lean=params.lean))
    single = arm.position(q[0], params=params)
    rows = arm.fk(q.T.copy(), params=params, layout="joint_major")

    assert every.shape == (7, COUNT, 4, 4)
    assert same(arm, every[3], arm.fk(q, params=arm.Params(a1=float(params.a1[3]), lean=params.lean)))
    assert single.shape == (COUNT, 3)
    assert same(arm, single, arm.position(np.tile(q[0], (COUNT, 1)), params=params))
    assert same(arm, rows.T.reshape(COUNT, 3, 4), arm.fk(q, params=params)[:, :3])
    assert arm.fk(q[:0], params=arm.Params(a1=params.a1[:0])).shape == (0, 4, 4)
    assert arm.fk(q[0], params=arm.Params(a1=params.a1[:0])).shape == (0, 4, 4)
    assert arm.fk(q[0], params=arm.Params(a1=np.array(230.0))).shape == (4, 4)


def test_results_go_where_they_are_wanted_and_changed_arrays_are_read_anew(arm: ModuleType) -> None:
    q, params = sample(arm, np.float64)
    wanted, out, bound = arm.position(q, params=params), np.empty((COUNT, 3)), np.empty((COUNT, 3))
    step = arm.position.bind(q, bound, params=params)
    step()

    assert arm.position(q, params=params, out=out) is out
    assert same(arm, out, wanted)
    assert same(arm, bound, wanted)
    params.a1[4] += 1
    step()
    assert same(arm, bound, arm.position(q, params=params))
    assert (bound != wanted).any(axis=1).tolist() == [place == 4 for place in range(COUNT)]
    with pytest.raises(ValueError, match=r"position: out has shape \(41, 3\), expected \(2, 41, 3\) for q of shape"):
        arm.position(q, params=arm.Params(a1=[[1.0], [2.0]]), out=out)
    with pytest.raises(ValueError, match=r"position: out shares memory with params.a2"):
        arm.position(q, params=arm.Params(a2=out[:, 0]), out=out)


@pytest.mark.parametrize("name", KERNELS[:4])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_stays_in_its_configuration(arm: ModuleType, name: str, value: float) -> None:
    q, params = sample(arm, np.float64)
    usual = as_tuple(getattr(arm, name)(q, params=params))
    for spoilt in (params._replace(a1=params.a1.copy()), params._replace(lean=params.lean.copy())):
        array = spoilt.a1 if spoilt.a1 is not params.a1 else spoilt.lean
        array[17] = value
        found = as_tuple(getattr(arm, name)(q, params=spoilt))
        for one, other in zip(found, usual, strict=True):
            assert same(arm, np.delete(one, 17, axis=0), np.delete(other, 17, axis=0))
        moved = arm.fk(q, params=spoilt)[17, 0, 3 if array is spoilt.a1 else 0]
        assert not np.isfinite(moved)


def test_an_inverse_takes_parameters_for_each_target(arm: ModuleType) -> None:
    q, params = sample(arm, np.float64)
    targets = arm.fk(q, params=params)
    found, exists = arm.inverse(targets, nearest=q + 0.01, params=params)
    single, _ = arm.inverse(targets[3], nearest=q[3], params=params)
    searched = arm.numeric_inverse(targets, q + 0.1, params=params, threads=2)
    crossed = arm.numeric_inverse(targets[0], q[0], params=params, restarts=2)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-7)
    assert single.shape == (COUNT, 4)
    np.testing.assert_allclose(single[3], q[3], atol=1e-7)
    assert searched.solved.all()
    np.testing.assert_allclose(arm.fk(searched.q, params=params), targets, atol=1e-5)
    assert crossed.q.shape == (COUNT, 4)
    np.testing.assert_allclose(
        arm.fk(crossed.q, params=params)[crossed.solved, :3, 3], [targets[0, :3, 3]] * crossed.solved.sum(), atol=1e-5
    )


@pytest.mark.parametrize("real", REALS)
def test_nearest_broadcasts_with_targets_and_parameters(arm: ModuleType, real: Any) -> None:
    """Leading axes (2, 1, 41) of parameters, (3, 1) of targets and (41,) of joint vectors, each way alone and all."""
    q, params = sample(arm, real)
    targets = arm.fk(q[:3], params=own(arm, params, 0))[:, None]
    near = (q + real(0.01)).astype(real)
    varied = arm.Params(a1=np.stack([params.a1, params.a1[::-1]])[:, None], a2=float(params.a2), lean=params.lean)
    found, exists = arm.inverse(targets, nearest=near, params=varied)

    assert (found.shape, exists.shape) == ((2, 3, COUNT, 4), (2, 3, COUNT))
    assert (found.dtype, exists.dtype) == (real, bool)
    assert exists.any()
    for which, target, row in np.ndindex(2, 3, COUNT):
        alone = arm.Params(float(varied.a1[which, 0, row]), float(varied.a2), float(varied.lean[row]))
        one, is_there = arm.inverse(targets[target, 0], nearest=near[row], params=alone)
        assert is_there == exists[which, target, row]
        assert same(arm, found[which, target, row], one)
    with pytest.raises(ValueError, match=r"^inverse: nearest has shape \(7, 4\), expected \(2, 3, 41, 4\) or "):
        arm.inverse(targets, nearest=near[:7], params=varied)


REFUSED = {
    "shapes that do not fit": (
        {"a1": np.ones(5)},
        ValueError,
        r"the shapes of \w+ \(41, [\d, ]+\), params\.a1 \(5,\) do not fit together",
    ),
    "strings": ({"a2": "175"}, TypeError, "params.a2 has strings, expected plain real numbers"),
    "complex numbers": (
        {"a2": [1j]},
        TypeError,
        "params.a2 has entries of type complex128, expected plain real numbers",
    ),
    "uneven lists": (
        {"lean": [[1], [1, 2]]},
        ValueError,
        "params.lean holds lists of different lengths, expected an array of numbers",
    ),
    "a masked array": (
        {"lean": np.ma.array([1.0])},
        TypeError,
        "params.lean is a masked array, expected plain real numbers",
    ),
    "nothing": ({"lean": None}, TypeError, "params.lean has entries of type object, expected plain real numbers"),
}


@pytest.mark.parametrize("case", REFUSED)
@pytest.mark.parametrize("name", ["fk", "inverse", "numeric_inverse"])
def test_what_does_not_fit_is_refused_in_one_line(arm: ModuleType, name: str, case: str) -> None:
    values, error, message = REFUSED[case]
    x, _ = given(arm, "fk" if name == "fk" else "inverse", np.float64)

    with pytest.raises(error, match=f"^{name}: {message}$"):
        getattr(arm, name)(x, params=arm.Params(**values))


def test_rows_and_parameters_of_two_axes_do_not_fit(arm: ModuleType) -> None:
    q, params = sample(arm, np.float64)

    with pytest.raises(ValueError, match=r"^fk: the shapes of q \(4, 41\), params.a1 \(7, 1\) do not fit together$"):
        arm.fk(q.T, params=arm.Params(a1=params.a1[:7, None]), layout="joint_major")
    with pytest.raises(TypeError, match="unexpected keyword argument 'a3'"):
        arm.Params(a3=params.a1)
