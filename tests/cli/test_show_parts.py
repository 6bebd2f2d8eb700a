"""What `kinegen show` prints beside a pose: products, named parts, blocks, angles, names of joints."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import kinegen
from kinegen.ui.cli import main
from kinegen.verify.reference import Kinematics
from tests.cli.commands import ROBOTS

OPTIONS = {
    "steps": ["--steps", "--link-matrix"],
    "named": ["--name-subexpressions"],
    "blocks": ["--output", "jacobian", "--blocks", "--name-subexpressions"],
    "angles": ["--output", "rpy_xyz", "--variables", "theta,d"],
}


def show(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main(["show", *map(str, arguments)]) == 0

    out, err = capsys.readouterr()
    assert err == ""
    return out


def module(capsys: pytest.CaptureFixture[str], name: str, *arguments: str) -> dict[str, Any]:
    """What the printed Python defines."""
    printed: dict[str, Any] = {}
    exec(show(capsys, ROBOTS / f"{name}.yaml", *arguments, "--format", "python"), printed)  # noqa: S102
    return printed


def joints(robot: kinegen.Robot) -> NDArray[np.float64]:
    return np.random.default_rng(6).uniform(-1, 1, robot.dof)


def test_steps_are_followed_by_their_products(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--steps", "--to", "4")
    assert re.findall(r"(?m)^(\dT\d) = ", text) == ["0T1", "1T2", "2T3", "3T4", "0T2", "0T3", "0T4"]

    robot = kinegen.load(ROBOTS / "puma560.yaml")
    printed, q = module(capsys, "puma560", "--steps"), joints(robot)
    kinematics = Kinematics(robot, q[None])
    for number, name in enumerate(robot.joints[1:5], start=2):
        np.testing.assert_allclose(printed[f"frame0_T_frame{number}"](q), kinematics.pose(name)[0], atol=1e-12)


@pytest.mark.parametrize("name", ["puma560", "panda", "ur5", "screw", "palletiser"])
def test_named_parts_give_the_pose_and_the_jacobian(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    robot = kinegen.load(ROBOTS / f"{name}.yaml")
    q = joints(robot)
    kinematics = Kinematics(robot, q[None])
    pose = module(capsys, name, "--name-subexpressions")["base_T_tool"](q)
    jacobian = module(capsys, name, "--name-subexpressions", "--output", "jacobian")["base_J_tool"](q)

    np.testing.assert_allclose(pose, kinematics.pose("tool")[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(jacobian, kinematics.jacobian("tool")[0], rtol=1e-9, atol=1e-12)


def test_every_name_is_used_more_than_once_and_none_is_a_parameter(tmp_path: Path) -> None:
    text = (ROBOTS / "panda.yaml").read_text(encoding="utf-8").replace("a7", "x7")
    form = kinegen.load(text).closed_form(named=True).sheet.products[0].factors[0]
    names = [name for name, _ in form.definitions]

    assert names
    assert names == [f"x_{number}" for number in range(1, len(names) + 1)]
    everything = f"{form.entries} {form.definitions}"
    assert all(everything.count(f"Symbol(name='{name}'") > 1 for name in names)


@pytest.mark.parametrize("name", ["puma560", "stanford"])
def test_named_parts_are_written_out_for_sympy(name: str) -> None:
    robot = kinegen.load(ROBOTS / f"{name}.yaml")
    values = {f"q{place}": value for place, value in enumerate(joints(robot), start=1)}
    values |= {entry.name: 0.3 for entry in robot.parameters}
    one, other = (robot.closed_form(named=named).sympy().subs(values) for named in (True, False))

    assert abs(one - other).norm() < 1e-12


def test_a_jacobian_in_blocks(capsys: pytest.CaptureFixture[str]) -> None:
    robot = kinegen.load(ROBOTS / "stanford.yaml")
    q = joints(robot)
    printed = module(capsys, "stanford", "--output", "jacobian", "--blocks")
    expected = Kinematics(robot, q[None]).jacobian("tool")[0]

    np.testing.assert_allclose(printed["base_Jv_tool"](q), expected[:3], atol=1e-12)
    np.testing.assert_allclose(printed["base_Jw_tool"](q), expected[3:], atol=1e-12)


def test_each_block_has_the_names_that_it_uses(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--output", "jacobian", "--blocks", "--name-subexpressions")
    blocks = [part for part in text.split("\n\n") if "base_J" in part]
    shown = show(capsys, ROBOTS / "puma560.yaml", "--output", "jacobian", "--name-subexpressions")

    names = re.findall(r"^  (x\d+) =", shown, re.M)
    assert len(blocks) == 2
    for block in blocks:
        defined = re.findall(r"^  (x\d+) =", block, re.M)
        assert all(len(re.findall(rf"\b{name}\b", block)) > 1 for name in defined)
        assert set(re.findall(r"\bx\d+\b", block)) == set(defined) < set(names)


def test_a_robot_without_joints_has_a_jacobian_without_columns(capsys: pytest.CaptureFixture[str]) -> None:
    printed = module(capsys, "blocks", "--output", "jacobian", "--blocks", "--name-subexpressions")

    assert printed["base_Jv_tool"]([]) == printed["base_Jw_tool"]([]) == [[], [], []]


def test_an_arm_in_a_plane_has_three_rows(capsys: pytest.CaptureFixture[str]) -> None:
    robot = kinegen.load(ROBOTS / "planar_3r.yaml")
    q = joints(robot)
    found = module(capsys, "planar_3r", "--output", "jacobian", "--blocks")["base_J_tool"](q)

    np.testing.assert_allclose(found, Kinematics(robot, q[None]).jacobian("tool")[0][[0, 1, 5]], atol=1e-12)
    text = show(capsys, ROBOTS / "planar_3r.yaml", "--output", "jacobian", "--blocks")
    assert "rows vx, vy, wz" in text


def turn(axis: str, angle: float) -> NDArray[np.float64]:
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    found = np.eye(3)
    found[i, i] = found[j, j] = np.cos(angle)
    found[i, j], found[j, i] = -np.sin(angle), np.sin(angle)
    return found


def test_angles_that_are_numbers_are_printed_as_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "planar_3r.yaml", "--output", "euler_zyz")

    assert "  phi = atan2(s123, c123)\n  theta = 0\n  psi = 0\n" in text


def test_the_sines_of_orientations_are_those_that_occur(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "ur3.yaml", "--output", "rpy_zyx")

    assert "s234 = sin(" in text
    assert "c23 = cos(" not in text


@pytest.mark.parametrize("output", ["rpy_zyx", "rpy_xyz", "euler_zyz"])
@pytest.mark.parametrize(
    "name", ["puma560", "ur5", "spherical_wrist", "anthropomorphic_arm", "scara", "scara_hd", "planar_3r"]
)
def test_the_angles_give_the_rotation(name: str, output: str, capsys: pytest.CaptureFixture[str]) -> None:
    robot = kinegen.load(ROBOTS / f"{name}.yaml")
    q = joints(robot)
    a, b, c = (float(row[0]) for row in module(capsys, name, "--output", output)["base_A_tool"](q))
    found = {
        "rpy_zyx": turn("z", c) @ turn("y", b) @ turn("x", a),
        "rpy_xyz": turn("x", a) @ turn("y", b) @ turn("z", c),
        "euler_zyz": turn("z", a) @ turn("y", b) @ turn("z", c),
    }[output]

    np.testing.assert_allclose(found, Kinematics(robot, q[None]).pose("tool")[0][:3, :3], atol=1e-12)


def test_angles_are_short_where_the_rotation_is(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "spherical_wrist.yaml", "--output", "euler_zyz")

    assert "theta = atan2(abs(s2), c2)" in text
    assert "where the rotation is Rz(phi) Ry(theta) Rz(psi)" in text
    assert "r33 = " in show(capsys, ROBOTS / "puma560.yaml", "--output", "euler_zyz")


def test_joint_variables_by_their_kind(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "stanford.yaml", "--variables", "theta,d")
    assert "c1 = cos(theta1)" in text
    assert "theta2 joint_2, d3 joint_3" in text
    assert re.search(r"\bq\d", text) is None

    latex = show(capsys, ROBOTS / "stanford.yaml", "--variables", "theta,d", "--format", "latex")
    assert r"\cos \theta_{1}" in latex
    assert "q_{" not in latex

    robot = kinegen.load(ROBOTS / "stanford.yaml")
    q = joints(robot)
    found = module(capsys, "stanford", "--variables", "theta,d")["base_T_tool"](q)
    np.testing.assert_allclose(found, Kinematics(robot, q[None]).pose("tool")[0], atol=1e-12)


def test_a_parameter_keeps_its_name_beside_joint_variables(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = (ROBOTS / "stanford.yaml").read_text(encoding="utf-8").replace("d2", "d3")
    path = tmp_path / "arm.yaml"
    path.write_text(text, encoding="utf-8")

    assert "theta2 joint_2, q3 joint_3" in show(capsys, path, "--variables", "theta,d")


def test_the_general_matrix_of_each_convention(capsys: pytest.CaptureFixture[str]) -> None:
    standard = show(capsys, ROBOTS / "ur5.yaml", "--link-matrix")
    modified = show(capsys, ROBOTS / "puma560.yaml", "--link-matrix")
    rows = [re.findall(r"(?m)^.*\[ (.*?) +\]$", text)[:3] for text in (standard, modified)]

    # Siciliano et al. 2009, eq. 2.52, and Craig 2005, eq. 3.6.
    assert [[re.sub("calpha", "ca", re.sub("salpha", "sa", entry)) for entry in row.split()] for row in rows[0]] == [
        ["ctheta", "-stheta*ca", "stheta*sa", "a*ctheta"],
        ["stheta", "ctheta*ca", "-ctheta*sa", "a*stheta"],
        ["0", "sa", "ca", "d"],
    ]
    assert [re.sub("calpha", "ca", re.sub("salpha", "sa", row)).split() for row in rows[1]] == [
        ["ctheta", "-stheta", "0", "a"],
        ["stheta*ca", "ctheta*ca", "-sa", "-d*sa"],
        ["stheta*sa", "ctheta*sa", "ca", "d*ca"],
    ]


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@pytest.mark.parametrize("name", ["puma560", "scara"])
def test_every_notation_prints_them(name: str, options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    path = ROBOTS / f"{name}.yaml"
    latex = show(capsys, path, *options, "--format", "latex")
    page = ET.fromstring(f"<body>{show(capsys, path, *options, '--format', 'mathml')}</body>")  # noqa: S314 - our own

    assert latex.count(r"\begin{") == latex.count(r"\end{") > 1
    assert len(page) >= 1
    compile(show(capsys, path, *options, "--format", "python"), "printed.py", "exec")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--blocks"], "blocks are parts of a Jacobian, and the output is pose"),
        (["--output", "singularities", "--name-subexpressions"], "singularities has names for long parts already"),
        (["--output", "rpy_zyx", "--name-subexpressions"], "rpy_zyx has names for long parts already"),
    ],
)
def test_options_that_would_change_nothing_are_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", str(ROBOTS / "ur5.yaml"), *arguments]) == 1

    assert message in capsys.readouterr().err


def test_a_robot_without_a_table_has_no_link_matrix(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "ets.yaml"
    path.write_text(
        "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\n"
        "joints:\n  - {name: turn, ets: [Rz(q), Tx(0.2)]}\n",
        encoding="utf-8",
    )
    assert main(["show", str(path), "--link-matrix"]) == 1

    assert "arm has no row of a table" in capsys.readouterr().err


_MOUNTED = "kinegen: 1\nname: mounted\nconvention: standard\nunits: {length: m, angle: deg}\n"


@pytest.mark.parametrize(
    ("arm", "output", "lines"),
    [
        ("joints: [{name: a, ets: [Tx(q)]}]\nbase: {rpy: [0, 30, 30]}\n", "rpy_zyx",
         ["roll = 0", "pitch = atan2(1/2, sqrt(3/4))", "yaw = atan2(sqrt(3)/4, 3/4)"]),
        ("joints: [{name: a, ets: [Tx(q)]}]\nbase: {rpy: [0, 90, 0]}\n", "rpy_xyz",
         ["roll = 0", "pitch = pi/2", "yaw = 0"]),
        ("joints: [{name: a, ets: [Rz(q)]}]\ntool: {rpy: [90, 0, 0]}\n", "euler_zyz",
         ["theta = pi/2", "psi = pi/2"]),
        ("joints: [{name: a, ets: [Rz(q)]}]\ntool: {rpy: [0, 30, 30]}\n", "euler_zyz",
         ["theta = atan2(1/2, sqrt(3)/2)", "psi = 0"]),
        ("joints: [{name: a, ets: [Rx(q)]}]\n", "rpy_xyz", ["pitch = 0", "yaw = 0"]),
        ("joints: [{name: a, ets: [Ry(45), Rz(q), Ry(45)]}]\n", "euler_zyz",
         ["theta = atan2(sqrt((c1 + 1)**2/4 + r23**2), (1 - c1)/2)"]),
    ],
)  # fmt: skip
def test_numbers_of_angles_are_computed(
    arm: str, output: str, lines: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A square has no square of a number in it, and an angle on an axis is a number."""
    path = tmp_path / "mounted.yaml"
    path.write_text(_MOUNTED + arm)
    text = show(capsys, path, "--output", output)

    for line in lines:
        assert f"  {line}\n" in text
    assert re.search(r"(?<![\w.])[\d.]+\*\*|sqrt\(1\)|atan2\(0", text) is None


