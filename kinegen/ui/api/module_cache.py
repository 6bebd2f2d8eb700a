"""Compiled modules that are kept in the user's cache, found by the call as it was written or by the robot.

In: a call or a model, everything else that decides a module, and a way to make it. Out: the module, imported. A folder
is made under another name and renamed when it is complete, so that two processes never see half of one. It has the
digest of each of its files; a folder that differs from them is made again. Readers of robot files are not imported.
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
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from kinegen.errors import KinegenError
from kinegen.runtime import compiled
from kinegen.runtime.cache import Cache
from kinegen.runtime.compiler import find_compiler
from kinegen.runtime.toolchain_fingerprint import identity
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import digests_of
from kinegen.support.naming import EXTENSION
from kinegen.support.system import is_of_this_user
from kinegen.ui.api.options import is_text

if TYPE_CHECKING:
    from kinegen.driver.results import BuildOptions
    from kinegen.model.robot import Robot


def say_compiling(name: str, *, is_kept: bool) -> None:
    """Say on stderr that a robot is being compiled, if that is a terminal or a notebook; and whether it is kept."""
    if _is_seen():
        # What is said is never a reason to fail: the terminal may be gone.
        with contextlib.suppress(OSError, ValueError):
            print(f"compiling {name} (first time{'; kept' if is_kept else ''})", file=sys.stderr, flush=True)


def _is_seen() -> bool:
    """Return whether a person sees what is printed now."""
    find_shell = getattr(sys.modules.get("IPython"), "get_ipython", None)
    if find_shell is not None and getattr(find_shell(), "kernel", None) is not None:
        return True
    try:
        return sys.stderr is not None and sys.stderr.isatty()
    except (AttributeError, ValueError):  # replaced by something else, or closed
        return False


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
    """Return a module from the cache, or make it now; the same object for the same key.

    Args:
        key: Name of everything that decides it; empty for one that is not kept.
        name: Name of the robot.
        make: Makes the package in a folder, and returns the package's own folder in it.

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
    """Return a module that was made before, the same object for the same key; None where it has to be made."""
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
    """Return the folder of all modules; one of this process alone where there is no cache."""
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
    """Return whether a folder is there as it was made; Python's own caches left aside."""
    try:
        status = folder.stat()
        if not is_of_this_user(status):
            return False
        known = json.loads((folder / _SEAL).read_bytes())
        found = digests_of(folder)
    except (OSError, ValueError, RecursionError):
        return False
    found.pop(_SEAL, None)
    return bool(known == found)


def _imported(home: Path, folder: Path) -> ModuleType:
    """Import a package as a submodule of `kinegen.runtime.compiled`."""
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


def made_module(model: Robot, options: BuildOptions, decisive: tuple[object, ...]) -> tuple[ModuleType, str]:
    """Return the module of a robot, found or made, and its key, which is empty if it is not kept.

    The folder of the options is not used; `decisive` is what `decisive_parts` gives.

    Raises:
        KinegenError: If the compiler refuses or the proof fails.
    """

    def make(work: Path) -> Path:
        from kinegen.driver.pipeline import build

        say_compiling(model.name, is_kept=bool(key))
        result = build(model, replace(options, output=work), lambda _stage: None)
        if options.compile and result.backend != "c":
            warnings.warn(f"{model.name}: {'; '.join(result.notes[:1])}", RuntimeWarning, stacklevel=2)
        return result.folder

    key = Cache().key("module", decisive, model, options) if decisive else ""
    return kept_module(key, model.name, make), key


def decisive_parts(*, compile: bool) -> tuple[object, ...]:  # noqa: A002 - as in `build`
    """Return what decides a module besides the robot and the options; nothing where it cannot be found out."""
    machine = identity()
    if machine is None:
        return ()
    try:
        return machine, find_compiler() if compile else None
    except KinegenError:
        return machine, None


_SHELF = "calls"
"""The folder of the cache that holds what calls led to."""

_OWN_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class _Found:
    """What a call led to: the key of the module, and the name of the robot."""

    key: str
    name: str


def call_name(robot: object, decisive: tuple[object, ...]) -> str:
    """Return a name for a call with a robot, as it was written, and everything else that decides the module.

    Reading a robot takes longer than importing its module, and the text decides what is read; so neither the model nor
    the readers are imported. The name is empty for a robot that has to be read: xacro files read others, and what
    importing a URDF changes is told at each call.
    """
    text = _text_of(robot)
    return Cache().key("call", text, decisive) if text else ""


def module_of(call: str) -> ModuleType | None:
    """Return the module that a call led to before; None where there was none, or its folder is not as it was left."""
    found = Cache(shelf=_SHELF).load_record(call, _Found) if call else None
    return None if found is None else known_module(found.key, found.name)


def remember(call: str, key: str, name: str) -> None:
    """Keep the key and the name of the robot that a call led to; nothing where the call or the key is empty."""
    if call and key:
        Cache(shelf=_SHELF).save_record(call, _Found(key, name))


def _text_of(robot: object) -> tuple[str, bytes] | None:
    """Return the path and the text of a robot in kinegen's own format, as far as they can be had without reading it."""
    if isinstance(robot, str) and is_text(robot):
        data = robot.encode("utf-8", "surrogatepass")
        return None if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") else ("", data)
    if not isinstance(robot, str | os.PathLike):
        return None
    path = os.fspath(robot)
    if not isinstance(path, str) or not path.lower().endswith(_OWN_SUFFIXES):
        return None
    try:
        return path, Path(path).read_bytes()
    except (OSError, ValueError):
        return None
