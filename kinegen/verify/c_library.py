"""The emitted C apart from Python, compiled and called here; its sines, roots and arc tangents.

Nothing in it is optimised, so that it takes a fraction of a second.

Poses say little of them: a sine that is fifty times worse than promised moves a tip by less than is accepted of a whole
arm.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from threading import Event
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.errors import ProofError
from kinegen.model.robot import Robot
from kinegen.runtime.compiler import Compiler
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, function, macro, prefix, selftest_file
from kinegen.verify.samples import LARGEST_ANGLE, SEED

TYPES: Mapping[str, Any] = {"double": ctypes.c_double, "float": ctypes.c_float, "q30": ctypes.c_int32}
NAMES = {"double": "double", "float": "float", "q30": "int32_t"}
"""Number types as C calls them."""

_BATCHES = re.compile(r"^void (\w+_batch)\(", re.MULTILINE)

_FLAGS = ("-std=c99", "-O0", "-w", "-fPIC", "-shared", "-ffp-contract=off", "-U_FORTIFY_SOURCE")

ROUTINES = ("sincos", "sqrt", "atan2")
"""What kernels are made of besides arithmetic."""


@dataclass(frozen=True, slots=True)
class Spoilable:
    """A kernel that the self-test calls."""

    function: str  # Its name after the robot's prefix
    inputs: int  # How many arrays it is given that have numbers
    results: tuple[int, ...]  # How many numbers each of its results has, the last rows of matrices counted
    is_choice: bool = False  # Whether it chooses a solution, and returns whether there is one; this is its last result


@dataclass(frozen=True, slots=True)
class Probe:
    """A compiled library."""

    real: str
    library: ctypes.CDLL
    routines: tuple[str, ...]  # The functions that can be called, such as `kinegen_batch_sqrt`


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

    `folder`: where the emitted files lie; the library is put beside them; `macros`: what the header must define, after
    the robot's prefix; `stop`: once it is set, the compiler is ended. Raises `CompileError` if it refuses a file, or
    the header lacks a macro.
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
    """Returns the macros as numbers, and around each kernel one that can spoil its results."""
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


Numbers = NDArray[Any]

SINE_ULPS = 0.85
"""What is promised of double sines and cosines, in units in the last place."""

SINE_ERROR = 5.4e-8
"""What is promised of those of floats."""

ANGLE_ULPS = 1.6
"""What is promised of double arc tangents, in units in the last place."""

ANGLE_ERROR = 1.7e-7
"""What is promised of those of floats, in radians."""

SAMPLES = 600
BITS = 90
_TYPES: Mapping[str, Any] = {"double": np.float64, "float": np.float32}


def require_routines(robot: Robot, probe: Probe) -> None:
    """Compare the functions of a number type with what is promised.

    Raises `ProofError` naming the function and the argument.
    """
    for name in probe.routines:
        form, routine = name.removeprefix("kinegen_").split("_")
        check = {"sincos": _sincos, "sqrt": _sqrt, "atan2": _atan2}[routine]
        wrong = check(probe, name)
        if wrong is not None:
            raise ProofError(
                f"{robot.name}: {routine} of the {probe.real} {form} kernels is off by more than the header states at "
                f"{', '.join(f'{float(number):.9g}' for number in wrong)}; nothing was written"
            )


def _call(probe: Probe, name: str, arguments: tuple[Numbers, ...], results: int) -> list[Numbers]:
    found = [np.empty_like(arguments[0]) for _ in range(results)]
    pointer = ctypes.POINTER(TYPES[probe.real])
    arrays = [array.ctypes.data_as(pointer) for array in (*arguments, *found)]
    probe.library[name](ctypes.c_long(len(arguments[0])), *arrays)
    return found


def _first(wrong: Numbers, *arguments: Numbers) -> tuple[Any, ...] | None:
    return tuple(array[np.argmax(wrong)] for array in arguments) if wrong.any() else None


def _sincos(probe: Probe, name: str) -> tuple[Any, ...] | None:
    real = _TYPES[probe.real]
    x, limit = _angles(probe.real), real(LARGEST_ANGLE[probe.real])
    sine, cosine = _call(probe, name, (x,), 2)
    wrong = np.zeros(len(x), bool)
    for found, (high, low) in zip((sine, cosine), _exact_pair(probe.real), strict=True):
        error = np.abs((found.astype(np.float64) - high) - low)
        wrong |= ~(error <= (SINE_ULPS * np.spacing(np.abs(high)) if probe.real == "double" else SINE_ERROR))
    far = np.array([np.nextafter(limit, real(np.inf)), limit * 2, 1e30, np.inf, np.nan], real)
    far = np.concatenate([far, -far])
    spoilt = _call(probe, name, (far,), 2)
    return _first(wrong, x) or _first(~(np.isnan(spoilt[0]) & np.isnan(spoilt[1])), far)


@cache
def _angles(real: str) -> Numbers:
    """Angles of every size, some of them beside multiples of a quarter turn, and both ends."""
    generator, kind, limit = np.random.default_rng(SEED), _TYPES[real], LARGEST_ANGLE[real]
    quarters = generator.integers(-int(limit / (np.pi / 4)), int(limit / (np.pi / 4)), SAMPLES // 4) * (np.pi / 4)
    parts = (
        generator.uniform(-np.pi / 4, np.pi / 4, SAMPLES),
        generator.uniform(-8, 8, SAMPLES),
        generator.choice([-1, 1], SAMPLES // 2) * np.exp(generator.uniform(-30, np.log(limit), SAMPLES // 2)),
        quarters,
        np.nextafter(quarters.astype(kind), kind(0)),
        np.arange(-16, 17) * (np.pi / 4),
        np.array([0, limit, -limit]),
    )
    return np.concatenate(parts).astype(kind)


@cache
def _exact_pair(real: str) -> tuple[tuple[Numbers, Numbers], ...]:
    """Sines and cosines of `_angles`, each as a double and what is left of it, which is nothing beside a float."""
    if real == "float":
        angles = _angles(real).astype(np.float64)
        return (np.sin(angles), np.zeros(len(angles))), (np.cos(angles), np.zeros(len(angles)))
    with mpmath.workprec(BITS):
        pairs = [mpmath.cos_sin(mpmath.mpf(float(angle))) for angle in _angles(real)]
        return tuple(_split([pair[place] for pair in pairs]) for place in (1, 0))


def _split(numbers: list[Any]) -> tuple[Numbers, Numbers]:
    high = np.array([float(number) for number in numbers])
    return high, np.array([float(number - float(number)) for number in numbers])


def _sqrt(probe: Probe, name: str) -> tuple[Any, ...] | None:
    generator, kind = np.random.default_rng(SEED), _TYPES[probe.real]
    size = 300 if probe.real == "double" else 36
    x = np.concatenate(
        [
            10.0 ** generator.uniform(-size, size, SAMPLES),
            generator.uniform(0, 4, SAMPLES),
            np.arange(64.0) ** 2,
            np.array([0.0, 1.0, 2.0, -1.0, -1e-30, np.nan, -np.inf]),
        ]
    ).astype(kind)
    with np.errstate(invalid="ignore"):
        wanted = np.sqrt(x)  # correctly rounded by IEEE 754
    (found,) = _call(probe, name, (x,), 1)
    return _first(~((found == wanted) | (np.isnan(found) & np.isnan(wanted))), x)


def _atan2(probe: Probe, name: str) -> tuple[Any, ...] | None:
    y, x = _points(probe.real)
    (found,) = _call(probe, name, (y, x), 1)
    high, low = _exact_angle(probe.real)
    error = np.abs((found.astype(np.float64) - high) - low)
    wrong = ~(error <= (ANGLE_ULPS * np.spacing(np.abs(high)) if probe.real == "double" else ANGLE_ERROR))
    kind = _TYPES[probe.real]
    bad = np.array([np.nan, np.inf, -np.inf, 1.0, 1.0, 1.0], kind)
    (spoilt,) = _call(probe, name, (bad, np.roll(bad, 3)), 1)
    return _first(wrong, y, x) or _first(~np.isnan(spoilt), bad, np.roll(bad, 3))


@cache
def _points(real: str) -> tuple[Numbers, Numbers]:
    """Points in every direction and at many distances, and on both axes."""
    generator, kind = np.random.default_rng(SEED), _TYPES[real]
    angle, size = generator.uniform(-np.pi, np.pi, SAMPLES), np.exp(generator.uniform(-20, 20, SAMPLES))
    ends = np.array([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)], float)
    return (
        np.concatenate([size * np.sin(angle), ends[:, 0]]).astype(kind),
        np.concatenate([size * np.cos(angle), ends[:, 1]]).astype(kind),
    )


@cache
def _exact_angle(real: str) -> tuple[Numbers, Numbers]:
    if real == "float":
        y, x = (numbers.astype(np.float64) for numbers in _points(real))
        return np.arctan2(y, x), np.zeros(len(x))
    with mpmath.workprec(BITS):
        points = zip(*_points(real), strict=True)
        return _split([mpmath.atan2(float(y), float(x)) if x or y else mpmath.mpf(0) for y, x in points])
