"""An `inverse` in a file that does not undo its values is the fault of the file, not of a kernel."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.model.outputs import parse_quantity
from kinegen.verify.reference.actuators import inverse_defect
from tests.builds.workshop import ROBOTS, make, write_robot

HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\njoints:\n"
SQUARE = (
    "  - {name: turn, a: 0.1, alpha: 0, d: 0, theta: q, limits: [0, 1]}\n"
    "  - {name: slide, a: 0, alpha: 0, d: q, theta: 0, limits: [0, 1]}\n"
    "actuators:\n  readings: {m: {dimension: number, limits: [0.1, 1]}, n: {dimension: number, limits: [0.1, 1]}}\n"
    "  joints:\n    - {joint: turn, value: m**2}\n    - {joint: slide, value: n**2}\n"
)


@pytest.mark.parametrize(
    ("inverse", "told"),
    [
        (
            "{m: turn, n: sqrt(slide)}",
            r"for turn = \S+ rad it gives m = \S+, n = \S+, at which turn is \S+ rad; nothing was",
        ),
        (
            "{m: sqrt(turn), n: 0.999999*sqrt(slide)}",
            r"for slide = \S+ m it gives m = \S+, n = \S+, at which slide is \S+ m;",
        ),
    ],
)
def test_an_inverse_that_does_not_undo_is_called_the_fault_of_the_file(inverse: str, told: str, tmp_path: Path) -> None:
    path = write_robot(tmp_path, f"{HEAD}{SQUARE}  inverse: {inverse}\n")
    with pytest.raises(ProofError, match=rf"^arm: actuators: inverse does not undo the values of the joints: {told}"):
        make(
            path,
            tmp_path,
            quantities=(parse_quantity("joints_to_actuators"),),
            compile=False,
            reals=(ScalarType.DOUBLE,),
        )


def test_an_inverse_that_undoes_is_not_blamed(tmp_path: Path) -> None:
    robot = load(write_robot(tmp_path, f"{HEAD}{SQUARE}  inverse: {{m: sqrt(turn), n: sqrt(slide)}}\n"))

    assert inverse_defect(robot, (0.3, 0.7)) == ""
    assert inverse_defect(load(ROBOTS / "al5d.yaml"), (0.0,) * 5) == "", "a robot without actuators has no inverse"
