"""One build: the stages in order, with their times, and what an option leaves out.

    load     robot file             -> Robot
    derive   Robot                  -> Expressions, one for each quantity
    lower    Expressions            -> Program
    vectors  Programs               -> test vectors, from the reference
    emit     Programs, test vectors -> files
    compile  C files                -> extension (left out without a compiler)
    prove    files, extension       -> Proof, in a staging folder
    write    files, extension       -> the output folder, all or nothing

A build that fails in any stage leaves the output folder as it was.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import Controller, require_name
from kinegen.backends.controllers.kernel_calls import needed
from kinegen.backends.controllers.machine import require_arm
from kinegen.backends.controllers.machine_tool import mill_for
from kinegen.backends.files import Emitted
from kinegen.backends.fixed_point.kernels import fixed_kernels
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.derive.inverse.classification import NotClosedForm, recognise, with_usual_inverse
from kinegen.driver.artifacts import Artifacts, ProgramBundle, bundle_of, texts_of
from kinegen.driver.results import BuildOptions, BuildResult, Clock, Stage
from kinegen.errors import KinegenError, MissingToolError
from kinegen.io.load import load
from kinegen.ir.from_expressions import plain_count
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import AngleSum, Count, Program, count
from kinegen.model.outputs import SOLVERS, Quantity, with_needed
from kinegen.model.robot import Robot
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.model.variants import require_frames
from kinegen.runtime.compile import Extension
from kinegen.runtime.extension import build_extension, interface_of
from kinegen.support.files.manifest import check_place
from kinegen.support.files.write import Written, check_files, refuse_link, write_files
from kinegen.support.naming import EXTENSION
from kinegen.verify.boards.cost import USUAL_TARGET, can_measure, usual_costs
from kinegen.verify.fixed_point import prove_fixed
from kinegen.verify.languages import prove_languages
from kinegen.verify.lint.numbers import nearly_special, wrong_unit
from kinegen.verify.lint.precision import precision_notes
from kinegen.verify.package_proof import cached_proof, require_printed, require_proven, require_written
from kinegen.verify.records import Comparison, Cost, Proof

_MEASURED = 8000
"""Statements up to which the cost of a kernel on a microcontroller is measured; longer ones take emulators too long."""


def build(
    source: Path | Robot,
    options: BuildOptions,
    report: Callable[[Stage], None],
    begin: Callable[[str], object] = str,
) -> BuildResult:
    """Build the package of one robot.

    Args:
        source: The robot file, or a robot that is loaded.
        options: What to make.
        report: Called after each stage.
        begin: Called with a few words before each stage, and before each output in stages that take them one by one.

    Returns:
        What was done; the proof holds.

    Raises:
        KinegenError: If the build fails; the output folder is then as it was.
    """
    refuse_link(options.output)
    clock = Clock(Path(source.source) if isinstance(source, Robot) else source, report, begin)
    with clock.stage("load") as detail:
        robot = _load(source, options.wrt)
        options = replace(options, quantities=_quantities(robot, options))
        detail.append(f"{len(robot.rows)} rows, {robot.dof} joint variables")
        check_place(options.output / robot.name)
    kernels, (plain,) = _programs(robot, options.quantities, clock, plain_count)
    folder = options.output / robot.name
    bundle, texts = _emit(kernels, folder, options, clock)
    # What is compiled, verified and measured is what will be written.
    extension, notes = _compile(kernels, texts.emitted, options, clock)
    proof, backend, reasons = _prove(bundle, texts, extension, options, clock)
    costs = _measure(kernels, options, clock)
    written = _write(folder, texts, extension, clock, force=options.force)
    return BuildResult(
        robot=robot,
        counts={program.quantity: count(program) for program in kernels.programs},
        plain=plain,
        angles=_angles(robot, kernels.programs),
        folder=folder,
        written=written,
        proof=proof,
        backend=backend,
        costs=costs,
        stages=tuple(clock.stages),
        notes=(
            *notes,
            *reasons,
            *map(str, (*wrong_unit(robot), *nearly_special(robot))),
            *precision_notes(kernels, options.reals),
        ),
    )


def _emit(kernels: RobotPrograms, folder: Path, options: BuildOptions, clock: Clock) -> tuple[ProgramBundle, Artifacts]:
    """Return the test vectors of the kernels and the text of every file; refuses files that are in the way."""
    with clock.stage("vectors", "compute test vectors with 50 digits") as detail:
        bundle = bundle_of(kernels, integers=options.integers)
        detail.append(f"{len(bundle.vectors.inputs['q'])} joint vectors")
    with clock.stage("emit", "emit C and Python, with error bounds") as detail:
        texts = texts_of(bundle, options)
        detail.append(f"{texts.count} files")
        # Before the long work; what was compiled is never in the way.
        check_files(folder, texts.written(None), partial(texts.is_stale, folder), force=options.force)
    return bundle, texts


def _quantities(robot: Robot, options: BuildOptions) -> tuple[Quantity, ...]:
    """Return what is computed of a robot, after frames and the arm of a controller are looked at."""
    quantities = with_usual_inverse(robot, options.quantities) if options.usual_inverse else options.quantities
    for quantity in quantities:
        require_frames(robot, str(quantity), (quantity.frame, quantity.seen_from))
    if isinstance(options.package, Controller):
        quantities = _controlled(robot, options.package)
    return quantities


def _controlled(robot: Robot, controller: Controller) -> tuple[Quantity, ...]:
    """Return what the package of a controller calls, if that can move the robot."""
    require_name(robot, controller)
    family = recognise(robot)
    reasons = family.reasons if isinstance(family, NotClosedForm) else ()
    if controller.has_mills and (mill := mill_for(robot, solved=not reasons)) is not None:
        return mill.quantities
    require_arm(robot, controller, reasons)
    return needed(robot, controller)


def _write(
    folder: Path, texts: Artifacts, extension: Extension | None, clock: Clock, *, force: bool
) -> tuple[Written, ...]:
    """Write the files and look at what was written."""
    contents = texts.written(extension)
    with clock.stage("write") as detail:
        written = write_files(folder, contents, partial(texts.is_stale, folder), force=force)
        require_written(folder, contents)
        detail.append(f"{sum(entry.changed for entry in written)} files changed")
    return written


def lower_file(path: Path, quantities: tuple[Quantity, ...], wrt: tuple[str, ...] = ()) -> RobotPrograms:
    """Go as far as the programs of a robot, for what needs no files; what `wrt` names becomes arguments of the kernels.

    Raises:
        KinegenError: If the file is bad, or a parameter does not exist.
    """
    clock = Clock(path, lambda _: None)
    return _programs(_load(path, wrt), quantities, clock)[0]


def lower_robot(robot: Robot, quantities: tuple[Quantity, ...]) -> RobotPrograms:
    """Go as far as the programs of one robot that is loaded."""
    return _programs(robot, quantities, Clock(Path(robot.source), lambda _: None))[0]


def _programs(
    robot: Robot, quantities: tuple[Quantity, ...], clock: Clock, *compared: Callable[[Robot], Count]
) -> tuple[RobotPrograms, tuple[Count, ...]]:
    """Return the robot with its programs, and the operations of other ones, which are for comparison."""
    wanted = with_needed(quantities)
    with clock.stage("derive") as detail:
        expressions = [derive(robot, quantity) for quantity in clock.each("derive", wanted)]
        detail.append(", ".join(map(str, quantities)))
    with clock.stage("lower") as detail:
        works = zip(expressions, clock.each("lower", wanted), strict=True)
        programs = tuple(lower(each) for each, _ in works)
        detail.append(f"{sum(len(program.statements) for program in programs)} statements")
        solvers = [solver in quantities for solver in SOLVERS]
        kernels = RobotPrograms(robot, programs, runtime_defaults(robot), *solvers)
        clock.begin("multiply the link matrices, for comparison")
        return kernels, tuple(make(robot) for make in compared)


def _load(source: Path | Robot, wrt: tuple[str, ...]) -> Robot:
    """Return the robot, with the parameters that are asked for."""
    robot = source if isinstance(source, Robot) else load(source)
    return with_runtime_entries(robot, wrt) if wrt else robot


def _compile(
    kernels: RobotPrograms, emitted: Emitted, options: BuildOptions, clock: Clock
) -> tuple[Extension | None, tuple[str, ...]]:
    """Return the extension, or none and the reason."""
    with clock.stage("compile", "compile the kernels") as detail:
        try:
            if options.compile:
                extension = build_extension(interface_of(kernels, options.reals), emitted.sources, options.flags)
                detail.append("cached" if extension.cached else EXTENSION)
                return extension, ()
            notes: tuple[str, ...] = ()
        except MissingToolError as error:
            notes = (f"{error.message}; the module evaluates with NumPy until then",)
        detail.append("NumPy kernels only")
        return None, notes


@contextmanager
def _kept_once_proved(extension: Extension | None) -> Iterator[None]:
    """Remember an extension for other builds if it loads and its proof holds; forget it if not."""
    try:
        yield
    except KinegenError:
        if extension is not None:
            extension.forget()
        raise
    if extension is not None:
        extension.keep()


def _prove(
    bundle: ProgramBundle, texts: Artifacts, extension: Extension | None, options: BuildOptions, clock: Clock
) -> tuple[Proof, str, tuple[str, ...]]:
    """Return the proof of all there is, the backend of the Python package, and reasons for what is not proven."""
    kernels = bundle.kernels
    quantities = (
        *(program.quantity for program in kernels.programs),
        *kernels.solvers,
    )
    reals = tuple(map(str, options.reals))
    work = "verify every output in every way to call it"
    with clock.stage("prove", work) as detail, _kept_once_proved(extension):
        # A proof of the same files holds for this build too.
        proof, backend, known = cached_proof(kernels.robot, texts.package(extension), quantities, reals)
        proof, reasons = _prove_others(proof, kernels, texts, options)
        # A firmware package has to have the verified files, byte by byte; and emitting twice has to give the same.
        if texts.project:
            require_proven(kernels.robot, texts.project, texts.vendored(options))
        require_printed(kernels.robot, texts.written(None), texts_of(bundle, options).written(None))
        detail += [f"{sum(each.poses for each in proof.comparisons)} poses", *["proved before"] * known]
    return proof, backend, reasons


def _prove_others(
    proof: Proof, kernels: RobotPrograms, texts: Artifacts, options: BuildOptions
) -> tuple[Proof, tuple[str, ...]]:
    """Return the proof with those of kernels in integers and in other languages, and reasons for what is missing."""
    integers, reasons = _prove_integers(kernels, texts.integers, options)
    others, more = prove_languages(kernels, options.languages, texts.others, compiled=options.compile)
    return replace(proof, comparisons=(*proof.comparisons, *integers, *others)), (*reasons, *more)


def _prove_integers(
    kernels: RobotPrograms, files: Mapping[str, str], options: BuildOptions
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Return the comparisons of the kernels without floating point; or none, and the reason."""
    if not files:
        return (), ()
    if options.compile:
        try:
            return prove_fixed(fixed_kernels(kernels), files).comparisons, ()
        except MissingToolError:
            pass
    return (), ("the q30 kernels are not verified, since that needs a C compiler",)


