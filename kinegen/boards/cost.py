"""What one call of a kernel costs on a target: flash, stack, instructions."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from kinegen.boards.emulator import HungError, run_program
from kinegen.boards.figures import Calls, Cost
from kinegen.boards.programs import build_program, write_measured, write_search
from kinegen.boards.targets import Target
from kinegen.boards.toolchain import SOURCES, find_cross_compiler, link, read_tool
from kinegen.emit.fixed import Q30
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError, MissingToolError
from kinegen.ir.program import Program, count
from kinegen.outputs import NUMERIC_INVERSE

OPTIMISATIONS = ("-Os", "-O2")
"""The levels that are tried; firmware is seldom built with others."""


def measure(kernels: Kernels, real: str, target: Target) -> tuple[Cost, ...]:
    """Measure every kernel of a robot with every optimisation level.

    Each kernel is measured by itself, as if the others were not in the firmware. Without the emulator, or where
    a program does not end in time, there are no counts (`Cost.missing` says why), and the stack is the compiler's
    account, which leaves out its library's arithmetic.

    Args:
        kernels: The robot and its programs.
        real: The number type, a `Real` or `Q30`.
        target: The processor.

    Returns:
        For each program, and the numeric inverse if there is one, one entry for each of `OPTIMISATIONS`.

    Raises:
        MissingToolError: If there is no compiler for the target; the message names the package.
        KinegenError: If the target lacks the number type, or integers cannot evaluate a kernel.
    """
    if real not in (*target.reals, Q30):
        raise KinegenError(f"{target.name} has no {real} of 64 bits: use --real float")
    find_cross_compiler(target)
    costs = []
    for program in (*kernels.programs, *([None] if kernels.numeric_inverse else [])):
        for optimisation in OPTIMISATIONS:
            with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
                costs.append(_measure(kernels, program, real, target, optimisation, Path(folder)))
    return tuple(costs)


def better(costs: Sequence[Cost]) -> Cost:
    """The one that takes the fewest instructions, or the least flash where these are equal or unknown."""
    return min(costs, key=lambda cost: (cost.calls.most if cost.calls else 0, cost.flash))


def _measure(
    kernels: Kernels, program: Program | None, real: str, target: Target, optimisation: str, folder: Path
) -> Cost:
    """The cost of one kernel; without a program, that of the numeric inverse."""
    if program is None:
        measured = write_search(folder, kernels, Real(real))
    else:
        measured = write_measured(folder, replace(kernels, programs=(program,)), real)
    flags = (optimisation, f"-DREPEATS={measured.repeats}")
    built = build_program(target, folder, measured.files, SOURCES / "cost.c", real, flags)
    calls, deepest, missing = _run(target, built, measured.repeats)
    own = [file.with_suffix(".o") for file in measured.files[: measured.own]]
    accounted = sum(_accounted_stack(file.with_suffix(".su")) for file in own)
    compiler = find_cross_compiler(target)
    return Cost(
        target=target.name,
        compiler=f"{compiler.command[0]} {compiler.version}",
        quantity=program.quantity if program else NUMERIC_INVERSE,
        real=real,
        optimisation=optimisation,
        function_flash=_symbol_size(target, own[-1], measured.name),
        flash=_flash(target, link(target, folder, own, "alone.elf", entry=measured.name)),
        # The search calls its functions one after the other, not each from within the one before.
        stack=deepest if deepest and program is None else max(deepest, accounted),
        calls=calls,
        unit=target.unit,
        operations=count(program) if program else None,
        missing=missing,
    )


def _run(target: Target, program: Path, repeats: int) -> tuple[Calls | None, int, str]:
    """Counts and depth of the stack from the emulator, or why there are none."""
    try:
        lines = run_program(target, program)
    except (MissingToolError, HungError) as error:
        return None, 0, error.message
    numbers: dict[str, list[int]] = {"spin": [], "call": [], "stack": []}
    for line in lines:
        label, _, number = line.partition(" ")
        if label in numbers:
            numbers[label].append(int(number))
    if not all(numbers.values()):
        raise KinegenError(f"{program.name} on {target.board} wrote no figures: {'; '.join(lines[-3:])}")
    ticks = Fraction(numbers["spin"][0], 10_000 * target.toolchain.round_cost)
    # The return of the function that does nothing was subtracted, and belongs to the kernel.
    taken = [round(Fraction(number, repeats) / ticks) + 1 for number in numbers["call"]]
    return Calls(min(taken), max(taken)), numbers["stack"][0] + target.toolchain.call_bytes, ""


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
