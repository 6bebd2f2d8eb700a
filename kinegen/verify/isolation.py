"""Compiled kernels are called in a process of their own, and their results lie between guard words.

Results of one form lie in rows of one array, each row with a guard on both sides, so that many are made and looked at
in one step. Memory is filled with ones in all bits: as a number that is NaN, so what a kernel leaves out is seen as
well.

A fork costs some milliseconds and has everything that was computed before. Where there is no fork that libraries of the
system survive, the work is done in this process.
"""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import math
import mmap
import os
import pickle
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from kinegen.errors import ProofError
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import RUNTIME
from kinegen.support.system import can_fork

Result = TypeVar("Result")

PATIENCE = 600.0
"""Seconds of processor time after which a call is ended."""

_LENGTH = 240
_END_WITH_PARENT = 1
"""The number of PR_SET_PDEATHSIG in <sys/prctl.h>."""

_FAILED = 70
"""The exit status of a process whose answer could not be handed over."""

_note: list[mmap.mmap] = []
"""Memory that both processes see, for the name of what is called; none outside such a process."""

_names = [""]


def calling(name: str) -> None:
    """Note what is called from now on, for the message if it does not come back.

    `name`: the kernel and how it is called.
    """
    _names[0] = name
    for note in _note:
        note[:_LENGTH] = name.encode()[:_LENGTH].ljust(_LENGTH, b"\0")
        signal.setitimer(signal.ITIMER_PROF, PATIENCE)


def latest_call() -> str:
    """Returns what was called last."""
    return _names[0]


def isolated(owner: str, work: Callable[[], Result]) -> Result:
    """Do work in a process of its own.

    `work`: what is done there; its result can be pickled. Returns what it returns. Raises `ProofError` if the process
    ends before the work is done; `Exception`: what the work raises.
    """
    if not can_fork():
        return work()
    with tempfile.TemporaryDirectory(prefix="kinegen-") as place, mmap.mmap(-1, _LENGTH) as note:
        reading, writing = os.pipe()
        with warnings.catch_warnings():
            # Python and some libraries warn of a fork beside threads; the child starts none of theirs.
            warnings.simplefilter("ignore")
            child = os.fork()
        if child == 0:
            _answer(work, writing, place, note)
        os.close(writing)
        answer, status = _awaited(child, reading)
        called = note[:_LENGTH].rstrip(b"\0").decode(errors="replace") or "the compiled module"
    if not answer:
        raise ProofError(f"{owner}: {called} {_ended(status)}; nothing was written")
    result: Result = _taken(answer)
    return result


def _awaited(child: int, reading: int) -> tuple[bytes, int]:
    """Returns what a process answers, and how it ends; it is ended if the wait is."""
    try:
        with os.fdopen(reading, "rb") as pipe:
            answer = pipe.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        status = 0
        with contextlib.suppress(ChildProcessError):  # whoever ignores SIGCHLD has no status either
            status = os.waitpid(child, 0)[1]
    return answer, os.waitstatus_to_exitcode(status)


def _ended(status: int) -> str:
    """Returns how a process ended, in words."""
    if -status == signal.SIGPROF:
        return f"does not return within {PATIENCE:.0f} s of CPU time"
    if -status == signal.SIGKILL:
        return "was ended from outside (SIGKILL), as the system does when memory is short"
    if status < 0:
        return f"crashes ({signal.Signals(-status).name})"
    return f"ends the process that calls it, with exit status {status}"


def _taken(answer: bytes) -> Any:
    """Returns the result in an answer; what was raised is raised again, with the lines where it was."""
    is_result, found, lines = pickle.loads(answer)  # noqa: S301 - written by our own child
    if is_result:
        return found
    raise found from _There(lines)


class _There(Exception):  # noqa: N818 - it only carries the lines of another process
    """The lines at which another process raised what is raised again here."""


# In the child ---------------------------------------------------------------------------------------------------------


def _answer(work: Callable[[], Any], writing: int, place: str, note: mmap.mmap) -> NoReturn:
    """Do the work, hand over what came of it, and end without a word."""
    status = _FAILED
    try:
        _settle(place)
        _note.append(note)
        calling("the compiled module")
        try:
            answer = True, work(), ""
        except BaseException as error:  # noqa: BLE001 - the other process decides what to do with it
            answer = False, error, f"\n{traceback.format_exc()}"
        with os.fdopen(writing, "wb") as pipe:
            pipe.write(_pickled(answer))
        status = 0
    finally:
        os._exit(status)


def _pickled(answer: tuple[bool, Any, str]) -> bytes:
    """Returns an answer as bytes; of an exception that cannot be pickled, its words."""
    try:
        found = pickle.dumps(answer)
        pickle.loads(found)  # noqa: S301 - made in the line before; some exceptions only fail here
    except Exception:
        # Whatever an exception of a library has in it.
        is_result, error, lines = answer
        if is_result:
            raise
        found = pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}"), lines))
    return found


def _settle(place: str) -> None:
    """Temporary files go where the parent removes them; nothing but the answer reaches anybody."""
    tempfile.tempdir = place
    faulthandler.disable()
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, sys.__stderr__.fileno() if sys.__stderr__ else 2)
    for number in (signal.SIGINT, signal.SIGPROF):
        signal.signal(number, signal.SIG_DFL)
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_END_WITH_PARENT, signal.SIGKILL)


GUARD = 64
"""Entries on each side of a result, or as many as the result has, up to `_MOST`."""

_MOST = 1024
_ONES = 0xFF
_ROOM = 1 << 20
"""Bytes of one array of results, unless one result is larger."""

_PENDING = 1 << 23
"""Bytes that are looked at together."""

