"""Tables of robots whose angles are printed with few digits: each number can be written, read again, and built upon."""

from __future__ import annotations

import random

import numpy as np
import pytest

from kinegen.io.format import ReadOptions
from kinegen.io.load import loads
from kinegen.io.robot_file.entry_text import spell
from kinegen.io.robot_file.write import write
from kinegen.model.dh_conversion import to_convention
from kinegen.model.dh_conversion.exact_poses import MP, identified_angle, recognised
from kinegen.model.expression_parser import parse
from kinegen.model.robot import Convention, Robot
from tests.tables.test_convert import furthest

TABLES = (Convention.STANDARD, Convention.MODIFIED)
JOINT = (
    '<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{name}_link"/>'
    '<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>{more}</joint>\n'
)


def urdf(*joints: tuple[str, str, str, str, str], more: dict[str, str] | None = None) -> Robot:
    """A robot of joints, each with its name, type, parent, shift and angles; every digit is kept."""
    text = '<robot name="arm"><link name="base_link"/>' + "".join(f'<link name="{each[0]}_link"/>' for each in joints)
    for name, kind, parent, xyz, rpy in joints:
        text += JOINT.format(name=name, kind=kind, parent=parent, xyz=xyz, rpy=rpy, more=(more or {}).get(name, ""))
    return loads(text + "</robot>", "arm.urdf", ReadOptions(snap=0.0))


@pytest.mark.parametrize("convention", TABLES)
@pytest.mark.parametrize("quarter", ["1.5708", "1.57079632679", "1.570796326589793", "1.57079632679489661923", "1.57"])
def test_what_is_printed_with_few_digits_can_be_written_and_read(quarter: str, convention: Convention) -> None:
    robot = urdf(
        ("j1", "revolute", "base_link", "0 0 0.333", "0 0 0"),
        ("j2", "revolute", "j1_link", "0 0 0", f"-{quarter} 0 0"),
        ("j3", "revolute", "j2_link", "0 -0.316 0.089159000000000005", f"{quarter} 0 0"),
        ("j4", "revolute", "j3_link", "0.0825 0 0.0997", f"{quarter} {quarter} -{quarter}"),
    )
    found = to_convention(robot, convention)
    text = write(found.robot)
    again = loads(text, "arm.yaml")
    assert [(row.alpha, row.a, row.d, row.theta) for row in again.rows] == [
        (row.alpha, row.a, row.d, row.theta) for row in found.robot.rows
    ]
    assert furthest(robot, found, np.random.default_rng(3)) < 1e-12


@pytest.mark.parametrize("convention", TABLES)
def test_axes_behind_a_fork_are_parallel_although_numbers_were_rounded(convention: Convention) -> None:
    """The fingers start from a frame whose entries have 50 digits; what is left of their angle is no angle."""
    fingers = [("left", "0 0.0306 0.0548", "3.14 0 0"), ("right", "0 -0.0306 0.0548", "3.14 0 0")]
    robot = urdf(
        ("j1", "revolute", "base_link", "0 0 0.15643", "3.1416 2.7629E-18 -4.9305E-36"),
        ("j2", "revolute", "j1_link", "0 0.005375 -0.12838", "1.5708 2.1343E-17 -1.1102E-16"),
        ("j3", "revolute", "j2_link", "0 -0.21038 -0.006375", "-1.5708 1.2326E-32 -2.9122E-16"),
        ("j4", "revolute", "j3_link", "0 0.006375 -0.21038", "1.5708 -6.6954E-17 -1.6653E-16"),
        *(
            (name, "revolute", "j4_link", xyz, f"{rpy[:-1]}{1.57 * index}")
            for index, (name, xyz, rpy) in enumerate(fingers)
        ),
        *((f"{name}_tip", "continuous", f"{name}_link", "0.04 0.02 0", "0 0 0.3") for name, _, _ in fingers),
    )
    found = to_convention(robot, convention)
    assert len(found.robot.rows) <= len(robot.rows) + 2
    assert furthest(robot, found, np.random.default_rng(4)) < 1e-12
    assert loads(write(found.robot), "arm.yaml").dof == robot.dof


@pytest.mark.parametrize("convention", TABLES)
@pytest.mark.parametrize("tilt", ["1.57655765344625E-30", "3E-38", "1E-41", "7E-48"])
def test_axes_of_slides_that_are_hardly_tilted_keep_every_pose(tilt: str, convention: Convention) -> None:
    robot = urdf(
        ("s1", "prismatic", "base_link", "0 0 0.013", "-1.57079632679489 0 0"),
        ("s2", "prismatic", "s1_link", "0 0 0.013", f"0 {tilt} -1.66533453693773E-16"),
        ("s3", "prismatic", "s2_link", "0 0 0.013", f"{tilt} 0 -2.2E-16"),
        ("r4", "revolute", "s3_link", "0.083 0 0", "1.5707963267949 0 1.5"),
    )
    found = to_convention(robot, convention)
    assert furthest(robot, found, np.random.default_rng(5)) < 1e-13
    assert loads(write(found.robot), "arm.yaml").dof == 4


def test_every_number_that_is_found_can_be_written_and_read() -> None:
    """Fractions, roots, nested roots and what is none of them, small and large."""
    numbers = random.Random(6)
    size = numbers.randrange
    for _ in range(10):
        top, bottom = (size(1, 10 ** size(1, most)) for most in (33, 30))
        a, b, c = (size(1, 10 ** size(1, 24)) for _ in range(3))
        values = [MP.sqrt(MP.mpf(top) / bottom), MP.mpf(top) / bottom, MP.pi * MP.mpf(10) ** size(-40, 8) / top]
        if b * b > 4 * a * c:
            values.append((-b + MP.sqrt(MP.mpf(b) ** 2 - 4 * MP.mpf(a) * c)) / (2 * a))
        for find in (recognised, identified_angle):
            for value in values:
                expression = find(value).expression
                assert parse(spell(expression)) == expression
