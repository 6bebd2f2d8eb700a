"""Runs xacro on one file, as a script in a process of its own; see `expand.py`.

In: a request as JSON on stdin. Out: the expanded text, or an error with its file and line, as JSON on stdout. Elements
remember where they were read; of an error inside of a macro the place is the call. Expressions may not reach for
attributes with an underscore, formats or types; files are opened in the package of the robot and in named folders only;
environment variables are not read.
"""

from __future__ import annotations

import ast
import contextlib
import io
import itertools
import json
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.dom import expatbuilder, minidom

_BARRED = frozenset({"format", "format_map", "mro", "type", "vars", "globals", "locals", "eval", "exec", "open"})
_LEVELS = 6
_MEMORY = 1 << 30
_LONGEST = 2000
_LARGEST_EXPONENT = 64
_PLACE = "place"


_ENDINGS = ("_support", "_description", "_resources")


class MissingPackageError(Exception):
    """A package that nothing names."""


class RefusedError(OSError):
    """What a robot has no use for; an OSError, of which xacro prints the reason."""

    def __init__(self, reason: str, name: str = "") -> None:
        super().__init__(1, reason, name)

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}" if self.filename else str(self.strerror)


def main() -> None:
    """Answer one request."""
    request = json.load(sys.stdin)
    _limit(int(request["seconds"]))
    sys.path[:] = request["path"]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        answer = _answer(request)
    print(json.dumps(answer))


def _limit(seconds: int) -> None:
    """Bound time and memory, where the system can; nothing is written."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    try:
        text = _expanded(request)
    except MemoryError:
        return {"error": "it takes too much memory"}
    except RecursionError as error:
        # The outermost element below the root is what is never done.
        places = list(itertools.islice(_places(error), 2))
        return {"error": "macros or includes are nested too deeply, or form a cycle", "place": [*places, None][-2]}
    except Exception as error:  # noqa: BLE001 - whatever an expression of a stranger raises
        cause, place = _cause(error), next(iter([*_places(error)][::-1]), None)
        if isinstance(cause, MissingPackageError):
            return {"error": "missing package", "package": str(cause), "place": place}
        message = re.sub(r"<class '[\w.]+'>: ", "", " ".join(str(cause or error).split()))
        return {"error": message[:400] or type(error).__name__, "place": place}
    if len(text) > request["bytes"]:
        return {"error": "the expanded text is too large for a robot file"}
    return {"urdf": text}


class _Builder(expatbuilder.ExpatBuilderNS):
    """Reads a document whose elements remember file and line."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def start_element_handler(self, name: Any, attributes: Any) -> None:
        """Read the begin of an element."""
        super().start_element_handler(name, attributes)
        self.curNode.setUserData(_PLACE, [self._name, self.getParser().CurrentLineNumber], None)  # type: ignore[arg-type]


def _parsed(file: Any) -> Any:
    """What xacro reads its files with."""
    return _Builder(file.name).parseFile(file)


def _places(error: BaseException) -> Iterator[list[Any]]:
    """File and line of the elements that were worked on, from the outermost to the innermost one."""
    trace = error.__traceback__
    while trace is not None:
        for name in ("node", "elt"):
            element = trace.tb_frame.f_locals.get(name)
            place = element.getUserData(_PLACE) if isinstance(element, minidom.Element) else None
            if place:
                yield place
        trace = trace.tb_next


def _cause(error: BaseException | None) -> BaseException | None:
    """Our own exception behind one that xacro has wrapped."""
    while error is not None and not isinstance(error, MissingPackageError | RefusedError):
        error = getattr(error, "exc", None) or error.__cause__ or error.__context__
    return error


