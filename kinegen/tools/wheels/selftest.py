"""The self-test that a wheel carries: inputs, results of the 50-digit reference, and what is accepted, as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.test_vectors import NOTHING, Row, Vectors, accepted_differences, whole
from kinegen.backends.c.vectors import INVERSE_TOLERANCES
from kinegen.backends.inverse import branches_of, inverse_of
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import reach
from kinegen.verify.vectors import compute_vectors

_KINDS = {ScalarType.DOUBLE: "float64", ScalarType.FLOAT: "float32"}


def selftest_files(kernels: RobotPrograms, reals: tuple[ScalarType, ...]) -> dict[str, str]:
    """Return `__main__.py` of the self-test and the numbers that it reads, by file name."""
    vectors = compute_vectors(kernels)
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    # Inputs, results and allowances are data; the program that reads them is the same for every robot.
    document = {
        "kinds": [_KINDS[real] for real in reals],
        "kernels": [_kernel(kernels, program, vectors, reals) for program in checked],
        "inverse": _inverse(kernels, vectors, reals),
    }
    robot = kernels.robot
    template = environment().get_template("wheel/__main__.py.jinja")
    inverse = inverse_of(kernels)
    return {
        "__main__.py": template.render(
            name=robot.name,
            provenance=provenance(robot),
            inverse=inverse[0].quantity.function if inverse else "inverse",
            given=len(robot.given),
        ),
        "_selftest.json": json.dumps(document, allow_nan=False, separators=(",", ":")) + "\n",
    }


def _kernel(
    kernels: RobotPrograms, program: Program, vectors: Vectors, reals: tuple[ScalarType, ...]
) -> dict[str, Any]:
    count = min(len(each.rows) for each in vectors.expected[program.quantity])
    return {
        "function": program.quantity.function,
        "inputs": [_floats(vectors.inputs[array.name][:count]) for array in program.signature.inputs],
        "results": list(_results(kernels, program, vectors, reals, count)),
    }


def _results(
    kernels: RobotPrograms, program: Program, vectors: Vectors, reals: tuple[ScalarType, ...], count: int
) -> Iterator[dict[str, Any]]:
    limits = {real: iter(accepted_differences(kernels, program, vectors, real)) for real in reals}
    for array, each in zip(program.signature.results, vectors.expected[program.quantity], strict=True):
        accepted = {_KINDS[real]: next(limits[real]) if array.size else () for real in reals}
        yield {
            "rows": _floats([whole(array, row) for row in each.rows[:count]]),
            "accepted": {kind: _floats([whole(array, row, NOTHING)])[0] for kind, row in accepted.items()},
            "turns": math.tau if each.turns else 0.0,
        }


def _inverse(kernels: RobotPrograms, vectors: Vectors, reals: tuple[ScalarType, ...]) -> dict[str, Any] | None:
    """Return the targets of the closed-form inverse with their joint values; None without one."""
    robot = kernels.robot
    branches = branches_of(kernels)
    if branches is None or not vectors.targets:
        return None
    return {
        "targets": _floats([pose for pose, _ in vectors.targets]),
        "given": _floats(vectors.given),
        "joints": _floats([joints for _, joints in vectors.targets]),
        "turns": [0.0 if math.isinf(turn) else float(turn) for turn in branches.turns],
        "extents": [reach(robot) if math.isinf(turn) else 1.0 for turn in branches.turns],
        "accepted": {_KINDS[real]: float(INVERSE_TOLERANCES[real]) for real in reals},
    }


def _floats(rows: list[Row] | tuple[Row, ...]) -> list[list[float]]:
    """Doubles; accepted differences that no double holds become the largest."""
    return [[_float(entry) for entry in row] for row in rows]


def _float(entry: Fraction) -> float:
    try:
        return float(entry)
    except OverflowError:
        return math.copysign(1.7976931348623157e308, entry)
