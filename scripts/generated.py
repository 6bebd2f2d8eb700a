"""What `generated/` holds: a few complete packages, and a digest of what every robot gives in every language.

    python scripts/generated.py                    builds and verifies the packages, and writes the digests
    python scripts/generated.py --check            compares the packages and the digests of one robot in seven
    python scripts/generated.py --check --every    compares all

The packages are for people who want to read what kinegen writes. The digests show every change of emitted code, for all
robots, all outputs and all languages, but not of its comments: a line is `ROBOT LANGUAGE SHA-256`, cut to 16 digits.
Lines marked `dh` belong to the robot whose table's entries are runtime parameters. `build/generated/` keeps the digests
of the last sources; where only comments have changed since, they are not computed anew.
"""

from __future__ import annotations

import argparse
import filecmp
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms, redundancy_refusal
from kinegen.backends.complete_inverse.elimination_choice import complete_of
from kinegen.backends.files import code_of, emit_files, emit_integers
from kinegen.backends.fixed_point.kernels import fixed_kernels
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import require_trackable
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import program_of, runtime_defaults
from kinegen.ir.program import Program
from kinegen.model.outputs import USUAL, Kind, Quantity, every_quantity
from kinegen.model.robot import Robot
from kinegen.model.runtime_entries import DH, with_runtime_entries
from kinegen.verify.fixed_point_vectors import fixed_vectors
from kinegen.verify.vectors import compute_vectors

sys.path.append(str(Path(__file__).parent))
import sampling
import sources

ROOT = Path(__file__).resolve().parent.parent
GENERATED = ROOT / "generated"
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))
DIGESTS = "digests.txt"
KEPT = ROOT / "build" / "generated"

EVERY = "all outputs"
"""Stands for every output that the robot has."""

PACKAGES: dict[str, tuple[str, ...]] = {
    "puma560": ("--outputs", EVERY, "--languages", "javascript"),
    "ur5": ("--outputs", "pose,frames,position,inverse,numeric_inverse", "--real", "double", "--languages", "cpp,rust"),
    "al5d": ("--outputs", "pose,inverse", "--real", "double"),
    "hand": ("--outputs", "pose,frames,position,fk_jacobian"),
    "calibrated_2r": ("--outputs", "pose,position,fk_jacobian,parameter_jacobian"),
    "motoman_l3": ("--outputs", "pose,actuators_to_joints,joints_to_actuators,fk_actuators,jacobian_actuators"),
    "scara": ("--package", "platformio", "--real", "all"),
    "iiwa14": ("--package", "cmake", "--outputs", "pose,fk_jacobian"),
}
"""Options of each package, every language in one of them: all outputs, inverses, five joints, a tree, runtime
parameters, actuators, integer kernels, and a library for C projects."""


def programs(robot: Robot, quantities: Iterable[Quantity]) -> RobotPrograms:
    """The programs of those quantities that a robot has."""
    found = []
    for quantity in quantities:
        try:
            found.append(program_of(robot, quantity))
        except KinegenError:
            continue  # such as an inverse of an arm without a closed form
    has_range = not redundancy_refusal(robot) and any(program.quantity.kind is Kind.INVERSE for program in found)
    solvers = robot.dof > 0, _has_all_solutions(robot), has_range, _has_tracker(robot, found)
    return RobotPrograms(robot, tuple(found), runtime_defaults(robot), *solvers)


def _has_tracker(robot: Robot, found: Iterable[Program]) -> bool:
    """Whether there is a closed-form inverse among some programs that can follow a path."""
    try:
        require_trackable(robot, next((each.signature.branches for each in found if each.signature.branches), None))
    except KinegenError:
        return False
    return True


def _has_all_solutions(robot: Robot) -> bool:
    """Whether there is an elimination that finds all solutions of the inverse."""
    try:
        complete_of(robot)
    except KinegenError:
        return False
    return True


def quantities_of(robot: Robot) -> tuple[Quantity, ...]:
    """Every quantity; of a machine with a tool and a workpiece also those of one as seen from the other."""
    if len(robot.tips) != 2:
        return every_quantity()
    workpiece, tool = robot.tips
    kinds = (Kind.POSE, Kind.FK_JACOBIAN, Kind.AXIS_INVERSE)
    return (*every_quantity(), *(Quantity(kind, frame=tool, seen_from=workpiece) for kind in kinds))


def outputs(robot: Robot) -> str:
    """The names of all outputs that a robot has, for `--outputs`."""
    kernels = programs(robot, quantities_of(robot))
    quantities = [*(program.quantity for program in kernels.programs), *kernels.solvers]
    return ",".join(map(str, quantities))


def lines(path: Path) -> list[str]:
    """The digests of one robot."""
    robot = load(path)
    kernels = programs(robot, quantities_of(robot))
    found = [*_lines(robot.name, kernels)]
    with suppress(KinegenError):  # elementary sequences have no entries
        found += _lines(
            f"{robot.name} dh", programs(with_runtime_entries(robot, (DH,)), (Quantity(Kind.PARAMETER_JACOBIAN),))
        )
    try:
        usual = RobotPrograms(
            robot, tuple(each for each in kernels.programs if each.quantity in USUAL), kernels.defaults
        )
        found.append(_line(f"{robot.name} q30", emit_integers(usual, fixed_vectors(fixed_kernels(usual)))))
    except KinegenError as error:
        found.append(f"{robot.name} q30 refused: {error.message}")
    return found


