"""From C text to the compiled extension: one shared library, built in a folder of its own and remembered.

In: C files by name, their compilations, the declarations for cffi. Out: the bytes of `_native.abi3.so`, which serves
every CPython from 3.10 on. The C is compiled as it is, in a temporary folder; where the result goes is for others to
say.
"""

from __future__ import annotations

import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from threading import Event

import cffi
import numpy as np
from cffi.recompiler import make_c_source

from kinegen.errors import CompileError, MissingToolError
from kinegen.runtime.cache import Cache
from kinegen.runtime.cffi_interface import CALLS, GLUE, HEADER
from kinegen.runtime.compiler import Compiler, find_compiler
from kinegen.runtime.dispatch import Unit
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import sealed_library
from kinegen.support.naming import EXTENSION
from kinegen.support.system import builds_extensions, cores

_WRAPPER = "kinegen_cffi.c"

# The module is what cffi makes, with the functions of calls.c.
_PREAMBLE = f"""#include "{HEADER}"
PyObject *kinegen_with_calls(PyObject *module);
static PyObject *kinegen_cffi_module(void);
PyMODINIT_FUNC PyInit__native(void) {{ return kinegen_with_calls(kinegen_cffi_module()); }}
#define PyInit__native kinegen_cffi_module"""

_PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"
_LONG = 3000
"""Lines of a function from which on compilers hurry: about 80 rows of a chain, or large derivatives of 20 joints."""

_OBJECT = ("-fPIC", "-fvisibility=hidden", "-w", "-c")
_SHARED = ("-shared",) if sys.platform != "darwin" else ("-bundle", "-undefined", "dynamic_lookup")


@dataclass(frozen=True, slots=True)
class Extension:
    """A compiled extension.

    Attributes:
        content: The bytes of the shared library.
        cached: Whether it was compiled before.
        key: Its name in the cache; empty for one that is not kept.
        cache: Folder in which results are kept; None for the user's cache folder.
    """

    content: bytes
    cached: bool
    key: str = ""
    cache: Path | None = None

    def keep(self) -> None:
        """Remember it for other builds. That is for the caller to do, once it was loaded and proven."""
        if not self.cached:
            Cache(self.cache).save(self.key, self.content)

    def forget(self) -> None:
        """See that no other build gets it, since it does not load or failed its proof."""
        Cache(self.cache).forget(self.key)


def compile_extension(
    sources: Mapping[str, str],
    units: Sequence[Unit],
    cdef: str,
    module: str,
    *,
    place: str = "",
    cache: Path | None = None,
) -> Extension:
    """Compile an extension, or fetch it where the same one was compiled before and kept.

    Args:
        sources: C files by name, among them those of `cffi_interface`.
        units: How to compile them, those of `cffi_interface` apart.
        cdef: Declarations for cffi.
        module: Dotted name of the extension module.
        place: Where it is compiled, as far as that matters to the units.
        cache: Folder in which results are kept; by default the user's cache folder.

    Returns:
        The extension.

    Raises:
        MissingToolError: If there is no compiler or no header of Python, or the system is not one for extensions.
        CompileError: If the compiler refuses a file; the message then holds the compiler's words and the folder in
            which the sources are kept.
    """
    if not builds_extensions():
        raise MissingToolError("extensions are not compiled on this system")
    compiler = find_compiler()
    python = sysconfig.get_config_var("SOABI"), cffi.__version__, np.__version__
    words = compiler.scheduling, compiler.haste, _LONG, _OBJECT, _SHARED
    store = Cache(cache)
    key = store.key(sorted(sources.items()), tuple(units), cdef, module, compiler, words, python, place)
    if (known := store.load(key)) is not None:
        return Extension(known, cached=True, key=key, cache=cache)
    _check_headers()
    folder = Path(tempfile.mkdtemp(prefix="kinegen-"))
    try:
        content = _build(folder, sources, units, cdef, module, compiler)
    except CompileError as error:
        kept = store.keep(key, folder)
        raise CompileError(f"{error.message} (sources kept in {kept})") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return Extension(content, cached=False, key=key, cache=cache)


def _build(
    folder: Path, sources: Mapping[str, str], units: Sequence[Unit], cdef: str, module: str, compiler: Compiler
) -> bytes:
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    own = _own_units()
    stop = Event()

    def start(unit: Unit) -> Future[None]:
        output = ("-o", f"{unit.name}.o", unit.source)
        order = _order(compiler, unit.source, sources.get(unit.source, ""))
        return pool.submit(compiler.run, folder, (*unit.arguments, *order, *_OBJECT, *output), unit.source, stop)

    with ThreadPoolExecutor(cores()) as pool:
        jobs: list[Future[None]] = []
        try:
            # The longest first, so that the last one to end is a short one.
            jobs.extend(map(start, sorted((*units, *own[:-1]), key=lambda unit: -len(sources[unit.source]))))
            _write_wrapper(folder / _WRAPPER, cdef, module)
            jobs.append(start(own[-1]))
            for job in jobs:
                job.result()
        except BaseException:
            # Ctrl-C, or one file refused: what runs is ended, what waits is not begun.
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    objects = sorted(f"{unit.name}.o" for unit in (*units, *own))
    compiler.run(folder, (*_SHARED, "-o", EXTENSION, *objects), "the extension")
    if not (folder / EXTENSION).is_file():
        raise CompileError(
            f"'{compiler.command[0]}' reported success and wrote no {EXTENSION}; CC must name a C compiler"
        )
    return sealed_library((folder / EXTENSION).read_bytes())


def _order(compiler: Compiler, name: str, text: str) -> tuple[str, ...]:
    """How a compiler treats a file, by the length of the longest function; loops of batch files in a better order."""
    longest = max(function.count("\n") for function in text.split("\n}\n"))
    return compiler.haste if longest > _LONG else compiler.scheduling if name.endswith("_batch.c") else ()


def _own_units() -> tuple[Unit, ...]:
    """How the C between the kernels and Python is compiled; what cffi makes is the last one."""
    includes = tuple(f"-I{path}" for path in _includes())
    flags = {CALLS: ("-O2", *includes), GLUE: ("-O2",), _WRAPPER: ("-O1", *includes)}
    return tuple(Unit(name, Path(name).stem, words) for name, words in flags.items())


def _write_wrapper(path: Path, cdef: str, module: str) -> None:
    ffi = cffi.FFI()
    ffi.cdef(cdef)
    make_c_source(ffi, module, _PREAMBLE, str(path))  # what ffi.emit_c_code does, without its line of print


def _includes() -> tuple[str, ...]:
    """Where headers are looked for; those of Python may have been put into the virtual environment."""
    own = Path(sys.prefix) / "include"
    python = (*(sysconfig.get_path(name) for name in ("include", "platinclude")), str(own / _PYTHON), str(own))
    return (*dict.fromkeys(python), np.get_include())


def _check_headers() -> None:
    if not any((Path(folder) / "Python.h").is_file() for folder in _includes()):
        raise MissingToolError(
            f"the headers of Python are missing (no Python.h in {_includes()[0]}): "
            "install them, for example with `apt install python3-dev`, or build without it by --no-compile"
        )
    if not (Path(np.get_include()) / "numpy" / "ndarraytypes.h").is_file():
        raise MissingToolError(
            f"the headers of NumPy are missing (no numpy/ndarraytypes.h in {np.get_include()}): install them, for "
            "example with `apt install python3-numpy-dev`, or build without it by --no-compile"
        )
