"""Any list of outputs that a build takes is taken by `prove` and `size`, which say what they leave out."""

from __future__ import annotations

import json
from typing import Any

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.ui.cli import main
from kinegen.verify.boards import cost
from kinegen.verify.frama_c.claims import subjects
from kinegen.verify.records import Cost
from tests.builds.workshop import ROBOTS

ARMS = {
    "planar_3r": "inverse_tracker,numeric_inverse",
    "jaco2": "complete_inverse",
    "panda_joint_7": "redundancy_range,inverse_tracker",
}

ANY = Cost("cortex-m4f", "gcc", Quantity.POSE, "float", "-O2", 1, 1, 1, None, "instructions", None)
"""What one kernel costs, said by nobody."""


def kernels_of(name: str) -> RobotPrograms:
    """The kernels of a robot with its outputs."""
    return lower_file(ROBOTS / f"{name}.yaml", tuple(map(parse_quantity, ARMS[name].split(","))))


@pytest.mark.parametrize("name", ARMS)
def test_every_function_is_analysed_and_measured_beside_outputs_without_a_program(name: str) -> None:
    kernels = kernels_of(name)
    needed = {str(program.quantity) for program in kernels.programs}
    measured = list(cost._subjects(kernels, "float"))

    assert needed <= {subject.output for subject in subjects(kernels, (ScalarType.FLOAT,), integers=False)}
    assert needed <= {str(subject.quantity) for subject in measured}


def test_limits_of_joints_and_of_readings_are_analysed_alike() -> None:
    driven = lower_file(ROBOTS / "palletiser.yaml", (Quantity.POSE, parse_quantity("joints_to_actuators")))
    found = {each.called: each for each in subjects(driven, (ScalarType.FLOAT,), integers=False)}
    readings = found["clamp_actuators"]

    assert {"within_limits", "clamp", "actuators_within_limits"} < found.keys()
    assert readings.function == "palletiser_f32_clamp_actuators"
    text = readings.driver.files["main.c"]
    assert "    palletiser_f32_clamp_actuators(actuators, clamped);" in text
    assert "(PALLETISER_F32_ACTUATORS_LOW[i] <= clamped[i] <= PALLETISER_F32_ACTUATORS_HIGH[i])" in text


@pytest.mark.parametrize("name", ARMS)
def test_size_says_what_it_leaves_out(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def measured(kernels: RobotPrograms, *_: Any) -> tuple[Cost, ...]:
        return tuple(ANY for _ in kernels.programs)

    monkeypatch.setattr(cost, "measure", measured)
    arguments = ["size", str(ROBOTS / f"{name}.yaml"), "--outputs", ARMS[name]]
    wanted = [each for each in ARMS[name].split(",") if each != "numeric_inverse"]

    assert main([*arguments, "--json"]) == 0
    assert sorted(json.loads(capsys.readouterr().out)["left_out"]) == sorted(wanted)
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert all(f"{output} is not measured" in said for output in wanted)
