"""One build: the stages in order, and nothing else.

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

import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from kinegen.emit.c.batch import emit_batch
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.c.vectors import Vectors, emit_vectors
from kinegen.emit.kernels import Kernels
from kinegen.emit.python.formula import emit_formula
from kinegen.emit.python.package import emit_package, output_shape
from kinegen.emit.reals import Real
from kinegen.errors import CompileError, MissingToolError
from kinegen.ir.lower import exact_number, lower
from kinegen.ir.program import AngleSum, Count, Program, count
from kinegen.naming import EXTENSION
from kinegen.native.compile import Extension
from kinegen.native.flags import Flags
from kinegen.native.glue import Interface, OutputShape
from kinegen.native.package import build_extension, load_package, stamp_of
from kinegen.outputs import Quantity
from kinegen.robot.expressions import evaluate
from kinegen.robot.extent import reach
from kinegen.robot.load import load
from kinegen.robot.model import Robot
from kinegen.symbolic.derive import derive
from kinegen.symbolic.plain import derive_plain
from kinegen.symbolic.transforms import EXACT
from kinegen.verify.proof import Proof, prove
from kinegen.verify.tolerances import TOLERANCES
from kinegen.verify.vectors import vector_inputs, vector_pairs, vector_results
from kinegen.write import Written, is_generated, write_files


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """What a build makes.

    Attributes:
        output: Folder in which the package folder of each robot lies.
        reals: Number types.
        quantities: Kinematic quantities.
        compile: Whether to build the compiled extension.
        flags: How to compile it.
    """

    output: Path = Path("generated")
    reals: tuple[Real, ...] = (Real.DOUBLE, Real.FLOAT)
    quantities: tuple[Quantity, ...] = tuple(Quantity)
    compile: bool = True
    flags: Flags = field(default_factory=Flags)


@dataclass(frozen=True, slots=True)
class Stage:
    """A finished stage.

    Attributes:
        name: Its name.
        seconds: How long it took.
        detail: What came out, in a few words.
    """

    name: str
    seconds: float
    detail: str


@dataclass(frozen=True, slots=True)
class BuildResult:
    """What a build did.

    Attributes:
        robot: The robot.
        counts: Operations of each quantity.
        plain: Operations of the pose as a plain product of link matrices.
        angles: The angles whose sines and cosines are taken.
        folder: The package folder.
        written: The files and whether each was new, changed or untouched.
        proof: The comparisons, all of which hold.
        backend: What the proof ran: `c`, or `numpy` without a compiler.
        stages: The stages with their times.
        notes: Sentences that the user should read.
    """

    robot: Robot
    counts: dict[Quantity, Count]
    plain: Count
    angles: tuple[AngleSum, ...]
    folder: Path
    written: tuple[Written, ...]
    proof: Proof
    backend: str
    stages: tuple[Stage, ...]
    notes: tuple[str, ...]


@dataclass(slots=True)
class _Clock:
    """Times the stages and reports each as it ends."""

    report: Callable[[Stage], None]
    stages: list[Stage] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str) -> Iterator[list[str]]:
        detail: list[str] = []
        begin = time.perf_counter()
        yield detail
        self.stages.append(Stage(name, time.perf_counter() - begin, ", ".join(detail)))
        self.report(self.stages[-1])


def build(path: Path, options: BuildOptions, report: Callable[[Stage], None]) -> BuildResult:
    """Build the package of one robot.

    Args:
        path: The robot file.
        options: What to make.
        report: Called after each stage.

    Returns:
        What was done; the proof holds.

    Raises:
        KinegenError: If the file is bad, the compiler refuses, the proof fails or the folder cannot be written. The
            output folder is then as it was.
    """
    clock = _Clock(report)
    with clock.stage("load") as detail:
        robot = load(path)
        detail.append(f"{len(robot.rows)} rows, {robot.dof} joint variables")
    with clock.stage("derive") as detail:
        expressions = [derive(robot, quantity) for quantity in options.quantities]
        plain = derive_plain(robot)
        detail.append(", ".join(quantity.value for quantity in options.quantities))
    with clock.stage("lower") as detail:
        programs = tuple(lower(each) for each in expressions)
        plain_count = count(lower(plain))
        detail.append(f"{sum(len(program.statements) for program in programs)} statements")
    with clock.stage("emit") as detail:
        kernels = Kernels(robot, programs, _defaults(robot))
        emitted = emit_all(kernels, options.reals)
        detail.append(f"{len(emitted.files)} files")
    with clock.stage("compile") as detail:
        extension, notes = _compile(kernels, emitted, options)
        detail.append("NumPy kernels only" if extension is None else "cached" if extension.cached else EXTENSION)
    with clock.stage("prove") as detail:
        contents = _contents(emitted, extension)
        proof, backend = _prove(robot, contents, options)
        detail.append(f"{sum(comparison.poses for comparison in proof.comparisons)} poses")
    with clock.stage("write") as detail:
        written = write_files(options.output / robot.name, contents, _stale(emitted))
        detail.append(f"{sum(entry.changed for entry in written)} files changed")
    return BuildResult(
        robot=robot,
        counts={program.quantity: count(program) for program in programs},
        plain=plain_count,
        angles=_angles(programs),
        folder=options.output / robot.name,
        written=written,
        proof=proof,
        backend=backend,
        stages=tuple(clock.stages),
        notes=notes,
    )


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
    return Kernels(robot, tuple(lower(derive(robot, quantity)) for quantity in quantities), _defaults(robot))


@dataclass(frozen=True, slots=True)
class Emitted:
    """What the emitters made.

    Attributes:
        sources: The C files that the extension is compiled from, by name.
        files: All files of the package, these among them.
        stamp: Digest of the sources.
    """

    sources: Mapping[str, str]
    files: Mapping[str, str]
    stamp: str


def emit_all(kernels: Kernels, reals: tuple[Real, ...]) -> Emitted:
    """Print every text file of a package.

    Args:
        kernels: The robot and its programs.
        reals: Number types.

    Returns:
        C kernels, their test vectors, and the Python module with its NumPy form.
    """
    sources: dict[str, str] = {}
    for real in reals:
        sources |= emit_kernel(kernels, real) | emit_batch(kernels, real)
    stamp = stamp_of(sources)
    quantities = tuple(program.quantity for program in kernels.programs)
    inputs = vector_inputs(kernels.robot)
    names = (parameter.name for parameter in kernels.robot.runtime_parameters)
    vectors = Vectors(
        inputs=inputs,
        expected=vector_results(kernels.robot, quantities),
        pairs=vector_pairs(kernels.programs, inputs, dict(zip(names, kernels.defaults, strict=True))),
    )
    files = dict(sources)
    for real in reals:
        files |= emit_vectors(kernels, vectors, real, _vector_tolerance(kernels.robot, real))
    files |= emit_formula(kernels) | emit_package(kernels, reals, stamp)
    return Emitted(sources, files, stamp)


def _compile(
    kernels: Kernels, emitted: Emitted, options: BuildOptions
) -> tuple[Extension | None, tuple[str, ...]]:
    """The extension, or none and the reason."""
    if not options.compile:
        return None, ()
    robot = kernels.robot
    interface = Interface(
        symbol=robot.name,
        dof=robot.dof,
        outputs=tuple(
            OutputShape(program.quantity.function, output_shape(robot, program)) for program in kernels.programs
        ),
        reals=tuple(real.value for real in options.reals),
        parameters=tuple(parameter.name for parameter in robot.runtime_parameters),
    )
    try:
        return build_extension(interface, emitted.sources, options.flags), ()
    except MissingToolError as error:
        return None, (f"{error.message}; the module evaluates with NumPy until then",)


def _contents(emitted: Emitted, extension: Extension | None) -> dict[str, str | bytes]:
    compiled = {} if extension is None else {EXTENSION: extension.content}
    return {**emitted.files, **compiled}


def _prove(robot: Robot, contents: Mapping[str, str | bytes], options: BuildOptions) -> tuple[Proof, str]:
    """Import the package from a staging folder and hold it against the reference."""
    with tempfile.TemporaryDirectory(prefix="kinegen-") as staging:
        folder = Path(staging) / robot.name
        folder.mkdir()
        for name, content in contents.items():
            (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            package = load_package(folder)
        if EXTENSION in contents and package.backend != "c":
            reason = "; ".join(str(warning.message) for warning in caught)
            raise CompileError(f"{robot.name}: the compiled module cannot be proven on this machine: {reason}")
        proof = prove(robot, package, options.quantities, tuple(real.value for real in options.reals))
        proof.require(robot)
        return proof, str(package.backend)


def _stale(emitted: Emitted) -> Callable[[Path], bool]:
    """Which files of an earlier build go: all that are ours, but not an extension of the same C files."""

    def stale(path: Path) -> bool:
        return is_generated(path) and not (path.name == EXTENSION and emitted.stamp.encode() in path.read_bytes())

    return stale


def _vector_tolerance(robot: Robot, real: Real) -> Fraction:
    relative = TOLERANCES.double if real is Real.DOUBLE else TOLERANCES.float
    return Fraction(relative) * max(Fraction(1), Fraction(reach(robot, robot.frame_names)))


def _defaults(robot: Robot) -> tuple[Fraction, ...]:
    return tuple(exact_number(evaluate(parameter.value, {}, EXACT)) for parameter in robot.runtime_parameters)


def _angles(programs: tuple[Program, ...]) -> tuple[AngleSum, ...]:
    found = {angle.text: angle for program in programs for angle in program.angles}
    return tuple(found.values())
