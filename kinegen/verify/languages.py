"""The proof of kernels in languages beside C and Python: what was emitted, run by the tool of the language.

In: emitted text. Out: comparisons with the reference, at the same inputs and on the same terms as those of C; and the
same bits as the scalar C kernels that are compiled without contraction.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kinegen import reference
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.emit.languages import LANGUAGES, kept, refusals
from kinegen.emit.limits import joint_limits
from kinegen.emit.reals import Real
from kinegen.errors import MissingToolError, ProofError
from kinegen.ir.program import Program
from kinegen.native.compiler import Compiler, find_compiler
from kinegen.outputs import INVERSES, Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.beyond import beyond_limits
from kinegen.verify.compared import Store
from kinegen.verify.comparison import Comparison, Proof
from kinegen.verify.impossible import refuse_the_impossible
from kinegen.verify.inverse import FEWER, try_ways
from kinegen.verify.machine import machine_inputs, try_machine_ways
from kinegen.verify.moved import move_parameters
from kinegen.verify.plain import CLAMP, NEAREST, WITHIN, PlainKernels, compile_plain
from kinegen.verify.proof import (
    MOVED_POSES,
    compare_kernel,
    held,
    inverse_comparison,
    with_parameters,
)
from kinegen.verify.runners import RUNNERS
from kinegen.verify.runners.runner import Call
from kinegen.verify.samples import SEED, FloatArray, proof_samples
from kinegen.verify.tables import agree, default_parameters, python_tables
from kinegen.verify.usage import compare_beyond, require_nans
from kinegen.verify.ways import DTYPES, Arrays, Way

_PYTHON_ALONE = ("ACTUATOR_RANGES", "ACTUATOR_UNITS")
"""Tables of a Python package that other languages do not have."""

SAME_BITS = 1024
"""Configurations at which a kernel has to give the bits of the C kernel."""

_SPOILT = np.array([[np.nan], [np.inf], [-np.inf], [1e16]])
"""Joint values that are none, for functions beside the kernels."""


def prove_languages(
    kernels: Kernels, names: Sequence[str], files: Mapping[str, str], *, compiled: bool
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Prove the files of some languages.

    Args:
        kernels: The robot and its programs.
        names: The languages, as in `LANGUAGES`.
        files: Their files by path.
        compiled: Whether the build compiles C, whose bits are asked for.

    Returns:
        The comparisons, and sentences about what a language leaves out, or why it was not proven.

    Raises:
        CompileError: As `prove_language`.
        ProofError: As `prove_language`.
    """
    comparisons: list[Comparison] = []
    reasons: list[str] = []
    for language in (LANGUAGES[name] for name in names):
        reasons += refusals(kernels, language)
        own = {path: text for path, text in files.items() if path.startswith(f"{language.name}/")}
        missing = "" if compiled else "it takes a C compiler"
        try:
            comparisons += prove_language(kernels, language, own) if compiled else ()
        except MissingToolError as error:
            missing = error.message
        reasons += [f"the {language.title} files are written without a proof: {missing}"] * bool(missing)
    return tuple(comparisons), tuple(reasons)


def prove_language(kernels: Kernels, language: Language, files: Mapping[str, str]) -> tuple[Comparison, ...]:
    """Run the files of a language and hold every kernel against the reference.

    Args:
        kernels: The robot and its programs.
        language: The language.
        files: Its files by path.

    Returns:
        The comparisons, all of which hold.

    Raises:
        MissingToolError: If nothing that runs the language is installed, or no C compiler, whose bits are asked for.
        CompileError: If the tool refuses the files.
        ProofError: If a kernel is off by more than is accepted, loses a NaN or gives other bits than C.
    """
    comparisons: list[Comparison] = []
    with prepared(kernels, language, files) as ready:
        for real in map(Real, language.reals):
            judged = _Judged(ready.kernels, language.title, real, ready.call, ready.branches)
            compared = judged.comparisons()
            Proof(1.0, compared).require(kernels.robot)
            judged.require_bits(ready.plain(real))
            comparisons += compared
    return tuple(comparisons)


@dataclass(frozen=True, slots=True)
class Ready:
    """Files of a language that can be called.

    Attributes:
        kernels: The robot and its programs, without those that the language refuses.
        call: Evaluates them.
        branches: What the files call the branches of the inverse.
        folder: A folder that is there as long.
        compiler: The C compiler.
    """

    kernels: Kernels
    call: Call
    branches: tuple[str, ...]
    folder: Path
    compiler: Compiler

    def plain(self, real: Real) -> PlainKernels:
        """The kernels of C of a number type."""
        return compile_plain(self.kernels, emit_kernel(self.kernels, real), self.folder, self.compiler, real)


