"""Kernels of some languages before the judge: against the reference, and bit for bit against C."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from kinegen import reference
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.limits import joint_limits
from kinegen.emit.reals import Real
from kinegen.errors import ProofError
from kinegen.ir.program import Program
from kinegen.outputs import INVERSES, Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.tables.seen import chain_of
from kinegen.verify.beyond import beyond_limits
from kinegen.verify.compared import Store
from kinegen.verify.comparison import Comparison
from kinegen.verify.impossible import refuse_the_impossible
from kinegen.verify.inverse import FEWER, Trial, try_ways
from kinegen.verify.inverses import inverse_comparison
from kinegen.verify.machine import machine_inputs, try_machine_ways
from kinegen.verify.moved import move_parameters
from kinegen.verify.plain import CLAMP, NEAREST, WITHIN, PlainKernels, compile_plain
from kinegen.verify.prepared import Ready
from kinegen.verify.proof import MOVED_POSES, compare_kernel, held, with_parameters
from kinegen.verify.samples import SEED, FloatArray, proof_samples
from kinegen.verify.usage import compare_beyond, require_nans
from kinegen.verify.ways import DTYPES, Arrays, Way

SAME_BITS = 1024
"""Configurations at which a kernel has to give the bits of the C kernel."""

_SPOILT = np.array([[np.nan], [np.inf], [-np.inf], [1e16]])
"""Joint values that are none, for functions beside the kernels."""

Given = dict[str, tuple[Arrays, list[str]]]
"""Inputs of functions and names of their results, by function."""


class Judged:
    """The kernels of one robot and number type in some languages.

    Args:
        ready: The languages, of the same robot; they may leave out different programs.
        real: The number type, which each has.
    """

    def __init__(self, ready: Sequence[Ready], real: Real) -> None:
        self._ready, self._robot, self._real = ready, ready[0].kernels.robot, real.value
        self._programs = {program.quantity: program for each in ready for program in each.kernels.programs}
        self._having = {
            quantity: [each for each in ready if any(own.quantity == quantity for own in each.kernels.programs)]
            for quantity in self._programs
        }
        self._samples = proof_samples(self._robot)

    def comparisons(self) -> dict[str, list[Comparison]]:
        """Comparisons by title of the language: usual inputs, other parameters, beyond the limits, inverses.

        Raises:
            ProofError: If a kernel loses a NaN, or an inverse claims what it should not.
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
        return {title: [each for each in found if each.target.startswith(f"{title} ")] for title in titles}

    def require_bits(self) -> None:
        """Refuse a kernel that gives other bits than C without contraction.

        Raises:
            ProofError: Naming the function and the number.
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
        """The kernels of C, all that some language has."""
        first, real = self._ready[0], Real(self._real)
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
        """What functions beside the kernels are given: those of limits, and of the nearest solution."""
        robot, dtype = self._robot, DTYPES[self._real]
        given: Given = {}
        if robot.dof:
            usual = [samples, beyond_limits(robot, self._real), np.repeat(_SPOILT, robot.dof, axis=1)]
            joints = np.concatenate([each.astype(dtype) for each in (*usual, _at_limits(robot, self._real))])
            given = {name: ((joints.astype(dtype),), [name]) for name in (WITHIN, CLAMP)}
        inverse = next((quantity for quantity in self._programs if quantity.kind is Kind.INVERSE), None)
        if inverse is not None:
            chain = chain_of(robot, inverse)
            poses = reference.pose(chain, samples)[:, 0]
            turns = 2 * np.pi * np.random.default_rng(SEED).integers(-2, 3, samples.shape)
            near = np.concatenate([samples[::-1] + turns, np.repeat(_SPOILT, robot.dof, axis=1)])
            poses = np.concatenate([poses, np.repeat(poses[:1], len(_SPOILT), axis=0)])
            targets = [poses]
            if robot.redundancy:
                values = reference.redundancy(chain, samples)
                targets.append(np.concatenate([values, np.repeat(values[:1], len(_SPOILT), axis=0)]))
            given[NEAREST] = tuple(each.astype(dtype) for each in (*targets, near)), ["q", "exists"]
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

    def _ways(self, program: Program, parameters: tuple[float, ...] | None) -> list[Way]:
        """One configuration after the other, and as a batch where there is something to batch, in each language."""
        batched = any(array.size for array in program.signature.inputs)
        found = []
        for each in self._having[program.quantity]:
            name = f"{each.language.title} {self._real}"
            for target, is_batch in ((name, False), (f"{name}, batch", True))[: 1 + batched]:
                call = partial(_called, each, program, parameters, self._real, is_batch)
                found.append(Way(target, call, program.signature, target, is_plain=is_batch))
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

    def _solve(self, robot: Robot, quantity: Quantity, ways: Sequence[Way]) -> list[Comparison]:
        found: list[Trial] = []
        if quantity.kind is not Kind.AXIS_INVERSE:
            refuse_the_impossible(robot, quantity, ways, self._real)
        for each in self._having[quantity]:
            own = [way for way in ways if way.target.startswith(f"{each.language.title} ")]
            if quantity.kind is Kind.AXIS_INVERSE:
                found += try_machine_ways(robot, quantity, own, self._real, FEWER)
            else:
                found += try_ways(robot, quantity, own, self._real, each.branches, FEWER)
        return [inverse_comparison(robot, quantity, trial, self._real) for trial in found]


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
    limits = joint_limits(robot, Real(real))
    middle = np.array([0.0 if pair is None else sum(pair) / 2 for pair in limits], kind)
    ends = [(place, kind(end)) for place, pair in enumerate(limits) for end in pair or ()]
    values = [(place, np.nextafter(end, kind(to))) for place, end in ends for to in (-np.inf, end, np.inf)]
    rows = [np.where(np.arange(robot.dof) == place, value, middle) for place, value in values]
    return np.array([middle, *rows])
