"""The files of a language laid out and taken by its tool, and its bits beside those of C.

C is proven against the reference; what has its bits is right where C is. A build compares some configurations,
`scripts/compare_bits.py` as many as asked.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.language import Language
from kinegen.backends.languages import kept
from kinegen.backends.limits import LARGEST
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import MissingToolError, ProofError
from kinegen.ir.program import Program
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.outputs import Kind
from kinegen.model.robot import Robot
from kinegen.runtime.compiler import Compiler, find_compiler
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.invocations import DTYPES, Arrays, Floats, PlainKernels, compile_plain
from kinegen.verify.package_tables import agree, default_parameters, python_tables
from kinegen.verify.proof import held
from kinegen.verify.runners import RUNNERS
from kinegen.verify.runners.runner import Call
from kinegen.verify.samples import SEED, FloatArray, beyond_limits, input_samples, proof_samples

_PYTHON_ALONE = ("ACTUATOR_UNITS",)
"""Tables of a Python package that other languages do not have."""

_LARGEST = float(LARGEST[ScalarType.DOUBLE])
"""What other languages have where nothing is known of a reading, and Python infinity."""


@dataclass(frozen=True, slots=True)
class Ready:
    """Files of a language that can be called."""

    language: Language
    kernels: RobotPrograms  # The robot and its programs, without those that the language refuses
    call: Call  # Evaluates them
    branches: tuple[str, ...]  # What the files call the branches of the inverse
    folder: Path  # A folder that is there as long
    compiler: Compiler

    def plain(self, real: ScalarType) -> PlainKernels:
        """Returns the kernels of C of a number type."""
        return compile_plain(self.kernels, emit_kernel(self.kernels, real), self.folder, self.compiler, real)


@contextmanager
def prepared(kernels: RobotPrograms, language: Language, files: Mapping[str, str]) -> Iterator[Ready]:
    """Lay out the files of a language, have its tool take them, and compare their tables with the robot.

    Raises `MissingToolError` if nothing that runs the language is installed, or no C compiler, whose bits are asked
    for; `CompileError` if the tool refuses the files; `ProofError` if a table is wrong.
    """
    tool = next((found for name in language.tools if (found := shutil.which(name))), None)
    if tool is None:
        raise MissingToolError(f"{language.title} needs {language.install}, which is not installed")
    compiler, kernels = find_compiler(), kept(kernels, language)
    with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
        folder = Path(name) / language.name
        folder.mkdir()
        _lay_out(folder, language, files)
        call = RUNNERS[language.name](tool, folder, kernels)
        tables = call.tables()
        _require_tables(kernels, language, tables)
        yield Ready(language, kernels, call, tables.get("BRANCHES", ()), Path(name), compiler)


def _lay_out(folder: Path, language: Language, files: Mapping[str, str]) -> None:
    """Write the files of a language to a folder of its own."""
    for path, text in files.items():
        place = folder / path.removeprefix(f"{language.name}/")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8", newline="\n")


def _require_tables(kernels: RobotPrograms, language: Language, tables: Mapping[str, Any]) -> None:
    """Compare what the files say of the robot with the robot; names of branches are tried with the inverse."""
    robot = kernels.robot
    kinds = tuple(program.quantity for program in kernels.programs)
    wanted = {name: value for name, value in python_tables(robot, kinds).items() if name not in _PYTHON_ALONE}
    wanted["MODEL"] = robot.digest
    for name in {"ACTUATOR_RANGES"} & set(wanted):
        wanted[name] = tuple((max(low, -_LARGEST), min(high, _LARGEST)) for low, high in wanted[name])
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


_SPOILT = np.array([np.nan, np.inf, -np.inf, 1e6, -1e9, 1e16, -1e30, 1e-300])
"""Numbers outside what is promised, one of which is put into every eighth configuration."""

_AT_ONCE = 20_000


@dataclass(frozen=True, slots=True)
class Bits:
    """What was compared."""

    words: int  # Numbers of all results
    differing: int  # Those that are not the same; NaN is the same as NaN, and a zero has no sign
    worst: str  # The function and number type of the first that differs, or an empty text


def compare_bits(kernels: RobotPrograms, language: Language, files: Mapping[str, str], count: int) -> Bits:
    """Compare every function of a language with C, one by one and in batches.

    `count`: configurations: joint vectors of a proof moved at random, others far beyond the limits; some have NaN, an
    infinity or a number out of range in one entry. Returns what was compared. Raises `MissingToolError` as
    `kinegen.verify.languages.prove_language`; `CompileError` as there; `ProofError` if a table is wrong or a function
    is not straight.
    """
    words, differing, worst = 0, 0, ""
    with prepared(kernels, language, files) as ready:
        for real in map(ScalarType, language.reals):
            for where, found, wanted in _compared(ready, real, count):
                wrong = int((~((found == wanted) | (np.isnan(found) & np.isnan(wanted)))).sum())
                words, differing = words + wanted.size, differing + wrong
                worst = worst or (f"{where} in {real}" if wrong else "")
    return Bits(words, differing, worst)


def _compared(ready: Ready, real: ScalarType, count: int) -> Iterator[tuple[str, Floats, Floats]]:
    """For every result its function, what the language gives, and what C gives."""
    plain = ready.plain(real)
    generator = np.random.default_rng(SEED)
    for start in range(0, count, _AT_ONCE):
        points = _points(ready.kernels.robot, real, min(_AT_ONCE, count - start), generator)
        for program in ready.kernels.programs:
            inputs = _inputs(ready.kernels.robot, program, points, real, generator)
            wanted = plain.call(program, inputs)
            for is_batch in (False, True) if any(each.size for each in program.signature.inputs) else (False,):
                found = ready.call(program, inputs, None, real=real, is_batch=is_batch)
                for pair in zip(found, wanted, strict=True):
                    yield f"{program.quantity}{', batch' if is_batch else ''}", *pair


def _points(robot: Robot, real: ScalarType, count: int, generator: np.random.Generator) -> FloatArray:
    """Joint vectors: those of a proof, and those beyond the limits, moved at random."""
    usual, far = proof_samples(robot), beyond_limits(robot, real)
    picked = usual[generator.integers(0, len(usual), count)]
    moved = picked + generator.normal(0, 0.1, picked.shape)
    if len(far):
        moved[::4] = far[generator.integers(0, len(far), len(moved[::4]))]
    return moved


def _inputs(
    robot: Robot, program: Program, points: FloatArray, real: ScalarType, generator: np.random.Generator
) -> Arrays:
    """Returns the inputs of a function, some of them spoilt."""
    if program.quantity.kind is Kind.INVERSE:
        chain = chain_of(robot, program.quantity)
        given = [reference.pose(chain, points)[:, 0]]
        given += [reference.redundancy(chain, points)] if robot.redundancy else []
    else:
        samples = input_samples(robot, program.signature.inputs, held(robot, program.quantity, points))
        given = [samples[array.name] for array in program.signature.inputs]
    found = []
    for array in given:
        spoilt = np.array(array, dtype=float)
        flat = spoilt.reshape(len(spoilt), -1)
        if flat.size:
            rows = np.arange(7, len(flat), 8)
            flat[rows, generator.integers(0, flat.shape[1], len(rows))] = generator.choice(_SPOILT, len(rows))
        with np.errstate(over="ignore"):
            found.append(spoilt.astype(DTYPES[real]))
    return tuple(found)
