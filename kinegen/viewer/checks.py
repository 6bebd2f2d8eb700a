"""Test vectors of a page: what its kernels must return, computed with 50 digits and rounded once."""

from __future__ import annotations

from typing import Any

from kinegen.emit.c.accepted import accepted_differences
from kinegen.emit.c.expected import Row
from kinegen.emit.c.vectors import INVERSE_TOLERANCES
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.outputs import Kind
from kinegen.robot.extent import reach
from kinegen.verify.vectors import compute_vectors

Json = Any


def check_data(kernels: Kernels) -> dict[str, Json]:
    """The vectors by kernel.

    Args:
        kernels: The robot and its programs.

    Returns:
        `{"checks": {"inputs", "kernels", "targets"}}`: inputs by name; of each kernel its arguments by name, and of
        each of its results the rows of numbers, the largest accepted difference of each entry, whether whole turns do
        not matter, and whether the numbers are matrices without their last rows. Targets are poses with the joint
        vectors that an inverse must find.
    """
    vectors = compute_vectors(kernels)
    programs = [program for program in kernels.programs if program.quantity in vectors.expected]
    checks = []
    for program in programs:
        accepted = iter(accepted_differences(kernels, program, vectors, Real.DOUBLE))
        expected = vectors.expected[program.quantity]
        results = [
            {
                "pose": array.is_pose,
                "turns": result.turns,
                "rows": _table(result.rows),
                "accepted": _numbers(next(accepted)) if array.size else [],
            }
            for array, result in zip(program.signature.results, expected, strict=True)
        ]
        checks.append({"name": program.quantity.function, "inputs": _inputs(program), "results": results})
    tolerance = float(INVERSE_TOLERANCES[Real.DOUBLE])
    extents = [reach(kernels.robot) if each.type == "prismatic" else 1.0 for each in kernels.robot.variables]
    has_inverse = any(program.quantity.kind is Kind.INVERSE for program in kernels.programs)
    targets = [{"pose": _numbers(pose), "q": _numbers(q)} for pose, q in vectors.targets] if has_inverse else []
    return {
        "checks": {
            "inputs": {name: _table(rows) for name, rows in vectors.inputs.items()},
            "kernels": checks,
            "targets": targets,
            "tolerances": [tolerance * extent for extent in extents],
        }
    }


def _inputs(program: Program) -> list[str]:
    return [array.name for array in program.signature.inputs]


def _table(rows: tuple[Row, ...]) -> list[list[float]]:
    return [_numbers(row) for row in rows]


def _numbers(row: Row) -> list[float]:
    return [float(entry) for entry in row]
