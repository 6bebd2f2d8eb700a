"""The inverse: targets are checked, and the solution nearest to a joint vector is chosen. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import Array, Floats
from ._kernel import Kernel, Layout
from ._nearest import NearestFormula
from ._overlap import check_apart
from ._parameters import checked_params, settled_params
from ._signature import by_place
from ._targets import checked_targets, is_pose, joint_vector_asked

Truths = NDArray[np.bool_]

Turnings = tuple[tuple[float, float, float], ...]
Sharings = tuple[tuple[Any, ...], ...]
Ends = tuple[tuple[Any, ...], tuple[Any, ...]]


class Inverse(Kernel[tuple[Floats, Truths]]):
    """All joint vectors that put the tool into a pose, each in a branch of its own.

    A branch that is not valid holds any numbers, or NaN; a valid one is finite.

    Args:
        name: As for a kernel, like all others.
        turnings: For float64 and for float32 what whole turns of each joint need, see `Turning`.
        sharings: Likewise the joints that can come in line, see `Sharing`.
        ends: Likewise the joint at an end that a pose may leave free, see `End`; None without one.
        options: As for a kernel.
    """

    kind = "inverse"
    options = (*Kernel.options, ("nearest", None), ("q0", None), ("check", True))

    def __init__(
        self,
        name: str,
        *,
        turnings: tuple[Turnings, Turnings] | None = None,
        sharings: tuple[Sharings, Sharings] = ((), ()),
        ends: Ends | None = None,
        **options: Any,
    ) -> None:
        super().__init__(name, **options)
        self.turnings, self.sharings, self.ends = turnings, sharings, ends
        self.chooses = _chooser(turnings, sharings, ends, options) if turnings else None

    def __call__(
        self,
        *inputs: ArrayLike,
        params: Any = None,
        out: Any = None,
        threads: int = 1,
        layout: Layout = "4x4",
        nearest: ArrayLike | None = None,
        q0: ArrayLike | None = None,
        check: bool = True,
        **named: Any,
    ) -> tuple[Floats, Truths]:
        """Solve for one target or a batch.

        Args:
            inputs: The target, shape (..., 4, 4); with a redundancy its value too, shape (...), or (..., joints) where
                several joints are given.
            params: As for a kernel.
            out: Arrays for both results, as for a kernel; that for validity is of type bool, or of the number type of
                the solutions, which then holds 1 or 0.
            threads: As for a kernel.
            layout: As for a kernel.
            nearest: A joint vector, or one for each target: of the valid solutions the one that is nearest to it is
                chosen, the squares of all differences added, with whole turns added where the limits allow. Where an
                entry is not finite, or further from zero than 10,000 whole turns (100 in float32), there is none.
            q0: Another name of `nearest`.
            check: Whether to see that targets are poses; those of the layout joint_major are taken as they are.
            named: The target, given by its name.

        Returns:
            Solutions (..., branches, joints), and which of them are valid (..., branches). With `nearest` one solution
            (..., joints), NaN where there is none, and whether there is one (...).

        Raises:
            ValueError: If a target is not a pose: not finite, not a rotation, reflected, or of another shape.
        """
        inputs = by_place(self, inputs, named) if named else inputs
        nearest = nearest if q0 is None else joint_vector_asked(self.__name__, "nearest", nearest, q0)
        if nearest is not None and (out is not None or layout == "joint_major"):
            raise ValueError(f"{self.__name__}: nearest cannot be combined with out or with the layout joint_major")
        if nearest is not None:
            return self._nearest(inputs, nearest, check, params, threads, layout)
        results: tuple[Floats, Truths] | None = None
        if out is None and threads == 1 and layout == "4x4":
            results = self._quickly(inputs, params, check)
        if results is None:
            if check and layout == "4x4" and len(inputs) == len(self.inputs):
                checked_targets(self.__name__, inputs[0])
            options: dict[str, Any] = {"params": params, "threads": threads, "layout": layout}
            if _has_numbers(out):
                return self._into_numbers(inputs, out, options)
            results = super().__call__(*inputs, out=out, **options)
        return results

    def bind(self, *arrays: Any, params: Any = None, layout: Layout = "4x4") -> Callable[[], object]:
        """Look everything up once, as for a kernel; for validity as for `out` in a call."""
        count = len(self.inputs)
        if not _has_numbers(arrays[count:]):
            return super().bind(*arrays, params=params, layout=layout)
        valid: Any = arrays[-1]
        truths = self._truths_for(arrays[:count], arrays[count:])
        bound = super().bind(*arrays[:-1], truths, params=params, layout=layout)

        def solve() -> None:
            bound()
            valid[...] = truths

        return solve

    def _into_numbers(
        self, inputs: tuple[ArrayLike, ...], out: tuple[Floats, Any], options: dict[str, Any]
    ) -> tuple[Floats, Truths]:
        """Solve into arrays of numbers, of which the second one then holds 1 or 0."""
        truths = self._truths_for(inputs, out)
        super().__call__(*inputs, out=(out[0], truths), **options)
        out[1][...] = truths
        return out

    def _truths_for(self, inputs: tuple[Any, ...], out: tuple[Any, ...]) -> Truths:
        """Memory for the Booleans that go to an array of numbers, which may be written."""
        solutions, valid = out
        if not valid.flags.writeable:
            raise ValueError(f"{self.__name__}: out for valid is read-only")
        others = [(given.name, np.asarray(each)) for given, each in zip(self.inputs, inputs)]
        others.append(("solutions", solutions))
        check_apart(self.__name__, "out for valid", valid, others)
        return np.empty(valid.shape, np.bool_)

    def _quickly(self, inputs: tuple[Any, ...], params: Any, check: bool) -> tuple[Floats, Any] | None:
        """The results of one C call for one plain target; None where something speaks against it."""
        if len(inputs) != len(self.inputs):
            return None
        target, *others = inputs
        if type(target) is not np.ndarray or target.shape != (4, 4) or (check and not is_pose(target)):
            return None
        direct = self._engine.direct(self._named(params))
        if direct is None:
            return None
        solutions, valid = self.results
        results = np.empty(solutions.shape, target.dtype), np.empty(valid.shape, np.bool_)
        if others:
            if not isinstance(others[0], (float, np.ndarray)):
                return None
            number = np.asarray(others[0])
            if number.dtype != target.dtype:
                return None  # the type of the results is not that of the target
            return results if direct(id(target), id(number), id(results[0]), id(results[1]), 0) else None
        return results if direct(id(target), id(results[0]), id(results[1]), 0) else None

    def _nearest(
        self, inputs: tuple[ArrayLike, ...], nearest: ArrayLike, check: bool, params: Any, threads: int, layout: Layout
    ) -> tuple[Floats, Truths]:
        """The valid solutions nearest to joint vectors, and whether there are any."""
        name = self.__name__
        if self.chooses is None or len(inputs) != len(self.inputs):
            names = ", ".join(each.name for each in self.inputs)
            count = f"{len(self.inputs)} array{'s' * (len(self.inputs) > 1)}"
            raise TypeError(f"{name} takes {count} ({names}), {len(inputs)} given")
        targets = checked_targets(name, inputs[0]) if check else self._checked_input(self.inputs[0], inputs[0], layout)
        others = [self._checked_input(*pair, layout) for pair in zip(self.inputs[1:], inputs[1:])]
        chosen, varied = settled_params(name, checked_params(name, params, self._params))
        try:
            shapes = [array.shape[: array.ndim - len(each.shape)] for array, each in zip(others, self.inputs[1:])]
            shapes += [array.shape for array in varied.values()]
            lead = np.broadcast_shapes(targets.shape[:-2], *shapes)
        except ValueError:
            lead = targets.shape[:-2]  # the kernel says which of them do not go together
        wanted = self._wanted(nearest, lead, self.types([targets, *others])[0])
        q, exists = self.chooses(targets, *others, wanted, params=chosen, threads=threads)
        return q, exists[()]

    def _wanted(self, nearest: ArrayLike, lead: tuple[int, ...], real: np.dtype[Any]) -> Floats:
        """The joint vectors asked for, one for each target."""
        given, dof = np.asarray(nearest), self.results[0].shape[-1]
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
        with np.errstate(over="ignore"):
            return full.astype(real, copy=False)


def _has_numbers(out: Any) -> bool:
    """Whether results go to two arrays of numbers of one type."""
    return (
        type(out) is tuple
        and len(out) == 2
        and all(isinstance(each, np.ndarray) for each in out)
        and out[1].dtype == out[0].dtype
        and out[1].dtype.kind == "f"
    )


def _chooser(
    turnings: tuple[Turnings, Turnings],
    sharings: tuple[Sharings, Sharings],
    ends: Ends | None,
    options: dict[str, Any],
) -> Kernel[tuple[Floats, Truths]]:
    """The kernel of the nearest solutions, made from the options of the inverse."""
    (solutions, _), formula = options["results"], options["formula"]
    dof = solutions.shape[-1:]
    own: dict[str, Any] = {
        **options,
        "inputs": (*options["inputs"], Array("nearest", dof)),
        "results": (Array("q", dof), Array("exists", (), is_truth=True)),
        "formula": NearestFormula(formula, turnings, len(options["inputs"]), sharings, ends),
    }
    # A package has one inverse, so that the choice has the same name for all.
    return Kernel("inverse_nearest", **own)
