"""One target at a time goes a way of its own, with the same answers and refusals as a batch."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

from kinegen.model.outputs import Kind, Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import closed_form_inverse as proof
from tests.builds.workshop import ROBOTS, make, set_machine


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("packages")
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        patch.setattr(proof, "TARGETS", 100)
        patch.setattr(proof, "FEWER", 100)
        quantities = (Quantity.POSE, Quantity(Kind.INVERSE))
        yield load_package(make(ROBOTS / "planar_3r.yaml", folder, quantities=quantities).folder)


@pytest.mark.parametrize("real", [np.float64, np.float32])
@pytest.mark.parametrize("check", [True, False])
def test_it_solves_as_a_batch_does(arm: ModuleType, real: type, check: bool) -> None:
    targets = arm.fk(np.random.default_rng(3).uniform(-1, 1, (20, 3))).astype(real)
    solutions, valid = arm.inverse(targets)

    assert arm.inverse.backend == "c"
    for target, all_, which in zip(targets, solutions, valid, strict=True):
        for given in (target, target.T.copy().T, target.tolist() if real is np.float64 else target):
            found, holds = arm.inverse(given, check=check)

            assert found.dtype == real
            assert holds.dtype == bool
            np.testing.assert_array_equal(found, all_)
            np.testing.assert_array_equal(holds, which)


@pytest.mark.parametrize("place", [(0, 0), (1, 2), (0, 3), (3, 0), (3, 3)])
@pytest.mark.parametrize("value", [np.nan, np.inf, 2.0])
def test_it_refuses_what_a_batch_refuses(arm: ModuleType, place: tuple[int, int], value: float) -> None:
    target = np.eye(4)
    target[place] = value
    if place == (0, 3) and value == 2.0:
        assert not arm.inverse(target)[1].any()
        return
    for given in (target, target[None]):
        with pytest.raises(ValueError, match="inverse: base_T_tool"):
            arm.inverse(given)


def test_a_reflection_is_refused(arm: ModuleType) -> None:
    with pytest.raises(ValueError, match="inverse: base_T_tool holds a reflection"):
        arm.inverse(np.diag([1.0, 1.0, -1.0, 1.0]))


def test_one_plain_target_never_enters_python(arm: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    targets = arm.fk(np.random.default_rng(4).uniform(-1, 1, (20, 3)))
    expected = [arm.inverse(target.tolist()) for target in targets]

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr(type(arm.inverse).__base__, "__call__", refuse)
    for target, (solutions, valid) in zip(targets, expected, strict=True):
        found, holds = arm.inverse(target)

        np.testing.assert_array_equal(found, solutions)
        np.testing.assert_array_equal(holds, valid)
        assert (found.dtype, holds.dtype) == (np.float64, np.bool_)
    assert valid.any()
