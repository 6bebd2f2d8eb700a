"""The bits of a language beside those of C, at any number of configurations.

In: emitted text. Out: how many numbers were compared and how many differ. C is proven against the reference; what has
its bits is right where C is. A build compares some configurations, `scripts/compare_bits.py` as many as asked.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kinegen import reference
from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.outputs import Kind
from kinegen.robot.model import Robot
from kinegen.tables.seen import chain_of
from kinegen.verify.beyond import beyond_limits
from kinegen.verify.prepared import Ready, prepared
from kinegen.verify.proof import held
from kinegen.verify.samples import SEED, FloatArray, input_samples, proof_samples
from kinegen.verify.ways import DTYPES, Arrays, Floats

_SPOILT = np.array([np.nan, np.inf, -np.inf, 1e6, -1e9, 1e16, -1e30, 1e-300])
"""Numbers outside what is promised, one of which is put into every eighth configuration."""

_AT_ONCE = 20_000


@dataclass(frozen=True, slots=True)
class Bits:
    """What was compared.

    Attributes:
        words: Numbers of all results.
        differing: Those that are not the same; NaN is the same as NaN, and a zero has no sign.
        worst: The function and number type of the first that differs, or an empty text.
    """

    words: int
    differing: int
    worst: str


def compare_bits(kernels: Kernels, language: Language, files: Mapping[str, str], count: int) -> Bits:
    """Compare every function of a language with C, one by one and in batches.

    Args:
        kernels: The robot and its programs.
        language: The language.
        files: Its files by path.
        count: Configurations: joint vectors of a proof moved at random, others far beyond the limits; some have NaN, an
            infinity or a number out of range in one entry.

    Returns:
        What was compared.

    Raises:
        MissingToolError: As `kinegen.verify.languages.prove_language`.
        CompileError: As there.
        ProofError: If a table is wrong or a function is not straight.
    """
    words, differing, worst = 0, 0, ""
    with prepared(kernels, language, files) as ready:
        for real in map(Real, language.reals):
            for where, found, wanted in _compared(ready, real, count):
                wrong = int((~((found == wanted) | (np.isnan(found) & np.isnan(wanted)))).sum())
                words, differing = words + wanted.size, differing + wrong
                worst = worst or (f"{where} in {real}" if wrong else "")
    return Bits(words, differing, worst)


def _compared(ready: Ready, real: Real, count: int) -> Iterator[tuple[str, Floats, Floats]]:
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


def _points(robot: Robot, real: Real, count: int, generator: np.random.Generator) -> FloatArray:
    """Joint vectors: those of a proof, and those beyond the limits, moved at random."""
    usual, far = proof_samples(robot), beyond_limits(robot, real)
    picked = usual[generator.integers(0, len(usual), count)]
    moved = picked + generator.normal(0, 0.1, picked.shape)
    if len(far):
        moved[::4] = far[generator.integers(0, len(far), len(moved[::4]))]
    return moved


def _inputs(robot: Robot, program: Program, points: FloatArray, real: Real, generator: np.random.Generator) -> Arrays:
    """The inputs of a function, some of them spoilt."""
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