@contextmanager
def prepared(kernels: Kernels, language: Language, files: Mapping[str, str]) -> Iterator[Ready]:
    """Lay out the files of a language, have its tool take them, and compare their tables with the robot.

    Args:
        kernels: The robot and its programs.
        language: The language.
        files: Its files by path.

    Raises:
        MissingToolError: As `prove_language`.
        CompileError: If the tool refuses the files.
        ProofError: If a table is wrong.
    """
    tool = next((found for name in language.tools if (found := shutil.which(name))), None)
    if tool is None:
        raise MissingToolError(f"{language.title} takes {language.install}, which is not installed")
    compiler, kernels = find_compiler(), kept(kernels, language)
    with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
        folder = Path(name) / language.name
        folder.mkdir()
        _lay_out(folder, language, files)
        call = RUNNERS[language.name](tool, folder, kernels)
        tables = call.tables()
        _require_tables(kernels, language, tables)
        yield Ready(kernels, call, tables.get("BRANCHES", ()), Path(name), compiler)


def _lay_out(folder: Path, language: Language, files: Mapping[str, str]) -> None:
    """Write the files of a language to a folder of its own."""
    for path, text in files.items():
        place = folder / path.removeprefix(f"{language.name}/")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8", newline="\n")


def _at_limits(robot: Robot, real: str) -> FloatArray:
    """Joint vectors with one joint at a limit, and at the next number on either side of it; the others are within."""
    kind = DTYPES[real].type
    limits = joint_limits(robot, Real(real))
    middle = np.array([0.0 if pair is None else sum(pair) / 2 for pair in limits], kind)
    ends = [(place, kind(end)) for place, pair in enumerate(limits) for end in pair or ()]
    values = [(place, np.nextafter(end, kind(to))) for place, end in ends for to in (-np.inf, end, np.inf)]
    rows = [np.where(np.arange(robot.dof) == place, value, middle) for place, value in values]
    return np.array([middle, *rows])


def _require_tables(kernels: Kernels, language: Language, tables: Mapping[str, Any]) -> None:
    """Compare what the files say of the robot with the robot; names of branches are tried with the inverse."""
    robot = kernels.robot
    kinds = tuple(program.quantity for program in kernels.programs)
    wanted = {name: value for name, value in python_tables(robot, kinds).items() if name not in _PYTHON_ALONE}
    wanted["MODEL"] = robot.digest
    if robot.runtime_parameters:
        wanted["DEFAULT_PARAMS"] = tuple(default_parameters(robot).items())
    found = {name: tuple(value.items()) if isinstance(value, dict) else value for name, value in tables.items()}
    branches = {"BRANCHES"} if any(each.kind is Kind.INVERSE for each in kinds) else set()
    if set(found) != set(wanted) | branches:
        names = ", ".join(sorted(set(found) ^ (set(wanted) | branches)))
        raise ProofError(f"{robot.name}: tables of {language.title} are missing or too many: {names}")
    for name, value in wanted.items():
        if not agree(found[name], value):
            reason = f"{name} in {language.title} is {found[name]}, expected {value}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


