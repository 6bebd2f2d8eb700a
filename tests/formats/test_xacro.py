"""xacro files in: arguments, packages, includes, and a process that cannot reach anything else."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.errors import RobotFileError
from kinegen.formats.format import ReadOptions
from kinegen.formats.load import load

MAIN = """\
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="prefix" default="left_"/>
  <xacro:include filename="$(find arm_parts)/urdf/joint.xacro"/>
  <link name="world"/>
  <xacro:moving name="$(arg prefix)hip" length="${2*0.1}"/>
</robot>
"""
PART = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="moving" params="name length">
    <link name="${name}_link"/>
    <joint name="${name}" type="continuous">
      <parent link="world"/><child link="${name}_link"/>
      <origin xyz="${length} 0 0" rpy="${pi/2} 0 0"/><axis xyz="0 0 1"/>
    </joint>
  </xacro:macro>
</robot>
"""


@pytest.fixture
def main(tmp_path: Path) -> Path:
    """A xacro file that includes another package."""
    (tmp_path / "elsewhere" / "urdf").mkdir(parents=True)
    (tmp_path / "elsewhere" / "urdf" / "joint.xacro").write_text(PART)
    (tmp_path / "arm").mkdir()
    path = tmp_path / "arm" / "arm.urdf.xacro"
    path.write_text(MAIN)
    return path


def test_arguments_and_packages(main: Path) -> None:
    packages = (("arm_parts", str(main.parent.parent / "elsewhere")),)
    robot = load(main, ReadOptions(packages=packages))
    assert [row.name for row in robot.rows] == ["left_hip"]
    assert [str(step.kind) for step in robot.rows[0].steps] == ["Tx", "Rx", "Rz"]
    other = load(main, ReadOptions(packages=packages, arguments=(("prefix", "right_"),)))
    assert [row.name for row in other.rows] == ["right_hip"]


def test_a_package_around_the_file_needs_no_path(main: Path) -> None:
    (main.parent.parent / "elsewhere").rename(main.parent.parent / "arm_parts")
    assert load(main).dof == 1


def test_a_missing_package_is_named(main: Path) -> None:
    with pytest.raises(RobotFileError, match=r"package 'arm_parts' is not found.*--package-path NAME=DIR"):
        load(main)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("${2*0.1}", "${2*long}", r"arm/arm\.urdf\.xacro:5: xacro: name 'long' is not defined"),
        ("${pi/2}", "${half}", r"arm/arm\.urdf\.xacro:5: xacro: name 'half' is not defined"),
        (
            "  </xacro:macro>\n",
            "  </xacro:macro>\n  <link name='${who}'/>\n",
            r"urdf/joint\.xacro:9: xacro: name 'who' is",
        ),
        (
            "  </xacro:macro>\n",
            "  </xacro:macro>\n  <xacro:turn/>\n",
            r"urdf/joint\.xacro:9: xacro: unknown macro name: ",
        ),
        (
            "<link name=",
            "<xacro:moving name='a' length='1'/><link name=",
            r"arm\.urdf\.xacro:5: xacro: macros or includes",
        ),
    ],
)
def test_errors_name_file_and_line(old: str, new: str, place: str, main: Path) -> None:
    """Of an error inside of a macro the place is the call."""
    part = main.parent.parent / "elsewhere" / "urdf" / "joint.xacro"
    path = main if old in MAIN and "${" in old else part
    path.write_text(path.read_text().replace(old, new, 1))

    with pytest.raises(RobotFileError, match=place) as caught:
        load(main, ReadOptions(packages=(("arm_parts", str(main.parent.parent / "elsewhere")),)))

    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(main.parent.parent))
    assert "/../" not in str(caught.value)


@pytest.mark.parametrize(
    "expression",
    [
        "xacro.load_yaml(secret)",
        "''.join(python.vars(pi))",
        "[x for x in ().__class__.__mro__]",
        "python.type(1).mro()",
    ],
)
def test_expressions_cannot_reach_out(expression: str, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("password: hunter2")
    path = tmp_path / "inside" / "arm.xacro"
    path.parent.mkdir()
    text = MAIN.partition("  <xacro:arg")[0] + f'<link name="${{{expression}}}"/></robot>'
    path.write_text(text.replace("secret", f"'{secret}'"))
    with pytest.raises(RobotFileError) as caught:
        load(path)
    assert "hunter2" not in str(caught.value)
    assert "not allowed" in str(caught.value) or "outside" in str(caught.value)
