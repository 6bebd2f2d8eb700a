"""`kinegen build`: files, kernels and their proof."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen import __version__
from kinegen.cli.cached import warn_of_cache
from kinegen.cli.interrupt import raise_if_pressed
from kinegen.cli.terminal import Passing, complain, say, strong
from kinegen.emit.packages.ecosystem import Ecosystem
from kinegen.errors import KinegenError, shown
from kinegen.outputs import USUAL, Kind, Quantity, parse_quantity

if TYPE_CHECKING:
    from kinegen.results import BuildOptions, BuildResult, Stage

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}
INTEGERS = {"q30": REALS["double"], "float,q30": REALS["float"], "all": REALS["both"]}
"""The choices with kernels in integers, and the number types beside them."""

ALWAYS = ("c", "python")
"""Languages that every build writes."""


def quantities_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[Quantity, ...]:
    """The outputs in the order of `Kind`, whatever the order in which they were named."""
    try:
        found = {parse_quantity(word.strip()) for word in text.split(",")}
    except KinegenError as error:
        raise click.BadParameter(error.message) from error
    places = {kind: place for place, kind in enumerate(Kind)}
    return tuple(sorted(found, key=lambda quantity: (places[quantity.kind], str(quantity))))


def names_of(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """The words of a list, each once."""
    return tuple(dict.fromkeys(word.strip() for word in text.split(","))) if text else ()


def languages_of(context: click.Context, parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """The languages in the order of their table; C and Python may be named, and are always written."""
    from kinegen.emit.languages import LANGUAGES

    names = names_of(context, parameter, text)
    unknown = [name for name in names if name not in (*ALWAYS, *LANGUAGES)]
    if unknown:
        raise click.BadParameter(f"unknown language '{unknown[0]}' (expected {', '.join((*ALWAYS, *LANGUAGES))})")
    return tuple(name for name in LANGUAGES if name in names)


@click.command("build", short_help="Writes the kernels, compiles and proves them.")
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
    type=click.Choice((*REALS, *INTEGERS)),
    help="Number types: both is double and float; q30 is integer kernels for processors without an FPU, together with "
    "double for Python (with --package alone); all is all three.  [default: both]",
)
@click.option(
    "--outputs",
    metavar="LIST",
    default=",".join(map(str, USUAL)),
    show_default=True,
    callback=quantities_of,
    help="What is computed: pose, frames, position; jacobian, fk_jacobian, twist, acceleration, hessian (with _local "
    "or _world for other axes); quaternion_wxyz, rpy_zyx and other orientations, with _jacobian for their derivatives; "
    "inverse, numeric_inverse; actuators_to_joints and others. pose@FRAME is for one frame. A wrong name "
    "prints the list of all names.",
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
    type=click.Choice([each.value for each in Ecosystem]),
    help="Write C files for a project of this kind instead of a Python package. Unless -o says otherwise, they go to "
    + ", ".join(f"{each.folder} ({each.value})" for each in Ecosystem)
    + ". Unless --real says otherwise, they are float only, and for cmake float and double.",
)
@click.option(
    "--languages",
    metavar="LIST",
    default="",
    callback=languages_of,
    help="Languages in addition to C and Python, each in its own folder: javascript. The build runs and proves them if "
    "their tools are installed (Node.js for JavaScript).",
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
    for a C project. The exit status is 0 only if every proof holds. A build that fails leaves the earlier output as it
    was. Only files that kinegen wrote are replaced or removed; kinegen-manifest.json lists them with their SHA-256.
    """
    from kinegen.emit.reals import Real
    from kinegen.native.flags import Flags
    from kinegen.results import BuildOptions

    if march and portable:
        raise click.UsageError("--march and --portable exclude each other")
    if package and languages:
        raise click.UsageError("--package writes C alone; build with --languages into another folder")
    ecosystem = Ecosystem(package) if package else None
    usual = ecosystem.reals if ecosystem else tuple(Real)
    options = BuildOptions(
        output=output or Path(ecosystem.folder if ecosystem else "generated"),
        reals=tuple(Real(name) for name in (REALS | INTEGERS)[real]) if real else usual,
        quantities=outputs,
        wrt=wrt,
        integers=real in INTEGERS,
        only_integers=bool(package) and real == "q30",
        package=ecosystem,
        languages=languages,
        force=force,
        compile=not no_compile,
        flags=Flags(march or "native", portable=portable, contraction=not reproducible),
    )
    return _build_all(files, options, as_json=as_json, debug=context.find_root().params["debug"])


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
    from kinegen.robot.load import load

    name = load(file).name
    if name in names:
        raise KinegenError(
            f"the robot is called {name!r}, as that of {names[name]}, whose folder it would take", str(file)
        )
    names[name] = file


def _build(file: Path, options: BuildOptions, *, brief: bool, quiet: bool) -> BuildResult:
    """Build one robot and tell of it as it goes."""
    from kinegen.cli.report import report_lines, stage_line
    from kinegen.unchanged import key_of, recall, remember

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
    key = key_of(file, options)
    result = recall(key, file, options)
    if result is None:
        from kinegen.build import build

        try:
            result = build(file, options, report, begin)
        finally:
            passing.clear()
        remember(key, result)
    else:
        report(result.stages[0])
    if not quiet:
        say("\n".join(report_lines(result, brief=brief)))
    return result


def _document(file: Path, result: BuildResult) -> dict[str, object]:
    from kinegen.cli.record import build_record

    return {"file": str(file), "ok": True, **build_record(result)}