class _Judged:
    """The kernels of one language and number type before the judge.

    Args:
        kernels: The robot and its programs.
        title: How sentences name the language.
        real: The number type.
        call: What evaluates its kernels.
        branches: What its files call the branches of the inverse.
    """

    def __init__(self, kernels: Kernels, title: str, real: Real, call: Call, branches: tuple[str, ...]) -> None:
        self._robot, self._title, self._call, self._branches = kernels.robot, title, call, branches
        self._real = real.value
        self._programs = {program.quantity: program for program in kernels.programs}
        self._samples = proof_samples(kernels.robot)

    def comparisons(self) -> tuple[Comparison, ...]:
        """Comparisons with the reference: usual inputs, other parameters, beyond the limits, inverses."""
        robot = self._robot
        found = self._compare(robot, self._samples)
        # An inverse is tried with targets that are no numbers among others.
        forward = {quantity: each for quantity, each in self._programs.items() if quantity.kind not in INVERSES}
        found += compare_beyond(robot, forward, self._real, lambda quantity: self._ways(forward[quantity], None))
        for quantity, program in forward.items():
            require_nans(robot, quantity, {self._real: self._ways(program, None)})
        if robot.runtime_parameters:
            moved, values = move_parameters(robot)
            found += map(with_parameters, self._compare(moved, self._samples[-MOVED_POSES:], values))
        return tuple(found)

    def require_bits(self, plain: PlainKernels) -> None:
        """Refuse a kernel that gives other bits than C without contraction."""
        robot, samples = self._robot, self._samples[:: max(1, len(self._samples) // SAME_BITS)]
        store = Store(robot, DTYPES[self._real], exact=False)
        for program in self._programs.values():
            if program.quantity.kind is Kind.INVERSE:
                given = (reference.redundancy(robot, samples),) if robot.redundancy else ()
                poses = reference.pose(robot, samples)[:, 0]
                inputs: Arrays = tuple(each.astype(DTYPES[self._real]) for each in (poses, *given))
            elif program.quantity.kind is Kind.AXIS_INVERSE:
                inputs = machine_inputs(robot, program.quantity, self._real, samples)
            else:
                points = held(robot, program.quantity, samples)
                inputs, _ = store.expect(program.quantity, program.signature.inputs, points)
            wanted, names = plain.call(program, inputs), [each.name for each in program.signature.results]
            for way in self._ways(program, None):
                self._require_same(f"{way.target} {program.quantity}", names, way.call(inputs), wanted)
        self._require_others(plain, samples)

    def _require_others(self, plain: PlainKernels, samples: FloatArray) -> None:
        """Refuse functions beside the kernels that give other bits than C: of the nearest solution, and of limits."""
        robot, dtype = self._robot, DTYPES[self._real]
        given: dict[str, tuple[Arrays, list[str]]] = {}
        if robot.dof:
            usual = [samples, beyond_limits(robot, self._real), np.repeat(_SPOILT, robot.dof, axis=1)]
            joints = np.concatenate([each.astype(dtype) for each in (*usual, _at_limits(robot, self._real))])
            given = {name: ((joints.astype(dtype),), [name]) for name in (WITHIN, CLAMP)}
        if any(quantity.kind is Kind.INVERSE for quantity in self._programs):
            poses = reference.pose(robot, samples)[:, 0]
            turns = 2 * np.pi * np.random.default_rng(SEED).integers(-2, 3, samples.shape)
            near = np.concatenate([samples[::-1] + turns, np.repeat(_SPOILT, robot.dof, axis=1)])
            poses = np.concatenate([poses, np.repeat(poses[:1], len(_SPOILT), axis=0)])
            targets = [poses]
            if robot.redundancy:
                values = reference.redundancy(robot, samples)
                targets.append(np.concatenate([values, np.repeat(values[:1], len(_SPOILT))]))
            given[NEAREST] = tuple(each.astype(dtype) for each in (*targets, near)), ["q", "exists"]
        for name, (inputs, names) in given.items():
            found = self._call.others(name, inputs, real=self._real)
            if found is not None:
                self._require_same(f"{self._title} {self._real} {name}", names, found, plain.others(name, inputs))

    def _require_same(self, where: str, names: Sequence[str], found: Arrays, wanted: Arrays) -> None:
        """Refuse other bits than those of C."""
        for name, one, other in zip(names, found, wanted, strict=True):
            wrong = ~((one == other) | (np.isnan(one) & np.isnan(other)))
            if wrong.any():
                place = tuple(int(entry) for entry in np.argwhere(wrong)[0])
                number = f"number {list(place[1:])} of {name}"
                reason = f"{number} is {one[place]!r}, in C {other[place]!r}"
                raise ProofError(f"{self._robot.name}: {where} gives other bits than C: {reason}; nothing was written")

    def _ways(self, program: Program, parameters: tuple[float, ...] | None) -> tuple[Way, ...]:
        """One configuration after the other, and as a batch where there is something to batch."""
        batched = any(array.size for array in program.signature.inputs)
        name = f"{self._title} {self._real}"
        return tuple(
            Way(
                target,
                partial(self._called, program, parameters, is_batch),
                program.signature,
                target,
                is_plain=is_batch,
            )
            for target, is_batch in ((name, False), (f"{name}, batch", True))
            if batched or not is_batch
        )

    def _called(self, program: Program, parameters: tuple[float, ...] | None, is_batch: bool, inputs: Arrays) -> Arrays:
        return self._call(program, inputs, parameters, real=self._real, is_batch=is_batch)

    def _compare(
        self, robot: Robot, samples: FloatArray, parameters: tuple[float, ...] | None = None
    ) -> list[Comparison]:
        found: list[Comparison] = []
        store = Store(robot, DTYPES[self._real], exact=False)
        for quantity, program in self._programs.items():
            ways = self._ways(program, parameters)
            if quantity.kind in INVERSES:
                found += self._solve(robot, quantity, ways)
            else:
                found += compare_kernel(robot, program, ways, self._real, store, samples)[2]
        return found

    def _solve(self, robot: Robot, quantity: Quantity, ways: tuple[Way, ...]) -> list[Comparison]:
        if quantity.kind is Kind.AXIS_INVERSE:
            trials = try_machine_ways(robot, quantity, ways, self._real, FEWER)
            return [inverse_comparison(robot, quantity, trial, self._real) for trial in trials]
        refuse_the_impossible(robot, quantity, ways, self._real)
        trials = try_ways(robot, quantity, ways, self._real, self._branches, FEWER)
        return [inverse_comparison(robot, quantity, trial, self._real) for trial in trials]
