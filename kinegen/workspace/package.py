"""The kernels of a robot, compiled for this machine and imported from a folder that nobody else sees.

They are the ones that a build emits, and proved there.
"""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from types import ModuleType

from kinegen.emit.c.batch import emit_batch
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.files import stamp_of
from kinegen.emit.kernels import Kernels
from kinegen.emit.python.formula import emit_formula
from kinegen.emit.python.package import emit_package
from kinegen.emit.reals import Real
from kinegen.errors import MissingToolError
from kinegen.naming import EXTENSION
from kinegen.native.package import build_extension, interface_of, load_package

_REALS = (Real.DOUBLE,)


def make_package(kernels: Kernels) -> ModuleType:
    """The package of a robot in double precision.

    Args:
        kernels: The robot and its programs.

    Returns:
        The module; NumPy evaluates where there is no compiler.

    Raises:
        CompileError: If there is a compiler, and it refuses the kernels.
    """
    sources: dict[str, str] = {}
    for real in _REALS:
        sources |= emit_kernel(kernels, real) | emit_batch(kernels, real)
    files = emit_formula(kernels) | emit_package(kernels, _REALS, stamp_of(sources))
    contents = {name: text.encode() for name, text in files.items()}
    extension = None
    with contextlib.suppress(MissingToolError):
        extension = build_extension(interface_of(kernels, _REALS), sources)
        contents[EXTENSION] = extension.content
    with tempfile.TemporaryDirectory(prefix="kinegen-") as staging:
        folder = Path(staging) / kernels.robot.name
        folder.mkdir()
        for name, content in contents.items():
            (folder / name).write_bytes(content)
        package = load_package(folder)
    if extension is not None:
        # What does not load is compiled again the next time.
        (extension.keep if package.backend == "c" else extension.forget)()
    return package
