"""`kinegen eval`: outputs of a robot over files of joint vectors, also larger than memory."""

from __future__ import annotations

import math
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinegen.errors import shown
from kinegen.ui.cli.robot_command import RobotCommand
from kinegen.ui.cli.terminal import ProgressLine, complain, raise_if_pressed, say, warn_of_cache

if TYPE_CHECKING:
    from kinegen.tools.datasets.run import Summary

_MOST = 0.5
"""A larger share of rows outside the joint limits gets a note."""

_SMALL = math.radians(2 * math.pi)
"""Angles in degrees that are all smaller, in radians, look like angles in radians."""

_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30}


def _memory(_context: click.Context, _parameter: click.Parameter, text: str) -> int:
    """Read an amount of memory in bytes, written as 512MB."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([A-Za-z]*)", text.strip())
    if found is None or found[2].upper() not in _UNITS:
        raise click.BadParameter(f"{text!r} is not an amount of memory, such as 512MB or 2GiB")
    return int(float(found[1]) * _UNITS[found[2].upper()])


def _columns(
    _context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> dict[str, tuple[str, ...]]:
    """Return columns by input; those without a name in front are the joint values."""
    found: dict[str, tuple[str, ...]] = {}
    for text in texts:
        name, separator, rest = text.partition("=")
        name, rest = (name, rest) if separator else ("q", text)
        columns = tuple(word.strip() for word in rest.split(","))
        if not all(columns) or name in found:
            raise click.BadParameter(f"{text!r}: expected j1,j2,... or INPUT=c1,c2,... once for each input")
        found[name] = columns
    return found


@click.command("eval", cls=RobotCommand, short_help="Evaluates files of joint vectors, also larger than memory.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.argument("data", metavar="DATA...", nargs=-1, required=True)
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    required=True,
    help="A file (.parquet, .arrow, .npz, .zarr); a name without such an ending is a folder of files.",
)
@click.option("--outputs", metavar="LIST", default="pose", show_default=True, help="As for `kinegen build`.")
@click.option(
    "--columns",
    metavar="LIST",
    multiple=True,
    callback=_columns,
    help="Columns of the joint values, or INPUT=LIST for another input; by default those named after the joints.",
)
@click.option(
    "--angle",
    type=click.Choice(["rad", "deg"]),
    help="Unit of the angles in columns of joint values and their rates.  [default: that of the robot file]",
)
@click.option("--drop", metavar="LIST", default="", help="Columns that are left out of the output; '*' for all.")
@click.option("--flat", is_flag=True, help="One column for each number, instead of columns of vectors.")
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True)
@click.option("--format", type=click.Choice(["parquet", "arrow", "npz", "zarr"]), default="parquet", show_default=True)
@click.option("--compression", type=click.Choice(["none", "snappy", "zstd", "lz4"]), default="none", show_default=True)
@click.option(
    "--part-rows",
    metavar="N",
    type=click.IntRange(min=1),
    default=1 << 21,
    show_default=True,
    help="Rows of each file of a folder, at least; blocks of the input stay whole.",
)
@click.option("--memory", metavar="SIZE", default="512MB", show_default=True, callback=_memory, help="Memory for data.")
@click.option("--threads", type=click.IntRange(0, 1024), default=1, show_default=True, help="Threads of a kernel.")
@click.option("--workers", type=click.IntRange(1, 4096), default=1, show_default=True, help="Processes; needs Dask.")
@click.option("--scheduler", metavar="ADDRESS", default="", help="A scheduler of Dask, such as tcp://10.0.0.1:8786.")
@click.option("--resume", is_flag=True, help="Go on with a run that was interrupted.")
@click.option("--force", is_flag=True, help="Replace the results of another run.")
def eval_command(
    file: Path,
    data: tuple[str, ...],
    output: str,
    outputs: str,
    drop: str,
    angle: str | None,
    **options: Any,
) -> None:
    """Evaluates outputs of a robot over files of joint vectors, a bounded number of rows at a time.

    DATA: files, folders or glob patterns: Parquet, Arrow (Feather), CSV, .npy with one row a joint vector, .npz, Zarr.
    Other columns pass through. Joint values are in the units of the robot file, unless --angle states the unit of their
    angles. Results have angles in radians, as in Python, and lengths in the unit of the robot file. NaN stays NaN, null
    stays null. Output files appear only once complete, so a run can be interrupted and resumed; their bytes do not
    depend on the number of workers.

    \b
        kinegen eval robots/puma560.yaml joints.parquet -o poses.parquet
        kinegen eval robots/ur5.yaml 'log/*.csv' -o results --outputs pose,jacobian --columns j1,j2,j3,j4,j5,j6
        kinegen eval robots/ur5.yaml poses.parquet -o solved --outputs inverse --columns base_T_tool=pose --workers 2
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.tools.datasets.run import evaluate

    warn_of_cache()
    started, line = time.perf_counter(), ProgressLine()

    def tell(done: int, everything: int) -> None:
        raise_if_pressed()
        line.show(_progress(done, everything, time.perf_counter() - started))

    try:
        summary = evaluate(
            file,
            list(data),
            output,
            outputs,
            drop=[word for word in drop.split(",") if word],
            angle=angle or "",
            **options,
            tell=tell,
        )
    except KeyboardInterrupt:
        line.clear()
        if _has_begun(Path(output)):
            complain("stopped; the files that are complete stay, and --resume goes on with the others")
        raise
    finally:
        line.clear()
    _report(summary, time.perf_counter() - started, is_stated=angle is not None)


def _has_begun(output: Path) -> bool:
    """Return whether there is something in the output that another run can go on with."""
    from kinegen.tools.datasets.plan import NAME

    return (output / NAME).is_file()


def _progress(done: int, everything: int, seconds: float) -> str:
    """Return rows that are done, the rate and the time left."""
    rate = done / seconds if seconds > 0 else 0.0
    total = f" of {everything:,}" if everything >= 0 else ""
    left = f", {(everything - done) / rate:.0f} s left" if everything >= 0 and rate > 0 else ""
    return f"{done:,}{total} rows, {rate:,.0f} a second{left}"


def _report(summary: Summary, seconds: float, *, is_stated: bool) -> None:
    if summary.backend != "c":
        complain("warning: there is no C compiler, so NumPy evaluates, which is many times slower")
    # What was written, then what looks wrong about the joint values.
    files = f"{summary.written} file{'s' if summary.written != 1 else ''}"
    kept = f"; {summary.kept} were complete" if summary.kept else ""
    kept += f"; {summary.damaged} were damaged and were made again" if summary.damaged else ""
    say(f"wrote {shown(summary.output)}: {summary.rows:,} rows in {files}, {seconds:.1f} s{kept}")
    if summary.angle:
        say(f"joint values taken in {summary.angle}, {'as asked' if is_stated else 'the unit of the file'}")
    elif summary.titled:
        say(f"joint values taken in {summary.titled}, as their titles state")
    if summary.angle == "deg" and not is_stated and 0 < summary.largest < _SMALL:
        complain(
            f"note: no joint of the first rows turns by more than {math.degrees(summary.largest):.3g} deg; if these "
            "are radians, add --angle rad"
        )
    if summary.outside > _MOST:
        other = {"deg": "rad", "rad": "deg"}.get(summary.angle, "")
        hint = f"; if their angles are in {other}, add --angle {other}" if other else ""
        complain(f"note: {summary.outside:.0%} of the first rows are outside the joint limits{hint}")
