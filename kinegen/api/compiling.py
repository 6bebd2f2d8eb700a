"""A robot as a module of compiled, proven kernels, without a folder to look after."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from kinegen.api.asked import call_name, module_of, remember
from kinegen.api.kept import kept_module
from kinegen.api.words import USUAL_OUTPUTS, Words
from kinegen.errors import KinegenError
from kinegen.native.cache import Cache
from kinegen.native.compiler import find_compiler
from kinegen.native.identity import identity

if TYPE_CHECKING:
    from kinegen.api.loading import Source
    from kinegen.results import BuildOptions


def compile(  # noqa: A001 - what it is called everywhere else, too
    robot: Source,
    outputs: Words = USUAL_OUTPUTS,
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
    cache. The kernels can be pickled for other processes of the same user.

    Args:
        robot: What `load` takes: a path, a text, a mapping or a robot.
        outputs: What is computed, such as `"pose,jacobian,inverse"` or a list of these words; `pose` becomes `fk`.
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
    outputs, wrt = _words(outputs), _words(wrt)
    decisive = _decisive(compile=compile)
    words = (outputs, wrt, real, march, reproducible, compile)
    call = call_name(robot, (words, decisive)) if decisive else ""
    if (known := module_of(call)) is not None:
        return known
    from kinegen.api.options import build_options

    options = build_options(
        Path(), outputs=outputs, real=real, wrt=wrt, march=march, reproducible=reproducible, compile=compile
    )
    module, key, name = _module(robot, options, decisive)
    if call and call == call_name(robot, (words, decisive)):  # the file may have been edited since
        remember(call, key, name)
    return module


def _module(robot: Source, options: BuildOptions, decisive: tuple[object, ...]) -> tuple[ModuleType, str, str]:
    """The module of a robot that is read, found or made; its key, empty if it is not kept, and the robot's name."""
    from kinegen.api.loading import load
    from kinegen.api.robot import model_of

    model = model_of(load(robot))

    def make(work: Path) -> Path:
        from kinegen.pipeline import build

        result = build(model, replace(options, output=work), lambda _stage: None)
        if options.compile and result.backend != "c":
            warnings.warn(f"{model.name}: {'; '.join(result.notes[:1])}", RuntimeWarning, stacklevel=2)
        return result.folder

    key = Cache().key("module", decisive, model, options) if decisive else ""
    return kept_module(key, model.name, make), key, model.name


def _words(words: Words) -> Words:
    """Words that can be gone through twice; what is none is left for `build_options` to refuse."""
    return words if isinstance(words, str) or not isinstance(words, Iterable) else tuple(words)


def _decisive(*, compile: bool) -> tuple[object, ...]:  # noqa: A002 - as above
    """What decides a module besides the robot and the options; nothing where it cannot be found out."""
    machine = identity()
    if machine is None:
        return ()
    try:
        return machine, find_compiler() if compile else None
    except KinegenError:
        return machine, None
