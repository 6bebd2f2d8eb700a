"""What one call of a kernel costs on a target: flash, stack, instructions."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from kinegen.boards.emulator import run_program
from kinegen.boards.figures import Calls, Cost
from kinegen.boards.programs import build_program, write_measured
from kinegen.boards.targets import Target
from kinegen.boards.toolchain import SOURCES, find_cross_compiler, link, read_tool
from kinegen.emit.fixed import Q30
from kinegen.emit.kernels import Kernels
from kinegen.errors import KinegenError, MissingToolError
from kinegen.ir.program import count
from kinegen.naming import function

OPTIMISATIONS = ("-Os", "-O2")
"""The levels that are tried; firmware is seldom built with others."""

_REPEATS = 8
"""Calls between two readings of the clock, as in cost.c."""


def measure(kernels: Kernels, real: str, target: Target) -> tuple[Cost, ...]:
    """Measure every kernel of a robot with every optimisation level.

    Each kernel is measured by itself, as if the others were not in the firmware. Without the emulator there are no
    counts, and the stack is the compiler's account, which leaves out its library's arithmetic.

    Args:
        kernels: The robot and its programs.
        real: The number type, a `Real` or `Q30`.
        target: The processor.

    Returns:
        For each program, one entry for each of `OPTIMISATIONS`.

    Raises:
        MissingToolError: If there is no compiler for the target; the message names the package.
        KinegenError: If the target lacks the number type, or integers cannot evaluate a kernel.
    """
    if real not in (*target.reals, Q30):
        raise KinegenError(f"{target.name} has no {real} of 64 bits: take --real float")
    find_cross_compiler(target)
    costs = []
    for program in kernels.programs:
        single = replace(kernels, programs=(program,))
        for optimisation in OPTIMISATIONS:
            with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
                costs.append(_measure(single, real, target, optimisation, Path(folder)))
    return tuple(costs)


def better(costs: Sequence[Cost]) -> Cost:
    """The one that takes the fewest instructions, or the least flash where these are equal or unknown."""
    return min(costs, key=lambda cost: (cost.calls.most if cost.calls else 0, cost.flash))


def _measure(kernels: Kernels, real: str, target: Target, optimisation: str, folder: Path) -> Cost:
    files = write_measured(folder, kernels, real)
    calls, deepest = _run(target, build_program(target, folder, files, SOURCES / "cost.c", real, (optimisation,)))
    (program,) = kernels.programs
    name = function(kernels.robot.name, program.quantity.function, real)
    compiled = files[0].with_suffix(".o")
    alone = link(target, folder, (compiled,), "alone.elf", entry=name)
    compiler = find_cross_compiler(target)
    return Cost(
        target=target.name,
        compiler=f"{compiler.command[0]} {compiler.version}",
        quantity=program.quantity,
        real=real,
        optimisation=optimisation,
        function_flash=_symbol_size(target, compiled, name),
        flash=_flash(target, alone),
        stack=max(deepest, _accounted_stack(compiled.with_suffix(".su"))),
        calls=calls,
        unit=target.unit,
        operations=count(program),
    )


def _run(target: Target, program: Path) -> tuple[Calls | None, int]:
    """Counts and depth of the stack from the emulator; nothing where it is not installed."""
    try:
        lines = run_program(target, program)
    except MissingToolError:
        return None, 0
    numbers: dict[str, list[int]] = {"spin": [], "call": [], "stack": []}
    for line in lines:
        label, _, number = line.partition(" ")
        if label in numbers:
            numbers[label].append(int(number))
    if not all(numbers.values()):
        raise KinegenError(f"{program.name} on {target.board} wrote no figures: {'; '.join(lines[-3:])}")
    ticks = Fraction(numbers["spin"][0], 10_000 * target.toolchain.round_cost)
    # The return of the function that does nothing was subtracted, and belongs to the kernel.
    taken = [round(Fraction(number, _REPEATS) / ticks) + 1 for number in numbers["call"]]
    return Calls(min(taken), max(taken)), numbers["stack"][0] + target.toolchain.call_bytes


def _accounted_stack(usage: Path) -> int:
    """The kernel's stack and that of the sine-cosine pair, the only function that it calls."""
    return sum(int(line.split("\t")[1]) for line in usage.read_text(encoding="utf-8").splitlines())


def _flash(target: Target, program: Path) -> int:
    """Bytes of code and constants; what RAM is filled with at the start lies in flash too."""
    table = read_tool((f"{target.toolchain.prefix}size", "-A", str(program)))
    rows = [line.split() for line in table.splitlines() if line.startswith((".text", ".rodata", ".data"))]
    return sum(int(row[1]) for row in rows)


def _symbol_size(target: Target, compiled: Path, name: str) -> int:
    table = read_tool((f"{target.toolchain.prefix}nm", "-S", str(compiled)))
    sizes = [line.split()[1] for line in table.splitlines() if line.endswith(f" {name}")]
    return int(sizes[0], 16)
