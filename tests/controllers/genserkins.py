"""The module of a package and LinuxCNC's genserkins on the same PUMA 560, in one process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kinegen.backends.controllers.controller import Controller
from tests.controllers.halrun import MODULES, ask, installed
from tests.controllers.packages import write_package

COUNT = 2000

_TABLE = (
    ("0", "0", "0"),
    ("0", "-1.5707963267948966", "0"),
    ("431.8", "0", "150.05"),
    ("20.3", "-1.5707963267948966", "431.8"),
    ("0", "1.5707963267948966", "0"),
    ("0", "-1.5707963267948966", "0"),
)
"""Rows a, alpha, d of `robots/puma560.yaml`, in mm and radians."""

_RANGES = ((-2.5, 2.5), (-3, 0.5), (-1, 1), (-1.8, 2.7), (0.3, 1.5), (-2, 2))


@dataclass(frozen=True)
class Pair:
    """A number of each module."""

    ours: float
    theirs: float


@dataclass(frozen=True)
class Compared:
    """Median ticks of a pose with its inverse, and failures."""

    ticks: Pair
    failures: Pair


def compare(place: Path, *, straight: bool) -> Compared:
    """Poses of random joint vectors, and the joints for them from up to 15 degrees away.

    The probe has to be installed.

    Args:
        place: A folder for the files of this run.
        straight: Whether joint 5 is at 0, where axes 4 and 6 are in line.
    """
    place.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    rows = []
    for _ in range(COUNT):
        q = np.degrees([rng.uniform(low, high) for low, high in _RANGES])
        q[4] = 0.0 if straight else q[4]
        rows.append(" ".join(repr(float(value)) for value in (*q, *(q + rng.uniform(-15, 15, 6)))))
    asked = "\n".join([f"ticks {COUNT} 6", *rows])
    setup = ["loadrt genserkins"]
    for joint, entries in enumerate(_TABLE):
        names = ("A", "ALPHA", "D")
        setup += [f"setp genserkins.{name}-{joint} {entry}" for name, entry in zip(names, entries, strict=True)]
    with installed(write_package(place, "puma560", Controller.LINUXCNC)) as module:
        answers = ask(
            place,
            [*setup, f"loadrt {module}"],
            [f"use {MODULES}/{module}.so", asked, f"use {MODULES}/genserkins.so", asked],
        )
    assert answers[0] == answers[COUNT + 2] == ["found"]
    parts = answers[1 : COUNT + 2], answers[COUNT + 3 :]
    ticks = [float(np.median([int(row[0]) for row in part[:COUNT]])) for part in parts]
    failures = [float(part[COUNT][1]) for part in parts]
    return Compared(Pair(*ticks), Pair(*failures))
