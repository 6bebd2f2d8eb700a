"""The page on actuators says what is so."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from kinegen.io.load import loads
from kinegen.io.robot_file import keys
from kinegen.model.expression_parser import ACTUATOR_FUNCTIONS
from kinegen.model.outputs import Kind
from tests.actuators.machines import computed, samples

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "actuators.md").read_text(encoding="utf-8")


def test_its_robot_goes_there_and_back() -> None:
    block = re.search(r"```yaml\n(kinegen: 1\n.*?)```", PAGE, re.DOTALL)
    assert block is not None
    robot = loads(block[1], "arm.yaml")
    readings = samples(robot, 50)
    joints = computed(robot, Kind.ACTUATORS_TO_JOINTS, readings)

    np.testing.assert_allclose(computed(robot, Kind.JOINTS_TO_ACTUATORS, joints), readings, atol=1e-10)


def test_it_names_every_form_and_key_and_function() -> None:
    further = {key for _, more in keys.FORMS.values() for key in more}
    needed = {key for every, _ in keys.FORMS.values() for key in every} - {"joint", "actuator"}

    for word in {*keys.FORMS, *keys.ACTUATORS, *keys.BRANCHES, *further, *needed}:
        assert f"`{word}" in PAGE or f"{word}:" in PAGE, word
    assert all(f"`{word}`" in PAGE for word in ACTUATOR_FUNCTIONS)
