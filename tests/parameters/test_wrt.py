"""`kinegen build --wrt`: what the module and the header say of parameters, and what they compute."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.ui.cli import main
from tests.cli.commands import TWO

OUTPUTS = ("--outputs", "pose,parameter_jacobian")


@pytest.fixture
def two(tmp_path: Path) -> Path:
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    return path


def built(two: Path, wrt: str) -> ModuleType:
    folder = two.parent / wrt.replace(",", "_")
    assert main(["build", "--no-compile", str(two), "-o", str(folder), *OUTPUTS, "--wrt", wrt]) == 0
    name = f"two_{folder.name}"
    spec = importlib.util.spec_from_file_location(name, folder / "two" / "__init__.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_the_module_names_the_columns_and_takes_the_parameters(two: Path) -> None:
    arm = built(two, "dh")
    q = np.array([[0.3, 0.7], [-1.2, 1.9]])
    step = 1e-6

    assert (
        arm.PARAMETERS
        == arm.Params._fields
        == (
            *("a_turn", "alpha_turn", "d_turn", "theta_turn"),
            *("a_slide", "alpha_slide", "d_slide", "theta_slide"),
        )
    )
    jacobian = arm.parameter_jacobian(q)
    assert jacobian.shape == (2, 6, 8)
    for column, name in enumerate(arm.PARAMETERS):
        value = getattr(arm.Params(), name)
        ahead, behind = (arm.fk(q, params=arm.Params(**{name: value + sign * step})) for sign in (1, -1))
        rate = (ahead - behind)[:, :3, 3] / (2 * step)
        np.testing.assert_allclose(jacobian[:, :3, column], rate, atol=1e-9)


def test_the_header_numbers_the_columns(two: Path) -> None:
    built(two, "theta_slide,L1")
    header = (two.parent / "theta_slide_L1" / "two" / "two.h").read_text(encoding="utf-8")

    assert "#define TWO_PARAMETERS 2" in header
    assert "#define TWO_PARAMETER_L1 0" in header
    assert "#define TWO_PARAMETER_THETA_SLIDE 1" in header
    assert "6x2 matrix, row by row, columns in the order of TWO_PARAMETER_*" in header
    assert "    double L1;\n    double theta_slide;\n} two_params;" in header


def test_a_parameter_that_does_not_exist_is_refused(two: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "--no-compile", str(two), "-o", str(two.parent / "out"), "--wrt", "L2"]) == 1

    assert capsys.readouterr().err == (
        f"error: {two}: there is no parameter 'L2' (expected L1; an entry, such as a_turn, of rows turn, slide; "
        "dh for all entries)\n"
    )
    assert not (two.parent / "out").exists()


def test_the_output_without_parameters_is_refused(two: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "--no-compile", str(two), "-o", str(two.parent / "out"), *OUTPUTS]) == 1

    assert "parameter_jacobian takes parameters" in capsys.readouterr().err
