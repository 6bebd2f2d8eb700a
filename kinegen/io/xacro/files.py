"""The files that a xacro file may read, and the names that its expressions may use."""

from __future__ import annotations

import datetime as dt
import glob
import io
import os
import re
from collections.abc import Callable, Mapping
from collections.abc import Set as AbstractSet
from pathlib import Path
from types import MappingProxyType
from typing import Any

from kinegen.io.xacro.evaluate import evaluate
from kinegen.io.xacro.functions import mathematics, python, tokenized
from kinegen.io.xacro.values import MAX_DEPTH, MAX_SIZE, ExpressionError, Function

_LEVELS = 6
_MOST_FILES = 2_000
"""Files that one robot reads, one as often as it is included; two includes in each of twenty files are a million."""

_ENDINGS = ("_support", "_description", "_resources")
_USUAL = frozenset({"urdf", "xacro", "robots", "robot", "model", "models"})
"""Folders of a package in which robot files usually are, beside those that they include."""

_MANIFEST = "package.xml"
_NAME = re.compile(r"\w[\w.+-]*")


class MissingPackageError(Exception):
    """A package that nothing names."""


class RefusedError(OSError):
    """A file that a robot has no use for; an OSError, of which xacro prints the reason."""

    def __init__(self, reason: str, name: str = "") -> None:
        super().__init__(1, reason, name)

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}" if self.filename else str(self.strerror)


class Files:
    """The folders that may be read, around an absolute path and of packages that the user has named.

    A package is a folder with a `package.xml` of its name, a folder of its name that holds robot files, or one that the
    user has named. No link leads out of it.
    """

    def __init__(self, file: Path, packages: dict[str, Path], most: int) -> None:
        self._file = file
        self._packages = dict(packages)
        self._most = most
        self._read = 0
        self._shared = _shared()
        # The file may be a link to the one that the user works on, as in the install folder of a workspace.
        own = [_package_root(each, self._shared) for each in (file, file.resolve())]
        self._roots = [*own, *packages.values()]

    def find(self, name: str) -> str:
        """Return the folder of a package.

        Raises:
            RefusedError: If this is a path rather than a name.
            MissingPackageError: If there is no such package.
        """
        if not _NAME.fullmatch(name):
            raise RefusedError(f"$(find {name[:40]}) does not name a package; expected letters, digits and '_'")
        found = self._packages.get(name) or _search(self._file, name, self._shared)
        if found is None:
            raise MissingPackageError(name)
        self._packages[name] = found
        self._roots.append(found)
        return str(found)

    def allow(self, name: str) -> bool:
        """Tell whether a file is in one of the packages, all links followed; in a home, nothing that is hidden."""
        path = Path(os.path.realpath(name))
        around = [root for root in (Path(os.path.realpath(each)) for each in self._roots) if path.is_relative_to(root)]
        return any(root not in self._shared or not _is_hidden(path.relative_to(root)) for root in around)

    def readable(self, name: str) -> bool:
        """Tell whether this process has to open a file: those of packages, and manifests, which name packages."""
        return self.allow(name) or Path(name).name == _MANIFEST

    def matching(self, pattern: str) -> list[str]:
        """Return the files of a pattern with `*`; folders outside of the packages are not listed."""
        if not self.allow(str(Path(re.split(r"[*?\[]", pattern, maxsplit=1)[0] + "x").parent)):
            raise RefusedError(_OUTSIDE, pattern)
        return [name for name in glob.glob(pattern) if self.allow(name)]  # noqa: PTH207 - a text with folders in it

    def opened(self, name: str, mode: str = "r", *_: object, **__: object) -> io.StringIO:
        """Return the text of a file, as `open` gives it. Raises `RefusedError` if it may not be read."""
        if mode not in ("r", "rt"):
            raise RefusedError("xacro may only read")
        text = io.StringIO(self._text(name))
        text.name = name
        return text

    def _text(self, name: str) -> str:
        path = Path(os.path.realpath(name))
        if not self.allow(name):
            raise RefusedError(_OUTSIDE, name)
        if not path.is_file():
            raise RefusedError("there is no such file", name)
        self._read += 1
        if self._read > _MOST_FILES:
            raise RefusedError(f"more than {_MOST_FILES} files are included", name)
        # Some files do not say how large they are.
        try:
            with path.open("rb") as file:
                data = file.read(self._most + 1)
        except OSError as error:
            raise RefusedError(f"it cannot be read: {error.strerror}", name) from None
        if len(data) > self._most:
            raise RefusedError("the file is too large", name)
        text = data.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise RefusedError("a document type or entity declaration is not allowed", name)
        return text


_OUTSIDE = "it is outside the package of the robot; name its folder with --package-path NAME=DIR"


def _package_root(file: Path, shared: AbstractSet[Path]) -> Path:
    """Return the folder with `package.xml` around a file, or the folder above the one of the file."""
    around = list(file.parents)[:_LEVELS]
    marked = [folder for folder in around if (folder / _MANIFEST).is_file() and folder.resolve() not in shared]
    if marked or len(around) < 2:
        return (marked or around)[0]
    return around[1] if file.parent.name in _USUAL and around[1].resolve() not in shared else around[0]


