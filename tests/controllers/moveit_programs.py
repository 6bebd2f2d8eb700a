"""The MoveIt plug-in of a robot as a program of this machine, and what it answers."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.kernel_calls import needed
from kinegen.backends.controllers.project import emit_controller
from kinegen.backends.files import emit_files
from kinegen.driver.pipeline import lower_file
from kinegen.io.load import load
from kinegen.support.files.write import write_files
from kinegen.verify.vectors import compute_vectors
from tests.controllers.contract import headers
from tests.controllers.elementary import Model, Numbers, pose_line, pose_of
from tests.controllers.packages import FLAGS, HERE, file_of, need, run

MOVEIT = Controller.MOVEIT2
CALLS = HERE / "standins" / "ros2" / "moveit.cpp"
EIGEN = Path("/usr/include/eigen3")
WARNINGS = ("-std=c++17", "-O0", "-Wall", "-Wextra", "-Werror")

SUCCESS, TIMED_OUT, NO_IK_SOLUTION = 1, -6, -31
OK, UNSUPPORTED, MULTIPLE_TIPS, EMPTY, SEED_OUTSIDE, NOT_ACTIVE, NO_SOLUTION = 1, 2, 4, 5, 6, 7, 8


@cache
def files_of(name: str) -> dict[str, str]:
    """The files of a package."""
    made = lower_file(file_of(name), needed(load(file_of(name)), MOVEIT))
    return emit_controller(made, emit_files(made, MOVEIT.reals, compute_vectors(made)).files, MOVEIT)


def compiled(place: Path, name: str, includes: Sequence[str] = (), others: Iterable[Path] = (CALLS,)) -> Path:
    """The program of a robot in a folder; its objects stay beside it.

    Args:
        place: The folder.
        name: The robot.
        includes: Options for headers that come before the stand-ins.
        others: Sources besides those of the package, or objects.
    """
    need("gcc", "g++")
    if not EIGEN.exists():
        pytest.skip("Eigen is not installed (Debian: apt-get install libeigen3-dev)")
    write_files(place / name, files_of(name))
    write_files(place / "standins", headers("moveit2"))
    write_files(place / "own", {"setter.cpp": setter(name)})
    sources = [*sorted((place / name / "src").glob("*.c*")), place / "own" / "setter.cpp", *others]
    run(["g++", *[compiled_file(place, name, path, includes) for path in sources], "-o", place / "run"], place)
    return place / "run"


def setter(name: str) -> str:
    """What sets a runtime parameter of the plug-in of a robot."""
    space = f"{name}_moveit_kinematics"
    has_some = "set_parameter" in files_of(name)[f"include/{space}/plugin.hpp"]
    body = f"dynamic_cast<{space}::Plugin &>(plugin).set_parameter(name, value)"
    return (
        f'#include "{space}/plugin.hpp"\n'
        "bool set_parameter(kinematics::KinematicsBase & plugin, const std::string & name, double value)\n"
        f"{{return {body if has_some else 'static_cast<void>(plugin), static_cast<void>(name), value > value'};}}\n"
    )


def compiled_file(place: Path, name: str, path: Path, includes: Sequence[str] = ()) -> Path:
    """The object of a source; an object is its own."""
    if path.suffix == ".o":
        return path
    source = place / name / "src"
    flags = [*WARNINGS, *includes, f"-I{place / 'standins'}", "-isystem", EIGEN]
    flags += [f"-I{place / name / 'include'}", f"-I{source}"]
    made = place / f"{path.stem}_{path.suffix[1:]}.o"
    run([*(["gcc", *FLAGS] if path.suffix == ".c" else ["g++", *flags]), "-c", path, "-o", made], place)
    return made


def altered(program: Path, name: str, source: str, old: str, new: str) -> Path:
    """The program with a word of one source replaced; the other objects are taken as they are."""
    place = program.parent
    text = files_of(name)[f"src/{source}.cpp"]
    assert old in text
    path = place / name / "src" / "altered.cpp"
    path.write_text(text.replace(old, new))
    objects = [each for each in sorted(place.glob("*.o")) if each.name not in (f"{source}_cpp.o", "altered_cpp.o")]
    run(["g++", compiled_file(place, name, path), *objects, "-o", place / "altered"], place)
    path.unlink()
    return place / "altered"


@dataclass(frozen=True)
class Answer:
    """What one call gives: a word, whether it succeeded, its code, and its numbers."""

    word: str
    good: bool
    code: int
    numbers: Numbers

    def rows(self, size: int) -> Numbers:
        """The numbers in rows."""
        return self.numbers.reshape(-1, size)


def ask(program: Path, *lines: str) -> tuple[list[Answer], str]:
    """What the plug-in gives, and its messages."""
    done = subprocess.run([program], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=120)
    rows = [line.split() for line in done.stdout.splitlines() if not line.startswith("names")]
    return [
        Answer(word, good == "1", int(code), np.array(list(map(float, rest)))) for word, good, code, *rest in rows
    ], (done.stderr)


class Arm:
    """A plug-in that is initialized with a model, and the model."""

    def __init__(self, program: Path, model: Model, *, order: Sequence[int] = (), before: Sequence[str] = ()) -> None:
        self.program, self.model = program, model
        self.order = list(order or range(len(model.joints)))
        self.dof = len(self.order)
        self.begin = [*model.lines(order), *before, "initialize arm 0.1 pedestal gripper"]

    def ask(self, *lines: str, silent: bool = True) -> list[Answer]:
        """What it gives after it was initialized."""
        (first, *answers), errors = ask(self.program, *self.begin, *lines)
        assert first.good, errors
        assert not silent or errors == ""
        return answers

    def seed(self, q: Sequence[float] | Numbers, word: str = "seed") -> str:
        """The line for joint values in the order of the file."""
        return " ".join([word, *(repr(float(q[k])) for k in self.order)])

    def target(self, q: Sequence[float] | Numbers) -> str:
        """The line for the pose of the tip at joint values."""
        return pose_line(self.tip(q))

    def tip(self, q: Sequence[float] | Numbers) -> Numbers:
        """The pose of the tip."""
        return self.model.poses(q)["gripper"]

    def joints(self, answer: Answer) -> Numbers:
        """The solutions of an answer, in the order of the file."""
        rows = answer.rows(self.dof)
        found = np.empty_like(rows)
        found[:, self.order] = rows
        return found

    def require_reached(self, answer: Answer, target: Numbers, atol: float = 1e-6) -> Numbers:
        """The solutions of an answer, each of which must reach a target within the limits."""
        assert answer.good, answer
        for q in self.joints(answer):
            np.testing.assert_allclose(self.tip(q), target, atol=atol)
            for value, joint in zip(q, self.model.joints, strict=True):
                assert joint.limits is None or joint.limits[0] - 1e-12 <= value <= joint.limits[1] + 1e-12
        return self.joints(answer)

    def require_links(self, answer: Answer, q: Numbers) -> None:
        """Compare the poses of all links with those of the model."""
        assert answer.good
        for row, pose in zip(answer.rows(7), self.model.poses(q).values(), strict=True):
            np.testing.assert_allclose(pose_of(row), pose, atol=1e-12)
