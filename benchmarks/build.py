"""What building costs, and how exact the kernels are: `python -m benchmarks.build`.

Every row is a figure that this project promises, what was found on this machine, and whether that meets it. Times are
those of a clock on the wall, so they mean something on an idle machine alone: the load is printed above and below the
table, and the processor time beside what takes long.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import mpmath
import numpy as np

from benchmarks.rows import table
from benchmarks.speed.clock import spent_by_children
from benchmarks.speed.machine import processor_name
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.files import stamp_of
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.python.package import emit_package
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import USUAL
from kinegen.model.robot import Robot
from kinegen.runtime.extension import build_extension, interface_of, lay_out, load_package
from kinegen.runtime.flags import Flags
from kinegen.support.naming import EXTENSION
from kinegen.verify import reference
from kinegen.verify.samples import vector_samples

ROOT = Path(__file__).resolve().parents[1]
ROBOTS = ROOT / "robots"
SIX_AND_SEVEN = ("puma560", "ur5", "tx60", "panda", "iiwa14")
TWENTY_ONE = ("human_body",)

SIX_OUTPUTS = "pose,frames,position,jacobian,twist,inverse"

TURNS = 5
"""Short measurements are the middle of so many."""

POSES = 48
"""Random joint vectors for which each robot is held against 50 digits, besides its test vectors."""

SEED = 20240229
SAMPLING = 0.005  # seconds between two looks at the memory of a process and its children

DERIVE = """
import sys, time
from pathlib import Path
from kinegen.model.outputs import USUAL, Quantity
from kinegen.io.load import load
from kinegen.derive.dispatch import derive
robot = load(Path(sys.argv[1]))
begin = time.perf_counter()
for quantity in USUAL:
    derive(robot, quantity)
