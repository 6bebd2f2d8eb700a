"""Processes that share the files of a run: a cluster of Dask on this machine, or one that is there already.

The compiled module travels as bytes, so a worker needs kinegen and pyarrow, and sees the same paths. A worker that is
lost costs what it was computing; another one computes it again.
"""

from __future__ import annotations

import hashlib
import importlib
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from kinegen.errors import KinegenError, shown
from kinegen.fleet.plan import Part
from kinegen.fleet.work import Job, make_part
from kinegen.workspace.optional import library

_PATIENCE = 10
"""Seconds that a scheduler has for its first answer."""

LOSSES = 20
"""Workers that may be lost over one file before the run gives up."""


@dataclass(frozen=True, slots=True)
class Shipped:
    """A compiled module as bytes.

    Attributes:
        name: Its name, under which it is imported elsewhere.
        files: Its files by path.
    """

    name: str
    files: tuple[tuple[str, bytes], ...]

    def load(self) -> ModuleType:
        """The module, imported from a new folder unless this process has it already."""
        if self.name in sys.modules:
            return sys.modules[self.name]
        home = Path(tempfile.mkdtemp(prefix="kinegen-shipped-"))
        for path, content in self.files:
            target = home / self.name / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        sys.path.insert(0, str(home))
        try:
            return importlib.import_module(self.name)
        finally:
            sys.path.remove(str(home))


def ship(module: ModuleType) -> Shipped:
    """A module as bytes.

    Args:
        module: A package that kinegen wrote.
    """
    folder = Path(str(module.__file__)).parent
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".pyc"]
    files = tuple((path.relative_to(folder).as_posix(), path.read_bytes()) for path in paths)
    digest = hashlib.sha256(repr(files).encode()).hexdigest()[:16]
    return Shipped(f"kinegen_shipped_{digest}", files)


@contextmanager
def processes(workers: int, scheduler: str) -> Iterator[Any]:
    """A client of a cluster.

    Args:
        workers: Processes to start on this machine; 0 to use the scheduler's.
        scheduler: Address of a scheduler, such as `tcp://10.0.0.1:8786`; empty for a cluster of one's own.

    Raises:
        KinegenError: If Dask is missing, or nobody answers at the address.
    """
    distributed = library("distributed", "--workers" if workers else "--scheduler", "fleet")
    dask = library("dask", "a cluster", "fleet")
    settings = {
        "distributed.scheduler.allowed-failures": LOSSES,
        "distributed.worker.memory.terminate": False,
        "distributed.comm.timeouts.connect": f"{_PATIENCE}s",
        "logging": {"distributed": "critical"},
    }
    with dask.config.set(settings):
        try:
            if scheduler:
                client = distributed.Client(scheduler, timeout=_PATIENCE)
            else:
                cluster = distributed.LocalCluster(
                    workers, threads_per_worker=1, dashboard_address=None, silence_logs=50, memory_limit=0
                )
                client = distributed.Client(cluster)
        except (OSError, ValueError, TimeoutError) as error:
            reason = str(error).partition("\n")[0]
            raise KinegenError(f"there is no scheduler at {shown(scheduler)}: {reason}") from error
        try:
            yield client
        finally:
            client.close()
            if not scheduler:
                cluster.close()


def make_parts(client: Any, job: Job, module: ModuleType, parts: Sequence[Part], tell: Callable[[int], None]) -> None:
    """Have the files written by the workers of a cluster.

    Args:
        client: A client of Dask.
        job: The run.
        module: The compiled robot.
        parts: The files.
        tell: Called with the rows of each file that is written.

    Raises:
        KinegenError: If a file cannot be made; those that are complete stay.
    """
    distributed = library("distributed", "a cluster", "fleet")
    shipped = client.scatter(ship(module), broadcast=True)
    # Not pure: a file is written anew even where a worker remembers one of another run.
    futures = {client.submit(_make, job, shipped, part, pure=False): part for part in parts}
    try:
        for future in distributed.as_completed(futures):
            try:
                tell(future.result())
            except distributed.scheduler.KilledWorker as error:
                raise KinegenError(f"{futures[future].name}: the worker was lost {LOSSES} times") from error
    finally:
        client.cancel(list(futures))


def _make(job: Job, shipped: Shipped, part: Part) -> int:
    """On a worker: one file."""
    Path(job.folder).mkdir(parents=True, exist_ok=True)
    return make_part(job, shipped.load(), part, lambda _rows: None)
