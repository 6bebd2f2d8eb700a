"""`kinegen build`: files, kernels and their proof."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from kinegen import __version__
from kinegen.api import options
from kinegen.api.words import USUAL_OUTPUTS, words_of
from kinegen.cli.cached import warn_of_cache
from kinegen.cli.interrupt import raise_if_pressed
from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import Passing, complain, say, strong
from kinegen.cli.wheels import DIST, WHEEL, build_wheels
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.languages import LANGUAGES
from kinegen.emit.packages.ecosystem import Ecosystem
from kinegen.errors import KinegenError, shown
from kinegen.outputs import Quantity

if TYPE_CHECKING:
    from kinegen.results import BuildOptions, BuildResult, Stage

Result = TypeVar("Result")

EXTRA = tuple(language.name for language in LANGUAGES.values() if language.is_extra)
"""Languages that `--languages` adds."""


def quantities_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[Quantity, ...]:
    """The outputs of a list."""
    return _taken(options.quantities_of, text)


def names_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """The words of a list, each once."""
    return words_of(text)


def languages_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """The languages of a list, without those that are always written."""
    return _taken(options.languages_of, text)


def _taken(read: Callable[[str], Result], text: str) -> Result:
    """What a list of words is read as; a wrong word is a wrong argument."""
    try:
        return read(text)
    except KinegenError as error:
        raise click.BadParameter(error.message) from error


@click.command("build", cls=RobotCommand, short_help="Writes the kernels, compiles and proves them.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Folder in which each robot gets a folder of its name.  [default: generated]",
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
    default=USUAL_OUTPUTS,
    show_default=True,
    callback=quantities_of,
    help="What is computed: pose, frames, position; jacobian, fk_jacobian, twist, acceleration, hessian (with _local "
    "or _world for other axes); quaternion_wxyz, rpy_zyx and other orientations, with _jacobian for their derivatives; "
    "inverse, numeric_inverse, inverse_tracker; actuators_to_joints and others. pose@FRAME is for one frame. A wrong "
    "name prints the list of all names.",
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
    + " drive an arm with a closed-form inverse in that controller; --real and --outputs are given by it. wheel writes "
    "what pip installs to dist: one wheel for this system and one with NumPy alone.",
)
@click.option("--bundle", metavar="NAME", help="Put all robots into one wheel of this name (with --package wheel).")
@click.option(
    "--languages",
    metavar="LIST",
    default="",
    callback=languages_of,
    help=f"Languages in addition to C and Python, each in its own folder: {', '.join(EXTRA)}. The build runs and "
    "proves them if their tools are installed.",
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
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
@click.pass_context
def command(
    context: click.Context,
    files: tuple[Path, ...],
    output: Path | None,
    real: str | None,
    outputs: tuple[Quantity, ...],
    wrt: tuple[str, ...],
    package: str | None,
    bundle: str | None,
    languages: tuple[str, ...],
    no_compile: bool,
    march: str | None,
    portable: bool,
    reproducible: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Writes C and a Python module for each robot file, compiles them, and proves every kernel against a reference.

    The folder DIR/NAME gets NAME.h, NAME.c and their companions. It is a Python package, or with --package a library
    for a C project; --package wheel writes a file for pip. The exit status is 0 only if every proof holds. A build that
    fails leaves the earlier output as it was. Only files that kinegen wrote are replaced or removed;
    kinegen-manifest.json lists them with their SHA-256.
    """
    if march and portable:
        raise click.UsageError("--march and --portable exclude each other")
    is_wheel = package == WHEEL
    if package and languages:
        raise click.UsageError("--package writes no other languages; build with --languages into another folder")
    if bundle is not None and not is_wheel:
        raise click.UsageError("--bundle is the name of a wheel, so it needs --package wheel")
    if is_wheel and real in options.INTEGERS:
        raise click.UsageError(f"--real {real} and --package wheel exclude each other: a wheel has no integer kernels")
    if is_wheel and march:
        raise click.UsageError("--march and --package wheel exclude each other: a wheel is for every processor")
    chosen = options.build_options(
        output or (DIST if is_wheel else None),
        outputs=map(str, outputs),
        real=real,
        wrt=wrt,
        package=None if is_wheel else package,
        languages=languages,
        compile=not no_compile,
        march=march,
        portable=portable,
        reproducible=reproducible,
        force=force,
    )
    if is_wheel:
        return build_wheels(files, chosen, bundle, as_json=as_json)
    return _build_all(files, chosen, as_json=as_json, debug=context.find_root().params["debug"])


def _build_all(files: tuple[Path, ...], options: BuildOptions, *, as_json: bool, debug: bool) -> int:
    """Build one robot after the other, also after one has failed; returns the exit status."""
    warn_of_cache()
    failed: list[Path] = []
    documents: list[dict[str, object]] = []
    names: dict[str, Path] = {}
    for file in files:
        try:
            _claim_name(file, names)
            result = _build(file, options, brief=len(files) > 1, quiet=as_json)
        except KinegenError as error:
            if (len(files) == 1 and not as_json) or debug:
                raise
            complain(f"error: {error}")
            failed.append(file)
            documents.append({"file": str(file), "ok": False, "error": str(error)})
        else:
            documents.append(_document(file, result) if as_json else {})
    if as_json:
        say(json.dumps({"kinegen": __version__, "format": 1, "builds": documents}, indent=2))
    if failed and len(files) > 1:
        complain(f"{len(failed)} of {len(files)} builds failed: {', '.join(str(file) for file in failed)}")
    return int(bool(failed))


def _claim_name(file: Path, names: dict[str, Path]) -> None:
    """See that no two files of one call go to the same folder."""
    from kinegen.formats.load import load

    name = load(file).name
    if name in names:
        raise KinegenError(
            f"the robot is called {name!r}, as that of {names[name]}, whose folder it would take", str(file)
        )
    names[name] = file


def _build(file: Path, options: BuildOptions, *, brief: bool, quiet: bool) -> BuildResult:
    """Build one robot and tell of it as it goes."""
    from kinegen.api.building import built
    from kinegen.cli.report import report_lines, stage_line

    passing = Passing(wanted=not quiet)

    def report(stage: Stage) -> None:
        passing.clear()
        raise_if_pressed()
        if not quiet:
            say(stage_line(stage))

    def begin(work: str) -> None:
        raise_if_pressed()
        passing.show(work)

    if not quiet:
        say(strong(shown(file)))
    try:
        result = built(file, options, report, begin)
    finally:
        passing.clear()
    if not quiet:
        say("\n".join(report_lines(result, brief=brief)))
    return result


def _document(file: Path, result: BuildResult) -> dict[str, object]:
    from kinegen.cli.record import build_record

    return {"file": str(file), "ok": True, **build_record(result)}
