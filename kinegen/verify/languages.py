"""The proof of kernels in languages beside C and Python: what was emitted, run by the tool of the language.

In: emitted text. Out: comparisons with the reference, at the same inputs and on the same terms as those of C; and the
same bits as the scalar C kernels that are compiled without contraction.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from kinegen import reference
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.emit.languages import LANGUAGES, kept, refusals
from kinegen.emit.reals import Real
from kinegen.errors import MissingToolError, ProofError
from kinegen.ir.program import Program
from kinegen.native.compiler import find_compiler
from kinegen.outputs import Kind
from kinegen.robot.model import Robot
from kinegen.verify.beyond import beyond_limits
from kinegen.verify.compared import Judge, Store
from kinegen.verify.comparison import Comparison, Proof
from kinegen.verify.impossible import refuse_the_impossible
from kinegen.verify.inverse import FEWER, try_ways
from kinegen.verify.known import PLACES
from kinegen.verify.nonnumbers import require_spoilt, spoil
from kinegen.verify.plain import PlainKernels, compile_plain
from kinegen.verify.proof import MOVED_POSES, NUMBERS, fewer, held, inverse_comparison, move_parameters, with_parameters
from kinegen.verify.runners import RUNNERS
from kinegen.verify.runners.runner import Call
from kinegen.verify.samples import FloatArray, proof_samples
from kinegen.verify.tables import agree, default_parameters, python_tables
from kinegen.verify.ways import DTYPES, Arrays, Way

DOUBLE = "double"

_PYTHON_ALONE = ("ACTUATOR_RANGES", "ACTUATOR_UNITS")
"""Tables of a Python package that other languages do not have."""

SAME_BITS = 1024
"""Configurations at which a kernel has to give the bits of the C kernel."""


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
    tool = next((found for name in language.tools if (found := shutil.which(name))), None)
    if tool is None:
        raise MissingToolError(f"{language.title} takes {language.install}, which is not installed")
    compiler, kernels = find_compiler(), kept(kernels, language)
    with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
        folder = Path(name) / language.name
        folder.mkdir()
        for path, text in files.items():
            (folder / Path(path).name).write_text(text, encoding="utf-8", newline="\n")
        call = RUNNERS[language.name](tool, folder, kernels)
        _require_tables(kernels, language, call)
        judged = _Judged(kernels, language, call)
        comparisons = judged.comparisons()
        Proof(1.0, comparisons).require(kernels.robot)
        plain = compile_plain(kernels, emit_kernel(kernels, Real.DOUBLE), Path(name), compiler)
        judged.require_bits(plain)
    return comparisons


def _require_tables(kernels: Kernels, language: Language, call: Call) -> None:
    """Compare what the files say of the robot with the robot; names of branches are tried with the inverse."""
    robot = kernels.robot
    kinds = tuple(program.quantity for program in kernels.programs)
    wanted = {name: value for name, value in python_tables(robot, kinds).items() if name not in _PYTHON_ALONE}
    wanted["MODEL"] = robot.digest
    if robot.runtime_parameters:
        wanted["DEFAULT_PARAMS"] = tuple(default_parameters(robot).items())
    found = {name: tuple(value.items()) if isinstance(value, dict) else value for name, value in call.tables().items()}
    branches = {"BRANCHES"} if any(each.kind is Kind.INVERSE for each in kinds) else set()
    if set(found) != set(wanted) | branches:
        names = ", ".join(sorted(set(found) ^ (set(wanted) | branches)))
        raise ProofError(f"{robot.name}: tables of {language.title} are missing or too many: {names}")
    for name, value in wanted.items():
        if not agree(found[name], value):
            reason = f"{name} in {language.title} is {found[name]}, expected {value}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


class _Judged:
    """The kernels of one language before the judge.

    Args:
        kernels: The robot and its programs.
        language: The language.
        call: What evaluates its kernels.
    """

    def __init__(self, kernels: Kernels, language: Language, call: Call) -> None:
        self._kernels, self._title, self._call = kernels, language.title, call

    def comparisons(self) -> tuple[Comparison, ...]:
        """Comparisons with the reference: usual inputs, other parameters, beyond the limits, inverses."""
        robot = self._kernels.robot
        samples = proof_samples(robot)
        found = self._compare(robot, samples)
        found += self._compare_beyond(robot)
        self._require_nans(robot)
        if robot.runtime_parameters:
            moved, values = move_parameters(robot)
            found += map(with_parameters, self._compare(moved, samples[-MOVED_POSES:], values))
        return tuple(found)

    def require_bits(self, plain: PlainKernels) -> None:
        """Refuse a kernel that gives other bits than C without contraction."""
        robot = self._kernels.robot
        samples = proof_samples(robot)
        samples = samples[:: max(1, len(samples) // SAME_BITS)]
        store = Store(robot, DTYPES[DOUBLE], exact=False)
        for program in self._kernels.programs:
            if program.quantity.kind is Kind.INVERSE:
                inputs: Arrays = (reference.pose(robot, samples)[:, 0],)
            else:
                points = held(robot, program.quantity, samples)
                inputs, _ = store.expect(program.quantity, program.signature.inputs, points)
            wanted = plain.call(program, inputs)
            for way in self._ways(program, None):
                for array, one, other in zip(program.signature.results, way.call(inputs), wanted, strict=True):
                    wrong = ~((one == other) | (np.isnan(one) & np.isnan(other)))
                    if wrong.any():
                        place = tuple(int(entry) for entry in np.argwhere(wrong)[0])
                        raise ProofError(
                            f"{robot.name}: {way.target} {program.quantity} gives other bits than C: number "
                            f"{list(place[1:])} of {array.name} is {one[place]!r}, in C {other[place]!r}; nothing was "
                            "written"
                        )

    def _ways(self, program: Program, parameters: tuple[float, ...] | None) -> tuple[Way, ...]:
        """One configuration after the other, and as a batch where there is something to batch."""
        batched = any(array.size for array in program.signature.inputs)
        name = f"{self._title} {DOUBLE}"
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
        return self._call(program, inputs, parameters, is_batch=is_batch)

    def _compare(
        self, robot: Robot, samples: FloatArray, parameters: tuple[float, ...] | None = None
    ) -> list[Comparison]:
        found = []
        store = Store(robot, DTYPES[DOUBLE], exact=False)
        for program in self._kernels.programs:
            quantity, ways = program.quantity, self._ways(program, parameters)
            if quantity.kind is Kind.INVERSE:
                found += self._solve(robot, program, ways)
                continue
            points = held(robot, quantity, samples)
            points = points if quantity.kind in PLACES else fewer(points, program.signature.results, NUMBERS)
            inputs, expectation = store.expect(quantity, program.signature.inputs, points)
            judge = Judge(expectation, program, DOUBLE)
            found += [judge.compare(way.target, way.call(inputs), way.row) for way in ways]
        return found

    def _solve(self, robot: Robot, program: Program, ways: tuple[Way, ...]) -> list[Comparison]:
        names = self._call.tables()["BRANCHES"]
        refuse_the_impossible(robot, program.quantity, ways, DOUBLE)
        trials = try_ways(robot, program.quantity, ways, DOUBLE, names, FEWER)
        return [inverse_comparison(robot, program.quantity, trial, DOUBLE) for trial in trials]

    def _compare_beyond(self, robot: Robot) -> list[Comparison]:
        found = []
        points, store = beyond_limits(robot, DOUBLE), Store(robot, DTYPES[DOUBLE], exact=False)
        for program in self._kernels.programs:
            if program.signature.inputs[0].name == "q" and len(points):
                inputs, expectation = store.expect(program.quantity, program.signature.inputs, points)
                judge = Judge(expectation, program, DOUBLE, within=False)
                for way in self._ways(program, None):
                    row = f"{self._title} {DOUBLE}, beyond limits"
                    found.append(judge.compare(f"{way.target}, beyond limits", way.call(inputs), row))
        return found

    def _require_nans(self, robot: Robot) -> None:
        for program in self._kernels.programs:
            if program.quantity.kind in (Kind.JOINTS_TO_ACTUATORS, Kind.INVERSE):
                continue  # the first cannot be moved to see what depends on what, the second is tried with its targets
            signature = program.signature
            spoilt = spoil(robot, program.quantity, signature.inputs, signature.results)
            for way in self._ways(program, None):
                require_spoilt(robot, program.quantity, way, spoilt, str(DTYPES[DOUBLE]))
