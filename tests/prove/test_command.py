"""`kinegen prove` with Frama-C: what it shows of kernels of every kind, and what it does not."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from kinegen.ui.cli import main
from kinegen.verify.frama_c.eva import PACKAGE, PROGRAM

pytestmark = pytest.mark.skipif(
    shutil.which(PROGRAM) is None,
    reason=f"{PROGRAM} is not installed (Debian: apt-get install --no-install-recommends {PACKAGE})",
)

ROBOTS = Path(__file__).resolve().parents[2] / "robots"


def proved(capsys: pytest.CaptureFixture[str], name: str, *options: str) -> tuple[int, dict[str, dict[str, object]]]:
    """The exit status, and what is found of each output or function about limits."""
    status = main(["prove", str(ROBOTS / f"{name}.yaml"), "--json", *options])
    document = json.loads(capsys.readouterr().out)
    assert document["holds"] is (status == 0)
    return status, {str(each["output"]): each for each in document["functions"]}


@pytest.mark.parametrize("real", ["float", "double"])
def test_kernels_without_branches_give_finite_numbers(real: str, capsys: pytest.CaptureFixture[str]) -> None:
    outputs = "pose,frames,position,jacobian,fk_jacobian,twist,hessian"
    status, found = proved(capsys, "scara", "--real", real, "--outputs", outputs)

    assert status == 0
    for output in outputs.split(","):
        assert (found[output]["claim"], found[output]["alarms"], found[output]["unreached"]) == ("finite", 0, 0)


@pytest.mark.parametrize("real", ["float", "double"])
def test_roots_arc_tangents_and_limits_take_any_number(real: str, capsys: pytest.CaptureFixture[str]) -> None:
    outputs = "quaternion_wxyz,inverse"
    status, found = proved(capsys, "puma560", "--real", real, "--outputs", outputs)

    assert status == 0
    for output in (*outputs.split(","), "inverse_nearest", "within_limits", "clamp"):
        assert (found[output]["claim"], found[output]["alarms"], found[output]["ranges"]) == ("defined", 0, [])


@pytest.mark.parametrize(
    ("name", "outputs"),
    [
        ("hand", "pose,jacobian"),
        ("calibrated_2r", "pose,parameter_jacobian"),
        ("blocks", "frames"),
        ("palletiser", "actuators_to_joints,fk_actuators,adjoint,transform_point"),
        ("motoman_l3", "actuators_to_joints,joints_to_actuators"),
    ],
)
def test_robots_of_every_kind(name: str, outputs: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert proved(capsys, name, "--real", "float", "--outputs", outputs)[0] == 0


def test_integers_leave_alarms_and_are_reported_so(capsys: pytest.CaptureFixture[str]) -> None:
    """Eva does not see why integers do not overflow; nothing is hidden, and nothing else is alarmed at."""
    status, found = proved(capsys, "scara", "--real", "q30", "--outputs", "position")
    messages = found["position"]["messages"]

    assert status == 1
    assert isinstance(messages, list)
    assert len(messages) == found["position"]["alarms"]
    assert all("signed overflow" in message for message in messages)


def test_the_kept_evidence_can_be_repeated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command of the folder says the same again."""
    options = ("--real", "float", "--outputs", "position", "-o", str(tmp_path))
    assert proved(capsys, "scara", *options)[0] == 0
    folder = tmp_path / "scara" / "scara_f32_position"
    command = (folder / "command.txt").read_text(encoding="utf-8")
    done = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=True)  # noqa: S602

    def summary(text: str) -> str:
        return text.partition("ANALYSIS SUMMARY")[2]

    assert "0 alarms generated" in summary(done.stdout)
    assert summary(done.stdout) == summary((folder / "frama-c.txt").read_text(encoding="utf-8"))
