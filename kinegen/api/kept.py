"""Compiled modules that are kept: each in a folder of its own in the user's cache, whole or not at all.

In: the key of everything that decides a module, and a way to make it. Out: the module, imported. A folder is made under
another name and renamed when it is complete, so that two processes never see half of one. It has the digest of each of
its files; a folder that differs from them is made again.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import json
import os
import shutil
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from kinegen import compiled
from kinegen.manifest import digests_of
from kinegen.naming import EXTENSION

_SEAL = "kinegen-kept.json"
"""The file with the digests of the others."""

_MOST = 50
"""Modules that are kept, at about 400 kB each."""

_STALE = 3600.0
"""Seconds after which a folder that was never finished is removed."""

_NEW = ".new-"

_lock = threading.RLock()
_loaded: dict[str, ModuleType] = {}


def kept_module(key: str, name: str, make: Callable[[Path], Path]) -> ModuleType:
    """A module from the cache, or made now.

    Args:
        key: Name of everything that decides it; empty for one that is not kept.
        name: Name of the robot.
        make: Makes the package in a folder, and returns the package's own folder in it.

    Returns:
        The module; the same object for the same key.

    Raises:
        KinegenError: What `make` raises.
    """
    # mpmath, warnings and the list of modules belong to the whole process: one module at a time.
    with _lock:
        if (known := known_module(key, name)) is not None:
            return known
        home = _home(bool(key))
        title = _title(key, name) if key else f"{name}_{os.getpid()}_{len(_loaded)}"
        _make(home, home / title, make)
        return _noted(key or title, home, home / title)


def known_module(key: str, name: str) -> ModuleType | None:
    """A module that was made before.

    Args:
        key: Name of everything that decides it; empty for one that is not kept.
        name: Name of the robot.

    Returns:
        The module, the same object for the same key; None where it has to be made.
    """
    if not key:
        return None
    with _lock:
        if key in _loaded:
            return _loaded[key]
        home = _home(is_kept=True)
        folder = home / _title(key, name)
        return _noted(key, home, folder) if _is_whole(folder) else None


def _title(key: str, name: str) -> str:
    return f"{name}_{key[:16]}"


def _noted(key: str, home: Path, folder: Path) -> ModuleType:
    """Import a package that is whole, and keep it for this process under its key."""
    module = _imported(home, folder)
    _loaded[key] = module
    with contextlib.suppress(OSError):
        os.utime(folder)  # the newest stay longest
    return module


def _home(is_kept: bool) -> Path:
    """The folder of all modules; one of this process alone where there is no cache."""
    home = compiled.cache_folder() if is_kept else None
    if home is not None:
        with contextlib.suppress(OSError):
            for place in (home.parent, home):
                place.mkdir(mode=0o700, parents=True, exist_ok=True)
            if os.access(home, os.W_OK):
                return home
    return _own_home()


def _own_home() -> Path:
    found = [Path(each) for each in compiled.__path__ if Path(each).name.startswith("kinegen-compiled-")]
    if found:
        return found[0]
    folder = tempfile.mkdtemp(prefix="kinegen-compiled-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    compiled.__path__.append(folder)
    return Path(folder)


def _make(home: Path, folder: Path, make: Callable[[Path], Path]) -> None:
    """Make a folder beside the others and put it into its place."""
    _prune(home)
    work = Path(tempfile.mkdtemp(prefix=_NEW, dir=home))
    try:
        package = make(work)
        from compileall import compile_dir

        # Python then need not translate the files at each start, even where it may not write beside them.
        compile_dir(package, quiet=2)
        (package / _SEAL).write_text(json.dumps(digests_of(package)), encoding="utf-8")
        for attempt in range(10):
            # Another process may have been quicker, and what it made is as good.
            if _is_whole(folder):
                break
            with contextlib.suppress(OSError):
                folder.rename(work / f"before-{attempt}")
            with contextlib.suppress(OSError):
                package.rename(folder)
                break
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _is_whole(folder: Path) -> bool:
    """Whether a folder is there as it was made; Python's own caches left aside."""
    try:
        status = folder.stat()
        if hasattr(os, "geteuid") and status.st_uid != os.geteuid():
            return False
        known = json.loads((folder / _SEAL).read_bytes())
        found = digests_of(folder)
    except (OSError, ValueError, RecursionError):
        return False
    found.pop(_SEAL, None)
    return bool(known == found)


def _imported(home: Path, folder: Path) -> ModuleType:
    """Import a package as a submodule of `kinegen.compiled`."""
    if str(home) not in compiled.__path__:
        compiled.__path__.append(str(home))
    name = f"{compiled.__name__}.{folder.name}"
    importlib.invalidate_caches()
    has_extension = (folder / EXTENSION).exists()
    try:
        with warnings.catch_warnings():
            if not has_extension:
                # Either this was asked for, or the caller is warned of the missing compiler.
                warnings.filterwarnings("ignore", "NumPy evaluates", RuntimeWarning)
            return importlib.import_module(name)
    except BaseException:
        for loaded in [other for other in sys.modules if other == name or other.startswith(f"{name}.")]:
            del sys.modules[loaded]
        raise


def _prune(home: Path) -> None:
    """Remove what was never finished, and the modules that were not used for the longest time."""
    with contextlib.suppress(OSError):
        entries = sorted(home.iterdir(), key=lambda entry: -entry.stat().st_mtime_ns)
        unfinished = [each for each in entries if each.name.startswith(_NEW)]
        whole = [each for each in entries if not each.name.startswith(_NEW)]
        old = [each for each in unfinished if time.time() - each.stat().st_mtime > _STALE]
        for entry in (*old, *whole[_MOST:]):
            shutil.rmtree(entry, ignore_errors=True)
