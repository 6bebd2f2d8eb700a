"""The parts of a kernel with their titles, and the lengths of the table by name."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.constants import named_constants
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import USUAL, Quantity, parse_quantity

ROBOTS = Path(__file__).parents[2] / "robots"


def lowered(name: str, *outputs: str) -> RobotPrograms:
    return lower_file(ROBOTS / f"{name}.yaml", tuple(map(parse_quantity, outputs)))


@pytest.mark.parametrize(
    ("name", "output"),
    [
        ("puma560", "frames"),
        ("puma560", "inverse"),
        ("puma560", "jacobian"),
        ("calibrated_2r", "pose"),
        ("wire_arm", "fk_actuators"),
        ("planar_3r", "quaternion_wxyz"),
        ("scara", "twist"),
    ],
)
def test_the_parts_are_all_statements_in_their_order(name: str, output: str) -> None:
    kernels = lowered(name, output)
    for program in kernels.programs:
        parts = sections(kernels.robot, program)

        assert tuple(each for part in parts for each in part.statements) == program.statements
        assert all(part.title and part.statements for part in parts)
        assert all(one.title != other.title for one, other in itertools.pairwise(parts))


def test_titles_name_joints_and_results() -> None:
    kernels = lowered("puma560", "pose")
    titles = [part.title for part in sections(kernels.robot, kernels.programs[0])]

    assert titles[:2] == ["Angle sums: q23 of shoulder and elbow", "Sines and cosines"]
    assert "shoulder, elbow, forearm, wrist_bend and flange: rotation" in titles
    assert titles[-2:] == ["waist: rotation", "waist: position"]


def test_a_position_alone_has_no_rotation() -> None:
    kernels = lowered("puma560", "position")

    assert not any("rotation" in part.title for part in sections(kernels.robot, kernels.programs[0]))


def test_equal_lengths_are_one_name_with_both_places() -> None:
    found = named_constants(lowered("puma560", *map(str, USUAL)), ScalarType.FLOAT, frozenset())

    assert [(each.name, each.literal, each.source) for each in found] == [
        ("PUMA560_F32_A2_D4", "0.4318F", "m, a2: a of row 3 (elbow); d4: d of row 4 (forearm)"),
        ("PUMA560_F32_D3", "0.15005F", "m, d of row 3 (elbow)"),
        ("PUMA560_F32_A3", "0.0203F", "m, a of row 4 (forearm)"),
    ]


def test_a_length_that_is_negative_in_the_table_is_named_with_its_sign() -> None:
    """A maintainer who puts a measured `a` into the macro has to know that it holds minus that."""
    ur5 = {each.name: each.source for each in named_constants(lowered("ur5", "pose"), ScalarType.FLOAT, frozenset())}

    assert ur5["UR5_F32_A2"] == "m, minus a of row 2 (shoulder)"
    assert ur5["UR5_F32_D1"] == "m, d of row 1 (base_turn)"


def test_a_parameter_that_is_used_with_a_minus_keeps_its_own_sign(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(
        "kinegen: 1\nname: arm\ndescription: x\nconvention: standard\nunits: {length: mm, angle: deg}\n"
        "parameters: {reach: 320, down: -45}\njoints:\n"
        "  - {name: one, theta: q, d: down, a: -reach, alpha: 90}\n"
        "  - {name: two, theta: q, d: 0, a: reach, alpha: 0}\n",
        encoding="utf-8",
    )
    found = named_constants(lower_file(path, (Quantity.POSE,)), ScalarType.DOUBLE, frozenset())

    assert {each.name: (each.value, each.source) for each in found} == {
        "ARM_REACH": (320, "mm, minus a of row 1 (one), a of row 2 (two)"),
        "ARM_DOWN": (45, "mm, minus d of row 1 (one)"),
    }


def test_a_name_that_is_taken_is_not_given_again() -> None:
    kernels = lowered("puma560", "pose")
    found = named_constants(kernels, ScalarType.DOUBLE, frozenset({"PUMA560_D3"}))

    assert [each.name for each in found] == ["PUMA560_A2_D4", "PUMA560_A3"]


@pytest.mark.parametrize("name", ["puma560", "ur5", "panda", "scara", "stanford", "planar_3r", "calibrated_2r"])
def test_every_name_is_defined_once_used_and_in_the_header(name: str) -> None:
    files = emit_kernel(lowered(name, *map(str, USUAL), "jacobian"), ScalarType.DOUBLE)
    source, header = files[f"{name}.c"], files[f"{name}.h"]
    names = re.findall(r"#define (\w+) \d\S* /\*", source)

    assert len(set(names)) == len(names)
    for each in names:
        assert len(re.findall(rf"\b{each}\b", source)) > 1
        assert re.search(rf"^ \*   {each} ", header, re.MULTILINE)


def test_a_length_like_the_cosine_of_a_twist_keeps_its_digits(tmp_path: Path) -> None:
    """Which of the two a kernel multiplies by cannot be told."""
    path = tmp_path / "arm.yaml"
    path.write_text(
        "kinegen: 1\nname: arm\ndescription: x\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: one, theta: q, d: 0.25, a: 0.5, alpha: 60}\n"
        "  - {name: two, theta: q, d: 0, a: 0.3, alpha: 0}\n",
        encoding="utf-8",
    )
    kernels = lower_file(path, USUAL)

    assert [each.name for each in named_constants(kernels, ScalarType.DOUBLE, frozenset())] == ["ARM_D1", "ARM_A2"]
