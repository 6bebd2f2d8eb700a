"""One digest of all that decides a result, so that what has not changed need not be made again.

That are the files that are named, the modules of kinegen, its tests and its benchmarks that these import, directly or
through others, the templates, the robots, and the versions of the libraries. Comments and docstrings decide nothing.
"""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from kinegen.backends.files import code_of
from kinegen.runtime.toolchain_fingerprint import libraries

ROOT = Path(__file__).resolve().parent.parent

ALWAYS = ("templates", "robots", "kinegen/runtime", "kinegen/io/robot_file", "scripts/sources.py")
"""What is read as text or found by its name; `native` holds modules that packages take as they are."""

OURS = ("kinegen", "tests", "benchmarks")
"""Packages whose modules are followed."""

DIGITS = 16


def digest(places: Iterable[str], modules: Iterable[str] = (), root: Path = ROOT) -> str:
    """The digest, cut to 16 digits.

    Args:
        places: Files and folders that count, with all our modules that the Python files among them import.
        modules: Further modules, such as those of a command.
        root: The top of the repository.
    """
    found = hashlib.sha256(repr((libraries(), sys.version_info[:2])).encode())
    own = set(_files(root / place for place in (*ALWAYS, *places)))
    scripts = [path for path in own if path.suffix == ".py" and path.relative_to(root).parts[0] != "kinegen"]
    names = [name for path in scripts for name in _names(path)]
    for path in sorted(own | imported([*names, *modules], root)):
        found.update(f"{path.relative_to(root).as_posix()}\0{_code(path)}\0".encode())
    return found.hexdigest()[:DIGITS]


def _code(path: Path) -> str:
    """The text of a file without comments; as bytes where it is none."""
    try:
        return code_of(path.name, path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        return path.read_bytes().hex()


def imported(modules: Iterable[str], root: Path = ROOT) -> set[Path]:
    """The files of ours that are read when modules are imported and used, imports in functions included.

    Args:
        modules: Their names; what is not a module of ours has no file here.
        root: The top of the repository.
    """
    found, waiting = set[Path](), list(modules)
    while waiting:
        name = waiting.pop()
        path = _file(name, root)
        if path is not None and path not in found:
            found.add(path)
            waiting += [name.rpartition(".")[0], *_names(path)]
    return found


def _file(name: str, root: Path) -> Path | None:
    """The file of a module, None for what is not a module of ours."""
    if name.partition(".")[0] not in OURS:
        return None
    place = root.joinpath(*name.split("."))
    return next((path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()), None)


def _names(path: Path) -> Iterator[str]:
    """What a file imports; of `from a import b` both, since b may be a module."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _files(places: Iterable[Path]) -> Iterator[Path]:
    for place in places:
        for path in (place,) if place.is_file() else place.rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                yield path