_MODULES = (
    "_kernel",
    "_engines",
    "_inverse",
    "_numeric_inverse",
    "_tips_inverse",
    "_complete_inverse",
    "_redundancy_range",
    "_inverse_tracker",
    "_tracked",
)
"""The modules of a package that make memory for what C writes."""

Shape = tuple[int, ...] | int


@dataclass(slots=True)
class GuardedRows:
    """Results of one form between guards."""

    whole: NDArray[Any]  # Guards and results, a row each
    cells: NDArray[Any]
    first: int  # Entries of the guard in front
    used: int = 0  # How many are given away
    seen: int = 0  # How many of these were looked at

    @classmethod
    def of(cls, count: int, shape: tuple[int, ...], dtype: DTypeLike, *, used: int = 0) -> GuardedRows:
        """Memory for results. `used`: how many are given away."""
        size = math.prod(shape)
        guard = guard_of(size)
        whole = np.empty((count, size + 2 * guard), dtype)
        whole.view(np.uint8)[...] = _ONES
        return cls(whole, whole[:, guard : guard + size].reshape(count, *shape), guard, used)

    def require(self, owner: str) -> None:
        """Refuse a kernel that has written beside these results. Raises `ProofError` naming what was called last."""
        if not self.is_intact():
            raise ProofError(f"{owner}: {latest_call()} writes outside its results; nothing was written")

    def is_intact(self) -> bool:
        """Returns whether the guards of the results given away since the last look are as they were."""
        rows, size = self.whole[self.seen : self.used], math.prod(self.cells.shape[1:])
        self.seen = self.used
        sides = rows[:, : self.first], rows[:, self.first + size :]
        return all(bool((side.view(np.uint8) == _ONES).all()) for side in sides)


def guard_of(size: int) -> int:
    """Entries of a guard of a result with so many."""
    return min(max(GUARD, size), _MOST)


class Guards:
    """Memory for results, watched."""

    def __init__(self, owner: str) -> None:
        self.owner, self._bytes = owner, 0
        self._open: dict[tuple[Shape, np.dtype[Any]], GuardedRows] = {}
        self._touched: list[GuardedRows] = []

    def empty(self, shape: Shape, dtype: DTypeLike = float) -> NDArray[Any]:
        """As `numpy.empty`."""
        key = shape, np.dtype(dtype)
        rows = self._open.get(key)
        if rows is None or rows.used == len(rows.cells):
            rows = self._more(*key, rows)
        if rows.used == rows.seen:
            self._touched.append(rows)
        rows.used += 1
        found: NDArray[Any] = rows.cells[rows.used - 1, ...]
        return found

    def zeros(self, shape: Shape, dtype: DTypeLike = float) -> NDArray[Any]:
        """As `numpy.zeros`."""
        found = self.empty(shape, dtype)
        found[...] = np.zeros((), dtype)
        return found

    def empty_like(self, other: NDArray[Any]) -> NDArray[Any]:
        """As `numpy.empty_like`, in the order of C."""
        return self.empty(other.shape, other.dtype)

    def require(self) -> None:
        """Refuse a kernel that has written beside its results. Raises `ProofError` naming what was called last."""
        touched, self._touched, self._bytes = self._touched, [], 0
        if not all(rows.is_intact() for rows in touched):
            raise ProofError(f"{self.owner}: {latest_call()} writes outside its results; nothing was written")

    def _more(self, shape: Shape, dtype: np.dtype[Any], before: GuardedRows | None) -> GuardedRows:
        """Returns the next array of results of a form, twice as many as before."""
        if self._bytes > _PENDING:
            self.require()
            self._open.clear()
        inner = shape if isinstance(shape, tuple) else (shape,)
        size = math.prod(inner)
        most = max(1, _ROOM // ((size + 2 * guard_of(size)) * max(1, dtype.itemsize)))
        count = 1 if before is None else min(2 * len(before.cells), most)
        rows = self._open[shape, dtype] = GuardedRows.of(count, inner, dtype)
        self._bytes += rows.whole.nbytes
        return rows


_active: list[Guards] = []


@contextmanager
def guarded(owner: str, package: ModuleType) -> Iterator[None]:
    """Watch all results of a package.

    `package`: its generated package, imported; nobody else uses it. Raises `ProofError` if something was written beside
    a result.
    """
    guards = Guards(owner)
    numpy = ModuleType("numpy")
    vars(numpy).update(vars(np), empty=guards.empty, zeros=guards.zeros, empty_like=guards.empty_like)
    modules = [sys.modules.get(f"{package.__name__}.{RUNTIME}.{name}") for name in _MODULES]
    for module in filter(None, modules):
        vars(module).update({name: numpy for name, each in vars(module).items() if each is np})
        vars(module).update({name: guards.empty for name, each in vars(module).items() if each is np.empty})
    _active.append(guards)
    try:
        yield
        guards.require()
    finally:
        _active.remove(guards)


def require_guards() -> None:
    """Look at the guards of all results since the last look.

    Raises `ProofError` if something was written beside a result.
    """
    for guards in _active:
        guards.require()


def watched(call: Callable[..., Any], inputs: tuple[NDArray[Any], ...]) -> Any:
    """Call something that must not change its inputs, nor write beside its results.

    `call`: what is called with the inputs as one tuple. Raises `ProofError` if it does.
    """
    before = tuple(array.tobytes() for array in inputs)
    found = call(inputs)
    require_guards()
    if any(array.tobytes() != kept for array, kept in zip(inputs, before, strict=True)):
        owner = "".join(f"{guards.owner}: " for guards in _active[-1:])
        raise ProofError(f"{owner}{latest_call()} changes its inputs; nothing was written")
    return found
