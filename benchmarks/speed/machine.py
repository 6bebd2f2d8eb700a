"""What the numbers were measured on, in words, and the core that the process keeps to."""

from __future__ import annotations

import os
import platform
import time
from pathlib import Path

import numpy as np


def pin(core: int | None = None) -> tuple[int, ...]:
    """Keep this process, and the threads that it will start, to one core.

    Args:
        core: Its number; by default the last one that the process may use, since the first serves most interrupts.

    Returns:
        All the cores that it could use before, the one that it keeps to standing first.
    """
    if not hasattr(os, "sched_getaffinity"):
        return (0,)
    cores = sorted(os.sched_getaffinity(0))
    kept = cores[-1] if core is None else core
    os.sched_setaffinity(0, {kept})
    return (kept, *(other for other in cores if other != kept))


def describe(cores: tuple[int, ...]) -> dict[str, str]:
    """The machine, as far as it matters to the numbers and says nothing about its owner."""
    return {
        "processor": processor_name(),
        "cores": f"{len(cores)}, one of them used where a row says one thread",
        "caches": _caches(cores[0]),
        "system": f"{platform.system()} {platform.machine()}, {' '.join(platform.libc_ver())}",
        "python": f"{platform.python_implementation()} {platform.python_version()}, NumPy {np.__version__}",
        "huge_pages": _huge_pages(),
        "priority": _priority(),
    }


def processor_name() -> str:
    """The model of the processor and its widest vectors."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    fields = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    name = fields.get("model name", platform.machine())
    family = f" (family {fields['cpu family']}, model {fields['model']})" if "cpu family" in fields else ""
    flags = fields.get("flags", fields.get("Features", "")).split()
    widest = next((f", {text}" for flag, text in _VECTORS.items() if flag in flags), "")
    return f"{name}{family}{widest}"


def load() -> float:
    """Jobs that wanted to run during the last minute, on average; this one counts too."""
    return os.getloadavg()[0]


def await_quiet(limit: float) -> bool:
    """Wait until other work leaves the machine alone.

    Args:
        limit: Seconds to wait at most.

    Returns:
        Whether it does now, as far as the system tells.
    """
    end = time.monotonic() + limit
    while True:
        before, begin = _busy_seconds(), time.monotonic()
        time.sleep(_GLANCE)
        if _busy_seconds() - before <= _QUIET * (time.monotonic() - begin):
            return True
        if time.monotonic() >= end:
            return False


def _busy_seconds() -> float:
    """Seconds that all cores together have worked so far."""
    try:
        fields = Path("/proc/stat").read_text(encoding="utf-8").split("\n", 1)[0].split()
    except OSError:
        return 0.0
    user, nice, system, _, _, irq, softirq, steal = map(int, fields[1:9])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")


_GLANCE = 0.5
"""Seconds of a look at how busy the machine is."""

_QUIET = 0.1
"""Cores that other work may keep busy."""


def waited() -> float:
    """Seconds that the threads of this process have waited for a core so far; 0 where the system does not tell."""
    total = 0
    for task in Path("/proc/self/task").glob("*"):
        try:
            total += int((task / "schedstat").read_text().split()[1])
        except (OSError, IndexError):
            continue
    return total * 1e-9


_VECTORS = {"avx512f": "AVX-512", "avx2": "AVX2", "sve": "SVE", "asimd": "NEON"}


def _caches(core: int) -> str:
    found = []
    for folder in sorted(Path(f"/sys/devices/system/cpu/cpu{core}/cache").glob("index*")):
        level, kind, size = ((folder / name).read_text().strip() for name in ("level", "type", "size"))
        if kind != "Instruction":
            found.append(f"L{level} {size.removesuffix('K')} KiB")
    return ", ".join(found) or "unknown"


def _priority() -> str:
    if hasattr(os, "sched_getscheduler") and os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR):
        return "real time (chrt), since the machine was busy"
    return "ordinary"


def _huge_pages() -> str:
    try:
        text = Path("/sys/kernel/mm/transparent_hugepage/enabled").read_text(encoding="utf-8")
    except OSError:
        return "unknown"
    return text.partition("[")[2].partition("]")[0] or "unknown"