def test_a_parameter_that_is_called_as_an_angle_keeps_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mounted.yaml"
    arm = "parameters: {roll: {value: 10, runtime: true}}\njoints: [{name: a, ets: [Rz(q), Rx(roll), Ry(q)]}]\n"
    path.write_text(_MOUNTED + arm.replace("Ry(q)]}]", "Ry(30)]}]"))
    text = show(capsys, path, "--output", "rpy_zyx")

    assert "  roll_ = atan2(" in text
    assert "where the rotation is Rz(yaw) Ry(pitch) Rx(roll_)" in text
    assert "roll = 10 deg (at run time)" in text


@pytest.mark.parametrize(
    ("form", "names"),
    [("latex", (r"\phi &= ", r"\theta &= ", r"\psi &= ")), ("mathml", ("<mi>φ</mi>", "<mi>θ</mi>", "<mi>ψ</mi>"))],
)
def test_angles_have_whole_names_in_every_notation(
    form: str, names: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("spherical_wrist", "puma560"):
        text = show(capsys, ROBOTS / f"{name}.yaml", "--output", "euler_zyz", "--format", form)
        assert all(each in text for each in names)
        assert "heta}" not in text


def test_no_long_bracket_stands_in_a_formula_of_an_angle(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "nutating_mill.yaml", "--output", "euler_zyz")

    assert "theta = atan2(sqrt(r13**2 + r23**2), (c5 + 1)/2)" in text