def _expanded(request: dict[str, Any]) -> str:
    import xacro
    from xacro import substitution_args

    file = Path(request["file"])
    packages = {name: Path(folder) for name, folder in request["packages"].items()}
    roots = [_package_root(file), *packages.values()]

    def find(name: str) -> str:
        found = packages.get(name) or _search(file, name)
        if found is None:
            raise MissingPackageError(name)
        packages[name] = found
        roots.append(found)
        return str(found)

    def opened(name: str, mode: str = "r", *_: object, **__: object) -> io.TextIOBase:
        if mode not in ("r", "rt"):
            raise RefusedError("xacro may only read")
        text = io.StringIO(_text(name, roots, int(request["bytes"])))
        text.name = name
        return text

    plain_eval = xacro.safe_eval

    def checked_eval(expression: str, symbols: Any, names: Any = None) -> Any:
        _check_expression(expression)
        return plain_eval(expression, symbols, names)

    xacro.open = opened
    minidom.parse = _parsed  # type: ignore[assignment]
    xacro.safe_eval = checked_eval
    substitution_args._eval_find = find  # noqa: SLF001 - the one place where packages are looked up
    substitution_args._eval_dict["find"] = find  # noqa: SLF001
    # An environment is not part of a robot file: what is optional takes its default.
    os.environ.clear()
    substitution_args._eval = _refused_eval  # noqa: SLF001
    for name in _BARRED:
        xacro._global_symbols["python"].pop(name, None)  # noqa: SLF001
    document = xacro.process_file(str(file), mappings=request["arguments"])
    return str(document.toprettyxml(indent="  "))


def _refused_eval(expression: str, _context: object) -> str:
    raise RefusedError(f"$(eval {expression[:40]}) is not allowed; write ${{...}} instead")


def _check_expression(expression: str) -> None:
    """Refuse what a robot has no use for, and an attack has."""
    if len(expression) > _LONGEST:
        raise RefusedError("an expression is too long")
    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        name = getattr(node, "attr", None) or (node.id if isinstance(node, ast.Name) else "")
        if (
            name.startswith("_")
            and isinstance(node, ast.Attribute | ast.Name)
            and (name.startswith("__") or isinstance(node, ast.Attribute))
        ):
            raise RefusedError(f"'{name[:40]}' is not allowed in an expression")
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not _is_small(node.right):
            raise RefusedError(f"an exponent is a number up to {_LARGEST_EXPONENT}")
        if name in _BARRED or isinstance(node, ast.Lambda):
            raise RefusedError(f"'{name[:40] or 'lambda'}' is not allowed in an expression")


def _is_small(node: ast.expr) -> bool:
    if isinstance(node, ast.UnaryOp):
        return _is_small(node.operand)
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and node.value <= _LARGEST_EXPONENT


def _text(name: str, roots: list[Path], most: int) -> str:
    path = Path(os.path.realpath(name))
    if not any(path.is_relative_to(os.path.realpath(root)) for root in roots):
        raise RefusedError("it is outside the package of the robot; name its folder with --package-path NAME=DIR", name)
    if not path.is_file():
        raise RefusedError("there is no such file", name)
    if path.stat().st_size > most:
        raise RefusedError("the file is too large", name)
    text = path.read_text(encoding="utf-8", errors="replace")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise RefusedError("a document type or entity declaration is not allowed", name)
    return text


def _package_root(file: Path) -> Path:
    """The folder with `package.xml` around a file, or the folder above the one of the file."""
    around = list(file.parents)[:_LEVELS]
    marked = [folder for folder in around if (folder / "package.xml").is_file()]
    return marked[0] if marked else (around[1] if len(around) > 1 and file.parent.name in _USUAL else around[0])


_USUAL = frozenset({"urdf", "xacro", "robots", "robot", "model", "models"})
"""Folders of a package in which robot files usually are, beside those that they include."""


def _search(file: Path, name: str) -> Path | None:
    """A package around a file: a folder of this name, or one whose `package.xml` has it, or one beside these.

    Failing that, a folder that differs by a usual ending: `kuka_kr10` for `kuka_kr10_support`.
    """
    around = list(file.parents)[:_LEVELS]
    exact = (found for folder in around for found in (folder, folder / name))
    for found in exact:
        if found.is_dir() and (found.name == name or _names(found) == name):
            return found
    stem = _without_ending(name)
    return next((folder for folder in around if _without_ending(folder.name) == stem), None)


def _without_ending(name: str) -> str:
    return next((name.removesuffix(ending) for ending in _ENDINGS if name.endswith(ending)), name)


def _names(folder: Path) -> str:
    manifest = folder / "package.xml"
    if not manifest.is_file() or manifest.stat().st_size > 1 << 20:
        return ""
    found = re.search(r"<name>\s*([^<\s]+)\s*</name>", manifest.read_text(encoding="utf-8", errors="replace"))
    return found[1] if found else ""


if __name__ == "__main__":
    main()
