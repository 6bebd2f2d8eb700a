"""A whole LinuxCNC run of the simulation in a package, with every commanded position of its joints."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.controllers.halrun import as_nobody, installed
from tests.controllers.packages import HERE

Numbers = NDArray[np.float64]
PERIOD = 1e-3
"""Seconds of a servo period in emitted INI files."""

_SAME = 1e-7
"""Joints that differ by less are at the same place, in LinuxCNC's units."""


@dataclass(frozen=True)
class Run:
    """What a run left.

    Attributes:
        steps: For home and each line what the operator wrote.
        joints: Joints about every 10 milliseconds, shape (N, joints), in the units of LinuxCNC.
        trace: What the inverse of the module gave in every servo period, likewise. LinuxCNC then draws a cubic spline
            through these, joint by joint.
    """

    steps: list[dict[str, Any]]
    joints: Numbers
    trace: Numbers

    def moving(self, step: int) -> Numbers:
        """The commanded joints while a line was done, from where it begins to where it ends."""
        begin, end = self.steps[step - 1]["joints"], self.steps[step]["joints"]
        after = 0
        for number in range(1, step):
            after = self._at(self.steps[number]["joints"], after)
        first = self._leaves(begin, after)
        return self.trace[first : self._at(end, first + 1) + 1]

    def _at(self, place: Sequence[float], after: int) -> int:
        """The first period after another one in which the joints stand at a place."""
        there = self._stands(place, after)
        assert there.any(), f"no joints at {place}"
        return after + int(np.argmax(there))

    def _leaves(self, place: Sequence[float], after: int) -> int:
        """The last period at a place before the joints leave it."""
        first = self._at(place, after)
        return first + int(np.argmax(~self._stands(place, first))) - 1

    def _stands(self, place: Sequence[float], after: int) -> NDArray[np.bool_]:
        return np.asarray(np.abs(self.trace[after:] - np.array(place)).max(axis=1) < _SAME)


def run_package(
    folder: Path,
    lines: Sequence[str],
    home: Sequence[float] = (),
    ini: Mapping[str, str] | None = None,
    hal: Sequence[str] = (),
    files: Mapping[str, str] | None = None,
) -> Run:
    """Start the simulation of a package with the operator of these tests as its display.

    Args:
        folder: The package; what is run is a copy beside it.
        lines: What the operator does.
        home: Where the joints are at home, if not where the package says.
        ini: Lines of the INI file by the pattern of those that they replace.
        hal: Lines that are added to the HAL file.
        files: Further files of the folder of the INI file.
    """
    place, name = folder.parent / "run", folder.name
    place.mkdir()
    folder = Path(shutil.copytree(folder, place / name))
    _change(folder / "sim" / f"{name}.ini", place, home, ini or {})
    count = len(re.findall(r"^\[JOINT_", (folder / "sim" / f"{name}.ini").read_text(), flags=re.M))
    traced = [f"loadrt kinegen_trace joints={count}", "addf kinegen_trace servo-thread"]
    traced += [
        f"net traced-{number} joint.{number}.coarse-pos-cmd => kinegen_trace.{number}" for number in range(count)
    ]
    path = folder / "sim" / f"{name}.hal"
    path.write_text("\n".join([path.read_text(), *traced, *hal]) + "\n")
    for file, text in (files or {}).items():
        (folder / "sim" / file).write_text(text)
    (place / "lines").write_text("\n".join(lines) + "\n")
    with ExitStack() as stack:
        stack.enter_context(installed(folder))
        stack.enter_context(installed(_tracer(place)))
        printed = as_nobody(
            ["linuxcnc", "-r", str(folder / "sim" / f"{name}.ini")],
            place,
            OPERATOR_LINES=str(place / "lines"),
            OPERATOR_TOLD=str(place / "told"),
            TRACE_OUT=str(place / "trace"),
        )
    assert (place / "told").exists(), printed
    steps = json.loads((place / "told").read_text())
    joints = np.array([row for step in steps for row in step["trace"]])
    return Run(steps, joints, np.fromfile(place / "trace").reshape(-1, count))


def _change(path: Path, place: Path, home: Sequence[float], lines: Mapping[str, str]) -> None:
    """Set the operator, the home and other lines of an INI file."""
    operator = place / "mdi_operator.py"
    operator.write_text((HERE / "mdi_operator.py").read_text())
    operator.chmod(0o755)
    text = path.read_text().replace("DISPLAY = axis", f"DISPLAY = {operator}")
    for number, value in enumerate(home):
        section, rest = text.split(f"[JOINT_{number}]")
        rest = re.sub(r"^(HOME(_OFFSET)?) = .*", rf"\1 = {value:.9f}", rest, count=2, flags=re.M)
        text = f"{section}[JOINT_{number}]{rest}"
    for pattern, line in lines.items():
        text, count = re.subn(pattern, line, text, flags=re.M)
        assert count, pattern
    path.write_text(text)


def _tracer(place: Path) -> Path:
    """The folder of the component that writes what is commanded."""
    folder = place / "tracer"
    folder.mkdir()
    shutil.copy(HERE / "trace.c", folder / "kinegen_trace.c")
    (folder / "Makefile").write_text("obj-m += kinegen_trace.o\ninclude $(shell halcompile --print-modinc)\n")
    return folder
