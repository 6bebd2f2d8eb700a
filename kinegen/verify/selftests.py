"""The self-tests that firmware engineers run: they pass here, and a spoilt kernel makes them fail.

In: a library with the self-test and kernels that can be spoilt. Out: nothing, or the first self-test that fails, or
that passes with a wrong kernel. Every result is spoilt in every call that the self-test makes, so that each of its
vectors is known to be compared, and to hold what the kernel returns, which is itself compared with the reference.
"""

from __future__ import annotations

import ctypes
import itertools
from collections.abc import Iterator, Sequence

from kinegen.errors import ProofError
from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.probe import TYPES, Probe, Spoilable
from kinegen.verify.subjects import subjects

FEWEST = 4
"""Calls that a self-test makes of a kernel at least, where it is called at all."""

SPOILT_JOINTS = 0.05
"""How wrong solutions of an inverse are made, in radians or lengths: near a singularity they may be off by more."""

EACH = 600
"""Numbers of a kernel, times calls, up to which each is spoilt alone."""


def require_selftest(
    robot: Robot, probe: Probe, quantities: Sequence[Quantity], kernels: Sequence[Spoilable], spoil: float
) -> None:
    """Run a self-test with right kernels, and with wrong ones.

    Args:
        robot: The robot.
        probe: Its compiled files.
        quantities: What the kernels compute.
        kernels: The kernels.
        spoil: By how much results are spoilt.

    Raises:
        ProofError: If it fails, leaves out a kernel, or passes with a spoilt one.
    """
    name = f"{robot.name}: the self-test of the {probe.real} kernels"
    calls = _run(probe, len(kernels))
    if calls is None:
        raise ProofError(f"{name} fails; nothing was written")
    for place, (quantity, kernel) in enumerate(zip(quantities, kernels, strict=True)):
        if not sum(kernel.results) or (calls[place] == 0 and _may_be_left_out(quantity)):
            continue
        if calls[place] < (FEWEST if robot.dof else 1):
            raise ProofError(f"{name} calls {quantity} {calls[place]} times; nothing was written")
        for result, number, call in _spoils(kernel, quantity, calls[place]):
            delta = spoil if quantity.kind is not Kind.INVERSE else SPOILT_JOINTS
            if _run(probe, len(kernels), (place, result, number, call), delta) is not None:
                where = "all numbers" if number < 0 else f"number {number}"
                raise ProofError(f"{name} passes with {where} of {quantity} wrong; nothing was written")


def _may_be_left_out(quantity: Quantity) -> bool:
    """Whether a kernel may have no vectors: one whose numbers jump may do so at every pose."""
    return quantity.kind is not Kind.INVERSE and any(subject.margin is not None for subject in subjects(quantity))


def _spoils(kernel: Spoilable, quantity: Quantity, calls: int) -> Iterator[tuple[int, int, int]]:
    """Result, number (-1 for all) and call (-1 for all) of each trial."""
    if quantity.kind is Kind.INVERSE:
        yield 0, -1, -1  # which of its branches is compared is not known here
        return
    for result, size in enumerate(kernel.results):
        # The last row of a matrix holds constants, which vectors leave out.
        numbers = [number for number in range(size) if not (_is_pose(quantity, result) and number % 16 > 11)]
        if len(numbers) * calls <= EACH:
            yield from ((result, number, call) for number, call in itertools.product(numbers, range(calls)))
        else:
            yield from ((result, number, -1) for number in numbers)
            yield from ((result, -1, call) for call in range(calls))


def _is_pose(quantity: Quantity, result: int) -> bool:
    """Whether a result of a quantity is poses."""
    first = quantity.is_pose or quantity.kind in (Kind.FK_JACOBIAN, Kind.INVERSE_POSE, Kind.FK_ACTUATORS)
    return first and result == 0


def _run(
    probe: Probe, kernels: int, spoilt: tuple[int, int, int, int] = (-1, -1, -1, -1), delta: float = 0.0
) -> tuple[int, ...] | None:
    """Run the self-test; how often it called each kernel, or None if it failed."""
    library = probe.library
    calls = (ctypes.c_int * max(1, kernels)).in_dll(library, "kinegen_calls")
    for index in range(kernels):
        calls[index] = 0
    for name, value in zip(("kernel", "result", "number", "call"), spoilt, strict=True):
        ctypes.c_int.in_dll(library, f"kinegen_{name}").value = value
    kind = TYPES[probe.real]
    kind.in_dll(library, "kinegen_delta").value = kind(int(delta) if probe.real == "q30" else delta).value
    return tuple(calls) if library.kinegen_selftest() == 0 else None
