"""Arguments of the search: the checks, `out=` and `bind` of every kernel; budgets; targets that are not poses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.numeric_inverse.conftest import Packages
from tests.numeric_inverse.test_search import reachable

BACKENDS = pytest.mark.parametrize("backend", ["c", "numpy"])


@BACKENDS
@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        (
            {"params": (0.35, 0.31)},
            TypeError,
            "params is given, but the robot has no runtime parameters",
        ),
        ({"restarts": -1}, ValueError, "restarts is -1, expected 0 to 2147483647"),
        ({"restarts": 1.5}, TypeError, "restarts is of type float, expected an integer"),
        ({"restarts": True}, TypeError, "restarts is of type bool, expected an integer"),
        ({"budget": -3}, ValueError, "budget is -3"),
        ({"steps": 1 << 40}, ValueError, "steps is 1099511627776"),
        ({"seed": "x"}, TypeError, "seed is of type str"),
        ({"tolerances": (np.nan, 1e-6)}, ValueError, "tolerances are nan and 1e-06"),
        ({"tolerances": 1e-6}, TypeError, "expected a distance and an angle"),
        ({"out": np.empty(6)}, TypeError, "out must be a tuple of arrays for q, solved, position_error"),
    ],
)
def test_arguments_are_checked(
    backend: str, options: dict[str, Any], error: type[Exception], message: str, package: Packages
) -> None:
    arm = package("ur5", backend)
    with pytest.raises(error, match=message):
        arm.numeric_inverse(np.eye(4), **options)


@BACKENDS
def test_the_start_may_be_called_q0(backend: str, package: Packages) -> None:
    arm = package("ur5", backend)
    targets, start = reachable("ur5", arm, 3)

    np.testing.assert_array_equal(arm.numeric_inverse(targets, q0=start).q, arm.numeric_inverse(targets, start).q)
    with pytest.raises(TypeError, match="numeric_inverse: start and q0 are the same argument"):
        arm.numeric_inverse(targets, start, q0=start)


@BACKENDS
def test_out_and_bind_fill_the_arrays_that_they_are_given(backend: str, package: Packages) -> None:
    arm = package("ur5", backend)
    targets, start = reachable("ur5", arm, 6)
    usual = arm.numeric_inverse(targets, start)
    out = type(usual)(*(np.empty_like(np.asarray(entry)) for entry in usual))
    returned = arm.numeric_inverse(targets, start, out=out)

    assert returned is out
    for given, entry in zip(out, usual, strict=True):
        np.testing.assert_array_equal(given, entry)
    wide = np.empty((12, 6))[::2]
    bound = arm.numeric_inverse.bind(targets, start, wide, *out[1:])
    targets[:] = targets[::-1].copy()
    bound()
    np.testing.assert_array_equal(wide, arm.numeric_inverse(targets, start).q)
    with pytest.raises(ValueError, match="out for solved has shape"):
        arm.numeric_inverse(targets, start, out=(out.q, out.solved[:2], *out[2:]))
    with pytest.raises(ValueError, match="out for q shares memory with start"):
        arm.numeric_inverse(targets, out.q, out=out)
    with pytest.raises(TypeError, match="bind takes 7 arrays"):
        arm.numeric_inverse.bind(targets, start)
    assert repr(arm.numeric_inverse).endswith(f"base_T_tool (4, 4), start (6,) to (6,), backend {backend}>")


@BACKENDS
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_start_that_is_not_finite_counts_as_the_middle(backend: str, value: float, package: Packages) -> None:
    arm = package("iiwa14", backend)
    targets, start = reachable("iiwa14", arm, 4)
    start[:, 2] = value
    found = arm.numeric_inverse(targets, start)
    start[:, 2] = 0

    assert np.isfinite(found.q).all()
    np.testing.assert_array_equal(found.q, arm.numeric_inverse(targets, start).q)


@BACKENDS
def test_a_budget_and_steps_bound_a_search(backend: str, package: Packages) -> None:
    arm = package("ur5", backend)
    far = np.eye(4)
    far[0, 3] = 5.0

    assert arm.numeric_inverse(far, budget=7, restarts=100).iterations <= 7
    assert arm.numeric_inverse(far, steps=2, restarts=3).iterations <= 8
    assert arm.numeric_inverse(far, restarts=3).iterations > 8


def test_what_is_not_a_pose_costs_nothing_in_c(package: Packages, monkeypatch: pytest.MonkeyPatch) -> None:
    arm = package("ur5", "c")
    module = __import__("sys").modules[f"{arm.__name__}._runtime._numeric_inverse"]
    monkeypatch.setattr(module, "checked_targets", lambda _, poses: poses)
    for target in (np.full((4, 4), np.nan), np.eye(4) * 2, np.diag([1.0, 1, -1, 1]), np.full((4, 4), np.inf)):
        found = arm.numeric_inverse(target)

        assert not found.solved
        assert found.iterations == 0
        assert found.position_error == 1e30
