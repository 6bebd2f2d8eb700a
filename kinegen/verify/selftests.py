"""The self-tests that firmware engineers run: they pass here, and a spoilt kernel makes them fail.

In: a library with the self-test and kernels that can be spoilt. Out: nothing, or the first self-test that fails, or
that passes with a wrong kernel. Every result is spoilt in every call that the self-test makes, so that each of its
vectors is known to be compared, and to hold what the kernel returns, which is itself compared with the reference.
"""

from __future__ import annotations

import ctypes
import itertools
import math
from collections.abc import Callable, Iterator, Sequence

from kinegen.errors import ProofError
from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.probe import TYPES, Probe, Spoilable
from kinegen.verify.subjects import subjects

Deltas = tuple[tuple[float, ...], ...]
"""Sizes for each number of each result, the last rows of matrices counted."""

FEWEST = 4
"""Calls that a self-test makes of a kernel at least, where it is called at all."""

SPOILT_JOINTS = 0.05
"""How wrong solutions of an inverse are made, in radians or lengths: near a singularity they may be off by more."""

EACH = 600
"""Numbers of a kernel, times calls, up to which each is spoilt alone."""


def require_selftest(
    robot: Robot,
    probe: Probe,
    quantities: Sequence[Quantity],
    kernels: Sequence[Spoilable],
    deltas: Sequence[Deltas],
    explain: Callable[[], str] = str,
) -> None:
    """Run a self-test with right kernels, and with wrong ones.

    Args:
        robot: The robot.
        probe: Its compiled files.
        quantities: What the kernels compute.
        kernels: The kernels.
        deltas: For each kernel by how much its numbers are spoilt; infinitely where rounding may do anything to one.
        explain: What to say of a self-test that fails.

    Raises:
        ProofError: If it fails, leaves out a kernel, or passes with a spoilt one.
    """
    name = f"{robot.name}: the self-test of the {probe.real} kernels"
    calls = _run(probe, len(kernels))
    if calls is None:
        raise ProofError(f"{name} fails{explain()}; nothing was written")
    for place, (quantity, kernel) in enumerate(zip(quantities, kernels, strict=True)):
        called = kernel.function if kernel.is_choice else quantity
        certain = all(map(math.isfinite, itertools.chain(*deltas[place])))
        if not sum(kernel.results) or (calls[place] == 0 and (not certain or _may_be_left_out(quantity))):
            continue
        if calls[place] < (FEWEST if robot.dof else 1):
            raise ProofError(f"{name} calls {called} {calls[place]} times; nothing was written")
        for result, number, call in _spoils(kernel, quantity, calls[place]):
            sizes = deltas[place][result] if result < len(kernel.results) else (1.0,)
            size = max(sizes) if number < 0 else sizes[number]
            signs = (1, -1) if call < 0 else (1,)
            spoilt = [(place, result, number, call)] * len(signs)
            if any(
                _run(probe, len(kernels), *each) is not None for each in zip(spoilt, (sign * size for sign in signs))
            ):
                where = "all numbers" if number < 0 else f"number {number}"
                raise ProofError(f"{name} passes with {where} of {called} wrong; nothing was written")


def require_accepted(robot: Robot, probe: Probe, kernels: Sequence[Spoilable], accepted: float, room: int) -> None:
    """See that a self-test accepts differences as large as stated, and no larger ones.

    Args:
        robot: The robot.
        probe: Its compiled files, whose kernels are nearly exact.
        kernels: The kernels.
        accepted: The largest difference that it has to accept.
        room: How far a result may be from the exact one by itself.

    Raises:
        ProofError: If a self-test passes with a number that is off by more, or fails with one that is off by less.
    """
    name = f"{robot.name}: with a coarse sine and cosine, the self-test of the {probe.real} kernels"
    for place, kernel in enumerate(kernels):
        first = (place, 0, 0, -1)
        for sign in (1, -1):
            if _run(probe, len(kernels), first, sign * (accepted + room)) is not None:
                raise ProofError(f"{name} accepts more than {accepted:.0f} units for {kernel.function}")
            if _run(probe, len(kernels), first, sign * (accepted - room)) is None:
                raise ProofError(f"{name} does not accept {accepted:.0f} units for {kernel.function}")


def _may_be_left_out(quantity: Quantity) -> bool:
    """Whether a kernel may have no vectors: one whose numbers jump may do so at every pose."""
    return quantity.kind is not Kind.INVERSE and any(subject.margin is not None for subject in subjects(quantity))


def _spoils(kernel: Spoilable, quantity: Quantity, calls: int) -> Iterator[tuple[int, int, int]]:
    """Result, number (-1 for all) and call (-1 for all, to either side) of each trial."""
    if kernel.is_choice:
        yield from ((len(kernel.results), 0, call) for call in (-1, *range(calls)))
    elif quantity.kind is Kind.INVERSE:
        yield 0, -1, -1  # which of its branches is compared is not known here
        return
    for result, size in enumerate(kernel.results):
        yield from ((result, number, -1) for number in range(size))
        if size * calls <= EACH:
            yield from ((result, number, call) for number, call in itertools.product(range(size), range(calls)))
        elif size:
            yield from ((result, -1, call) for call in range(calls))


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
