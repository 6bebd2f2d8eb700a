"""The options, stages and results of a build, and results that are kept for builds that change nothing.

When all that decides a build is as it was, and the output folder has what that build left there, the build is not made
again: it would give the same bytes and the same proof.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field, fields, replace
from pathlib import Path
from typing import get_type_hints

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.languages import LANGUAGES
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError, WriteError
from kinegen.io.format import READING, YAML_SUFFIXES
from kinegen.io.load import load
from kinegen.ir.program import AngleSum, Count
from kinegen.model.outputs import USUAL, Quantity
from kinegen.model.robot import Robot
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.runtime.cache import Cache
from kinegen.runtime.compiler import find_compiler
from kinegen.runtime.flags import Flags
from kinegen.runtime.toolchain_fingerprint import identity
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import digests_of
from kinegen.support.files.write import Written
from kinegen.support.records import from_plain, to_plain
from kinegen.verify.records import Cost, Proof


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """What a build makes.

    Attributes:
        output: Folder in which the package folder of each robot lies.
        reals: Number types.
        quantities: Kinematic quantities.
        wrt: Parameters and entries of the table that stay arguments of the kernels, and by which `parameter_jacobian`
            is taken (see `calibrated`).
        integers: Whether to write the kernels without floating point too.
        only_integers: Whether a firmware package holds these alone; `reals` are then proven all the same.
        compile: Whether to build the compiled extension.
        flags: How to compile it.
        package: What kind of project or machine controller gets a package, in place of the Python package.
        languages: Names of the languages beside C and Python, as in `kinegen.backends.languages.LANGUAGES`.
        force: Whether to replace files in the way that kinegen did not write.
        measure: Whether to measure the float kernels on a microcontroller, where its tools are installed.
        usual_inverse: Whether an inverse that is not usual is left out (see `with_usual_inverse`).
    """

    output: Path = Path("build")
    reals: tuple[ScalarType, ...] = (ScalarType.DOUBLE, ScalarType.FLOAT)
    quantities: tuple[Quantity, ...] = USUAL
    wrt: tuple[str, ...] = ()
    integers: bool = False
    only_integers: bool = False
    compile: bool = True
    flags: Flags = field(default_factory=Flags)
    package: Ecosystem | Controller | None = None
    languages: tuple[str, ...] = ()
    force: bool = False
    measure: bool = False
    usual_inverse: bool = False


@dataclass(frozen=True, slots=True)
class Stage:
    """A finished stage.

    Attributes:
        seconds: How long it took.
        detail: What came out, in a few words.
    """

    name: str
    seconds: float
    detail: str


@dataclass(frozen=True, slots=True)
class BuildResult:
    """What a build did.

    Attributes:
        counts: Operations of each quantity.
        plain: Operations of the pose as a plain product of link matrices.
        angles: The angles whose sines and cosines are taken.
        folder: The package folder.
        written: The files and whether each was new, changed or untouched.
        proof: The comparisons, all of which hold.
        backend: What the proof ran: `c`, or `numpy` without a compiler.
        costs: What the float kernels cost on a usual microcontroller; empty where that cannot be measured.
        stages: The stages with their times.
        notes: Sentences that the user should read.
    """

    robot: Robot
    counts: dict[Quantity, Count]
    plain: Count
    angles: tuple[AngleSum, ...]
    folder: Path
    written: tuple[Written, ...]
    proof: Proof
    backend: str
    costs: tuple[Cost, ...]
    stages: tuple[Stage, ...]
    notes: tuple[str, ...]


_TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
"""What the costs of a build depend on."""

_TOLD_ANEW = ("robot", "stages")
"""Fields of a result that are not kept: the robot is in its file, and the stages are not run again."""


def recall(key: str, path: Path, options: BuildOptions) -> BuildResult | None:
    """Return what an earlier build told, with every file untouched, if this one would tell the same and change nothing.

    Its proof is looked at like that of a new build. None where the build has to be made.
    """
    begin = time.perf_counter()
    kept = Cache().load_record(key, _Kept)
    if kept is None:
        return None
    # What was kept is read by the types of the fields, and its proof is judged again.
    try:
        robot = with_runtime_entries(load(path), options.wrt) if options.wrt else load(path)
        hints = get_type_hints(BuildResult)
        told = {name: from_plain(hints[name], value) for name, value in json.loads(kept.told).items()}
        result = BuildResult(robot=robot, stages=(), **told)
        result.proof.require(robot)
    except (KinegenError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        return None  # of another shape, or not accepted
    # The folder has to be as that build left it.
    if result.folder != options.output / robot.name or kept.digests != digests_of(result.folder):
        return None
    written = tuple(replace(entry, status="unchanged") for entry in result.written if entry.status != "removed")
    stage = Stage("compare", time.perf_counter() - begin, "nothing has changed since the last verified build")
    return replace(result, written=written, stages=(stage,))


def remember(key: str, result: BuildResult) -> None:
    """Keep what a build told under what `key_of` said before it began: the robot file may have been edited since."""
    if key:
        names = [each.name for each in fields(result) if each.name not in _TOLD_ANEW]
        told = {name: to_plain(getattr(result, name)) for name in names}
        Cache().save_record(key, _Kept(digests_of(result.folder), json.dumps(told)))


@dataclass(frozen=True, slots=True)
class _Kept:
    """A build as it is kept: the SHA-256 of each file of its folder, and what it told, as JSON."""

    digests: dict[str, str]
    told: str


def key_of(path: Path, options: BuildOptions) -> str:
    """Return a name for all that decides a build; empty where something cannot be found out.

    That is the robot file, the options, this program with its libraries, the tools and the processor of the machine.
    Whatever is different, missing, damaged or unknown leads to an ordinary build.
    """
    try:
        text = path.read_bytes()
        # The text is not all where a file includes others.
        robot = "" if path.suffix.lower() in YAML_SUFFIXES else load(path).digest
        compiler = find_compiler() if options.compile else None
    except (OSError, KinegenError):
        return ""
    machine = identity()
    if machine is None:
        return ""
    # The tools that run kernels decide which of them are verified and measured.
    named = (*_TOOLS, *(tool for name in options.languages for tool in LANGUAGES[name].tools))
    tools = [(tool, shutil.which(tool)) for tool in named]
    # The path of the output is resolved without a complaint about a loop of links, which the build makes.
    output = os.path.realpath(options.output)
    given = READING.get().redundancy, READING.get().strict_limits, READING.get().tips
    return Cache().key("build", machine, compiler, tools, text, robot, given, str(path), options, output)


@dataclass(slots=True)
class Clock:
    """Times the stages, says what begins, and reports each stage as it ends.

    Attributes:
        path: The robot file, as the user named it.
        report: Called after each stage.
        begin: Called with a few words before each stage, and before each output in stages that take them one by one.
        stages: The stages that have ended.
    """

    path: Path
    report: Callable[[Stage], None]
    begin: Callable[[str], object] = str
    stages: list[Stage] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str, work: str = "") -> Iterator[list[str]]:
        """Run a stage; yields where details are put that the report shows, such as the number of files.

        `work` says what is being done in a stage that can take long.

        Raises:
            KinegenError: What the stage raised, with the robot file as its place if it had none.
            WriteError: If temporary files cannot be used.
        """
        detail: list[str] = []
        self.begin(work or name)
        begin = time.perf_counter()
        try:
            yield detail
        except KinegenError as error:
            # What is wrong with a robot is told of the file as the user named it.
            if type(error) is KinegenError:
                raise KinegenError(error.message, str(self.path), error.line) from error
            raise
        except OSError as error:
            # Reading and writing speak for themselves; what is left is the folder in which packages are made.
            reason = f"cannot {name} with temporary files: {error}; TMPDIR can name another folder for them"
            raise WriteError(f"{reason}; the earlier output is untouched") from error
        self.stages.append(Stage(name, time.perf_counter() - begin, ", ".join(detail)))
        self.report(self.stages[-1])

    def each(self, verb: str, quantities: Sequence[Quantity]) -> Iterator[Quantity]:
        """Yield the quantities, each said with its number before its turn comes."""
        for place, quantity in enumerate(quantities, start=1):
            self.begin(f"{verb} {quantity} ({place} of {len(quantities)})")
            yield quantity
