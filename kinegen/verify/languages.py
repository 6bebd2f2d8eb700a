"""The proof of kernels in languages beside C and Python: against the reference, and bit for bit against C."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.language import Language
from kinegen.backends.languages import LANGUAGES, refusals
from kinegen.backends.limits import joint_limits
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import family_of
from kinegen.errors import MissingToolError, ProofError
from kinegen.ir.program import Program
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.outputs import INVERSES, Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.closed_form_inverse import FEWER, Trial, rooms_of, try_ways
from kinegen.verify.compare import Store, compare_beyond, require_nans
from kinegen.verify.five_axis import machine_inputs, try_machine_ways
from kinegen.verify.free_joint_samples import joints_freed
from kinegen.verify.inverse_targets import refuse_the_impossible
from kinegen.verify.invocations import (
    BATCH,
    CLAMP,
    CLAMP_READINGS,
    DTYPES,
    NEAREST,
    READINGS_WITHIN,
    WITHIN,
    Arrays,
    KernelCall,
    PlainKernels,
    compile_plain,
)
from kinegen.verify.language_build import Ready, prepared
from kinegen.verify.nearest import joints_in_line
from kinegen.verify.package_tables import DRIVEN, limit_readings
from kinegen.verify.proof import MOVED_POSES, compare_kernel, held, inverse_comparison, with_parameters
from kinegen.verify.records import Comparison, Invocation, Proof
from kinegen.verify.samples import SEED, FloatArray, beyond_limits, move_parameters, proof_samples

SAME_BITS = 1024
"""Configurations at which a kernel has to give the bits of the C kernel."""

_FREED = 4
"""Poses that leave the first or last joint free, for each place where that is so."""

_SPOILT = np.array([[np.nan], [np.inf], [-np.inf], [1e16]])
"""Joint values that are none, for functions beside the kernels."""

Given = dict[str, tuple[Arrays, list[str]]]
"""Inputs of functions and names of their results, by function."""


class LanguageVerifier:
    """The kernels of one robot and number type in some languages.

    Args:
        ready: The languages, of the same robot; they may leave out different programs.
        real: The number type, which each has.
    """

    def __init__(self, ready: Sequence[Ready], real: ScalarType) -> None:
        self._ready, self._robot, self._real = ready, ready[0].kernels.robot, real.value
        self._programs = {program.quantity: program for each in ready for program in each.kernels.programs}
        self._having = {
            quantity: [each for each in ready if any(own.quantity == quantity for own in each.kernels.programs)]
            for quantity in self._programs
        }
        self._samples = proof_samples(self._robot)

    def comparisons(self) -> dict[str, list[Comparison]]:
        """Comparisons by title of the language: usual inputs, other parameters, beyond the limits, inverses.

        Raises `ProofError` if a kernel loses a NaN, or an inverse claims what it should not.
        """
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
        titles = [each.language.title for each in self._ready]
        return {title: [each for each in found if each.invocation.language == title] for title in titles}

    def require_bits(self) -> None:
        """Refuse a kernel that gives other bits than C without contraction.

        Raises `ProofError` naming the function and the number.
        """
        robot, samples = self._robot, self._samples[:: max(1, len(self._samples) // SAME_BITS)]
        store, plain = Store(robot, DTYPES[self._real], exact=False), self._plain()
        for program in self._programs.values():
            inputs = self._inputs(store, program, samples)
            wanted, names = plain.call(program, inputs), [each.name for each in program.signature.results]
            for way in self._ways(program, None):
                self._require_same(f"{way.target} {program.quantity}", names, way.call(inputs), wanted)
        for name, (given, names) in self._others(samples).items():
            answers = [(each, each.call.others(name, given, real=self._real)) for each in self._ready]
            if any(found is not None for _, found in answers):
                wanted = plain.others(name, given)
                for each, found in answers:
                    if found is not None:
                        self._require_same(f"{each.language.title} {self._real} {name}", names, found, wanted)

    def _plain(self) -> PlainKernels:
        """Returns the kernels of C, all that some language has."""
        first, real = self._ready[0], ScalarType(self._real)
        kernels = replace(first.kernels, programs=tuple(self._programs.values()))
        return compile_plain(kernels, emit_kernel(kernels, real), first.folder, first.compiler, real)

    def _inputs(self, store: Store, program: Program, samples: FloatArray) -> Arrays:
        """Inputs of a kernel at which its bits are compared."""
        robot, quantity = self._robot, program.quantity
        if quantity.kind is Kind.INVERSE:
            chain = chain_of(robot, quantity)
            given = (reference.redundancy(chain, samples),) if robot.redundancy else ()
            poses = reference.pose(chain, samples)[:, 0]
            return tuple(each.astype(DTYPES[self._real]) for each in (poses, *given))
        if quantity.kind is Kind.AXIS_INVERSE:
            return machine_inputs(robot, quantity, self._real, samples)
        return store.expect(quantity, program.signature.inputs, held(robot, quantity, samples))[0]

    def _others(self, samples: FloatArray) -> Given:
        """Returns what functions beside the kernels are given: those of limits, and of the nearest solution."""
        robot, dtype = self._robot, DTYPES[self._real]
        given: Given = {}
        if robot.dof:
            usual = [samples, beyond_limits(robot, self._real), np.repeat(_SPOILT, robot.dof, axis=1)]
            joints = np.concatenate([each.astype(dtype) for each in (*usual, _at_limits(robot, self._real))])
            given = {name: ((joints.astype(dtype),), [name]) for name in (WITHIN, CLAMP)}
        if any(quantity.kind in DRIVEN for quantity in self._programs):
            readings = limit_readings(robot, self._real)
            given |= {name: ((readings,), [name]) for name in (READINGS_WITHIN, CLAMP_READINGS)}
        inverse = next((quantity for quantity in self._programs if quantity.kind is Kind.INVERSE), None)
        if inverse is not None:
            chain = chain_of(robot, inverse)
            turns = 2 * np.pi * np.random.default_rng(SEED).integers(-2, 3, samples.shape)
            # Among them poses with axes in line, where two joints share an angle, and with an end joint free.
            family = family_of(chain)
            lined = np.concatenate([joints_in_line(chain, family), joints_freed(chain, family, _FREED)])
            reached = np.concatenate([samples, lined, lined, np.repeat(samples[:1], len(_SPOILT), axis=0)])
            near = [samples[::-1] + turns, lined, lined[::-1], np.repeat(_SPOILT, robot.dof, axis=1)]
            targets = [reference.pose(chain, reached)[:, 0], np.concatenate(near)]
            if robot.redundancy:
                targets.insert(1, reference.redundancy(chain, reached))
            given[NEAREST] = tuple(each.astype(dtype) for each in targets), ["q", "exists"]
        return given

    def _require_same(self, where: str, names: Sequence[str], found: Arrays, wanted: Arrays) -> None:
        """Refuse other bits than those of C."""
        for name, one, other in zip(names, found, wanted, strict=True):
            wrong = ~((one == other) | (np.isnan(one) & np.isnan(other)))
            if wrong.any():
                place = tuple(int(entry) for entry in np.argwhere(wrong)[0])
                number = f"number {list(place[1:])} of {name}"
                reason = f"{number} is {one[place]!r}, in C {other[place]!r}"
                raise ProofError(f"{self._robot.name}: {where} gives other bits than C: {reason}; nothing was written")

    def _ways(self, program: Program, parameters: tuple[float, ...] | None) -> list[KernelCall]:
        """One configuration after the other, and as a batch where there is something to batch, in each language."""
        can_batch = any(array.size for array in program.signature.inputs)
        found = []
        for each in self._having[program.quantity]:
            has_batch = can_batch and each.language.has_batches
            for form in ("", BATCH)[: 1 + has_batch]:
                call = partial(_called, each, program, parameters, self._real, form == BATCH)
                invocation = Invocation(each.language.title, self._real, form)
                found.append(KernelCall(invocation, call, program.signature, is_plain=form == BATCH or not has_batch))
        return found

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

    def _solve(self, robot: Robot, quantity: Quantity, ways: Sequence[KernelCall]) -> list[Comparison]:
        found: list[Trial] = []
        if quantity.kind is not Kind.AXIS_INVERSE:
            refuse_the_impossible(robot, quantity, ways, self._real)
        for each in self._having[quantity]:
            own = [way for way in ways if way.invocation.language == each.language.title]
            if quantity.kind is Kind.AXIS_INVERSE:
                found += try_machine_ways(robot, quantity, own, self._real, FEWER)
            else:
                rooms = rooms_of(self._robot, quantity, self._real)
                found += try_ways(robot, quantity, own, self._real, each.branches, FEWER, rooms)
        return [inverse_comparison(robot, quantity, trial) for trial in found]


def _called(
    ready: Ready,
    program: Program,
    parameters: tuple[float, ...] | None,
    real: str,
    is_batch: bool,
    inputs: Arrays,
) -> Arrays:
    return ready.call(program, inputs, parameters, real=real, is_batch=is_batch)


def _at_limits(robot: Robot, real: str) -> FloatArray:
    """Joint vectors with one joint at a limit, and at the next number on either side of it; the others are within."""
    kind = DTYPES[real].type
    limits = joint_limits(robot, ScalarType(real))
    middle = np.array([0.0 if pair is None else sum(pair) / 2 for pair in limits], kind)
    ends = [(place, kind(end)) for place, pair in enumerate(limits) for end in pair or ()]
    values = [(place, np.nextafter(end, kind(to))) for place, end in ends for to in (-np.inf, end, np.inf)]
    rows = [np.where(np.arange(robot.dof) == place, value, middle) for place, value in values]
    return np.array([middle, *rows])


def prove_languages(
    kernels: RobotPrograms, names: Sequence[str], files: Mapping[str, str], *, compiled: bool
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Prove the files of some languages, all of them beside one computation of the reference.

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
    ready: list[Ready] = []
    reasons: list[str] = []
    with ExitStack() as stack:
        for language in (LANGUAGES[name] for name in names):
            reasons += refusals(kernels, language)
            own = {path: text for path, text in files.items() if path.startswith(f"{language.name}/")}
            missing = "" if compiled else "that needs a C compiler"
            try:
                ready += [stack.enter_context(prepared(kernels, language, own))] if compiled else ()
            except MissingToolError as error:
                missing = error.message
            reasons += [f"the {language.title} files are written unverified: {missing}"] * bool(missing)
        return _prove(ready), tuple(reasons)


def prove_language(kernels: RobotPrograms, language: Language, files: Mapping[str, str]) -> tuple[Comparison, ...]:
    """Run the files of a language and hold every kernel against the reference.

    Returns the comparisons, all of which hold. Raises `MissingToolError` if nothing that runs the language is
    installed, or no C compiler, whose bits are asked for; `CompileError` if the tool refuses the files; `ProofError` if
    a kernel is off by more than is accepted, loses a NaN or gives other bits than C.
    """
    with prepared(kernels, language, files) as ready:
        return _prove([ready])


def _prove(ready: Sequence[Ready]) -> tuple[Comparison, ...]:
    """Returns the comparisons of languages that can be called, one language after the other."""
    found: dict[str, list[Comparison]] = {each.language.title: [] for each in ready}
    for real in ScalarType:
        able = [each for each in ready if real in map(ScalarType, each.language.reals)]
        if able:
            judged = LanguageVerifier(able, real)
            compared = judged.comparisons()
            for title, own in compared.items():
                Proof(1.0, tuple(own)).require(able[0].kernels.robot)
                found[title] += own
            judged.require_bits()
    return tuple(comparison for own in found.values() for comparison in own)
