"""`kinegen build`: files, kernels and their verification, or wheels with them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.languages import LANGUAGES
from kinegen.errors import KinegenError, shown
from kinegen.model.outputs import Quantity
from kinegen.ui.api import options
from kinegen.ui.api.options import words_of
from kinegen.ui.cli.robot_command import Record, RobotCommand, accepted, document_text, json_option
from kinegen.ui.cli.terminal import ProgressLine, complain, faint, mention, raise_if_pressed, warn_of_cache

if TYPE_CHECKING:
    from kinegen.driver.results import BuildOptions, BuildResult, Stage

WHEEL = "wheel"
"""The word for `--package`."""

DIST = "dist"
"""Where wheels go unless -o says otherwise."""


def build_wheels(
    files: tuple[Path, ...], options: BuildOptions, bundle: str | None, *, as_json: bool, verbose: bool
) -> int:
    """Build the wheels of some robots and report what was written; returns the exit status, 0.

    The output of the options is the folder of the wheels. With `bundle` one wheel of this name holds all robots.

    Raises:
        KinegenError: If a build fails; nothing was written then.
    """
    from kinegen.tools.wheels.build import make_wheels
    from kinegen.ui.cli.build_record import build_record
    from kinegen.ui.cli.build_report import report_lines

    warn_of_cache()
    passing = ProgressLine(wanted=not as_json)

    def report(file: Path, stage: Stage) -> None:
        raise_if_pressed()
        passing.show(f"{file.name}: {stage.name} is done")

    try:
        made = make_wheels(files, options.output, options, bundle=bundle, report=report)
    finally:
        passing.clear()
    if as_json:
        builds = [build_record(file, result) for file, result in zip(files, made.results, strict=True)]
        mention(document_text({"wheels": [str(path) for path in made.files], "builds": builds}))
        return 0
    for result in made.results:
        mention("\n".join(report_lines(result, verbose=verbose, is_wheel=True)))
    for path in made.files:
        mention(f"wrote {shown(path)}: {path.stat().st_size / 1000:,.0f} kB")
    names = [result.robot.name for result in made.results]
    mention(f"after `pip install {shown(made.files[0])}`, `python -m {names[0]}` runs the self-test")
    return 0


_FILES = frozenset(
    ".c .csv .h .html .json .parquet .pdf .png .py .so .svg .urdf .whl .xacro .xml .yaml .yml .zip".split()
)
"""Endings of files, which no folder for packages is meant to have."""

EXTRA = tuple(language.name for language in LANGUAGES.values() if language.is_extra)
"""Languages that `--languages` adds."""


def quantities_of(
    _context: click.Context, _parameter: click.Parameter, text: str | None
) -> tuple[Quantity, ...] | None:
    """Return the outputs of a list; None where nothing is asked for."""
    return None if text is None else accepted(options.quantities_of, text)


def names_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """Return the words of a list, each once."""
    return words_of(text)


def languages_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """Return the languages of a list, without those that are always written."""
    return accepted(options.languages_of, text)


@click.command("build", cls=RobotCommand, short_help="Writes the kernels, compiles and verifies them.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Folder in which each robot gets a folder of its name.  [default: build]",
)
@click.option(
    "--real",
    type=click.Choice((*options.REALS, *options.INTEGERS)),
    help="Number types: both is double and float; q30 is integer kernels for processors without an FPU, together with "
    "double for Python (with --package alone); all is all three.  [default: both]",
)
@click.option(
    "--outputs",
    metavar="LIST",
    callback=quantities_of,
    help="What is computed: pose, frames, position; jacobian, fk_jacobian, twist, acceleration, hessian (with _local "
    "or _world for other axes); quaternion_wxyz, rpy_zyx and other orientations, with _jacobian for their derivatives; "
    "inverse, numeric_inverse, inverse_tracker; actuators_to_joints and others. pose@FRAME is for one frame. A wrong "
    "name prints the nearest one, or the list of all names.  [default: pose,jacobian, and inverse where there is one "
    "in closed form; pose,frames,position with integer kernels]",
)
@click.option(
    "--wrt",
    metavar="LIST",
    default="",
    callback=names_of,
    help="Parameters that parameter_jacobian differentiates by, such as a2,d3, and entries of the table, such as "
    "a_elbow; dh means all entries. They become arguments of the kernels.",
)
@click.option(
    "--package",
    type=click.Choice([*(each.value for each in (*Ecosystem, *Controller)), WHEEL]),
    help="Write C files for a project of this kind instead of a Python package. Unless -o says otherwise, they go to "
    + ", ".join(f"{each.folder} ({each.value})" for each in (*Ecosystem, *Controller))
    + ". Unless --real says otherwise, they are float only, and for cmake float and double. Packages for "
    + ", ".join(Controller)
    + " drive an arm with a closed-form inverse in that controller, linuxcnc a machine tool too; --real and --outputs "
    "are given by it. wheel writes what pip installs to dist: one wheel for this system and one with NumPy alone.",
)
@click.option("--bundle", metavar="NAME", help="Put all robots into one wheel of this name (with --package wheel).")
@click.option(
    "--languages",
    metavar="LIST",
    default="",
    callback=languages_of,
    help=f"Languages in addition to C and Python, each in its own folder: {', '.join(EXTRA)}. The build runs and "
    "verifies them if their tools are installed.",
)
@click.option("--no-compile", is_flag=True, help="Do not compile; the module computes with NumPy.")
@click.option("--march", metavar="NAME", help="Processor to compile for, as the compiler names it.  [default: native]")
@click.option(
    "--portable",
    is_flag=True,
    help="Compile for every processor of this family. The best variant is picked on loading, unless KINEGEN_VARIANT "
    "names one.",
)
@click.option("--reproducible", is_flag=True, help="The same bits on every machine, but slower.")
@click.option("--force", is_flag=True, help="Also replace files that kinegen did not write or that were edited.")
@json_option
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Also print the stages, the operations of each kernel and how it was chosen, its cost on a microcontroller, "
    "the files, and the table of errors.",
)
@click.pass_context
def build_command(
    context: click.Context,
    /,
    files: tuple[Path, ...],
    output: Path | None,
    outputs: tuple[Quantity, ...] | None,
    package: str | None,
    bundle: str | None,
    no_compile: bool,
    as_json: bool,
    verbose: bool,
    **words: Any,
) -> int:
    """Writes C and a Python module for each robot file, compiles them, and verifies every kernel against a reference.

    The folder DIR/NAME gets NAME.h, NAME.c and their companions. It is a Python package, or with --package a library
    for a C project; --package wheel writes a file for pip. The exit status is 0 only if every error is within its
    tolerance. A build that fails leaves the earlier output as it was. Only files that kinegen wrote are replaced or
    removed; kinegen-manifest.json lists them with their SHA-256.

    Generated C and Python functions take and return angles in radians, and lengths in the unit of the robot file.
    """
    _refuse_together(package, bundle, **words)
    if output is not None and output.suffix.lower() in _FILES and not output.is_dir():
        raise click.UsageError(f"-o takes a folder, and {shown(output)} looks like the name of a file")
    is_wheel = package == WHEEL
    chosen = options.build_options(
        output or (DIST if is_wheel else None),
        outputs=None if outputs is None else map(str, outputs),
        package=None if is_wheel else package,
        compile=not no_compile,
        measure=verbose,
        **words,
    )
    # The shell may name a file twice, as in `robots/*.yaml robots/ur5.yaml`.
    files = tuple({file.resolve(): file for file in reversed(files)}.values())[::-1]
    if is_wheel:
        return build_wheels(files, chosen, bundle, as_json=as_json, verbose=verbose)
    debug = context.find_root().params["debug"]
    return _build_all(files, chosen, as_json=as_json, debug=debug, verbose=verbose)


def _refuse_together(package: str | None, bundle: str | None, **words: Any) -> None:
    """Refuse options that exclude each other."""
    is_wheel, real = package == WHEEL, words["real"]
    if words["march"] and words["portable"]:
        raise click.UsageError("--march and --portable exclude each other")
    if package and words["languages"]:
        raise click.UsageError("--package writes no other languages; build with --languages into another folder")
    if bundle is not None and not is_wheel:
        raise click.UsageError("--bundle is the name of a wheel, so it needs --package wheel")
    if is_wheel and real in options.INTEGERS:
        raise click.UsageError(f"--real {real} and --package wheel exclude each other: a wheel has no integer kernels")
    if is_wheel and words["march"]:
        raise click.UsageError("--march and --package wheel exclude each other: a wheel is for every processor")


def _build_all(files: tuple[Path, ...], options: BuildOptions, *, as_json: bool, debug: bool, verbose: bool) -> int:
    """Build one robot after the other, also after one has failed; returns the exit status."""
    from kinegen.ui.cli.build_record import build_record
    from kinegen.ui.cli.build_report import DETAILS

    warn_of_cache()
    # A document has an entry for each file, also for those that failed.
    failed: list[Path] = []
    documents: list[Record] = []
    names: dict[str, Path] = {}
    for file in files:
        try:
            _claim_name(file, names)
            result = _build(file, options, quiet=as_json, verbose=verbose)
        except KinegenError as error:
            if (len(files) == 1 and not as_json) or debug:
                raise
            complain(f"error: {error}")
            failed.append(file)
            documents.append({"file": str(file), "ok": False, "error": str(error)})
        else:
            documents.append(build_record(file, result) if as_json else {})
    if as_json:
        mention(document_text({"builds": documents}))
    elif len(failed) < len(files) and not verbose:
        mention(faint(DETAILS))
    if failed and len(files) > 1:
        complain(f"{len(failed)} of {len(files)} builds failed: {', '.join(str(file) for file in failed)}")
    return int(bool(failed))


def _claim_name(file: Path, names: dict[str, Path]) -> None:
    """See that no two files of one call go to the same folder, also where capitals make no difference in names."""
    from kinegen.io.load import load

    name = load(file).name
    before = next((other for other in names if other.lower() == name.lower()), None)
    if before is not None:
        but = "" if before == name else f" but for capitals (it is {before!r})"
        where = "" if before == name else " on Windows and macOS"
        raise KinegenError(
            f"the robot is called {name!r}, as that of {names[before]}{but}, whose folder it would take{where}",
            str(file),
        )
    names[name] = file


def _build(file: Path, options: BuildOptions, *, quiet: bool, verbose: bool) -> BuildResult:
    """Build one robot; say on a terminal what is being done, and at the end what came of it."""
    from kinegen.ui.api.building import built
    from kinegen.ui.cli.build_report import report_lines

    # Ctrl-C that a library swallowed is raised between the stages.
    passing = ProgressLine(wanted=not quiet)

    def report(_stage: Stage) -> None:
        passing.clear()
        raise_if_pressed()

    def begin(work: str) -> None:
        raise_if_pressed()
        passing.show(f"{file.name}: {work}")

    try:
        result = built(file, options, report, begin)
    finally:
        passing.clear()
    if not quiet:
        mention("\n".join(report_lines(result, verbose=verbose)))
    return result
