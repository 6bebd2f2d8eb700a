"""Processes that share the files of a run: a cluster of Dask on this machine, or one that is there already.

The compiled module travels as bytes, so a worker needs kinegen and pyarrow, and sees the same paths. A worker that is
lost costs what it was computing; another one computes it again.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import importlib
import logging
import queue
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, shown
from kinegen.runtime.compiler import find_compiler, processor
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.plan import Part
from kinegen.tools.datasets.worker import Job, make_part
from kinegen.tools.datasets.writing import Made

_PATIENCE = 10
"""Seconds that a scheduler has for its first answer."""

_PAUSE = 0.2
"""Seconds after which Ctrl-C is looked for."""

LOSSES = 20
"""Workers that may be lost over one file before the run gives up."""


@dataclass(frozen=True, slots=True)
class Shipped:
    """A compiled module as bytes: the name under which it is imported elsewhere, and its files by path."""

    name: str
    files: tuple[tuple[str, bytes], ...]

    def load(self) -> ModuleType:
        """Return the module, imported from a new folder unless this process has it already."""
        if self.name in sys.modules:
            return sys.modules[self.name]
        # A folder that goes with the worker, so that nothing is left behind.
        home = _folder_for_modules()
        for path, content in self.files:
            target = home / self.name / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        sys.path.insert(0, str(home))
        try:
            return importlib.import_module(self.name)
        finally:
            sys.path.remove(str(home))


def _folder_for_modules() -> Path:
    """A new folder that goes with the worker: that of Dask, which is removed also after a kill, or this process."""
    distributed = library("distributed", "a cluster", "fleet")
    try:
        place = distributed.get_worker().local_directory
    except ValueError:
        place = None
    home = tempfile.mkdtemp(prefix="kinegen-shipped-", dir=place)
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    return Path(home)


def way_of(module: ModuleType, *, reproducible: bool) -> str:
    """Return words for the way in which kernels were made: equal ones mean the same bits of their results."""
    if module.backend == "c" and reproducible:
        return "c, reproducible"
    machine = [processor().describe(), find_compiler().version if module.backend == "c" else f"numpy {np.__version__}"]
    return f"{module.backend}, {hashlib.sha256(repr(machine).encode()).hexdigest()[:16]}"


def ship(module: ModuleType) -> Shipped:
    """Return a package that kinegen wrote as bytes."""
    folder = Path(str(module.__file__)).parent
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".pyc"]
    files = tuple((path.relative_to(folder).as_posix(), path.read_bytes()) for path in paths)
    digest = hashlib.sha256(repr(files).encode()).hexdigest()[:16]
    return Shipped(f"kinegen_shipped_{digest}", files)


@contextmanager
def processes(workers: int, scheduler: str) -> Iterator[Any]:
    """Yield a client of processes on this machine, or of a scheduler such as `tcp://10.0.0.1:8786` if it answers."""
    distributed = library("distributed", "--workers" if workers else "--scheduler", "fleet")
    dask = library("dask", "a cluster", "fleet")
    # A worker that runs out of memory pauses instead of being killed, and says nothing on the terminal.
    settings = {
        "distributed.scheduler.allowed-failures": LOSSES,
        "distributed.worker.memory.terminate": False,
        "distributed.comm.timeouts.connect": f"{_PATIENCE}s",
        "logging": {"distributed": "critical"},
    }
    with dask.config.set(settings):
        # Workers of one's own are started here; those of a scheduler are only asked.
        try:
            if scheduler:
                client = distributed.Client(scheduler, timeout=_PATIENCE)
            else:
                cluster = _started(distributed, workers)
                client = distributed.Client(cluster)
        except (OSError, ValueError, TimeoutError) as error:
            reason = str(error).partition("\n")[0]
            raise KinegenError(f"there is no scheduler at {shown(scheduler)}: {reason}") from error
        try:
            yield client
        finally:
            with _silent():
                client.close()
                if not scheduler:
                    cluster.close()


@contextmanager
def _silent() -> Iterator[None]:
    """No words of Dask while it closes connections on which work is still under way."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


@contextmanager
def _held_back() -> Iterator[threading.Event]:
    """Yield whether Ctrl-C was pressed: it is raised at the end, and not in the midst of a library that swallows it."""
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    before = signal.signal(signal.SIGINT, lambda _number, _frame: pressed.set())
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
        if pressed.is_set() and callable(before):
            before(signal.SIGINT, None)


_DEAF = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
"""What a worker runs first, also one that is started later as a replacement for a lost one."""


@contextmanager
def _ctrl_c_later() -> Iterator[None]:
    """Processes that are started here ignore Ctrl-C, and one that is pressed meanwhile is raised afterwards."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # A signal that is held back is kept even while it is ignored.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _started(distributed: Any, workers: int) -> Any:
    """Return a cluster on this machine, whose processes leave Ctrl-C to this one."""
    with _ctrl_c_later():
        return distributed.LocalCluster(
            workers,
            threads_per_worker=1,
            # Any free port: the scheduler has an HTTP server also without a dashboard.
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
            silence_logs=50,
            memory_limit=0,
            preload=[_DEAF],
        )


def make_parts(
    client: Any,
    job: Job,
    module: ModuleType,
    parts: Sequence[Part],
    tell: Callable[[int], None],
    keep: Callable[[str, Made], None],
) -> None:
    """Have the files written by the workers of a cluster.

    `tell` is called with the rows of each file that is written, `keep` with its name and what it holds. If a file
    cannot be made, which is an error, those that are complete stay.
    """
    distributed = library("distributed", "a cluster", "fleet")
    finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
    with _held_back() as pressed:
        shipped = client.scatter(ship(module), broadcast=True)
        # Not pure: a file is written anew even where a worker remembers one of another run.
        futures = {client.submit(_make, job, shipped, part, pure=False): part for part in parts}
        for future in futures:
            future.add_done_callback(finished.put)
        try:
            for _ in parts:
                future = _next(finished, pressed)
                if future is None:
                    break
                try:
                    made = future.result()
                except distributed.scheduler.KilledWorker as error:
                    raise KinegenError(f"{futures[future].name}: the worker was lost {LOSSES} times") from error
                keep(futures[future].name, made)
                tell(made.rows)
        finally:
            with _silent():
                client.cancel(list(futures))


def _next(finished: queue.SimpleQueue[Any], pressed: threading.Event) -> Any:
    """Return the next future that is done; None where Ctrl-C was pressed."""
    while not pressed.is_set():
        with contextlib.suppress(queue.Empty):
            return finished.get(timeout=_PAUSE)
    return None


def _make(job: Job, shipped: Shipped, part: Part) -> Made:
    """On a worker: one file."""
    Path(job.folder).mkdir(parents=True, exist_ok=True)
    return make_part(job, shipped.load(), part, lambda _rows: None)
