"""The self-tests that firmware engineers run: they pass, and fail where a number of a kernel is wrong.

Every result is spoilt in every call that the self-test makes, so that each of its vectors is known to be compared, and
to hold what the kernel returns, which is itself compared with the reference.
"""

from __future__ import annotations

import ctypes
import itertools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType

import numpy as np

from kinegen.errors import ProofError
from kinegen.ir.lower import program_of
from kinegen.model.outputs import INVERSES, Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.support.naming import companion, function, prefix
from kinegen.verify.c_library import TYPES, Probe, Spoilable
from kinegen.verify.expected_results import subjects
from kinegen.verify.isolation import calling
from kinegen.verify.samples import FloatArray


def worst_number(robot: Robot, package: ModuleType, text: str, quantities: Sequence[Quantity], real: str) -> str:
    """Compare the kernels of a package with its test vectors.

    `text`: the header with the test vectors. Returns the number with the largest part of its accepted difference, after
    a colon; empty where none is above it.
    """
    worst, sentence = 1.0, ""
    for quantity in quantities:
        if quantity.kind in INVERSES:
            continue
        for name, found, wanted, accepted in _compared(robot, package, text, quantity, real):
            apart = np.abs(found - wanted)
            parts = np.nan_to_num(apart / accepted, nan=math.inf)
            row, number = np.unravel_index(np.argmax(parts), parts.shape)
            if parts[row, number] > worst:
                worst = float(parts[row, number])
                sentence = (
                    f": number {number} of {name} is off by {apart[row, number]:.3g} at vector {row}, "
                    f"tolerance {accepted[number]:.3g}"
                )
    return sentence


def _compared(
    robot: Robot, package: ModuleType, text: str, quantity: Quantity, real: str
) -> list[tuple[str, FloatArray, FloatArray, FloatArray]]:
    """For each result its name, what the kernel gives and what is expected, (N, numbers) each, and what is accepted."""
    signature = program_of(robot, quantity).signature
    name, kernel = function(robot.name, quantity.function, real), getattr(package, quantity.function)
    dtype = np.float32 if real == "float" else np.float64
    inputs = [
        _array(text, f"{prefix(robot.name, real)}_vectors_{array.name}") for array in signature.inputs if array.size
    ]
    # A quantity without vectors, or without inputs, has nothing to compare.
    if any(each is None for each in inputs) or len(inputs) != len(signature.inputs):
        return []
    shapes = [array.shape for array in kernel.inputs]
    results = kernel(
        *(
            each.astype(dtype).reshape(-1, *shape)
            for each, shape in zip(inputs, shapes, strict=True)
            if each is not None
        )
    )
    compared = []
    both = zip(
        subjects(quantity), signature.results, results if isinstance(results, tuple) else (results,), strict=True
    )
    for subject, array, result in both:
        ending = f"_{array.name}" if len(signature.results) > 1 else ""
        wanted, accepted = (
            _array(text, f"{companion(name, 'expected')}{ending}"),
            _array(text, f"{companion(name, 'accepted')}{ending}"),
        )
        if wanted is None or accepted is None:
            continue
        # The vectors hold no last rows, and angles count up to whole turns.
        numbers = result[..., :3, :] if array.is_pose else result
        found = numbers.reshape(len(numbers), -1)[: len(wanted)].astype(np.float64)
        turns = np.round((found - wanted) / (2 * np.pi)) if subject.turns else 0.0
        compared.append(
            (f"{quantity}{f' ({array.name})' if ending else ''}", found - 2 * np.pi * turns, wanted, accepted[0])
        )
    return compared


def _array(text: str, name: str) -> FloatArray | None:
    """Returns the rows of an array in C, shape (N, numbers); None where there is none."""
    block = re.search(rf" {name}(?:\[\w+\])+(?: \w+)? = (\{{.*?\}});", text, re.DOTALL)
    if block is None:
        return None
    rows = re.findall(r"\{([^{}]+)\}", block.group(1))
    return np.array([[float(number.strip().rstrip("F")) for number in row.split(",")] for row in rows])


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

    `deltas`: for each kernel by how much its numbers are spoilt; infinitely where rounding may do anything to one;
    `explain`: what to say of a self-test that fails. Raises `ProofError` if it fails, leaves out a kernel, or passes
    with a spoilt one.
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

    `probe`: its compiled files, whose kernels are nearly exact; `accepted`: the largest difference that it has to
    accept; `room`: how far a result may be from the exact one by itself. Raises `ProofError` if a self-test passes with
    a number that is off by more, or fails with one that is off by less.
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
    """Returns whether a kernel may have no vectors: one whose numbers jump may do so at every pose."""
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
    calling(f"the self-test of the {probe.real} kernels")
    library = probe.library
    calls = (ctypes.c_int * max(1, kernels)).in_dll(library, "kinegen_calls")
    for index in range(kernels):
        calls[index] = 0
    for name, value in zip(("kernel", "result", "number", "call"), spoilt, strict=True):
        ctypes.c_int.in_dll(library, f"kinegen_{name}").value = value
    kind = TYPES[probe.real]
    kind.in_dll(library, "kinegen_delta").value = kind(int(delta) if probe.real == "q30" else delta).value
    return tuple(calls) if library.kinegen_selftest() == 0 else None
