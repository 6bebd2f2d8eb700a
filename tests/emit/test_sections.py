"""The parts of a kernel with their titles, and the lengths of the table by name."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.constants import named_constants
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.javascript.files import emit_javascript
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import CONSTANT, FEWEST, sections
from kinegen.driver.pipeline import lower_file
from kinegen.ir.program import Variable
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
        ("human_body", "pose"),
        ("hand", "frames"),
    ],
)
def test_the_parts_are_all_statements_in_their_order(name: str, output: str) -> None:
    kernels = lowered(name, output)
    for program in kernels.programs:
        parts = sections(kernels.robot, program)
        titles = [part.title for part in parts]

        assert tuple(each for part in parts for each in part.statements) == program.statements
        assert all(titles)
        assert len(set(titles)) == len(titles)
        assert all(sum(len(each.results) for each in part.statements) >= FEWEST for part in parts)
        assert len(parts) <= 2 + math.sqrt(len(program.statements)) / 2


TITLES = {
    ("puma560", "pose"): """Angle sum q23, sines and cosines
Joints 2 and 3: position
Rotation
Rotation and position
Joints 1 to 3: position""",
    ("puma560", "frames"): """Angle sum q23, sines and cosines
Frames waist to elbow
Frames elbow and forearm
Frames forearm and wrist_bend
Frame wrist_bend
Frame flange""",
    ("puma560", "quaternion_wxyz"): """Angle sum q23, sines and cosines
Joints 4 to 6: quaternion_wxyz
Joints 2 to 6: quaternion_wxyz
quaternion_wxyz""",
    ("hand", "position"): """Angles, sines and cosines
Joints 3 to 8: tips thumb_tip and index_tip
Joints 9 to 11: tip middle_tip
Joints 12 to 14: tip ring_tip
Joints 15 to 17: tip little_tip
Joints 1 to 5: tip thumb_tip""",
}


@pytest.mark.parametrize(("name", "output"), TITLES)
def test_titles_name_joints_and_results(name: str, output: str) -> None:
    kernels = lowered(name, output)

    assert [part.title for part in sections(kernels.robot, kernels.programs[0])] == TITLES[name, output].split("\n")


def test_the_statements_of_a_section_need_no_other_joints_than_its_title_says() -> None:
    kernels = lowered("ur5", "pose", "fk_jacobian", "twist")
    for program in kernels.programs:
        joints: dict[str, set[int]] = {}
        for part in sections(kernels.robot, program):
            found: set[int] = set()
            for statement in part.statements:
                of_each = (
                    {each.index % 6 + 1} if isinstance(each, Variable) else joints.get(getattr(each, "name", ""), set())
                    for each in statement.operands
                )
                joints |= dict.fromkeys(statement.results, own := set().union(*of_each))
                found |= own
            if named := re.match(r"Joints? (\d)(?: (?:to|and) (\d))?: ", part.title):
                assert {min(found), max(found)} == {int(each) for each in named.groups() if each}


def test_a_short_kernel_has_no_titles() -> None:
    kernels = lowered("puma560", "transform_point")

    assert sections(kernels.robot, kernels.programs[0]) == ()


def test_a_long_chain_has_one_title_for_its_loop_over_angles() -> None:
    """The loop takes the place of the first section."""
    source = emit_kernel(lowered("human_body", "pose"), ScalarType.DOUBLE)["human_body.c"]
    titles = re.findall(r"^    /\* (.*) \*/$", source.partition("void human_body_fk(")[2], re.MULTILINE)

    assert titles[0] == "Sines and cosines"
    assert len(set(titles)) == len(titles)


def test_javascript_has_the_titles_of_c() -> None:
    kernels = lowered("ur5", "pose")
    titles = [part.title for part in sections(kernels.robot, kernels.programs[0])]
    script = emit_javascript(kernels)["ur5.js"].partition("function fk_at(")[2].partition("\n}\n")[0]

    assert re.findall(r"^  // (.*)$", script, re.MULTILINE) == [*titles, CONSTANT]


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
