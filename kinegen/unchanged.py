"""Builds that would change nothing, recognised without making them.

A build is decided by the robot file, the options, this program with its libraries, and the tools and the processor of
the machine. When all these are as they were, and the output folder holds what that build left there, the build is not
made again: it would give the same bytes and the same proof. What it told is kept in the user's cache folder. Whatever
is different, missing, damaged or unknown leads to an ordinary build.
"""

from __future__ import annotations

import hashlib
import pickle
import platform
import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from importlib import metadata
from pathlib import Path

from kinegen.errors import KinegenError
from kinegen.native.cache import Cache
from kinegen.native.compiler import find_compiler, processor
from kinegen.results import BuildOptions, BuildResult, Stage

_PACKAGE = Path(__file__).resolve().parent
_SUFFIXES = (".py", ".jinja", ".c", ".h", ".ld")
_LIBRARIES = ("sympy", "numpy", "mpmath", "cffi", "jinja2")
_TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
"""What the costs of a build depend on."""


def recall(key: str) -> BuildResult | None:
    """What an earlier build told, if this one would tell the same and change nothing.

    Args:
        key: What `key_of` says of the build.

    Returns:
        The result with every file untouched; None where the build has to be made.
    """
    begin = time.perf_counter()
    known = Cache().load(key) if key else None
    if known is None:
        return None
    try:
        kept: tuple[dict[str, str], BuildResult] = pickle.loads(known)  # noqa: S301 - from the user's own cache, beside the extensions
    except Exception:  # noqa: BLE001 - of another version, or damaged in a way that its digest does not show
        return None
    digests, result = kept
    if digests != _digests(result.folder):
        return None
    written = tuple(replace(entry, status="unchanged") for entry in result.written if entry.status != "removed")
    stage = Stage("compare", time.perf_counter() - begin, "all is as it was built and proved before")
    return replace(result, written=written, stages=(stage,))


def remember(key: str, result: BuildResult) -> None:
    """Keep what a build told.

    Args:
        key: What `key_of` said before the build began: the robot file may have been edited since.
        result: What it told.
    """
    if key:
        Cache().save(key, pickle.dumps((_digests(result.folder), result)))


def key_of(path: Path, options: BuildOptions) -> str:
    """A name for all that decides a build.

    Args:
        path: The robot file.
        options: What to make.

    Returns:
        The name; empty where something cannot be found out.
    """
    try:
        text = path.read_bytes()
        compiler = find_compiler() if options.compile else None
    except (OSError, KinegenError):
        return ""
    tools = [(tool, shutil.which(tool)) for tool in _TOOLS]
    libraries = [metadata.version(name) for name in _LIBRARIES]
    machine = processor().describe(), compiler, tools, libraries, platform.python_version()
    return Cache().key("build", _program(), text, str(path), options, str(options.output.resolve()), machine)


def _digests(folder: Path) -> dict[str, str]:
    """A digest of every file of an output folder, by its name; caches of Python left aside."""
    return {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and "__pycache__" not in file.parts
    }


@cache
def _program() -> str:
    """A digest of this program: its modules, templates and C files."""
    digest = hashlib.sha256()
    for file in _files():
        digest.update(f"{file.name}\0".encode() + file.read_bytes())
    return digest.hexdigest()


def _files() -> Iterator[Path]:
    # A wheel has its templates inside the package, a checkout beside it.
    outside = () if (_PACKAGE / "templates").is_dir() else (_PACKAGE.parent / "templates",)
    for folder in (_PACKAGE, *outside):
        yield from sorted(file for file in folder.rglob("*") if file.suffix in _SUFFIXES)
