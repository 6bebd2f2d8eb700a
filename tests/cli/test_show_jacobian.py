"""`kinegen show --output jacobian`: printed in every notation, and right."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.model.outputs import Reference
from kinegen.ui.cli import main
from kinegen.ui.cli.show import OUTPUTS
from kinegen.verify.reference import Kinematics
from tests.cli.commands import ROBOTS

JACOBIANS = {name: reference for name, reference in OUTPUTS.items() if reference is not None}
NAMES = {
    "jacobian": "base_J_tool",
    "jacobian_local": "tool_J_tool",
    "jacobian_world": "base_J_tool_world",
}


def show(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main(["show", *map(str, arguments)]) == 0

    out, err = capsys.readouterr()
    assert err == ""
    return out


@pytest.mark.parametrize("output", JACOBIANS)
@pytest.mark.parametrize("name", ["puma560", "stanford", "screw", "planar_3r"])
def test_the_printed_python_gives_the_jacobian_of_the_reference(
    name: str, output: str, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    printed: dict[str, Any] = {}
    exec(show(capsys, ROBOTS / f"{name}.yaml", "--output", output, "--format", "python"), printed)  # noqa: S102
    q = np.random.default_rng(4).uniform(-1, 1, robot.dof)
    expected = Kinematics(robot, q[None]).jacobian(robot.tips[0], JACOBIANS[output])[0]

    np.testing.assert_allclose(np.array(printed[NAMES[output]](q), dtype=float), expected, atol=1e-12)


@pytest.mark.parametrize("output", JACOBIANS)
def test_every_notation_names_it_and_prints_six_rows(output: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = ROBOTS / "scara.yaml"
    text = show(capsys, path, "--output", output)
    latex = show(capsys, path, "--output", output, "--format", "latex")
    page = ET.fromstring(  # noqa: S314 - our own
        f"<body>{show(capsys, path, '--output', output, '--format', 'mathml')}</body>"
    )

    assert f"{NAMES[output]} = " in text
    assert sum(line.rstrip().endswith("]") and "[" in line for line in text.splitlines()) == 6
    assert r"J_{\text{tool" in latex
    assert latex.count("begin{bmatrix}") == 1
    space = "{http://www.w3.org/1998/Math/MathML}"
    assert [element.text for element in page.iter(f"{space}mi") if element.text == "J"] == ["J"]


def test_a_frame_and_a_part_of_the_chain(capsys: pytest.CaptureFixture[str]) -> None:
    path = ROBOTS / "puma560.yaml"

    assert "base_J_elbow" in show(capsys, path, "--output", "jacobian", "--to", "elbow")
    assert "3_J_6" in show(capsys, path, "--output", "jacobian", "--from", "3", "--to", "6")


def test_a_chain_that_no_page_holds_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(ROBOTS / "human_body.yaml"), "--output", "jacobian"]) == 1

    assert capsys.readouterr().err == (
        "error: base_J_tool has 21 turns and is too long to be printed; select a part with --from and --to\n"
    )


def test_a_tree_has_a_jacobian_for_every_tip(capsys: pytest.CaptureFixture[str]) -> None:
    printed = show(capsys, ROBOTS / "hand.yaml", "--output", "jacobian_world")

    for tip in load(ROBOTS / "hand.yaml").tips:
        assert f"base_J_{tip}_world" in printed
    assert Reference.WORLD in JACOBIANS.values()


@pytest.mark.parametrize("lengths", ["d: 0, a: 1", "d: 1, a: 1", "d: 2, a: 0", "d: 0.5, a: 0"])
@pytest.mark.parametrize("twists", [(-90, 90), (90, 90), (90, -60), (20, -75)])
def test_a_sum_alone_behind_a_minus_stands_in_brackets(
    twists: tuple[int, int], lengths: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The length in front of it is 1, or becomes 1 with the numbers of a twist, and is not printed."""
    path = tmp_path / "arm.yaml"
    path.write_text(
        "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        f"  - {{name: j1, theta: q, d: 0, a: 0, alpha: {twists[0]}}}\n"
        f"  - {{name: j2, theta: q, d: 0, a: 0, alpha: {twists[1]}}}\n"
        f"  - {{name: j3, theta: q, {lengths}, alpha: 0}}\n",
        encoding="utf-8",
    )
    q = np.array([0.3, -0.7, 1.1])
    printed: dict[str, Any] = {}
    for output in ("pose", "jacobian"):
        exec(show(capsys, path, "--output", output, "--format", "python"), printed)  # noqa: S102
    kinematics = Kinematics(load(path), q[None])

    np.testing.assert_allclose(printed["base_T_tool"](q), kinematics.pose("tool")[0], atol=1e-12)
    np.testing.assert_allclose(
        np.array(printed[NAMES["jacobian"]](q), dtype=float),
        kinematics.jacobian("tool", JACOBIANS["jacobian"])[0],
        atol=1e-12,
    )
