"""The options and the results of a build: only records, which suffice for a build that changes nothing."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from kinegen.boards.figures import Cost
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.packages.ecosystem import Ecosystem
from kinegen.emit.reals import Real
from kinegen.ir.program import AngleSum, Count
from kinegen.native.flags import Flags
from kinegen.outputs import USUAL, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Proof
from kinegen.write import Written


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
        package: What kind of project or machine controller the output is for, which then gets a package of the same
            kernels in place of the Python package.
        languages: Names of the languages beside C and Python, as in `kinegen.emit.languages.LANGUAGES`.
        force: Whether to replace files in the way that kinegen did not write.
    """

    output: Path = Path("generated")
    reals: tuple[Real, ...] = (Real.DOUBLE, Real.FLOAT)
    quantities: tuple[Quantity, ...] = USUAL
    wrt: tuple[str, ...] = ()
    integers: bool = False
    only_integers: bool = False
    compile: bool = True
    flags: Flags = field(default_factory=Flags)
    package: Ecosystem | Controller | None = None
    languages: tuple[str, ...] = ()
    force: bool = False


@dataclass(frozen=True, slots=True)
class Stage:
    """A finished stage.

    Attributes:
        name: Its name.
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
        robot: The robot.
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
