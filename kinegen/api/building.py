"""A build as the command line makes it: repeated from what is kept where nothing has changed, else made."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.api.loading import Source, load
from kinegen.api.options import build_options
from kinegen.api.robot import model_of
from kinegen.api.words import USUAL_OUTPUTS, Words, is_text

if TYPE_CHECKING:
    from kinegen.results import BuildOptions, BuildResult, Stage
    from kinegen.robot.model import Robot


def build(
    robot: Source,
    output: str | os.PathLike[str] | None = None,
    *,
    outputs: Words = USUAL_OUTPUTS,
    real: str | None = None,
    wrt: Words = (),
    package: str | None = None,
    languages: Words = (),
    compile: bool = True,  # noqa: A002 - as the option of the command
    march: str | None = None,
    portable: bool = False,
    reproducible: bool = False,
    force: bool = False,
    report: Callable[[Stage], None] | None = None,
) -> BuildResult:
    """Write C and a Python module for a robot, compile them, and prove every kernel: the command `kinegen build`.

    The folder `output`/NAME gets the files; it is a Python package, or with `package` a library for a C project. A
    build that fails leaves the earlier files as they were. Only files that kinegen wrote are replaced or removed.

    Args:
        robot: What `load` takes: a path, a text, a mapping or a robot.
        output: Folder in which each robot gets a folder of its name; `generated` if left out, or what is usual for
            `package`.
        outputs: What is computed, such as `"pose,jacobian,inverse"` or a list of these words.
        real: Number types: `double`, `float`, `both`, `q30`, `float,q30` or `all`; by default `both`, and for packages
            what is usual there.
        wrt: Parameters and entries of the table that become arguments, and by which `parameter_jacobian` is taken.
        package: `cmake`, `platformio`, `arduino` or `esp-idf`, for C files in a project of that kind; or `linuxcnc`,
            `ros2_control`, `grblhal` or `klipper`, for an arm in that controller.
        languages: Languages in addition to C and Python, each in its own folder.
        compile: Whether to compile; otherwise the module computes with NumPy.
        march: Processor to compile for, as the compiler names it; this machine's by default.
        portable: Whether to compile for every processor of this family.
        reproducible: Whether results have the same bits on every machine, which is slower.
        force: Whether to replace files that kinegen did not write or that were edited.
        report: Called after each stage with its record.

    Returns:
        What was done: `folder`, `written`, `proof`, `counts`, `stages`, `notes`. The proof holds.

    Raises:
        KinegenError: If the robot is bad, an option is wrong, the compiler refuses, the proof fails or the folder
            cannot be written.

    Example:
        >>> import kinegen, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     result = kinegen.build("robots/planar_3r.yaml", folder, real="double", compile=False)
        ...     result.folder.name, (result.folder / "planar_3r.c").exists()
        ('planar_3r', True)
        >>> [quantity.function for quantity in result.counts], len(result.proof.comparisons) > 0
        (['fk', 'frames', 'position'], True)
    """
    options = build_options(
        output,
        outputs=outputs,
        real=real,
        wrt=wrt,
        package=package,
        languages=languages,
        compile=compile,
        march=march,
        portable=portable,
        reproducible=reproducible,
        force=force,
    )
    is_file = isinstance(robot, os.PathLike) or (isinstance(robot, str) and not is_text(robot))
    source = Path(robot) if is_file else model_of(load(robot))  # type: ignore[arg-type]
    return built(source, options, report or _say_nothing)


def _say_nothing(_stage: Stage) -> None:
    """What is done with the report of a stage where nobody asked for it."""


def built(
    source: Path | Robot,
    options: BuildOptions,
    report: Callable[[Stage], None],
    begin: Callable[[str], object] = str,
) -> BuildResult:
    """Make a build, or repeat what an earlier one reported if this one would change nothing.

    Args:
        source: The robot file, or a robot; builds of the latter are always made.
        options: What to make.
        report: Called after each stage.
        begin: Called with a few words before each stage.

    Raises:
        KinegenError: If the build fails; the output folder is then as it was.
    """
    from kinegen.unchanged import key_of, recall, remember

    key = key_of(source, options) if isinstance(source, Path) else ""
    result = recall(key, source, options) if isinstance(source, Path) else None
    if result is not None:
        report(result.stages[0])
        return result
    from kinegen.pipeline import build as make

    result = make(source, options, report, begin)
    remember(key, result)
    return result
