"""The closed form in Python: what `kinegen show` prints, and matrices of sympy with the same value."""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import kinegen
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.verify.reference import Kinematics

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))


def numbers(robot: kinegen.Robot, matrix: sp.MatrixBase, q: np.ndarray) -> np.ndarray:
    """A matrix at joint values and the parameters of the file; 30 digits on the way."""
    values = {f"q{place}": value for place, value in enumerate(q, start=1)}
    values |= {entry.name: float(evaluate(entry.value, {}, FLOAT64)) for entry in robot.parameters}
    values |= {f"{name}_": value for name, value in list(values.items())}
    taken = {symbol: sp.Float(values[symbol.name], 30) for symbol in matrix.free_symbols}
    return np.array(matrix.subs(taken).doit().evalf(30).tolist(), dtype=float)


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.long] * (path.stem == "general_6r")) for path in ROBOTS],
    ids=lambda path: path.stem,
)
def test_sympy_has_the_value_of_the_judge(path: Path) -> None:
    robot = kinegen.load(path)
    q = np.random.default_rng(3).uniform(-1.5, 1.5, robot.dof)
    form = robot.closed_form()
    wanted = kinegen.reference.fk(robot, q).reshape(-1, 4, 4)

    for name, pose in zip(form.names, wanted, strict=True):
        assert np.allclose(numbers(robot, form.sympy(name), q), pose, atol=1e-12 * max(1, abs(pose).max()))


@pytest.mark.parametrize("output", ["jacobian", "jacobian_local", "jacobian_world"])
def test_jacobians_too(output: str) -> None:
    from kinegen.ui.api.textbook_forms import OUTPUTS

    robot = kinegen.load(ROOT / "robots" / "puma560.yaml")
    q = np.random.default_rng(4).uniform(-1.5, 1.5, 6)
    found = numbers(robot, robot.closed_form(output=output).sympy(), q)

    assert np.allclose(found, Kinematics(robot, q).jacobian("tool", OUTPUTS[output])[0], atol=1e-12)


def test_singularities_are_those_of_their_output_alone() -> None:
    robot = kinegen.load(ROOT / "robots" / "scara.yaml")

    assert len(robot.closed_form(output="singularities").singularities) == 1
    with pytest.raises(
        kinegen.KinegenError, match=r"closed form of 'pose'; closed_form\(output='singularities'\) has them"
    ):
        _ = robot.closed_form().singularities


def test_text_is_what_the_command_prints() -> None:
    file = ROOT / "robots" / "puma560.yaml"
    command = [sys.executable, "-m", "kinegen", "show", str(file)]
    wide = {**os.environ, "COLUMNS": "100"}
    printed = subprocess.run(command, capture_output=True, text=True, check=True, env=wide).stdout
    robot = kinegen.load(file)

    assert printed == f"{robot.table()}\n\n{robot.closed_form()}\n"


@pytest.mark.parametrize("name", ["puma560", "hand", "human_body", "motoman_l3"])
def test_rich_display_is_well_formed(name: str) -> None:
    robot = kinegen.load(ROOT / "robots" / f"{name}.yaml")
    form = robot.closed_form()

    for html in (form._repr_html_(), robot._repr_html_()):
        ET.fromstring(f"<div>{html.replace('<br>', '<br/>')}</div>")  # noqa: S314 - our own text
    assert form._repr_latex_().count(r"\begin{") == form._repr_latex_().count(r"\end{") > 0
    assert "\n" not in repr(form)


def test_names_from_a_file_are_text_and_not_markup() -> None:
    robot = kinegen.load(
        {
            "kinegen": 1,
            "name": "arm",
            "description": "<script>alert(1)</script> & --> </math>",
            "convention": "standard",
            "units": {"length": "m", "angle": "rad"},
            "joints": [{"name": "turn", "theta": "q", "d": 0, "a": 1, "alpha": 0}],
        }
    )

    for html in (robot._repr_html_(), robot.closed_form()._repr_html_()):
        assert "<script" not in html
        ET.fromstring(f"<div>{html.replace('<br>', '<br/>')}</div>")  # noqa: S314 - our own text


def test_wrong_words_are_named() -> None:
    puma, hand = (kinegen.load(ROOT / "robots" / f"{name}.yaml") for name in ("puma560", "hand"))

    with pytest.raises(kinegen.KinegenError, match="unknown output 'twist'"):
        puma.closed_form(output="twist")
    with pytest.raises(kinegen.KinegenError, match="nowhere"):
        puma.closed_form(end="nowhere")
    with pytest.raises(kinegen.KinegenError, match="hand has several closed forms, and name one of them: base_T_thumb"):
        hand.closed_form().sympy()
    with pytest.raises(kinegen.KinegenError, match="'x' is not one of them"):
        hand.closed_form().sympy("x")


def test_a_word_of_c_is_refused_by_what_makes_c() -> None:
    joint = {"name": "turn", "theta": "q", "d": 0, "a": 0.5, "alpha": 0}
    units = {"length": "m", "angle": "deg"}
    arm = kinegen.load({"kinegen": 1, "name": "double", "convention": "standard", "units": units, "joints": [joint]})

    assert arm.closed_form().names == ("base_T_tool",)
    with pytest.raises(kinegen.KinegenError, match="robot name 'double' is a C keyword"):
        kinegen.compile(arm, "pose", real="double", compile=False)
