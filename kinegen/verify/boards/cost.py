"""What one call of a kernel costs on a target, and on the usual one: flash, stack, instructions.

Emulators take seconds, so the figures are remembered in the user's cache, by the text of the kernels and the compiler.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import field
from fractions import Fraction
from functools import partial
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError, MissingToolError
from kinegen.ir.program import Program, count
from kinegen.model.outputs import NUMERIC_INVERSE, Kind, Quantity
from kinegen.runtime.cache import Cache
from kinegen.runtime.toolchain_fingerprint import identity
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30
from kinegen.verify.boards.programs import (
    Measured,
    build_program,
    compile_board,
    compile_files,
    targets_by_kind,
    write_measured,
    write_nearest,
    write_search,
)
from kinegen.verify.boards.targets import (
    SOURCES,
    HungError,
    Target,
    find_cross_compiler,
    find_target,
    link,
    read_tool,
    run_program,
)
from kinegen.verify.records import Calls, Cost

OPTIMISATIONS = ("-Os", "-O2")
"""The levels that are tried; firmware is seldom built with others."""

_MAIN = SOURCES / "cost.c"


def measure(kernels: RobotPrograms, real: str, target: Target) -> tuple[Cost, ...]:
    """Measure every kernel of a robot with every optimisation level.

    Each kernel is measured by itself, as if the others were not in the firmware. Without the emulator, or where
    a program does not end in time, there are no counts (`Cost.missing` says why), and the stack is the compiler's
    account, which leaves out its library's arithmetic.

    Returns:
        For each program, the choice among solutions and the numeric inverse if there are any, one entry for each of
        `OPTIMISATIONS`.

    Raises:
        MissingToolError: If there is no compiler for the target; the message names the package.
        KinegenError: If the target lacks the number type, or integers cannot evaluate a kernel.
    """
    if real not in (*target.reals, Q30):
        raise KinegenError(f"{target.name} has no {real} of 64 bits: use --real float")
    find_cross_compiler(target)
    costs: list[Cost] = []
    with tempfile.TemporaryDirectory(prefix="kinegen-") as made:
        bench = _Bench(real, target, Path(made))
        for subject in _subjects(kernels, real):
            with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
                costs += bench.measure(subject, Path(folder))
    return tuple(costs)


def measure_targets(kernels: RobotPrograms, real: ScalarType, target: Target) -> dict[tuple[str, str], Cost]:
    """Measure what targets of different kinds cost: the search, and the choice among the solutions of an inverse.

    `kernels`: a robot with its inverse, or with the search, or with both. Returns the better of the levels of
    optimisation, by the name of the function and the kind of target. Raises `MissingToolError` if there is no compiler
    for the target; the message names the package.
    """
    find_cross_compiler(target)
    costs: dict[tuple[str, str], Cost] = {}
    for kind, rows in targets_by_kind(kernels.robot).items():
        for subject in _subjects(kernels, str(real), rows):
            if subject.program is None:
                with tempfile.TemporaryDirectory(prefix="kinegen-") as made:
                    found = _Bench(str(real), target, Path(made)).measure(subject, Path(made))
                costs[found[0].name, kind] = better(found)
    return costs


@dataclass(frozen=True, slots=True)
class _Subject:
    """What is measured: a kernel, the choice among the solutions of an inverse, or the search."""

    quantity: Quantity
    part: str  # See `Cost`
    write: Callable[[Path], Measured]  # Writes its C and the program around it into a folder
    program: Program | None = None  # Its program; none for the choice and the search


def _subjects(kernels: RobotPrograms, real: str, rows: Sequence[Sequence[float]] = ()) -> Iterator[_Subject]:
    for program in kernels.programs:
        own = kernels.alone(program)
        yield _Subject(program.quantity, "", partial(write_measured, kernels=own, real=real), program)
        if program.quantity.kind is Kind.INVERSE:
            yield _Subject(
                program.quantity, "nearest", partial(write_nearest, kernels=own, real=ScalarType(real), rows=rows)
            )
    if kernels.numeric_inverse:
        yield _Subject(NUMERIC_INVERSE, "", partial(write_search, kernels=kernels, real=ScalarType(real), rows=rows))


def better(costs: Sequence[Cost]) -> Cost:
    """Returns the one that takes the fewest instructions, or the least flash where these are equal or unknown."""
    return min(costs, key=lambda cost: (cost.calls.most if cost.calls else 0, cost.flash))


@dataclass(frozen=True, slots=True)
class _Bench:
    """Measures one subject after the other; what their programs share is compiled once."""

    real: str
    target: Target
    folder: Path
    _boards: dict[tuple[str, ...], tuple[Path, ...]] = field(default_factory=dict)

    def measure(self, subject: _Subject, folder: Path) -> list[Cost]:
        """Returns the costs of one subject at each level of optimisation."""
        measured = subject.write(folder)
        # What calls the kernel also calls the function that does nothing, so its own cost cancels out at any level.
        table = compile_files(self.target, folder, measured.files[measured.own :], self.real, OPTIMISATIONS[:1])
        return [self._cost(subject, measured, optimisation, folder, table) for optimisation in OPTIMISATIONS]

    def _cost(
        self, subject: _Subject, measured: Measured, optimisation: str, folder: Path, table: tuple[Path, ...]
    ) -> Cost:
        target, flags, files = self.target, (optimisation, f"-DREPEATS={measured.repeats}"), measured.files
        rest = (*table, *self._board(flags))
        built = build_program(target, folder, files[: measured.own], _MAIN, self.real, flags, rest)
        calls, deepest, missing = _run(target, built, measured.repeats)
        own = [file.with_suffix(".o") for file in files[: measured.own]]
        alone = link(target, folder, own, "alone.elf", entry=measured.name)
        called = _functions(target, alone)
        accounted = sum(_accounted_stack(file.with_suffix(".su"), called) for file in own)
        compiler, program = find_cross_compiler(target), subject.program
        return Cost(
            target=target.name,
            compiler=f"{compiler.command[0]} {compiler.version}",
            quantity=subject.quantity,
            real=self.real,
            optimisation=optimisation,
            function_flash=_symbol_size(target, own[-1], measured.name),
            flash=_flash(target, alone),
            # The search and the choice call their functions one after the other, not each from within the one before.
            stack=deepest if deepest and program is None else max(deepest, accounted),
            calls=calls,
            unit=target.unit,
            operations=count(program) if program else None,
            missing=missing,
            part=subject.part,
        )

    def _board(self, flags: tuple[str, ...]) -> tuple[Path, ...]:
        """Returns the objects of everything but the kernels, compiled once for each set of flags."""
        if flags not in self._boards:
            folder = self.folder / str(len(self._boards))
            folder.mkdir()
            self._boards[flags] = compile_board(self.target, folder, _MAIN, self.real, flags)
        return self._boards[flags]


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


def _functions(target: Target, program: Path) -> frozenset[str]:
    """Returns the functions of a program that was linked by itself: what one function needs, and nothing else."""
    table = read_tool((f"{target.toolchain.prefix}nm", str(program)))
    rows = [line.split() for line in table.splitlines()]
    return frozenset(_plain(row[-1]) for row in rows if row[-2] in ("T", "t"))


def _accounted_stack(usage: Path, called: Container[str]) -> int:
    """Returns the compiler's account of the function that is measured and of those that it calls.

    A source holds other functions too, such as those about limits; a call does not use their stack.
    """
    lines = [line.split("\t") for line in usage.read_text(encoding="utf-8").splitlines()]
    return sum(int(size) for place, size, *_ in lines if _plain(place.rpartition(":")[2]) in called)


def _plain(symbol: str) -> str:
    """Returns the name of a function in C; a compiler appends to those that it copies, such as `.constprop.0`."""
    return symbol.partition(".")[0]


def _flash(target: Target, program: Path) -> int:
    """Bytes of code and constants; what RAM is filled with at the start lies in flash too."""
    table = read_tool((f"{target.toolchain.prefix}size", "-A", str(program)))
    rows = [line.split() for line in table.splitlines() if line.startswith((".text", ".rodata", ".data"))]
    return sum(int(row[1]) for row in rows)


def _symbol_size(target: Target, compiled: Path, name: str) -> int:
    table = read_tool((f"{target.toolchain.prefix}nm", "-S", str(compiled)))
    sizes = [line.split()[1] for line in table.splitlines() if line.endswith(f" {name}")]
    return int(sizes[0], 16)


USUAL_TARGET = "cortex-m4f"
"""The microcontroller that most arms are driven by; its FPU is for floats."""


def can_measure() -> bool:
    """Returns whether the compiler of the usual target is installed."""
    try:
        find_cross_compiler(find_target(USUAL_TARGET))
    except MissingToolError:
        return False
    return True


def usual_costs(kernels: RobotPrograms) -> tuple[Cost, ...]:
    """Returns the cost of the float kernels on the usual target.

    Returns:
        For each kernel the better of the optimisation levels.

    Raises:
        MissingToolError: If there is no compiler for the target.
    """
    target = find_target(USUAL_TARGET)
    store = Cache()
    search = emit_numeric_inverse(kernels, ScalarType.FLOAT) if kernels.numeric_inverse else {}
    texts = sorted((emit_kernel(kernels, ScalarType.FLOAT) | search).items())
    key = store.key("cost", identity(), texts, find_cross_compiler(target))
    known = store.load_record(key, _Kept)
    if known is not None:
        return known.costs
    costs = measure(kernels, ScalarType.FLOAT, target)
    names = dict.fromkeys(cost.name for cost in costs)
    chosen = tuple(better([cost for cost in costs if cost.name == name]) for name in names)
    if all(cost.calls is not None for cost in chosen):
        store.save_record(key, _Kept(chosen))
    return chosen


@dataclass(frozen=True, slots=True)
class _Kept:
    """Figures as they are kept."""

    costs: tuple[Cost, ...]
