"""From C text to the compiled extension: one shared library, built in a folder of its own and remembered.

In: C files by name, the declarations for cffi and the flags. Out: the bytes of `_native.abi3.so`, which serves every
CPython from 3.11 on. The C is compiled as it is, in a temporary folder; where the result goes is for others to say.
"""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import cffi
import numpy as np
from cffi.recompiler import make_c_source

from kinegen.errors import CompileError, MissingToolError
from kinegen.naming import EXTENSION
from kinegen.native.cache import Cache
from kinegen.native.compiler import Compiler, find_compiler, processor
from kinegen.native.glue import GLUE, HEADER

_WRAPPER = "kinegen_cffi.c"
_PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"
_SHARED = ("-shared",) if sys.platform != "darwin" else ("-bundle", "-undefined", "dynamic_lookup")


@dataclass(frozen=True, slots=True)
class Flags:
    """How the kernels are compiled.

    Attributes:
        march: Processor to compile for: "native", a name that the compiler knows, or None for the plainest one.
        contraction: Whether a product and a sum may become one operation with one rounding.
        optimisation: Digit after -O.
        extra: Further flags, for the kernels alone.
    """

    march: str | None = "native"
    contraction: bool = True
    optimisation: str = "3"
    extra: tuple[str, ...] = ()

    def arguments(self) -> tuple[str, ...]:
        """The flags as the compiler takes them."""
        option = "-mcpu" if self.march == "native" and processor().machine in ("aarch64", "arm64") else "-march"
        target = (f"{option}={self.march}",) if self.march else ()
        contraction = f"-ffp-contract={'fast' if self.contraction else 'off'}"
        return ("-std=c99", f"-O{self.optimisation}", contraction, *target, *self.extra)


@dataclass(frozen=True, slots=True)
class Extension:
    """A compiled extension.

    Attributes:
        content: The bytes of the shared library.
        cached: Whether it was compiled before.
    """

    content: bytes
    cached: bool


def compile_extension(
    sources: Mapping[str, str], cdef: str, module: str, flags: Flags, cache: Path | None = None
) -> Extension:
    """Compile an extension, or fetch it where the same one was compiled before.

    Args:
        sources: C files by name, among them those of `glue`.
        cdef: Declarations for cffi.
        module: Dotted name of the extension module.
        flags: How to compile the kernels.
        cache: Folder in which results are kept; by default the user's cache folder.

    Returns:
        The extension.

    Raises:
        CompileError: If there is no compiler or no header of Python, or if the compiler refuses a file; the message
            then holds the compiler's words and the folder in which the sources are kept.
    """
    compiler = find_compiler()
    python = sysconfig.get_config_var("SOABI"), cffi.__version__, np.__version__
    place = processor().describe() if flags.march == "native" else processor().machine
    store = Cache(cache)
    key = store.key(sorted(sources.items()), cdef, module, flags, compiler, python, place)
    if (known := store.load(key)) is not None:
        return Extension(known, cached=True)
    _check_headers()
    folder = Path(tempfile.mkdtemp(prefix="kinegen-"))
    try:
        content = _build(folder, sources, cdef, module, flags, compiler)
    except CompileError as error:
        kept = store.keep(key, folder)
        raise CompileError(f"{error.message} (sources kept in {kept})") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    store.save(key, content)
    return Extension(content, cached=False)


def _build(folder: Path, sources: Mapping[str, str], cdef: str, module: str, flags: Flags, compiler: Compiler) -> bytes:
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    common = ("-fPIC", "-fvisibility=hidden", "-w", "-c")
    includes = tuple(f"-I{path}" for path in _includes())
    with ThreadPoolExecutor(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None) as pool:
        # The longest first, so that the last one to end is a short one.
        names = sorted(
            (name for name in sources if name.endswith(".c") and name != GLUE), key=lambda n: -len(sources[n])
        )
        jobs = [pool.submit(compiler.run, folder, (*flags.arguments(), *common, name), name) for name in names]
        jobs.append(pool.submit(compiler.run, folder, ("-O2", *common, *includes, GLUE), GLUE))
        _write_wrapper(folder / _WRAPPER, cdef, module)
        jobs.append(pool.submit(compiler.run, folder, ("-O1", *common, *includes, _WRAPPER), _WRAPPER))
        for job in jobs:
            job.result()
    objects = sorted(path.with_suffix(".o").name for path in folder.glob("*.c"))
    compiler.run(folder, (*_SHARED, "-o", EXTENSION, *objects), "the extension")
    return (folder / EXTENSION).read_bytes()


def _write_wrapper(path: Path, cdef: str, module: str) -> None:
    ffi = cffi.FFI()
    ffi.cdef(cdef)
    make_c_source(
        ffi, module, f'#include "{HEADER}"', str(path)
    )  # what ffi.emit_c_code does, without its line of print


def _includes() -> tuple[str, ...]:
    """Where headers are looked for; those of Python may have been put into the virtual environment."""
    own = Path(sys.prefix) / "include"
    python = (*(sysconfig.get_path(name) for name in ("include", "platinclude")), str(own / _PYTHON), str(own))
    return (*dict.fromkeys(python), np.get_include())


def _check_headers() -> None:
    if not any((Path(folder) / "Python.h").is_file() for folder in _includes()):
        raise MissingToolError(
            f"the headers of Python are missing (no Python.h in {_includes()[0]}): "
            "install them, for example with `apt install python3-dev`, or leave compiling out with --no-compile"
        )