def _measure(kernels: RobotPrograms, options: BuildOptions, clock: Clock) -> tuple[Cost, ...]:
    """Return costs on a microcontroller; a build does not fail because an emulator does."""
    wanted = options.measure and options.compile and ScalarType.FLOAT in options.reals
    if not wanted or not can_measure():
        return ()
    with clock.stage("measure", f"measure every output on {USUAL_TARGET}") as detail:
        if max((len(program.statements) for program in kernels.programs), default=0) > _MEASURED:
            detail.append(f"left out: a kernel has more than {_MEASURED} statements; `kinegen size` measures it")
            return ()
        try:
            costs = usual_costs(kernels)
        except KinegenError as error:
            detail.append(error.message)
            return ()
        detail.append(f"on {USUAL_TARGET}")
        return costs


def _angles(robot: Robot, programs: tuple[Program, ...]) -> tuple[AngleSum, ...]:
    """Return the angles of all programs; readings of actuators are called by their names."""
    readings = {f"actuators[{reading.index}]": reading.name for reading in robot.actuators.readings}
    found = {}
    for angle in (angle for program in programs for angle in program.angles):
        text = re.sub(r"actuators\[\d+\]", lambda match: readings[match[0]], angle.text)
        found[text] = replace(angle, text=text)
    return tuple(found.values())
