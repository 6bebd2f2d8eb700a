"""One build: the stages in order, with their times, and what an option leaves out.

    load     robot file             -> Robot
    derive   Robot                  -> Expressions, one for each quantity
    lower    Expressions            -> Program
    emit     Programs               -> files
    compile  C files                -> extension (left out without a compiler)
    prove    files, extension       -> Proof, in a staging folder
    write    files, extension       -> the output folder, all or nothing

A build that fails in any stage leaves the output folder as it was.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from kinegen.boards.figures import Cost
from kinegen.boards.usual import USUAL_TARGET, can_measure, usual_costs
from kinegen.emit.files import Emitted, emit_files
from kinegen.emit.kernels import Kernels
from kinegen.emit.languages import LANGUAGES, emit_languages
from kinegen.emit.packages.project import emit_project
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError, MissingToolError, WriteError
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import AngleSum, Count, Program, count
from kinegen.naming import EXTENSION
from kinegen.native.compile import Extension
from kinegen.native.package import build_extension, interface_of
from kinegen.outputs import NUMERIC_INVERSE, Quantity, with_needed
from kinegen.results import BuildOptions, BuildResult, Stage
from kinegen.robot.calibrated import calibrated
from kinegen.robot.load import load
from kinegen.robot.model import Robot
from kinegen.symbolic.derive import derive
from kinegen.symbolic.plain import derive_plain
from kinegen.verify.comparison import Proof
from kinegen.verify.fixed import prove_fixed
from kinegen.verify.integer_vectors import IntegerKernels, emit_integers
from kinegen.verify.languages import prove_languages
from kinegen.verify.nearly import nearly_special
from kinegen.verify.precision import precision_notes
from kinegen.verify.remembered import proof_of
from kinegen.verify.vectors import compute_vectors
from kinegen.verify.written import require_proven, require_written
from kinegen.verify.wrong_unit import wrong_unit
from kinegen.write import Written, refuse_link, write_files

_WORK = {
    "emit": "emit C and Python, with test vectors and proven errors",
    "compile": "compile the kernels",
    "prove": "prove every output in every way to call it",
    "measure": f"measure every output on {USUAL_TARGET}",
}
"""What is being done in stages that can take long, in words."""


@dataclass(slots=True)
class _Clock:
    """Times the stages, says what begins, and reports each stage as it ends."""

    path: Path
    report: Callable[[Stage], None]
    begin: Callable[[str], object] = str
    stages: list[Stage] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str) -> Iterator[list[str]]:
        detail: list[str] = []
        self.begin(_WORK.get(name, name))
        begin = time.perf_counter()
        try:
            yield detail
        except KinegenError as error:
            # What is wrong with a robot is told of the file as the user named it.
            if type(error) is KinegenError:
                raise KinegenError(error.message, str(self.path), error.line) from error
            raise
        except OSError as error:
            # Reading and writing speak for themselves; what is left is the folder in which packages are made.
            reason = f"cannot {name} with temporary files: {error}; TMPDIR can name another folder for them"
            raise WriteError(f"{reason}; the earlier output is untouched") from error
        self.stages.append(Stage(name, time.perf_counter() - begin, ", ".join(detail)))
        self.report(self.stages[-1])

    def each(self, verb: str, quantities: Sequence[Quantity]) -> Iterator[Quantity]:
        """The quantities, each said with its number before its turn comes."""
        for place, quantity in enumerate(quantities, start=1):
            self.begin(f"{verb} {quantity} ({place} of {len(quantities)})")
            yield quantity


def build(
    path: Path,
    options: BuildOptions,
    report: Callable[[Stage], None],
    begin: Callable[[str], object] = str,
) -> BuildResult:
    """Build the package of one robot.

    Args:
        path: The robot file.
        options: What to make.
        report: Called after each stage.
        begin: Called with a few words before each stage, and before each output in stages that take them one by one.

    Returns:
        What was done; the proof holds.

    Raises:
        KinegenError: If the file is bad, the compiler refuses, the proof fails or the folder cannot be written. The
            output folder is then as it was.
    """
    refuse_link(options.output)
    clock = _Clock(path, report, begin)
    kernels, plain = _programs(path, options, clock)
    robot, programs = kernels.robot, kernels.programs
    with clock.stage("emit") as detail:
        integers = emit_integers(kernels) if options.integers else None
        emitted, project = _emit(kernels, options, integers)
        others = emit_languages(kernels, options.languages)
        detail.append(f"{len(project or emitted.files) + len(integers.files if integers else ()) + len(others)} files")
    with clock.stage("compile") as detail:
        extension, notes = _compile(kernels, emitted, options)
        detail.append("NumPy kernels only" if extension is None else "cached" if extension.cached else EXTENSION)
    with clock.stage("prove") as detail, _kept_once_proved(extension):
        contents = _contents(emitted, extension, integers)
        proof, backend, known = _prove(kernels, contents, options)
        proof, reasons = _prove_others(proof, kernels, integers, others, options)
        contents |= others
        if project:
            require_proven(robot, project, _packaged(emitted, options, integers))
        poses = sum(comparison.poses for comparison in proof.comparisons)
        detail += [f"{poses} poses", *["proved before"] * known]
    costs = _measure(kernels, options, clock)
    folder = options.output / robot.name
    stale = _is_below if project else _stale(folder, emitted)
    written = _write(folder, project or contents, stale, clock, force=options.force)
    return BuildResult(
        robot=robot,
        counts={program.quantity: count(program) for program in programs},
        plain=plain,
        angles=_angles(robot, programs),
        folder=folder,
        written=written,
        proof=proof,
        backend=backend,
        costs=costs,
        stages=tuple(clock.stages),
        notes=(*notes, *reasons, *_file_notes(robot), *precision_notes(kernels, options.reals)),
    )


def _write(
    folder: Path, contents: Mapping[str, str | bytes], stale: Callable[[str], bool], clock: _Clock, *, force: bool
) -> tuple[Written, ...]:
    """Write the files and look at what was written."""
    with clock.stage("write") as detail:
        written = write_files(folder, contents, stale, force=force)
        require_written(folder, contents)
        detail.append(f"{sum(entry.changed for entry in written)} files changed")
    return written


def _file_notes(robot: Robot) -> tuple[str, ...]:
    return tuple(map(str, (*wrong_unit(robot), *nearly_special(robot))))


def lower_file(path: Path, quantities: tuple[Quantity, ...]) -> Kernels:
    """Go as far as the programs of one robot, for what needs no files.

    Args:
        path: The robot file.
        quantities: Kinematic quantities.

    Returns:
        The robot and its programs.

    Raises:
        KinegenError: If the file is bad.
    """
    robot = load(path)
    programs = tuple(lower(derive(robot, quantity)) for quantity in with_needed(quantities))
    return Kernels(robot, programs, runtime_defaults(robot), NUMERIC_INVERSE in quantities)


def _programs(path: Path, options: BuildOptions, clock: _Clock) -> tuple[Kernels, Count]:
    """The robot with its programs, and what the pose costs as a plain product of link matrices."""
    with clock.stage("load") as detail:
        robot = _load(path, options)
        detail.append(f"{len(robot.rows)} rows, {robot.dof} joint variables")
    with clock.stage("derive") as detail:
        quantities = with_needed(options.quantities)
        expressions = [derive(robot, quantity) for quantity in clock.each("derive", quantities)]
        clock.begin("derive the plain product of link matrices, for comparison")
        plain = derive_plain(robot)
        detail.append(", ".join(map(str, options.quantities)))
    with clock.stage("lower") as detail:
        works = zip(expressions, clock.each("lower", quantities), strict=True)
        programs, plain_count = tuple(lower(each) for each, _ in works), count(lower(plain))
        detail.append(f"{sum(len(program.statements) for program in programs)} statements")
        return Kernels(robot, programs, runtime_defaults(robot), NUMERIC_INVERSE in options.quantities), plain_count


def _load(path: Path, options: BuildOptions) -> Robot:
    """The robot, with the parameters that are asked for."""
    robot = load(path)
    return calibrated(robot, options.wrt) if options.wrt else robot


def _emit(kernels: Kernels, options: BuildOptions, integers: IntegerKernels | None) -> tuple[Emitted, dict[str, str]]:
    """The files, and those of the firmware package; none of these if none is asked for."""
    vectors = compute_vectors(kernels)
    emitted = emit_files(kernels, options.reals, vectors)
    if options.package is None:
        return emitted, {}
    files, reals = _packaged(emitted, options, integers), () if options.only_integers else options.reals
    fixed = integers.fixed if integers else None
    return emitted, emit_project(kernels, vectors, files, reals, options.package, fixed)


def _packaged(emitted: Emitted, options: BuildOptions, integers: IntegerKernels | None) -> dict[str, str]:
    """The emitted files that a firmware package takes from."""
    floats = {} if options.only_integers else emitted.files
    return {**floats, **(integers.files if integers else {})}


def _compile(kernels: Kernels, emitted: Emitted, options: BuildOptions) -> tuple[Extension | None, tuple[str, ...]]:
    """The extension, or none and the reason."""
    if not options.compile:
        return None, ()
    try:
        return build_extension(interface_of(kernels, options.reals), emitted.sources, options.flags), ()
    except MissingToolError as error:
        return None, (f"{error.message}; the module evaluates with NumPy until then",)


@contextmanager
def _kept_once_proved(extension: Extension | None) -> Iterator[None]:
    """An extension is remembered for other builds if it loads and its proof holds, and is forgotten if not."""
    try:
        yield
    except KinegenError:
        if extension is not None:
            extension.forget()
        raise
    if extension is not None:
        extension.keep()


def _prove(kernels: Kernels, contents: dict[str, str | bytes], options: BuildOptions) -> tuple[Proof, str, bool]:
    """The proof, the backend that was proven, and whether it was made before."""
    quantities = (
        *(program.quantity for program in kernels.programs),
        *[NUMERIC_INVERSE] * kernels.numeric_inverse,
    )
    return proof_of(kernels.robot, contents, quantities, tuple(map(str, options.reals)))


def _prove_others(
    proof: Proof,
    kernels: Kernels,
    integers: IntegerKernels | None,
    others: Mapping[str, str],
    options: BuildOptions,
) -> tuple[Proof, tuple[str, ...]]:
    """The proof with those of kernels in integers and in other languages, and reasons for what is missing."""
    proof, reasons = _prove_integers(proof, integers, options)
    found, more = prove_languages(kernels, options.languages, others, compiled=options.compile)
    return replace(proof, comparisons=(*proof.comparisons, *found)), (*reasons, *more)


def _prove_integers(
    proof: Proof, integers: IntegerKernels | None, options: BuildOptions
) -> tuple[Proof, tuple[str, ...]]:
    """The proof with that of the kernels without floating point; or as it was, and the reason."""
    if integers is None:
        return proof, ()
    if options.compile:
        try:
            found = prove_fixed(integers.fixed, integers.files)
            return Proof(proof.reach, (*proof.comparisons, *found.comparisons)), ()
        except MissingToolError:
            pass
    return proof, ("the q30 kernels are written without a proof, which takes a C compiler",)


def _measure(kernels: Kernels, options: BuildOptions, clock: _Clock) -> tuple[Cost, ...]:
    """Costs on a microcontroller; a build does not fail because an emulator does."""
    if not options.compile or Real.FLOAT not in options.reals or not can_measure():
        return ()
    with clock.stage("measure") as detail:
        try:
            costs = usual_costs(kernels)
        except KinegenError as error:
            detail.append(error.message)
            return ()
        detail.append(f"on {USUAL_TARGET}")
        return costs


def _contents(emitted: Emitted, extension: Extension | None, integers: IntegerKernels | None) -> dict[str, str | bytes]:
    compiled = {} if extension is None else {EXTENSION: extension.content}
    return {**emitted.files, **compiled, **(integers.files if integers else {})}


def _stale(folder: Path, emitted: Emitted) -> Callable[[str], bool]:
    """Which files of an earlier build go: kernels in any language, but not an extension of the same C files."""

    def stale(name: str) -> bool:
        if name == EXTENSION:
            return emitted.stamp.encode() not in (folder / name).read_bytes()
        return not _is_below(name) or name.partition("/")[0] in LANGUAGES

    return stale


def _is_below(name: str) -> bool:
    """Which files of an earlier firmware package go: those in the folders below, where all there is may be compiled.

    What lies in the folder itself may be another package of the same robot.
    """
    return "/" in name


def _angles(robot: Robot, programs: tuple[Program, ...]) -> tuple[AngleSum, ...]:
    """The angles of all programs; readings of actuators are called by their names."""
    readings = {f"actuators[{reading.index}]": reading.name for reading in robot.actuators.readings}
    found = {}
    for angle in (angle for program in programs for angle in program.angles):
        text = re.sub(r"actuators\[\d+\]", lambda match: readings[match[0]], angle.text)
        found[text] = replace(angle, text=text)
    return tuple(found.values())