def _lines(name: str, kernels: RobotPrograms) -> Iterator[str]:
    """The digests of C with its test vectors, of the Python package, and of every other language."""
    vectors = compute_vectors(kernels)
    files = emit_files(kernels, tuple(ScalarType), vectors).files
    yield _line(f"{name} c", {path: text for path, text in files.items() if path.endswith((".c", ".h"))})
    yield _line(f"{name} python", {path: text for path, text in files.items() if path.endswith((".py", ".pyi"))})
    for language in filter(lambda each: each.is_extra, LANGUAGES.values()):
        yield _line(f"{name} {language.name}", emit_language(kernels, language, vectors))


def _line(label: str, files: Mapping[str, str]) -> str:
    digest = hashlib.sha256()
    for path, text in sorted(files.items()):
        digest.update(f"{path}\0{code_of(path, text)}\0".encode())
    return f"{label} {digest.hexdigest()[:16]}"


def digests(paths: Iterable[Path]) -> str:
    """The text of `generated/digests.txt`, or its lines of some robots."""
    paths = sorted(paths, key=lambda path: (-path.stat().st_size, path.name))
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = dict(zip(paths, pool.map(lines, paths), strict=True))
    return "".join(f"{line}\n" for path in sorted(found) for line in found[path])


def build_packages(folder: Path, *, compiled: bool) -> None:
    """Build every package into a folder."""

    def build(name: str) -> None:
        path = ROOT / "robots" / f"{name}.yaml"
        named = [outputs(load(path)) if option == EVERY else option for option in PACKAGES[name]]
        command = [sys.executable, "-m", "kinegen", "build", str(path), "-o", str(folder), *named]
        command += ["--reproducible"] if compiled else ["--no-compile"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(f"{name}: {done.stderr or done.stdout}")

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(build, PACKAGES))


def differences(here: Path, there: Path) -> Iterator[str]:
    """The files of two folders that differ, compiled ones left aside."""
    names = {
        path.relative_to(folder)
        for folder in (here, there)
        for path in folder.rglob("*")
        if path.is_file() and path.suffix != ".so" and "__pycache__" not in path.parts and path.parent != folder
    }
    for name in sorted(names):
        if not (here / name).exists() or not (there / name).exists():
            yield f"{name} is missing in {here if not (here / name).exists() else 'what the robots give'}"
        elif not filecmp.cmp(here / name, there / name, shallow=False):
            yield f"{name} differs"


def kept_for_these_sources() -> Path:
    """Where the digests of all robots are kept that the present sources give, if they were computed here."""
    return KEPT / f"{sources.digest(['scripts/generated.py'], ['kinegen.ui.cli.build'])}.txt"


def every_digest() -> str:
    """The digests of all robots, as they were computed before where only comments have changed since."""
    kept = kept_for_these_sources()
    if not kept.exists():
        text = digests(ROBOTS)
        shutil.rmtree(KEPT, ignore_errors=True)
        KEPT.mkdir(parents=True)
        kept.write_text(text, encoding="utf-8")
    return kept.read_text(encoding="utf-8")


def check(*, every: bool) -> int:
    """Compare `generated/` with what the robots give."""
    before, commit = (GENERATED / DIGESTS).read_text(encoding="utf-8"), sampling.commit()
    with tempfile.TemporaryDirectory() as temporary:
        fresh = Path(temporary)
        build_packages(fresh, compiled=False)
        found = list(differences(GENERATED, fresh))
    if every or kept_for_these_sources().exists():
        new, old, what = every_digest().splitlines(), before.splitlines(), "all robots compared"
    else:
        paths = [path for path in ROBOTS if sampling.is_in_sample(path.stem, commit)]
        new, what = digests(paths).splitlines(), f"{len(paths)} of {len(ROBOTS)} robots compared"
        names = {path.stem for path in paths}
        old = [line for line in before.splitlines() if line.split()[0] in names]
    if new != old:
        found.append(f"{DIGESTS} differs")
    for text in found:
        print(text)
    for line in sorted(set(new) - set(old)):
        print(f"now {line}")
    is_not = f"generated/ is not current: run 'make generated', and commit ({what})"
    print(is_not if found else f"it is current: {what}")
    return bool(found)


def main() -> int:
    """Write or check."""
    parser = argparse.ArgumentParser(description="Writes generated/, or compares it with what the robots give.")
    parser.add_argument("--check", action="store_true", help="compare, and change nothing")
    parser.add_argument("--every", action="store_true", help="compare all robots")
    options = parser.parse_args()
    if options.check:
        return check(every=options.every)
    # A package for C projects leaves what lies beside its own folders, so everything is made from nothing.
    for folder in GENERATED.iterdir() if GENERATED.is_dir() else ():
        if folder.is_dir():
            shutil.rmtree(folder)
    build_packages(GENERATED, compiled=True)
    (GENERATED / DIGESTS).write_text(every_digest(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
