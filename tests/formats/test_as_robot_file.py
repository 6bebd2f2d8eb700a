"""Commands that edit the text of a robot file take other formats as `kinegen convert` writes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import load, loads
from kinegen.io.robot_file.document import as_robot_file
from kinegen.ui.cli import main
from kinegen.verify import reference

URDF = """<robot name="arm"><link name="base_link"/><link name="l1"/><link name="l2"/>
<joint name="j1" type="revolute"><parent link="base_link"/><child link="l1"/><origin xyz="0 0 0.3"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.2 0 0" rpy="1.5708 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="flange"/><joint name="end" type="fixed"><parent link="l2"/><child link="flange"/>
<origin xyz="0.1 0 0"/></joint></robot>
"""


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF, encoding="utf-8")
    return path


def test_a_robot_file_is_taken_as_it_is(tmp_path: Path) -> None:
    path = Path(__file__).parents[2] / "robots" / "puma560.yaml"

    assert as_robot_file(path) == (path.read_text(encoding="utf-8"), str(path))


def test_another_format_becomes_text_of_the_same_robot(urdf: Path) -> None:
    text, name = as_robot_file(urdf)

    q = np.random.default_rng(1).uniform(-1, 1, (20, 2))
    np.testing.assert_array_equal(reference.pose(loads(text, name), q), reference.pose(load(urdf), q))


def test_doctor_and_compare_take_urdf(urdf: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The poses are those of the other direction of joint 2."""
    robot = load(urdf)
    q = np.array([[0.1, 0.2], [0.7, 0.9], [-0.8, -0.4], [1.3, -0.9]])
    poses = reference.pose(robot, q * [1, -1]).reshape(-1, 4, 4)
    rows = [f"{a},{b},{x:.6f},{y:.6f},{z:.6f}" for (a, b), (x, y, z) in zip(q, poses[:, :3, 3], strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join(["j1,j2,x,y,z", *rows]) + "\n", encoding="utf-8")
    mended = tmp_path / "mended.yaml"

    main(["doctor", str(urdf), "--poses", str(tmp_path / "poses.csv"), "--write", str(mended), "--take", "1"])

    assert "joint 2 (j2): the other direction" in capsys.readouterr().out
    np.testing.assert_allclose(reference.pose(load(mended), q).reshape(-1, 4, 4)[:, :3, 3], poses[:, :3, 3], atol=1e-12)
    assert main(["compare", str(urdf), str(urdf)]) == 0
    assert main(["compare", str(urdf), str(mended)]) == 1


def test_calibrate_names_the_way_to_a_table(urdf: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", str(urdf), str(tmp_path / "none.csv"), "-o", str(tmp_path / "o.yaml")]) == 1

    assert "kinegen convert FILE -o OUT.yaml --convention standard" in capsys.readouterr().err
