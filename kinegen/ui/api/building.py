"""Builds of a robot: the folder as the command line makes it, and the module of verified kernels from the cache."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from kinegen.errors import KinegenError
from kinegen.ui.api.module_cache import call_name, decisive_parts, made_module, module_of, remember
from kinegen.ui.api.options import Words, build_options, is_text

if TYPE_CHECKING:
    from kinegen.driver.results import BuildOptions, BuildResult, Stage
    from kinegen.model.robot import Robot
    from kinegen.ui.api.loading import Source


def build(
    robot: Source,
    output: str | os.PathLike[str] | None = None,
    *,
    outputs: Words | None = None,
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
        output: Folder in which each robot gets a folder of its name; `build` if left out, or what is usual for
            `package`.
        outputs: What is computed, such as `"pose,frames,twist"` or a list of these words. If left out, the pose, the
            Jacobian, and the inverse where there is one in closed form; with integer kernels pose, frames and position.
        real: Number types: `double`, `float`, `both`, `q30`, `float,q30` or `all`; by default `both`, and for packages
            what is usual there.
        wrt: Parameters and entries of the table that become arguments, and by which `parameter_jacobian` is taken.
        package: `cmake`, `platformio`, `arduino` or `esp-idf`, for C files in a project of that kind; or `linuxcnc`,
            `ros2_control`, `moveit2`, `grblhal` or `klipper`, for an arm in that controller.
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
        (['fk', 'jacobian', 'inverse'], True)
    """
    from kinegen.ui.api import loading, robot_methods

    # A file is left to the build; anything else is read now.
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
    source = Path(robot) if is_file else robot_methods.model_of(loading.load(robot))  # type: ignore[arg-type]
    return built(source, options, report or (lambda _stage: None))


def built(
    source: Path | Robot,
    options: BuildOptions,
    report: Callable[[Stage], None],
    begin: Callable[[str], object] = str,
) -> BuildResult:
    """Make a build, or repeat what an earlier one reported if this one would change nothing; a robot is always built.

    Calls `report` after each stage, and `begin` with a few words before.

    Raises:
        KinegenError: If the build fails; the output folder is then as it was.
    """
    from kinegen.driver.results import key_of, recall, remember

    key = key_of(source, options) if isinstance(source, Path) else ""
    result = recall(key, source, options) if isinstance(source, Path) else None
    if result is not None:
        report(result.stages[0])
        return result
    from kinegen.driver.pipeline import build as make

    result = make(source, options, report, begin)
    remember(key, result)
    return result


def compile(  # noqa: A001 - what it is called everywhere else, too
    robot: Source,
    outputs: Words | None = None,
    *,
    wrt: Words = (),
    real: str = "both",
    march: str | None = None,
    reproducible: bool = False,
    compile: bool = True,  # noqa: A002 - as in `build`
) -> ModuleType:
    """The module that `kinegen build` writes, compiled and proven, from the user's cache.

    The first call takes as long as a build; later ones, also of other processes, find the module by a digest of the
    robot, the options, kinegen with its libraries, the compiler and the processor. Nothing is written outside the
    cache. On a terminal and in a notebook a line on stderr says that a module is compiled. The kernels can be pickled
    for other processes of the same user.

    Args:
        robot: What `load` takes: a path, a text, a mapping or a robot.
        outputs: What is computed, such as `"pose,frames,twist"` or a list of these words; the function of `pose` is
            called `fk`. If left out, the pose, the Jacobian, and the inverse where there is one in closed form.
        wrt: Parameters and entries of the table that become arguments, and by which `parameter_jacobian` is taken.
        real: Number types: `double`, `float` or `both`.
        march: Processor to compile for, as the compiler names it; this machine's by default.
        reproducible: Whether results have the same bits on every machine, which is slower.
        compile: Whether to compile; otherwise the module computes with NumPy.

    Returns:
        The module. Its kernels take joint vectors of shape (..., dof), in radians and the robot's length unit, and give
        arrays with the same leading axes: `module.fk(q)` of shape (..., 4, 4), `module.jacobian(q)` of shape
        (..., 6, dof) and so on, relative to the base frame. `help(module)` lists them.

    Raises:
        KinegenError: If the robot is bad, an option is wrong, the compiler refuses or the proof fails.

    Example:
        >>> import kinegen, numpy as np
        >>> arm = kinegen.compile("robots/planar_3r.yaml", "pose,jacobian", real="double")
        >>> arm.fk(np.zeros(3)).shape, arm.jacobian(np.zeros((100, 3))).shape
        ((4, 4), (100, 6, 3))
        >>> arm is kinegen.compile("robots/planar_3r.yaml", ["jacobian", "pose"], real="double")
        True
    """
    if real not in ("double", "float", "both"):
        raise KinegenError(f"a module has the number types double, float or both, not {real!r}")
    # A call that was made before leads to its module without the robot being read.
    outputs, wrt = _words(outputs), _words(wrt)
    decisive = decisive_parts(compile=compile)
    words = (outputs, wrt, real, march, reproducible, compile)
    call = call_name(robot, (words, decisive)) if decisive else ""
    if (known := module_of(call)) is not None:
        return known
    from kinegen.ui.api.loading import load
    from kinegen.ui.api.options import build_options
    from kinegen.ui.api.robot_methods import model_of

    options = build_options(
        Path(), outputs=outputs, real=real, wrt=wrt, march=march, reproducible=reproducible, compile=compile
    )
    model = model_of(load(robot))
    module, key = made_module(model, options, decisive)
    if call and call == call_name(robot, (words, decisive)):  # the file may have been edited since
        remember(call, key, model.name)
    return module


def _words(words: Words | None) -> Any:
    """Return words that can be gone through twice; what is none is left for `build_options` to refuse."""
    return words if isinstance(words, str) or not isinstance(words, Iterable) else tuple(words)
