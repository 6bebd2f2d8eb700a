"""What C files say in comments, refuse to the preprocessor, and offer to a linker, against what is proven.

A header is the manual of its kernels: the order of the joints, their limits and the proven errors are as much a result
as numbers are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from kinegen.backends.accuracy import NUMBER_TYPES, bound_over, fraction_box, has_free_angles
from kinegen.backends.bundle import operation_line
from kinegen.backends.descriptions import input_text, result_text
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import ProofError
from kinegen.ir.error_analysis import ErrorBound, Ranges, has_rules
from kinegen.ir.lower import program_of, runtime_defaults
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.outputs import INVERSES, Quantity
from kinegen.model.robot import JointType, JointVariable, Robot
from kinegen.support.naming import c_file, function, prefix
from kinegen.verify.source_checks import COMMENT, constants, entries_of, require_little_stack

_WORDS = r"^([A-Za-z_]\w*)(?: [A-Za-z_]\w*)*[ *]+"
_DEFINED = re.compile(_WORDS + r"(\w+)\([^;{]*\)\s*\{", re.MULTILINE)
_DECLARED = re.compile(_WORDS + r"(\w+)\([^;{]*\)\s*;", re.MULTILINE)
_MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)[ \t]+(\w+)", re.MULTILINE)
"""A macro with its first word, such as one for `static inline` with what a compiler adds."""
_INCLUDED = re.compile(r"^[ \t]*#[ \t]*include[ \t]*(\S+)", re.MULTILINE)

_FREESTANDING = frozenset(f"<{name}.h>" for name in ("float", "stdbool", "stddef", "stdint"))
_TESTING = frozenset(("<stdio.h>", "<avr/pgmspace.h>"))
"""What the main program of a self-test reads, and its vectors on an AVR, each behind a macro."""

_SELFTEST = "_selftest.c"


def require_exported(robot: Robot, folder: Path, names: Sequence[str]) -> None:
    """Refuse C files with functions of a linker's that are not theirs to define, or with headers of others.

    Raises `ProofError` naming the file and the function or header.
    """
    headers = {path.name: COMMENT.sub(" ", path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.h"))}
    declared = {name for text in headers.values() for _, name in _DECLARED.findall(text)}
    own = {f'"{name}"' for name in headers}
    for name in names:
        code, is_test = COMMENT.sub(" ", (folder / name).read_text(encoding="utf-8")), name.endswith(_SELFTEST)
        hidden = _hidden(code)
        for head, found in _DEFINED.findall(code):
            if head not in hidden and found not in declared and not (is_test and found == "main"):
                raise _error(robot, name, f"{found} is not static, and no header declares it")
        for found in _INCLUDED.findall(code):
            if found not in own | _FREESTANDING | (_TESTING if is_test else frozenset()):
                raise _error(robot, name, f"it includes {found}, which is none of its headers")


def _hidden(code: str) -> set[str]:
    """First words of functions that a linker does not see: `static`, and macros that mean it in every definition."""
    found = _MACRO.findall(code)
    return {"static", *(name for name, _ in found)} - {name for name, word in found if word != "static"}


_GUARD = re.compile(r"^#ifndef (\w+)\n#define (\w+)$", re.MULTILINE)
_JOINT = re.compile(r"^ \*   (q\[\d+\] .*)$", re.MULTILINE)
_RANGE = re.compile(r"(-?[\d.]+(?:e[-+]?\d+)?) to (-?[\d.]+(?:e[-+]?\d+)?)")
_NUMBER = re.compile(r"<= (\d[\d.]*(?:e[-+]?\d+)?|infinity)")
_ROUNDED = 2e-5
"""How far a limit of six digits may be from the limit, as a part of it."""

_CEILING = 1.11
"""A bound of two digits is never smaller than it is, and larger by at most this factor."""

_SOLVERS = (
    *("selftest", "numeric_inverse", "numeric_inverse_batch", "complete_inverse", "redundancy_range"),
    "inverse_tracker",
)
"""Ends of the names of further C files; others in the folder are those of the proof itself."""

_FAST = "FAST_MATH__", "ASSOCIATIVE_MATH__", "RECIPROCAL_MATH__", "NO_SIGNED_ZEROS__"
_REFUSED = (
    "#if "
    + " || ".join(f"defined(__{name})" for name in _FAST)
    + ' || defined(_M_FP_FAST)\n#error "-ffast-math breaks',
    '#if defined(__FINITE_MATH_ONLY__)\n#if __FINITE_MATH_ONLY__ != 0\n#error "-ffinite-math-only breaks',
)
_DOUBLE_ALONE = (
    "#if defined(DBL_MANT_DIG)\n#if DBL_MANT_DIG != 53\n#error ",
    "_IS_OFF = 1 / (1 - (int)0.9999999999999999) };",
)


def require_headers(robot: Robot, folder: Path, quantities: Sequence[Quantity], reals: Sequence[str]) -> None:
    """Check the comments of the headers, their include guards, and what the C files refuse to compile with.

    Raises `ProofError` naming the file and what it says.
    """
    headers = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.h"))}
    _require_guards(robot, headers)
    for real in reals:
        name = c_file(robot.name, "h", ScalarType(real))
        _require_joints(robot, name, headers[name])
        _require_errors(robot, name, headers[name], quantities, ScalarType(real))
        _require_functions(robot, name, headers[name], quantities, ScalarType(real))
        names = [c_file(robot.name, "c", ScalarType(real), batch=batch) for batch in (False, True)]
        sources = {source: (folder / source).read_text(encoding="utf-8") for source in names}
        _require_options(robot, sources, real)
        solvers = (name for name in _SOLVERS if (folder / f"{prefix(robot.name, ScalarType(real))}_{name}.c").exists())
        others = [f"{prefix(robot.name, ScalarType(real))}_{name}.c" for name in solvers]
        require_little_stack(robot, folder, (*names, *others))
        require_exported(robot, folder, (*names, *others))


def _require_guards(robot: Robot, headers: Mapping[str, str]) -> None:
    """Every header is read once, and none keeps another one from being read."""
    seen: dict[str, str] = {}
    for name, text in headers.items():
        found = _GUARD.search(text)
        if found is None or found[1] != found[2]:
            raise _error(robot, name, "it has no include guard")
        if found[1] in seen:
            raise _error(robot, name, f"its include guard {found[1]} is that of {seen[found[1]]}")
        seen[found[1]] = name


def _require_joints(robot: Robot, name: str, text: str) -> None:
    lines = _JOINT.findall(text)[: robot.dof]
    if len(lines) != robot.dof:
        raise _error(robot, name, f"its comment lists {len(lines)} joint values, expected {robot.dof}")
    for line, variable in zip(lines, robot.variables, strict=True):
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        place, called, kind, measured, rest = line.split(maxsplit=4)
        wanted = (f"q[{variable.index}]", variable.name, variable.type.value, unit)
        if (place, called, kind, measured) != wanted or not _has_limits(variable, rest):
            raise _error(robot, name, f"'{' '.join(line.split())}' is not joint {variable.name} of the robot")


def _has_limits(variable: JointVariable, text: str) -> bool:
    """Returns whether a text gives the limits of a joint, with six digits that leave out no joint value."""
    found = _RANGE.match(text)
    if variable.limits is None or found is None:
        return variable.limits is None and text.startswith("no limits")
    low, high = (float(evaluate(limit, {}, FLOAT64)) for limit in variable.limits)
    rooms = low - float(found[1]), float(found[2]) - high
    return all(0 <= room <= _ROUNDED * abs(end) for room, end in zip(rooms, (low, high), strict=True))


def _require_errors(robot: Robot, name: str, text: str, quantities: Sequence[Quantity], real: ScalarType) -> None:
    for quantity in quantities:
        if quantity.kind in INVERSES:
            continue
        program = program_of(robot, quantity)
        is_stated = program.outputs and all(given.name == "q" for given in program.signature.inputs)
        if not is_stated or not has_rules(program):
            continue
        words = _comment(text, function(robot.name, quantity.function, real))
        for part, free in zip(_stated(words), _ends(robot, real), strict=True):
            ranges = Ranges(fraction_box(robot, free), runtime_defaults(robot))
            wanted = _bounds(bound_over(program, ranges, NUMBER_TYPES[real]))
            found = [float(number) for number in _NUMBER.findall(part)]
            is_right = len(found) == len(wanted) and all(
                least <= number <= _CEILING * least for number, least in zip(found, wanted, strict=True)
            )
            if not is_right:
                stated = f"it states '{part}' for {quantity}"
                raise _error(robot, name, f"{stated}, and the proven bound is {_listed(wanted)}")


def _require_functions(robot: Robot, name: str, text: str, quantities: Sequence[Quantity], real: ScalarType) -> None:
    """What callers go by: sizes of arrays, what each holds, what a call costs, and how good sines are."""
    known, has_angles = constants(text), False
    for quantity in quantities:
        if quantity.kind in INVERSES:
            continue
        program, called = program_of(robot, quantity), function(robot.name, quantity.function, real)
        declared = re.search(rf"^void {called}\(([^;]*)\);", text, re.MULTILINE)
        if declared is None:
            raise _error(robot, name, f"it does not declare {called}")
        # The comment and the declaration are made apart: each must say what the program says.
        words = _comment(text, called)
        signature, arguments = program.signature, " ".join(declared[1].split())
        for array in filter(lambda each: each.size, (*signature.inputs, *signature.results)):
            kind = "const " * (array in signature.inputs) + ("unsigned char" if array.is_truth else real)
            found = re.search(rf"(?:^|, ){kind} {array.name}((?:\[[^\]]+\])+)(?:,|$)", arguments)
            if found is None or entries_of(found[1], known) != math.prod(array.shape):
                raise _error(robot, name, f"{called} does not take {kind} {array.name} of {math.prod(array.shape)}")
            held = input_text(array) if array in signature.inputs else result_text(array)
            if f"] {array.name} {held}" not in words:
                raise _error(robot, name, f"the comment of {called} does not say that {array.name} holds {held}")
        if f"Costs {operation_line(program)}." not in words:
            raise _error(robot, name, f"the comment of {called} does not say that it costs {operation_line(program)}")
        has_angles |= bool(program.angles)
    # What holds for all functions is said once.
    prose = " ".join(text.replace("\n *", " ").split())
    if has_angles and f"evaluated {SINCOS[real].accuracy};" not in prose:
        raise _error(robot, name, f"it does not say that sines are {SINCOS[real].accuracy}")
    if '#ifdef __cplusplus\nextern "C" {\n#endif' not in text:
        raise _error(robot, name, 'its functions are not extern "C" in C++')


def _ends(robot: Robot, real: ScalarType) -> Iterator[float | None]:
    """Yields how far angles without limits go, in each of the two statements: half a turn, and as far as sines do."""
    yield None
    yield SINCOS[real].limit if has_free_angles(robot) else None


def _stated(words: str) -> tuple[str, str]:
    """Returns what a comment states: within the usual ranges, and with any angle; the same twice where it says so."""
    first = re.search(r"Proven error[^:]*: (.+?)\.(?=\s|$)", words)
    wide = re.search(r"as far as sums of angles are too: (.+?)\.(?=\s|$)", words)
    usual = first[1] if first else "nothing"
    return usual, wide[1] if wide else usual


def _comment(text: str, name: str) -> str:
    """Returns the comment of a function in one line."""
    head = text.partition(f"\nvoid {name}(")[0]
    return " ".join(head.rpartition("/*")[2].replace("\n *", " ").split())


def _bounds(proven: ErrorBound) -> list[float]:
    if not proven.frames:
        return [max(proven.entries)]
    return [*proven.position, *([] if proven.rotation is None else [proven.rotation])]


def _listed(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:.3g}" for number in numbers)


def _require_options(robot: Robot, sources: Mapping[str, str], real: str) -> None:
    """What the files refuse before anything else, so that they are not compiled with options that break them."""
    for name, text in sources.items():
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        head = re.sub(r" *\\\n *", " ", code.partition("\nstatic ")[0])
        for refusal in (*_REFUSED, *_DOUBLE_ALONE * (real == "double")):
            if refusal not in head:
                words = refusal.splitlines()[0]
                raise _error(robot, name, f"it does not refuse options that break it: '{words}' with #error is missing")


def _error(robot: Robot, name: str, reason: str) -> ProofError:
    return ProofError(f"{robot.name}: {name}: {reason}; nothing was written")
