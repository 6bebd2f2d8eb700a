"""Runs xacro on one file, as a script in a process of its own; see `expand.py`.

In: a request as JSON on stdin. Out: the expanded text, or an error with its file and line, as JSON on stdout. Elements
remember where they were read; of an error inside of a macro the place is the call. Expressions are computed by
`evaluate`, never by Python; files are read through `Files`; environment variables are not read. Beside that the process
gives up what it does not need: it writes no file, starts no program, opens no connection.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType, SimpleNamespace
from typing import Any
from xml.dom import expatbuilder, minidom

_MEMORY = 1 << 30
_MOST_MACROS = 5_000
"""Calls of macros in one file; a humanoid takes hundreds."""

_DEEPEST = 2_200
"""Calls within calls: an expression takes more of them here than in xacro, which has 1000."""

_PLACE = "place"


def main() -> None:
    """Answer one request."""
    request = json.load(sys.stdin)
    sys.setrecursionlimit(_DEEPEST)
    sys.path[:] = [*request["path"], str(Path(__file__).resolve().parents[3])]
    # Limits first: whatever comes now is the file of a stranger.
    _limit(int(request["seconds"]))
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        answer = _answer(request)
    print(json.dumps(answer))


def _limit(seconds: int) -> None:
    """Bound time and memory, where the system can; nothing is written, and no other process started."""
    from kinegen.support.system import limit

    limit({"CPU": (seconds, seconds + 1), "AS": (_MEMORY, _MEMORY), "FSIZE": (0, 0), "NPROC": (0, 0)})


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    from kinegen.io.xacro.files import MissingPackageError

    missing: dict[str, list[Any] | None] = {}
    given = set(request["arguments"])
    try:
        text = _expanded(request, missing)
        text.encode()
    except MemoryError:
        return {"error": "it takes too much memory"}
    except RecursionError as error:
        # The outermost element below the root is what is never done.
        places = list(itertools.islice(_places(_frames(error)), 2))
        return {"error": "macros or includes are nested too deeply, or form a cycle", "place": [*places, None][-2]}
    except UnicodeEncodeError as error:
        return {"error": f"after expansion: {error.object[error.start]!a} is not a character"}
    except Exception as error:  # noqa: BLE001 - whatever a file of a stranger raises in xacro
        if missing:
            return _unset(missing, [name for name in request["arguments"] if name not in given])
        cause, place = _cause(error), next(iter([*_places(_frames(error))][::-1]), None)
        if isinstance(cause, MissingPackageError):
            return {"error": "missing package", "package": str(cause), "place": place}
        return {"error": _message(cause or error), "place": place}
    if missing:
        return _unset(missing, [name for name in request["arguments"] if name not in given])
    if len(text) > request["bytes"]:
        return {"error": "the expanded text is too large for a robot file"}
    return {"urdf": text}


def _message(error: BaseException) -> str:
    """Return what an error says, with the innermost expression alone."""
    message = re.sub(r"<class '[\w.]+'>: ", "", " ".join(str(error).split())) or type(error).__name__
    said, _, expressions = message.partition(_EVALUATED)
    # xacro puts the message of an error behind that of the error that wraps it, which may be the same.
    said = re.sub(r"\A(.+) \1\Z", r"\1", said[:1000])
    expression = expressions.partition(_EVALUATED)[0]
    return f"{said[:400]}{expression and _EVALUATED + _shortened(expression)}"


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


_EVALUATED = " when evaluating expression "
_LONGEST_SHOWN = 80
_MOST_NAMES = 8


def _unset(missing: dict[str, list[Any] | None], defaults: list[str]) -> dict[str, Any]:
    """Return what is said of arguments without a value: those that were needed until the end, or until the first error.

    xacro adds those that have a default to the arguments as it meets them.
    """
    names = ", ".join(repr(name) for name in missing)
    words = " ".join(f"{name}:=VALUE" for name in missing)
    of = "argument" if len(missing) == 1 else "arguments"
    others = [name for name in defaults if name not in missing]
    shown = ", ".join(others[:_MOST_NAMES]) + ", ..." * (len(others) > _MOST_NAMES)
    also = f" (with a default: {shown})" if others else ""
    message = f"no value for the {of} {names}; write {words} after the file{also}"
    return {"error": message, "place": next(iter(missing.values()))}


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
    """Return what xacro reads its files with."""
    return _Builder(file.name).parseFile(file)


def _frames(error: BaseException) -> Iterator[FrameType]:
    trace = error.__traceback__
    while trace is not None:
        yield trace.tb_frame
        trace = trace.tb_next


def _places(frames: Iterator[FrameType]) -> Iterator[list[Any]]:
    """Return file and line of the elements that are worked on in these frames."""
    for frame in frames:
        for name in ("node", "elt"):
            element = frame.f_locals.get(name)
            place = element.getUserData(_PLACE) if isinstance(element, minidom.Element) else None
            if place:
                yield place


def _cause(error: BaseException | None) -> BaseException | None:
    """Find our own exception behind one that xacro has wrapped."""
    from kinegen.io.xacro.files import MissingPackageError, RefusedError

    while error is not None and not isinstance(error, MissingPackageError | RefusedError):
        error = getattr(error, "exc", None) or error.__cause__ or error.__context__
    return error


def _expanded(request: dict[str, Any], missing: dict[str, list[Any] | None]) -> str:
    import xacro
    from xacro import substitution_args

    from kinegen.io.xacro.files import Arguments, Files, symbols

    file = Path(request["file"])
    files = Files(file, {name: Path(folder) for name, folder in request["packages"].items()}, int(request["bytes"]))
    # An environment is not part of a robot file: what is optional takes its default.
    os.environ.clear()

    def argument(name: str, args: dict[str, Any]) -> Any:
        if name not in args:
            # One run finds as many of them as it can.
            missing.setdefault(name, next(_places(frame for frame, _ in traceback.walk_stack(None)), None))
        return args.get(name, "")

    _replace_in(xacro, files.opened, files.matching)
    # xacro would offer Python's own functions and the environment.
    xacro._global_symbols.clear()  # noqa: SLF001
    xacro._global_symbols.update(symbols(argument))  # noqa: SLF001
    minidom.parse = _parsed  # type: ignore[assignment]
    substitution_args._eval_arg = argument  # noqa: SLF001
    substitution_args._eval_find = files.find  # noqa: SLF001
    substitution_args._eval = Arguments.evaluated  # noqa: SLF001
    # From here on nothing but files of packages is opened.
    sys.addaudithook(_guard(files.readable))
    document = xacro.process_file(str(file), mappings=request["arguments"])
    return str(document.toprettyxml(indent="  "))


def _replace_in(xacro: Any, opened: Callable[..., Any], matching: Callable[[str], list[str]]) -> None:
    """Take out of xacro what evaluates, opens and lists, and bound how often it expands macros."""
    from kinegen.io.xacro.evaluate import evaluate
    from kinegen.io.xacro.files import RefusedError

    class Table(xacro.Table):  # type: ignore[misc]
        """Properties of one call of a macro."""

        count = 0

        def __init__(self, parent: Any = None) -> None:
            super().__init__(parent)
            Table.count += 1
            # One for the properties, one for the macros.
            if Table.count > 2 * _MOST_MACROS:
                raise RefusedError(f"macros are called more than {_MOST_MACROS} times")

    xacro.Table = Table
    xacro.safe_eval = lambda expression, scope, _names=None: evaluate(expression, scope)
    xacro.open = opened
    xacro.glob = SimpleNamespace(glob=matching)


_QUIET = ("os.listdir", "os.scandir")
_BARRED = ("os.", "subprocess.", "socket.", "ctypes.", "shutil.", "fcntl.", "pty.", "mmap.", "syslog.", "_winapi.")


def _guard(readable: Callable[[str], bool]) -> Callable[[str, tuple[Any, ...]], None]:
    """Return a hook of Python that ends what a file should never bring about; it cannot be taken away again."""
    own = tuple(os.path.realpath(each) + os.sep for each in (*sys.path, sys.prefix, sys.base_prefix) if each)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            name, _, flags = arguments
            written = flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
            # Python's own modules may still be loaded.
            known = isinstance(name, int) or os.path.realpath(name).startswith(own)
            if written or not (known or readable(os.fspath(name))):
                raise PermissionError("xacro may only read files of the package")
        elif event.startswith(_BARRED) and event not in _QUIET:
            raise PermissionError(f"xacro may not do this: {event}")

    return hook


if __name__ == "__main__":
    main()
