"""Which number fails a self-test: read from the emitted test vectors, for the message of a build.

In: the text of the vectors, and the module of the package. Out: a sentence with the kernel, the number, its difference
and the accepted one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from kinegen.ir.lower import program_of
from kinegen.naming import companion, function, prefix
from kinegen.outputs import INVERSES, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.subjects import subjects

FloatArray = NDArray[np.float64]


def worst_number(robot: Robot, package: ModuleType, text: str, quantities: Sequence[Quantity], real: str) -> str:
    """Compare the kernels of a package with its test vectors.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        text: The header with the test vectors.
        quantities: What its kernels compute.
        real: `double` or `float`.

    Returns:
        The number with the largest part of its accepted difference, after a colon; empty where none is above it.
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
                    f"accepted is {accepted[number]:.3g}"
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
        numbers = result[..., :3, :] if array.is_pose else result
        found = numbers.reshape(len(numbers), -1)[: len(wanted)].astype(np.float64)
        turns = np.round((found - wanted) / (2 * np.pi)) if subject.turns else 0.0
        compared.append(
            (f"{quantity}{f' ({array.name})' if ending else ''}", found - 2 * np.pi * turns, wanted, accepted[0])
        )
    return compared


def _array(text: str, name: str) -> FloatArray | None:
    """The rows of an array in C, shape (N, numbers); None where there is none."""
    block = re.search(rf" {name}(?:\[\w+\])+(?: \w+)? = (\{{.*?\}});", text, re.DOTALL)
    if block is None:
        return None
    rows = re.findall(r"\{([^{}]+)\}", block.group(1))
    return np.array([[float(number.strip().rstrip("F")) for number in row.split(",")] for row in rows])