print(time.perf_counter() - begin)
"""

IMPORT = """
import sys, time
import numpy
sys.path.insert(0, sys.argv[1])
begin = time.perf_counter()
import puma560
print(time.perf_counter() - begin)
assert puma560.backend == "c"
"""


@dataclass(frozen=True)
class Row:
    """A figure.

    Attributes:
        what: What was measured.
        asked: What is promised, in the unit.
        measured: What was found.
        unit: Of both.
        detail: Where the worst was.
    """

    what: str
    asked: float
    measured: float
    unit: str
    detail: str = ""

    def __str__(self) -> str:
        met = "met" if self.measured < self.asked else "NOT MET"
        values = f"< {self.asked:<6.3g} {self.measured:>9.3g} {self.unit:<6}"
        return f"{self.what:<58} {values} {met:<8} {self.detail}".rstrip()


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print.

    Args:
        arguments: Of the command line.

    Returns:
        0; a figure that is not met is told in the table and fails nothing, since machines differ.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks.build", description="Measure what building costs.")
    parser.add_argument("--robots", help="hold only these against 50 digits, such as puma560,ur5 (all)")
    options = parser.parse_args(arguments)
    names = options.robots.split(",") if options.robots else sorted(path.stem for path in ROBOTS.glob("*.yaml"))
    print(f"{processor_name()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.2f} before")
    print(f"{'what':<58} {'asked':<8} {'measured':>9}")
    with tempfile.TemporaryDirectory(prefix="kinegen-bench-") as folder:
        for measure in (_symbolic, _builds, _starts):
            for row in measure(Path(folder)):
                print(row, flush=True)
        print("processor time of each stage, s")
        for line in table():
            print(line, flush=True)
        print(_exactness(names, Path(folder) / "cache"), flush=True)
    print(f"load {os.getloadavg()[0]:.2f} after")
    return 0


def _symbolic(_: Path) -> Iterator[Row]:
    """The symbolic stage alone, in processes that have derived nothing yet; pose, frames and position."""
    for what, asked, names in (
        ("symbolic stage, 6 and 7 joints, every output [slowest]", 1.0, SIX_AND_SEVEN),
        ("symbolic stage, 21 rows, every output", 5.0, TWENTY_ONE),
    ):
        times = {name: float(_python(DERIVE, str(ROBOTS / f"{name}.yaml"))) for name in names}
        slowest = max(times, key=lambda name: times[name])
        yield Row(what, asked, times[slowest], "s", slowest)


def _builds(folder: Path) -> Iterator[Row]:
    """The build of a PUMA 560 into an empty folder with an empty cache, and once more."""
    robot = ROBOTS / "puma560.yaml"
    outputs = ["--outputs", "pose,frames,position"]  # whatever the default is: times are compared with earlier ones
    command = [sys.executable, "-m", "kinegen", "build", str(robot), "-o", str(folder), "--real", "both", *outputs]
    environment = _environment() | {"XDG_CACHE_HOME": str(folder / "cache")}
    (folder / "cache").mkdir()
    first = _run(command, environment)
    yield Row("kinegen build, PUMA 560, cold, with compile and proof", 8.0, first.seconds, "s", str(first))
    yield Row("  its memory and that of all compilers at once [peak]", 300.0, first.memory, "MB")
    before = _picture(folder / "puma560")
    six = [*command[: -len(outputs)], "--outputs", SIX_OUTPUTS]
    six[six.index(str(folder))] = str(folder / "six")
    (folder / "six-cache").mkdir()
    other = _run(six, _environment() | {"XDG_CACHE_HOME": str(folder / "six-cache")})
    yield Row("kinegen build, PUMA 560, six outputs, cold [processor]", 10.0, other.processor, "s")
    again = _middle(_run(command, environment) for _ in range(TURNS))
    touched = [name for name, state in _picture(folder / "puma560").items() if before.get(name) != state]
    detail = f"{again}, {len(touched)} files touched"
    yield Row("kinegen build, nothing changed", 1.0, again.seconds, "s", detail)


def _starts(folder: Path) -> Iterator[Row]:
    """Help, and the import of what was built."""
    helped = _middle(_run([sys.executable, "-m", "kinegen", "--help"], _environment()) for _ in range(TURNS))
    yield Row("kinegen --help", 0.3, helped.seconds, "s", str(helped))
    imported = statistics.median(float(_python(IMPORT, str(folder))) for _ in range(TURNS))
    yield Row("import of a generated module beyond NumPy's own", 0.15, imported, "s")


def _exactness(names: Sequence[str], cache: Path) -> Row:
    """The worst double error of any robot, output and pose, relative to the reach."""
    worst, where = 0.0, ""
    for name in names:
        _say(f"holding {name} against 50 digits")
        error, frame = _error(name, cache)
        if error >= worst:
            worst, where = error, f"{name}, {frame}"
    _say("")
    return Row(f"worst double error of {len(names)} robots, relative to reach", 2e-15, worst, "", where)


def _error(name: str, cache: Path) -> tuple[float, str]:
    """The worst error of one robot, compiled as the generated module is, and the frame that has it."""
    kernels = lower_file(ROBOTS / f"{name}.yaml", USUAL)
    robot, reals = kernels.robot, (ScalarType.DOUBLE,)
    sources = emit_kernel(kernels, ScalarType.DOUBLE) | emit_batch(kernels, ScalarType.DOUBLE)
    extension = build_extension(interface_of(kernels, reals), sources, Flags(), cache / "kinegen")
    with tempfile.TemporaryDirectory(prefix="kinegen-bench-") as folder:
        package = Path(folder) / name
        files = emit_formula(kernels) | emit_package(kernels, reals, stamp_of(sources))
        lay_out(package, {**files, EXTENSION: extension.content})
        module = load_package(package)
    extension.keep()
    errors = [(0.0, "")]
    q = _points(robot)
    poses, tips = module.frames(q), module.fk(q).reshape(len(q), len(robot.tips), 4, 4)
    extents = {frame: reach(robot, [frame]) for frame in robot.frame_names}
    with mpmath.workdps(50):
        for row, point in enumerate(q):
            known = reference.frames_mp(robot, point)
            for index, frame in enumerate(robot.frame_names):
                errors.append((_worst(poses[row, index], known[frame], extents[frame]), frame))
            for index, frame in enumerate(robot.tips):
                errors.append((_worst(tips[row, index], known[frame], extents[frame]), frame))
    return max(errors)


def _worst(found: np.ndarray, known: mpmath.matrix, extent: float) -> float:
    """The largest error of an entry; those of the position relative to the reach."""
    scales = (1.0, 1.0, 1.0, extent)
    return max(float(abs(mpmath.mpf(float(found[i, j])) - known[i, j])) / scales[j] for i in range(3) for j in range(4))


def _points(robot: Robot) -> np.ndarray:
    """The test vectors, and random points of the joint box."""
    if not robot.dof:
        return np.zeros((1, 0))
    box = np.array(joint_box(robot))
    random = np.random.default_rng(SEED).uniform(box[:, 0], box[:, 1], (POSES, robot.dof))
    return np.concatenate([vector_samples(robot), random])


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def _python(code: str, *arguments: str) -> str:
    """What a fresh interpreter prints."""
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, env=_environment(), stdout=subprocess.PIPE, text=True, check=True).stdout


@dataclass(frozen=True)
class Run:
    """A process and all its children.

    Attributes:
        seconds: From its beginning to its end.
        processor: Processor time, of all of them together.
        memory: The most that they held at once, in MB.
    """

    seconds: float
    processor: float
    memory: float

    def __str__(self) -> str:
        return f"{self.processor:.2f} s of processor time"


def _run(command: Sequence[str], environment: dict[str, str]) -> Run:
    peak = [0.0]
    used = spent_by_children()
    begin = time.perf_counter()
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        watcher = threading.Thread(target=_watch, args=(process, peak))
        watcher.start()
        status = process.wait()
        seconds = time.perf_counter() - begin
        watcher.join()
    if status:
        raise SystemExit(f"{' '.join(command)} ended with status {status}")
    return Run(seconds, spent_by_children() - used, peak[0])


def _middle(runs: Iterable[Run]) -> Run:
    return sorted(runs, key=lambda run: run.seconds)[TURNS // 2]


def _watch(process: subprocess.Popen[bytes], peak: list[float]) -> None:
    while process.poll() is None:
        peak[0] = max(peak[0], sum(_resident(pid) for pid in _family(process.pid)) / 1e6)
        time.sleep(SAMPLING)


def _family(pid: int) -> Iterator[int]:
    """A process and all that came from it."""
    yield pid
    with contextlib.suppress(OSError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            for child in (thread / "children").read_text(encoding="utf-8").split():
                yield from _family(int(child))


def _resident(pid: int) -> int:
    """The memory of a process in bytes, of what it shares its part."""
    with contextlib.suppress(OSError, StopIteration):
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8").splitlines()
        return int(next(line for line in lines if line.startswith("Pss:")).split()[1]) * 1024
    return 0


def _picture(folder: Path) -> dict[str, tuple[int, int]]:
    """Of each file, when it was changed and its number on the disk."""
    files = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {str(path): (path.stat().st_mtime_ns, path.stat().st_ino) for path in files}


def _say(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
