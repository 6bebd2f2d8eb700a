"""One comparison: what the reference says at the inputs of a kernel, and how far the kernel is from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kinegen.ir.program import Program
from kinegen.outputs import Array, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Comparison
from kinegen.verify.expectation import Expectation, Limits, expect
from kinegen.verify.known import Known
from kinegen.verify.samples import FloatArray, input_samples
from kinegen.verify.tolerances import accepted, number_type
from kinegen.verify.ways import Arrays, Floats


class Store:
    """The reference at the inputs of all kernels of one number type, each asked once."""

    def __init__(self, robot: Robot, dtype: Any, *, exact: bool) -> None:
        self._robot, self._dtype, self._exact = robot, dtype, exact
        self._known: dict[Any, Known] = {}

    def expect(self, quantity: Quantity, arrays: Sequence[Array], points: FloatArray) -> tuple[Arrays, Expectation]:
        """The inputs of a kernel, and what it must return for them."""
        key = len(points), *(array.name for array in arrays)
        known = self._known.get(key)
        if known is None:
            values = input_samples(self._robot, arrays, points)
            rounded = {name: value.astype(self._dtype).astype(np.float64) for name, value in values.items()}
            known = self._known[key] = Known(
                self._robot, rounded, exact=self._exact, unit=float(np.finfo(self._dtype).eps) / 2
            )
        return tuple(known.inputs[array.name].astype(self._dtype) for array in arrays), expect(known, quantity)


class Judge:
    """Compares what kernels return at some inputs with what they must; limits are found once for each number type.

    Args:
        expectation: The reference at the inputs.
        program: What the kernels were printed from.
        real: Their number type.
        within: Whether the inputs lie where samples are taken from, for which errors are proven.
    """

    def __init__(self, expectation: Expectation, program: Program, real: str, *, within: bool = True) -> None:
        self.expectation, self._program, self._real, self._within = expectation, program, real, within
        self._limits: dict[bool, Limits] = {}
        self._found: dict[bool, tuple[tuple[bytes, ...], Comparison]] = {}

    def limits(self, target: str) -> Limits:
        """What is accepted of a target; the sines of NumPy are its own."""
        return self._accepted(library=_is_library(target))

    def compare(self, target: str, results: Arrays, row: str = "") -> Comparison:
        """One comparison; `row` is what it counts as in a report.

        The sines of NumPy may be off by more than those of C. Most of its results keep the limits of C all the same;
        its own, which take as long to find, are asked for only where they do not.
        """
        found = self._compare(results, library=False)
        if not found.holds and _is_library(target):
            found = self._compare(results, library=True)
        return replace(found, target=target, row=row)

    def _accepted(self, *, library: bool) -> Limits:
        if library not in self._limits:
            kind = number_type(self._real, library=library)
            self._limits[library] = accepted(self.expectation, self._program, kind, within=self._within)
        return self._limits[library]

    def _compare(self, results: Arrays, *, library: bool) -> Comparison:
        """A comparison without its names; of the same bits it is found once."""
        bits, limits = tuple(map(_bits, results)), self._accepted(library=library)
        before, known = self._found.get(library, ((), None))
        if known is None or bits != before:
            known = compare(self.expectation, "", results, limits, self._real)
            self._found[library] = bits, known
        return known


def _is_library(target: str) -> bool:
    """Whether its sines are those of NumPy."""
    return target.startswith("NumPy")


def _bits(result: Floats) -> bytes:
    """Everything that an array holds, and of what type and shape it is."""
    return f"{result.dtype} {result.shape} ".encode() + result.tobytes()


def compare(
    expectation: Expectation, target: str, results: Arrays, limits: Limits, real: str, row: str = ""
) -> Comparison:
    """Hold the results of a kernel against what it must return.

    Args:
        expectation: What it must return.
        target: The kernel and how it was called, for people.
        results: What it returned, N configurations each.
        limits: What is accepted.
        real: Its number type.
        row: What it counts as in a report.
    """
    verdict = expectation.judge(results, limits)
    return Comparison(
        target=target,
        quantity=expectation.quantity,
        poses=expectation.known.count,
        position_error=verdict.position_error,
        rotation_error=verdict.rotation_error,
        position_tolerance=verdict.position_limit,
        rotation_tolerance=verdict.rotation_limit,
        worst=tuple(float(entry) for entry in expectation.known.joints[verdict.row]),
        frame=verdict.frame,
        real=real,
        row=row,
    )
