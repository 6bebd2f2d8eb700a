"""The emitted C apart from Python: what a firmware engineer compiles, compiled and called here.

In: the files of a package. Out: a library for each number type, with the functions that the kernels are made of, the
macros and the defaults of the headers, and the self-test with kernels that can be spoilt on demand. Nothing in it is
optimised, so that it takes a fraction of a second.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

from kinegen.naming import c_file, function, macro, prefix, selftest_file
from kinegen.native.compiler import Compiler
from kinegen.robot.model import Robot

TYPES: Mapping[str, Any] = {"double": ctypes.c_double, "float": ctypes.c_float, "q30": ctypes.c_int32}
NAMES = {"double": "double", "float": "float", "q30": "int32_t"}
"""Number types as C calls them."""

_BATCHES = re.compile(r"^void (\w+_batch)\(", re.MULTILINE)

_FLAGS = ("-std=c99", "-O0", "-w", "-fPIC", "-shared", "-ffp-contract=off", "-U_FORTIFY_SOURCE")

ROUTINES = ("sincos", "sqrt", "atan2")
"""What kernels are made of besides arithmetic."""


@dataclass(frozen=True, slots=True)
class Spoilable:
    """A kernel that the self-test calls.

    Attributes:
        function: Its name after the robot's prefix.
        inputs: How many arrays it is given that have numbers.
        results: How many numbers each of its results has, the last rows of matrices counted.
        is_choice: Whether it chooses a solution, and returns whether there is one; this is its last result.
    """

    function: str
    inputs: int
    results: tuple[int, ...]
    is_choice: bool = False


@dataclass(frozen=True, slots=True)
class Probe:
    """A compiled library.

    Attributes:
        real: Number type.
        library: The opened library.
        routines: The functions that can be called, such as `kinegen_batch_sqrt`.
    """

    real: str
    library: ctypes.CDLL
    routines: tuple[str, ...]


def compile_probe(
    robot: Robot,
    folder: Path,
    real: str,
    kernels: Sequence[Spoilable],
    macros: Sequence[str],
    compiler: Compiler,
    flags: Sequence[str] = (),
    stop: Event | None = None,
) -> Probe:
    """Compile the files of one number type.

    Args:
        robot: The robot.
        folder: Where the emitted files lie; the library is put beside them.
        real: `double`, `float` or `q30`.
        kernels: The kernels of the self-test.
        macros: What the header must define, after the robot's prefix.
        compiler: The compiler.
        flags: Further flags for all of them.
        stop: Once it is set, the compiler is ended.

    Raises:
        CompileError: If it refuses a file, or the header lacks a macro.
    """
    stem, routines, sources = prefix(robot.name, real), [], [f"{prefix(robot.name, real)}_probe.c"]
    for form in ("scalar", "batch") if real != "q30" else ():
        source = c_file(robot.name, "c", real, batch=form == "batch")
        text = (folder / source).read_text(encoding="utf-8")
        found = [name for name in ROUTINES if f"void {stem}_{name}(" in text or f" {stem}_{name}(const" in text]
        routines += [f"kinegen_{form}_{name}" for name in found]
        if form == "batch" or found:
            wrapped = "".join(_ROUTINES[name].format(form=form, stem=stem, real=real) for name in found)
            path = folder / f"{stem}_{form}_routines.c"
            # Nothing here calls the batch kernels: as inline functions they are read and left out.
            unused = "".join(f"static inline void {name}();\n" for name in _BATCHES.findall(text) if form == "batch")
            path.write_text(f'{unused}#include "{source}"\n{wrapped}', encoding="utf-8")
            sources.append(path.name)
    if "kinegen_scalar" not in " ".join(routines):
        sources.append(c_file(robot.name, "c", real))
    (folder / sources[0]).write_text(_probe(robot, real, kernels, macros), encoding="utf-8")
    renames = [f"-D{function(robot.name, each.function, real)}=kinegen_spoilt_{each.function}" for each in kernels]
    test = (*flags, "-DKINEGEN_SELFTEST_MAIN", "-Dmain=kinegen_selftest", "-Dprintf=kinegen_printf", *renames)
    works = [(selftest_file(robot.name, real), test), *((source, tuple(flags)) for source in sources)]
    objects = [_compiled(compiler, folder, source, more, stop) for source, more in works]
    library = folder / f"{stem}_probe.so"
    compiler.run(folder, (*_FLAGS, *objects, "-o", library.name, "-lm"), "the self-test", stop)
    return Probe(real, ctypes.CDLL(str(library)), tuple(routines))


def _compiled(compiler: Compiler, folder: Path, source: str, more: tuple[str, ...], stop: Event | None) -> str:
    target = f"{source.removesuffix('.c')}_probe.o"
    flags = tuple(flag for flag in _FLAGS if flag != "-shared")
    compiler.run(folder, (*flags, *more, "-c", source, "-o", target), source, stop)
    return target


def _probe(robot: Robot, real: str, kernels: Sequence[Spoilable], macros: Sequence[str]) -> str:
    """The macros as numbers, and around each kernel one that can spoil its results."""
    header, kind = c_file(robot.name, "h", real), NAMES[real]
    values = ", ".join(f"(long)({macro(robot.name, name)})" for name in macros)
    lines = [
        f'#include "{header}"',
        f"const long kinegen_macros[] = {{{values or 0}}};",
        # Which kernel, result and number is spoilt, in which of its calls (or all), and by how much.
        "int kinegen_kernel = -1, kinegen_result = -1, kinegen_number = -1, kinegen_call = -1;",
        f"{kind} kinegen_delta;",
        f"int kinegen_calls[{max(1, len(kernels))}];",
        "int kinegen_printf(const char *format, ...) { (void)format; return 0; }",
    ]
    for place, each in enumerate(kernels):
        lines += _spoilt(robot, real, place, each)
    return "\n".join([*lines, ""])


def _spoilt(robot: Robot, real: str, place: int, each: Spoilable) -> list[str]:
    kind = NAMES[real]
    names = [f"i{index}" for index in range(each.inputs)]
    names += ["params"] * bool(robot.runtime_parameters)
    sizes = {f"r{index}": size for index, size in enumerate(each.results) if size}
    arguments = ", ".join([*(f"const void *{name}" for name in names), *(f"{kind} *{name}" for name in sizes)])
    call = function(robot.name, each.function, real)
    answer, kept = ("int", "const int exists = ") if each.is_choice else ("void", "")
    told = f"exists ^ (is_spoilt && kinegen_result == {len(sizes)})" if each.is_choice else ""
    body = [
        f"    const int is_meant = kinegen_call < 0 || kinegen_call == kinegen_calls[{place}];",
        f"    const int is_spoilt = kinegen_kernel == {place} && is_meant;",
        *(
            f"    if (is_spoilt && kinegen_result == {name[1:]}) for (int i = 0; i < {size}; i++) "
            f"if (kinegen_number < 0 || kinegen_number == i) "
            # A NaN that has to be one becomes a number.
            f"{name}[i] = ({name}[i] == {name}[i]) ? {name}[i] + kinegen_delta : 0;"
            for name, size in sizes.items()
        ),
        f"    kinegen_calls[{place}]++;",
        f"    return {told};",
    ]
    # The header declares the kernel with arrays; what is passed on are the same pointers.
    return [
        f"{answer} kinegen_spoilt_{each.function}({arguments or 'void'})",
        "{",
        f"    {kept}(({answer} (*)({arguments or 'void'})){call})({', '.join([*names, *sizes])});",
        *body,
        "}",
    ]


_ROUTINES = {
    "sincos": "void kinegen_{form}_sincos(long n, const {real} *x, {real} *s, {real} *c)"
    "\n{{ for (long i = 0; i < n; i++) {stem}_sincos(x[i], &s[i], &c[i]); }}\n",
    "sqrt": "void kinegen_{form}_sqrt(long n, const {real} *x, {real} *y)"
    "\n{{ for (long i = 0; i < n; i++) y[i] = {stem}_sqrt(x[i]); }}\n",
    "atan2": "void kinegen_{form}_atan2(long n, const {real} *y, const {real} *x, {real} *a)"
    "\n{{ for (long i = 0; i < n; i++) a[i] = {stem}_atan2(y[i], x[i]); }}\n",
}
