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

from kinegen.boards.figures import Cost
from kinegen.boards.usual import USUAL_TARGET, can_measure, usual_costs
from kinegen.clock import Clock as _Clock
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.machine import require_arm
from kinegen.emit.files import Emitted
from kinegen.emit.fixed.kernels import fixed_kernels
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError, MissingToolError
from kinegen.formats.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.plain import plain_count
from kinegen.ir.program import AngleSum, Count, Program, count
from kinegen.naming import EXTENSION
from kinegen.native.compile import Extension
from kinegen.native.package import build_extension, interface_of
from kinegen.outputs import SOLVERS, Quantity, with_needed
from kinegen.results import BuildOptions, BuildResult, Stage
from kinegen.robot.calibrated import calibrated
from kinegen.robot.model import Robot
from kinegen.symbolic.derive import derive
from kinegen.symbolic.inverse.recognise import Unknown, recognise
from kinegen.texts import Texts, bundle_of, texts_of
from kinegen.verify.comparison import Comparison, Proof
from kinegen.verify.fixed import prove_fixed
from kinegen.verify.languages import prove_languages
from kinegen.verify.nearly import nearly_special
from kinegen.verify.precision import precision_notes
from kinegen.verify.remembered import proof_of
from kinegen.verify.written import require_proven, require_written
from kinegen.verify.wrong_unit import wrong_unit
from kinegen.write import Written, refuse_link, write_files

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
        KinegenError: If the file is bad, the compiler refuses, the proof fails or the folder cannot be written. The
            output folder is then as it was.
    """
    refuse_link(options.output)
    clock = _Clock(Path(source.source) if isinstance(source, Robot) else source, report, begin)
    with clock.stage("load") as detail:
        robot = _load(source, options.wrt)
        if isinstance(options.package, Controller):
            family = recognise(robot)
            require_arm(robot, options.package, family.reasons if isinstance(family, Unknown) else ())
        detail.append(f"{len(robot.rows)} rows, {robot.dof} joint variables")
    kernels, (plain,) = _programs(robot, options.quantities, clock, plain_count)
    folder = options.output / robot.name
    with clock.stage("vectors") as detail:
        bundle = bundle_of(kernels, integers=options.integers)
        detail.append(f"{len(bundle.vectors.inputs['q'])} joint vectors")
    with clock.stage("emit") as detail:
        texts = texts_of(bundle, options)
        detail.append(f"{texts.count} files")
    extension, notes = _compile(kernels, texts.emitted, options, clock)
    proof, backend, reasons = _prove(kernels, texts, extension, options, clock)
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
        notes=(*notes, *reasons, *_file_notes(robot), *precision_notes(kernels, options.reals)),
    )


def _write(
    folder: Path, texts: Texts, extension: Extension | None, clock: _Clock, *, force: bool
) -> tuple[Written, ...]:
    """Write the files and look at what was written."""
    contents = texts.written(extension)
    with clock.stage("write") as detail:
        written = write_files(folder, contents, partial(texts.is_stale, folder), force=force)
        require_written(folder, contents)
        detail.append(f"{sum(entry.changed for entry in written)} files changed")
    return written


def _file_notes(robot: Robot) -> tuple[str, ...]:
    return tuple(map(str, (*wrong_unit(robot), *nearly_special(robot))))


def lower_file(path: Path, quantities: tuple[Quantity, ...], wrt: tuple[str, ...] = ()) -> Kernels:
    """Go as far as the programs of one robot, for what needs no files.

    Args:
        path: The robot file.
        quantities: Kinematic quantities.
        wrt: Parameters and entries of the table that become arguments of the kernels.

    Returns:
        The robot and its programs.

    Raises:
        KinegenError: If the file is bad, or a parameter does not exist.
    """
    clock = _Clock(path, lambda _: None)
    return _programs(_load(path, wrt), quantities, clock)[0]


def lower_robot(robot: Robot, quantities: tuple[Quantity, ...]) -> Kernels:
    """Go as far as the programs of one robot that is loaded.

    Args:
        robot: The robot.
        quantities: Kinematic quantities.
    """
    return _programs(robot, quantities, _Clock(Path(robot.source), lambda _: None))[0]


def _programs(
    robot: Robot, quantities: tuple[Quantity, ...], clock: _Clock, *compared: Callable[[Robot], Count]
) -> tuple[Kernels, tuple[Count, ...]]:
    """The robot with its programs, and the operations of other ones, which are for comparison."""
    wanted = with_needed(quantities)
    with clock.stage("derive") as detail:
        expressions = [derive(robot, quantity) for quantity in clock.each("derive", wanted)]
        detail.append(", ".join(map(str, quantities)))
    with clock.stage("lower") as detail:
        works = zip(expressions, clock.each("lower", wanted), strict=True)
        programs = tuple(lower(each) for each, _ in works)
        detail.append(f"{sum(len(program.statements) for program in programs)} statements")
        solvers = [solver in quantities for solver in SOLVERS]
        kernels = Kernels(robot, programs, runtime_defaults(robot), *solvers)
        clock.begin("multiply the link matrices, for comparison")
        return kernels, tuple(make(robot) for make in compared)


def _load(source: Path | Robot, wrt: tuple[str, ...]) -> Robot:
    """The robot, with the parameters that are asked for."""
    robot = source if isinstance(source, Robot) else load(source)
    return calibrated(robot, wrt) if wrt else robot


def _compile(
    kernels: Kernels, emitted: Emitted, options: BuildOptions, clock: _Clock
) -> tuple[Extension | None, tuple[str, ...]]:
    """The extension, or none and the reason."""
    with clock.stage("compile") as detail:
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
    """An extension is remembered for other builds if it loads and its proof holds, and is forgotten if not."""
    try:
        yield
    except KinegenError:
        if extension is not None:
            extension.forget()
        raise
    if extension is not None:
        extension.keep()


def _prove(
    kernels: Kernels, texts: Texts, extension: Extension | None, options: BuildOptions, clock: _Clock
) -> tuple[Proof, str, tuple[str, ...]]:
    """The proof of all there is, the backend of the Python package, and reasons for what is not proven."""
    quantities = (
        *(program.quantity for program in kernels.programs),
        *kernels.solvers,
    )
    reals = tuple(map(str, options.reals))
    with clock.stage("prove") as detail, _kept_once_proved(extension):
        proof, backend, known = proof_of(kernels.robot, texts.package(extension), quantities, reals)
        proof, reasons = _prove_others(proof, kernels, texts, options)
        if texts.project:
            require_proven(kernels.robot, texts.project, texts.vendored(options))
        detail += [f"{sum(each.poses for each in proof.comparisons)} poses", *["proved before"] * known]
    return proof, backend, reasons


def _prove_others(proof: Proof, kernels: Kernels, texts: Texts, options: BuildOptions) -> tuple[Proof, tuple[str, ...]]:
    """The proof with those of kernels in integers and in other languages, and reasons for what is missing."""
    integers, reasons = _prove_integers(kernels, texts.integers, options)
    others, more = prove_languages(kernels, options.languages, texts.others, compiled=options.compile)
    return replace(proof, comparisons=(*proof.comparisons, *integers, *others)), (*reasons, *more)


def _prove_integers(
    kernels: Kernels, files: Mapping[str, str], options: BuildOptions
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """The comparisons of the kernels without floating point; or none, and the reason."""
    if not files:
        return (), ()
    if options.compile:
        try:
            return prove_fixed(fixed_kernels(kernels), files).comparisons, ()
        except MissingToolError:
            pass
    return (), ("the q30 kernels are written without a proof, which takes a C compiler",)


def _measure(kernels: Kernels, options: BuildOptions, clock: _Clock) -> tuple[Cost, ...]:
    """Costs on a microcontroller; a build does not fail because an emulator does."""
    if not options.compile or Real.FLOAT not in options.reals or not can_measure():
        return ()
    with clock.stage("measure") as detail:
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
    """The angles of all programs; readings of actuators are called by their names."""
    readings = {f"actuators[{reading.index}]": reading.name for reading in robot.actuators.readings}
    found = {}
    for angle in (angle for program in programs for angle in program.angles):
        text = re.sub(r"actuators\[\d+\]", lambda match: readings[match[0]], angle.text)
        found[text] = replace(angle, text=text)
    return tuple(found.values())