def _shared() -> AbstractSet[Path]:
    """List folders that hold more than one robot: the home of a user, those above it, temporary ones."""
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - a user without a home is no error
    several = (Path("/tmp"), Path("/var/tmp"), Path("/home"), home, *home.parents)  # noqa: S108 - nothing is written
    return {each.resolve() for each in several if each.is_absolute()} | {Path(os.sep)}


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _search(file: Path, name: str, shared: AbstractSet[Path]) -> Path | None:
    """Find a package around or beside a file whose `package.xml` has this name, or that looks like it.

    Failing that, the package of the file if it differs by a usual ending: `kuka_kr10` for `kuka_kr10_support`. A link
    beside the file needs the `package.xml`.
    """
    around, own = list(file.parents)[:_LEVELS], _package_root(file, shared)
    for folder in (found for above in around for found in (above, above / name)):
        if _names(folder) == name:
            return folder
        looks = folder == own or (_holds_robots(folder, shared) and (folder in around or not folder.is_symlink()))
        if folder.name == name and looks:
            return folder
    stem = _without_ending(name)
    alike = (folder for folder in around if _without_ending(folder.name) == stem)
    return next((folder for folder in alike if folder == own or _holds_robots(folder, shared)), None)


def _holds_robots(folder: Path, shared: AbstractSet[Path]) -> bool:
    return folder.resolve() not in shared and any((folder / usual).is_dir() for usual in (*_USUAL, "meshes"))


def _without_ending(name: str) -> str:
    return next((name.removesuffix(ending) for ending in _ENDINGS if name.endswith(ending)), name)


def _names(folder: Path) -> str:
    manifest = folder / _MANIFEST
    if not manifest.is_file() or manifest.stat().st_size > 1 << 20:
        return ""
    found = re.search(r"<name>\s*([^<\s]+)\s*</name>", manifest.read_text(encoding="utf-8", errors="replace"))
    return found[1] if found else ""


_EVERYWHERE = "list dict map len str float int bool min max round sorted range"
"""Functions of Python that xacro has without a namespace."""


def symbols(argument: Callable[[str, Any], Any]) -> dict[str, Any]:
    """Return the names of every file; `argument` gives the value of an argument from its name and all values.

    `${...}` has the functions of `functions`, in the namespaces `python`, `math` and `xacro` and, as far as xacro has
    them there, without one.
    """
    import xacro

    builtin, mathematical = python(), mathematics()
    own = {
        "load_yaml": _load_yaml,
        "abs_filename": xacro.abs_filename_spec,
        "dotify": dict,
        "arg": lambda name: argument(name, xacro.substitution_args_context["arg"]),
        "tokenize": tokenized,
        "fatal": _fatal,
        **dict.fromkeys(("message", "warning", "error", "print_location"), _silent),
    }
    functions = {name: Function(name, call, takes_sets=call in (_fatal, _silent)) for name, call in own.items()}
    return {
        **mathematical,
        **{name: builtin[name] for name in _EVERYWHERE.split()},
        **{name: functions[name] for name in ("load_yaml", "abs_filename", "dotify")},
        "python": MappingProxyType(builtin),
        "math": MappingProxyType(mathematical),
        "xacro": MappingProxyType(functions),
    }


def _silent(*_: Any, **__: Any) -> str:
    """Print nothing of what a file says while it is expanded."""
    return ""


def _fatal(*words: Any) -> None:
    raise ExpressionError(" ".join(map(str, words)))


def _load_yaml(name: Any) -> Any:
    import xacro
    import yaml

    if type(name) is not str:
        raise ExpressionError("the name of a file is a text")
    try:
        # Anchors make small files large.
        return _plain(xacro.load_yaml(name), [MAX_SIZE])
    except yaml.YAMLError as error:
        raise ExpressionError(f"{name}: not valid YAML: {' '.join(str(error).split())}") from None


def _plain(value: Any, left: list[int], depth: int = 0) -> Any:
    """Return what YAML gives, without the classes that xacro wraps it with; as many values as are left."""
    left[0] -= 1
    if left[0] < 0 or depth > MAX_DEPTH:
        raise ExpressionError("the YAML file is too large, or nested too deeply")
    if isinstance(value, dict):
        pairs = dict.items(value)
        return {_plain(key, left, depth + 1): _plain(each, left, depth + 1) for key, each in pairs}
    if isinstance(value, list):
        return [_plain(each, left, depth + 1) for each in list.__iter__(value)]
    return str(value) if isinstance(value, dt.date) else value


_IN_EVAL = ("list", "dict", "map", "str", "float", "int")


class Arguments(Mapping[str, Any]):
    """The names of `$(eval ...)`: arguments of the file behind a few functions."""

    def __init__(self, context: Mapping[str, Any]) -> None:
        from xacro import substitution_args

        self._convert = substitution_args.convert_value
        self._values = context.get("arg", {})
        builtin = {
            name: each for name, each in python().items() if name in ("list", "dict", "map", "str", "float", "int")
        }
        own = {
            "arg": lambda name: self._convert(substitution_args._eval_arg(name, self._values), "auto"),  # noqa: SLF001
            "env": substitution_args._eval_env,  # noqa: SLF001
            "optenv": substitution_args._eval_optenv,  # noqa: SLF001
            "find": substitution_args._eval_find,  # noqa: SLF001
            "dirname": lambda: substitution_args._eval_dirname(context.get("filename")),  # noqa: SLF001
        }
        functions = {name: Function(name, call) for name, call in own.items()}
        self._functions = {**mathematics(), **builtin, **functions, "true": True, "false": False}

    @staticmethod
    def evaluated(text: str, context: Mapping[str, Any]) -> str:
        """Return the text that `$(eval ...)` stands for.

        Raises:
            RefusedError: If it is not an expression, does what is not allowed, or fails.
        """
        try:
            return str(evaluate(text, Arguments(context)))
        except ExpressionError as error:
            raise RefusedError(f"{error} when evaluating expression '{text}'") from None

    def __getitem__(self, name: str) -> Any:
        return self._functions[name] if name in self._functions else self._convert(self._values[name], "auto")

    def __iter__(self) -> Any:
        return iter({**self._functions, **self._values})

    def __len__(self) -> int:
        return len({**self._functions, **self._values})
