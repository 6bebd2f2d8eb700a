"""What decides a result besides its inputs: this program, the libraries that it uses, and the processor."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib import metadata
from pathlib import Path

from kinegen.native.compiler import processor

_PACKAGE = Path(__file__).resolve().parents[1]
_LIBRARIES = ("cffi", "click", "jinja2", "mpmath", "numpy", "pyyaml", "sympy")


def identity() -> tuple[object, ...] | None:
    """Everything that is imported, and the machine; None where a library does not say which version it is."""
    versions = libraries()
    if not all(versions):
        return None
    return program(), versions, platform.python_version(), processor().describe()


def libraries() -> tuple[str, ...]:
    """The versions of the libraries; empty where one is installed without saying so."""
    found = []
    for name in _LIBRARIES:
        try:
            found.append(metadata.version(name))
        except metadata.PackageNotFoundError:
            found.append("")
    return tuple(found)


@cache
def program() -> str:
    """A digest of this program: every file of the package and of its templates, by name and content."""
    digest = hashlib.sha256()
    # A wheel has its templates inside the package, a checkout beside it.
    outside = () if (_PACKAGE / "templates").is_dir() else (_PACKAGE.parent / "templates",)
    for folder in (_PACKAGE, *outside):
        for file in sorted(folder.rglob("*")):
            if file.is_file() and "__pycache__" not in file.parts:
                name = file.relative_to(folder).as_posix()
                digest.update(f"{name}\0{file.stat().st_size}\0".encode() + file.read_bytes())
    return digest.hexdigest()
