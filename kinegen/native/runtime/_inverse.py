"""The inverse: targets are checked, and the solution nearest to a joint vector is chosen. It needs NumPy alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import Floats
from ._kernel import Kernel, Layout
from ._targets import checked_targets, is_pose

Truths = NDArray[np.bool_]


class Inverse(Kernel[tuple[Floats, Truths]]):
    """All joint vectors that put the tool into a pose, each in a branch of its own.

    A branch that is not valid holds any numbers, or NaN.

    Args:
        name: As for a kernel, like all others.
        limits: Lower and upper limit of each joint, or None.
        turns: What a whole turn of each joint is in its variable; infinite for one that shifts.
        options: As for a kernel.
    """

    kind = "inverse"

    def __init__(
        self,
        name: str,
        *,
        limits: tuple[tuple[float, float] | None, ...] = (),
        turns: tuple[float, ...] = (),
        **options: Any,
    ) -> None:
        super().__init__(name, **options)
        unlimited = (-math.inf, math.inf)
        self._limits = np.array([unlimited if each is None else each for each in limits], dtype=float).reshape(-1, 2)
        self._turns = np.array(turns, dtype=float)

    def __call__(
        self,
        *inputs: ArrayLike,
        params: Any = None,
        out: Any = None,
        threads: int = 1,
        layout: Layout = "4x4",
        nearest: ArrayLike | None = None,
        check: bool = True,
    ) -> tuple[Floats, Truths]:
        """Solve for one target or a batch.

        Args:
            inputs: The target, shape (..., 4, 4).
            params: As for a kernel.
            out: As for a kernel; validity then comes as numbers, 1 or 0.
            threads: As for a kernel.
            layout: As for a kernel.
            nearest: A joint vector, or one for each target: of the valid solutions the one that is nearest to it is
                chosen, the squares of all differences added, with whole turns added where the limits allow.
            check: Whether to see that targets are poses; those of the layout joint_major are taken as they are.

        Returns:
            Solutions (..., branches, joints), and which of them are valid (..., branches). With `nearest` one solution
            (..., joints), NaN where there is none, and whether there is one (...).

        Raises:
            ValueError: If a target is no pose: not finite, not a rotation, reflected, or of another shape.
        """
        if nearest is not None and (out is not None or layout == "joint_major"):
            raise ValueError(f"{self.__name__}: nearest goes with neither out nor the layout joint_major")
        results: tuple[Floats, Truths] | None = None
        if out is None and threads == len(inputs) == 1 and layout == "4x4":
            results = self._quickly(inputs[0], params, check)
        if results is None:
            if check and layout == "4x4" and len(inputs) == 1:
                checked_targets(self.__name__, inputs[0])
            results = super().__call__(*inputs, params=params, out=out, threads=threads, layout=layout)
        if out is not None:
            return results
        solutions, valid = results[0], results[1].astype(np.bool_)
        return (solutions, valid) if nearest is None else self._nearest(solutions, valid, nearest)

    def _quickly(self, target: Any, params: Any, check: bool) -> tuple[Floats, Any] | None:
        """The results of one C call for one plain target; None where something speaks against it."""
        if type(target) is not np.ndarray or target.shape != (4, 4) or (check and not is_pose(target)):
            return None
        direct = self._engine.direct(self._named(params))
        if direct is None:
            return None
        solutions, valid = self.results
        results = np.empty(solutions.shape, target.dtype), np.empty(valid.shape, target.dtype)
        return results if direct(id(target), id(results[0]), id(results[1]), 0) else None

    def _nearest(self, solutions: Floats, valid: Truths, nearest: ArrayLike) -> tuple[Floats, Truths]:
        wanted = np.asarray(nearest, dtype=solutions.dtype)
        if wanted.shape[-1:] != solutions.shape[-1:]:
            raise ValueError(
                f"{self.__name__}: nearest has shape {wanted.shape}, expected (..., {solutions.shape[-1]})"
            )
        wanted = np.broadcast_to(wanted, (*solutions.shape[:-2], solutions.shape[-1]))
        with np.errstate(invalid="ignore"):
            moved = self._turned(solutions, wanted[..., None, :])
            distances = np.where(valid, ((moved - wanted[..., None, :]) ** 2).sum(axis=-1), np.inf)
        best = distances.argmin(axis=-1)[..., None]
        found: Truths = np.take_along_axis(valid, best, axis=-1)[..., 0]
        chosen = np.take_along_axis(moved, best[..., None], axis=-2)[..., 0, :]
        return np.where(found[..., None], chosen, np.nan).astype(solutions.dtype), found

    def _turned(self, solutions: Floats, wanted: Floats) -> Floats:
        """Solutions with as many whole turns added as bring them nearest within their limits."""
        turns, (low, high) = self._turns, self._limits.T
        count = np.round((wanted - solutions) / turns)
        # A solution that rounding put beside its limit still takes no turn the other way.
        fewest, most = np.ceil((low - solutions) / turns - 1e-6), np.floor((high - solutions) / turns + 1e-6)
        count = np.clip(count, np.minimum(fewest, 0), np.maximum(most, 0))
        moved: Floats = np.where(
            np.isfinite(turns), solutions + count * np.where(np.isfinite(turns), turns, 0), solutions
        )
        return moved.astype(solutions.dtype)
