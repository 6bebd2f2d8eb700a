"""All files of a package from all emitters, and what of their text decides how they work."""

from __future__ import annotations

import ast
import hashlib
import io
import re
import tokenize
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c import C
from kinegen.backends.c.test_vectors import Vectors
from kinegen.backends.c.vectors import emit_vectors
from kinegen.backends.complete_inverse.screws import require_double
from kinegen.backends.fixed_point import INTEGERS
from kinegen.backends.fixed_point.kernels import fixed_kernels
from kinegen.backends.fixed_point.vectors import FixedVectors, emit_fixed_vectors
from kinegen.backends.python import PYTHON
from kinegen.backends.python.package import emit_package
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30

_STRING = r'"(?:\\.|[^"\\\n])*"'
_CHARACTERS = r"'(?:\\.|[^'\\\n])*'"

_C = re.compile(rf"{_STRING}|{_CHARACTERS}|(?P<comment>/\*.*?\*/|//[^\n]*)", re.DOTALL)
_LIFETIMES = re.compile(rf"{_STRING}|(?P<comment>/\*.*?\*/|//[^\n]*)", re.DOTALL)  # a lifetime is a single apostrophe
_PERCENT = re.compile(
    rf"{_STRING}|(?<![\w)\]}}.'])'(?:[^'\n]|'')*'|(?P<comment>%[^\n]*)"
)  # behind a name, ' transposes
_PYTHON = re.compile(rf"{_STRING}|{_CHARACTERS}|(?P<comment>#[^\n]*)")
_TEMPLATE = re.compile(r"(?P<comment>{#.*?#})", re.DOTALL)

_COMMENTS: Mapping[str, re.Pattern[str]] = {
    **dict.fromkeys((".c", ".h", ".cpp", ".hpp", ".cu", ".cuh", ".js", ".mjs", ".ts"), _C),
    ".rs": _LIFETIMES,
    ".m": _PERCENT,
    ".py": _PYTHON,
    ".pyi": _PYTHON,
}
"""By the suffix of a file: its strings, and its comments."""


def code_of(name: str, text: str) -> str:
    """Return the text of a file without comments, blank lines, and spaces at the ends of lines.

    `name`: the file's name, whose suffix says the language; `.jinja` behind it marks a template. Returns the code of C
    and languages like it, and of Python, which loses its docstrings too. Other text is as it is. Files of equal code
    behave alike, but for what they say of themselves.
    """
    if name.endswith(".jinja"):
        return _code(name.removesuffix(".jinja"), _without(_TEMPLATE, text))
    if name.endswith((".py", ".pyi")):
        try:
            return _without_blanks(_without_docstrings(text), str.rstrip)
        except (SyntaxError, tokenize.TokenError):
            pass  # such as what only Python 2 reads
    return _code(name, text)


def _code(name: str, text: str) -> str:
    pattern = _COMMENTS.get(PurePosixPath(name).suffix)
    kept = text if pattern is None else _without(pattern, text)
    return _without_blanks(kept, str.rstrip if pattern in (None, _PYTHON) else str.strip)  # where indentation counts


def _without_blanks(text: str, trimmed: Callable[[str], str]) -> str:
    return "\n".join(line for line in map(trimmed, text.splitlines()) if line)


def _without(pattern: re.Pattern[str], text: str) -> str:
    return pattern.sub(lambda found: " " if found["comment"] is not None else found[0], text)


def _without_docstrings(text: str) -> str:
    """Return Python whose comments, and statements that are strings on lines of their own, are blank."""
    lines = text.split("\n")
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            first, last = node.lineno - 1, node.end_lineno or node.lineno
            if not lines[first][: node.col_offset].strip():
                lines[first:last] = [""] * (last - first)
    kept = "\n".join([*lines, ""])
    for token in tokenize.generate_tokens(io.StringIO(kept).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Emitted:
    """Holds what the emitters made.

    Attributes:
        sources: The C files that the extension is compiled from, by name.
        files: All files of the package, these among them.
        stamp: Digest of the sources.
    """

    sources: Mapping[str, str]
    files: Mapping[str, str]
    stamp: str


def emit_files(kernels: RobotPrograms, reals: tuple[ScalarType, ...], vectors: Vectors) -> Emitted:
    """Print every text file of a package.

    Returns:
        C kernels, their test vectors, and the Python module with its NumPy form.
    """
    if kernels.complete_inverse:
        require_double(kernels.robot, reals)
    sources: dict[str, str] = {}
    for real in reals:
        sources |= C.files(kernels, real)
    files = dict(sources)
    for real in reals:
        files |= emit_vectors(kernels, vectors, real)
    stamp = stamp_of(sources)
    for real in reals:
        files |= PYTHON.files(kernels, real)
    return Emitted(sources, files | emit_package(kernels, reals, stamp), stamp)


def emit_integers(kernels: RobotPrograms, vectors: FixedVectors) -> dict[str, str]:
    """Print all there is of the kernels in integers.

    Returns:
        Kernels, test vectors and self-test, by name.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    return {**INTEGERS.files(kernels, Q30), **emit_fixed_vectors(fixed_kernels(kernels), vectors)}


def stamp_of(sources: Mapping[str, str]) -> str:
    """Return the digest by which a package recognises the extension that belongs to it.

    `sources`: emitted C files by name: those of the kernels, headers included, in any order. Returns sixteen
    hexadecimal digits. Other comments alone do not change them: the compiled module is the same.
    """
    digest = hashlib.sha256()
    for name, text in sorted(sources.items()):
        digest.update(f"{name}\0{code_of(name, text)}\0".encode())
    return digest.hexdigest()[:16]
