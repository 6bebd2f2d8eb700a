"""What decides a result besides its inputs: this program, the libraries that it uses, and the processor.

The digest of the program is asked for by every build, proof and module that is looked up, so it must cost less than
reading 600 files. It is kept in the user's cache folder under a name made of the place, the size and the times of each
file, and contents are read again only where one of these differs. Besides the time of modification this is the time of
the last change of content or name (`st_ctime`), which POSIX systems set by themselves: a file that is edited and then
given its former size and modification time is noticed. Windows has no such time, and there it is not.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import stat
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from kinegen.runtime.cache import Cache
from kinegen.runtime.compiler import processor

_PACKAGE = Path(__file__).resolve().parents[1]
_LIBRARIES = ("cffi", "click", "jinja2", "mpmath", "numpy", "pyyaml", "sympy")
_SHELF = "programs"
"""The folder of the cache that holds digests of programs."""
_SETTLED = 2_000_000_000
"""Nanoseconds after which another edit gives a file another time; the coarsest clock of a file system in use."""
_METADATA = (".dist-info", ".egg-info")


def identity() -> tuple[object, ...] | None:
    """Everything that is imported, and the machine; None where a library does not say which version it is."""
    versions = libraries()
    if not all(versions):
        return None
    return program(), versions, platform.python_version(), processor().describe()


def libraries() -> tuple[str, ...]:
    """The versions of the libraries; empty where one is installed without saying so.

    The names of the folders that installers leave (`numpy-2.1.0.dist-info`) say it. Where they do not,
    `importlib.metadata` is asked; its import alone takes as long as everything else here.
    """
    named = _named_versions()
    return tuple(named.get(name) or _stated_version(name) for name in _LIBRARIES)


def _named_versions() -> dict[str, str]:
    """Versions by the names of folders on the path of modules; the first of a name counts, as it does for imports."""
    found: dict[str, str] = {}
    for place in sys.path:
        try:
            entries = sorted(os.listdir(place or "."))  # noqa: PTH208 - names are all that is needed
        except OSError:
            continue
        for entry in entries:
            if entry.endswith(_METADATA):
                project, _, version = entry.rpartition(".")[0].partition("-")
                found.setdefault(project.lower(), version)
    return found


def _stated_version(name: str) -> str:
    from importlib import metadata

    try:
        return metadata.version(name)
    except (metadata.PackageNotFoundError, OSError):  # the backport's finder, once loaded, raises the latter
        return ""


@cache
def program() -> str:
    """A digest of this program: every file of the package and of its templates, by name and content."""
    begin = time.time_ns()
    store, files = Cache(shelf=_SHELF), sorted(_files())
    key = store.key("program", str(_PACKAGE), [(name, times) for name, _, times in files])
    if (known := store.load(key)) is not None:
        return known.decode()
    digest = hashlib.sha256()
    for name, path, _ in files:
        content = Path(path).read_bytes()
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    found = digest.hexdigest()
    # A file that was written just now may be written again and keep its times.
    if all(max(changed) < begin - _SETTLED for _, _, (_, *changed) in files):
        store.save(key, found.encode())
    return found


def _files() -> Iterator[tuple[str, str, tuple[int, int, int]]]:
    """The files of the package and of its templates: name below the folder, path; size, modification and change."""
    # A wheel has its templates inside the package, a checkout beside it.
    outside = () if (_PACKAGE / "templates").is_dir() else (_PACKAGE.parent / "templates",)
    for folder in map(str, (_PACKAGE, *outside)):
        for place, folders, names in os.walk(folder):
            folders[:] = [name for name in folders if name != "__pycache__"]
            for name in names:
                path = os.path.join(place, name)  # noqa: PTH118 - pathlib would take longer than all else here
                with contextlib.suppress(OSError):  # a link of an editor that leads nowhere
                    status = os.stat(path)  # noqa: PTH116 - the same
                    if stat.S_ISREG(status.st_mode):
                        yield path[len(folder) :], path, (status.st_size, status.st_mtime_ns, status.st_ctime_ns)
