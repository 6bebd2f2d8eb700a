"""The inverse: targets are checked, and the solution nearest to a joint vector is chosen. It needs NumPy alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import Floats
from ._kernel import Kernel, Layout, check_apart
from ._targets import checked_targets, is_pose

Truths = NDArray[np.bool_]

_MOST_TURNS = {np.dtype(np.float64): 1e4, np.dtype(np.float32): 1e2}
"""A joint value further from zero than so many whole turns has lost the digits that `nearest` is to keep."""

_FARTHEST_STROKE = 1e15


class Inverse(Kernel[tuple[Floats, Truths]]):
    """All joint vectors that put the tool into a pose, each in a branch of its own.

    A branch that is not valid holds any numbers, or NaN; a valid one is finite.

    Args:
        name: As for a kernel, like all others.
        limits: Lower and upper limit of each joint, or None.
        turns: What a whole turn of each joint is in its variable; infinite for one that shifts.
        rooms: How far outside its limits a joint of a valid solution may be, for float64 and for float32.
        options: As for a kernel.
    """

    kind = "inverse"

    def __init__(
        self,
        name: str,
        *,
        limits: tuple[tuple[float, float] | None, ...] = (),
        turns: tuple[float, ...] = (),
        rooms: tuple[tuple[float, ...], tuple[float, ...]] = ((), ()),
        **options: Any,
    ) -> None:
        super().__init__(name, **options)
        unlimited = (-math.inf, math.inf)
        self._limits = np.array([unlimited if each is None else each for each in limits], dtype=float).reshape(-1, 2)
        self._turns = np.array(turns, dtype=float)
        self._rooms = {np.dtype(kind): np.array(room) for kind, room in zip((float, np.float32), rooms, strict=True)}

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
            out: Arrays for both results, as for a kernel; that for validity is of type bool, or of the number type of
                the solutions, which then holds 1 or 0.
            threads: As for a kernel.
            layout: As for a kernel.
            nearest: A joint vector, or one for each target: of the valid solutions the one that is nearest to it is
                chosen, the squares of all differences added, with whole turns added where the limits allow. Where an
                entry is not finite, or further from zero than 10,000 whole turns (100 in float32), there is none.
            check: Whether to see that targets are poses; those of the layout joint_major are taken as they are.

        Returns:
            Solutions (..., branches, joints), and which of them are valid (..., branches). With `nearest` one solution
            (..., joints), NaN where there is none, and whether there is one (...).

        Raises:
            ValueError: If a target is not a pose: not finite, not a rotation, reflected, or of another shape.
        """
        if nearest is not None and (out is not None or layout == "joint_major"):
            raise ValueError(f"{self.__name__}: nearest cannot be combined with out or with the layout joint_major")
        results: tuple[Floats, Truths] | None = None
        if out is None and threads == len(inputs) == 1 and layout == "4x4":
            results = self._quickly(inputs[0], params, check)
        if results is None:
            if check and layout == "4x4" and len(inputs) == 1:
                checked_targets(self.__name__, inputs[0])
            options: dict[str, Any] = {"params": params, "threads": threads, "layout": layout}
            if _has_truths(out):
                return self._into_truths(inputs, out, options)
            results = super().__call__(*inputs, out=out, **options)
        if out is not None:
            return results
        solutions, valid = results[0], results[1].astype(np.bool_)
        return (solutions, valid) if nearest is None else self._nearest(solutions, valid, nearest)

    def _into_truths(
        self, inputs: tuple[ArrayLike, ...], out: tuple[Floats, Truths], options: dict[str, Any]
    ) -> tuple[Floats, Truths]:
        """Solve into arrays of which the second one holds truth values."""
        solutions, valid = out
        if not valid.flags.writeable:
            raise ValueError(f"{self.__name__}: out for valid is read-only")
        others = [("base_T_tool", np.asarray(each)) for each in inputs] + [("solutions", solutions)]
        check_apart(self.__name__, "out for valid", valid, others)
        numbers = np.empty(valid.shape, solutions.dtype)
        super().__call__(*inputs, out=(solutions, numbers), **options)
        valid[...] = numbers
        return out

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
        """The valid solution nearest to a joint vector, and whether there is one."""
        wanted, is_near = self._wanted(nearest, solutions)
        with np.errstate(invalid="ignore", over="ignore"):
            moved = self._turned(solutions, wanted[..., None, :])
            distances = np.where(valid, ((moved - wanted[..., None, :]) ** 2).sum(axis=-1), np.inf)
        best = distances.argmin(axis=-1)[..., None]
        found: Truths = np.take_along_axis(valid, best, axis=-1)[..., 0] & is_near
        chosen = np.take_along_axis(moved, best[..., None], axis=-2)[..., 0, :]
        return np.where(found[..., None], chosen, np.nan).astype(solutions.dtype), found

    def _wanted(self, nearest: ArrayLike, solutions: Floats) -> tuple[Floats, Truths]:
        """The joint vectors asked for, zeros where they cannot serve, and whether they can."""
        given = np.asarray(nearest)
        lead, dof = solutions.shape[:-2], solutions.shape[-1]
        if given.dtype.kind not in "fiub" or isinstance(nearest, np.ma.MaskedArray):
            raise TypeError(f"{self.__name__}: nearest is of type {given.dtype}, expected plain real numbers")
        try:
            # The leading axes may be fewer than those of the targets, never more.
            full = np.broadcast_to(given, (*lead, dof)) if given.shape[-1:] == (dof,) else None
        except ValueError:
            full = None
        if full is None:
            expected = ", ".join(map(str, (*lead, dof))) + ("," if not lead else "")
            raise ValueError(f"{self.__name__}: nearest has shape {given.shape}, expected ({expected}) or (..., {dof})")
        farthest = np.where(np.isfinite(self._turns), self._turns * _MOST_TURNS[solutions.dtype], _FARTHEST_STROKE)
        serves = np.abs(full.astype(float)) <= farthest
        wanted: Floats = np.where(serves, full, 0).astype(solutions.dtype)
        return wanted, serves.all(axis=-1)

    def _turned(self, solutions: Floats, wanted: Floats) -> Floats:
        """Solutions with as many whole turns added as bring them nearest within their limits."""
        turns, (low, high), room = self._turns, self._limits.T, self._rooms[solutions.dtype]
        count = np.round((wanted - solutions) / turns)
        # What a solution may be outside its limits by, it may be after whole turns. One that rounding put beside its
        # limit takes no turn the other way for that.
        fewest, most = np.ceil((low - room - solutions) / turns), np.floor((high + room - solutions) / turns)
        count = np.clip(count, np.minimum(fewest, 0), np.maximum(most, 0))
        moved: Floats = np.where(
            np.isfinite(turns), solutions + count * np.where(np.isfinite(turns), turns, 0), solutions
        )
        return moved.astype(solutions.dtype)


def _has_truths(out: Any) -> bool:
    """Whether results go to an array of numbers and one of truth values."""
    return (
        type(out) is tuple
        and len(out) == 2
        and all(isinstance(each, np.ndarray) for each in out)
        and out[1].dtype == np.bool_
    )
