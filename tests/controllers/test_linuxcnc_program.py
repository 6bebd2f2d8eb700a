"""Arms inside LinuxCNC: the speed of the tool, ends of lines and arcs, a target out of reach, a jog and its cancel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.controllers.controller import Controller
from tests.controllers.halrun import SERIAL
from tests.controllers.linuxcnc_cases import tried
from tests.controllers.machine_run import run_package
from tests.controllers.modules import write_linuxcnc
from tests.controllers.packages import kernels, machine, write_package
from tests.controllers.test_linuxcnc_arm import arm, pose_of

pytestmark = [pytest.mark.controllers, SERIAL]


@pytest.mark.parametrize("name", ["scara4", "palletiser3", "arm3", "coupled3"])
def test_an_arm_keeps_to_its_program(name: str, tmp_path: Path) -> None:
    """One with coupled motors and runtime parameters among them; LinuxCNC's joints are the motors there."""
    made = machine(name, Controller.LINUXCNC)
    folder = write_package(tmp_path, name, Controller.LINUXCNC)
    for what, measured, allowed in tried(folder, kernels(name).robot, made):
        print(f"{name:12} {what:45} {measured:10.3g}")
        assert measured <= allowed, what


def test_a_tool_of_the_table_moves_the_tip_and_not_the_arm(tmp_path: Path) -> None:
    """Of a SCARA whose tool hangs down: its joints stay, and words are then those of the longer tool's tip."""
    name = "scara_tool"
    folder = write_linuxcnc(tmp_path, arm(name), solved=True)
    done = run_package(
        folder, ["T1 M6", "G43", "G91 G1 X10 Z-7 F600", "G49", "G1 X-10 Z7"], files={f"{name}.tbl": "T1 P1 Z80 D1\n"}
    )
    home, _, offset, moved, without, back = (step["joints"] for step in done.steps)

    assert [step["errors"] for step in done.steps] == [[]] * 6
    np.testing.assert_allclose([offset, without, back], [home, moved, home], atol=1e-9)
    tips = [pose_of(name, joints, {"tool_length": 0.08})[:3, 3] for joints in (home, moved)]
    np.testing.assert_allclose(tips[1] - tips[0], [10.0, 0.0, -7.0], atol=1e-9)
    words = np.array(done.steps[2]["world"][:3]) - [0.0, 0.0, 80.0]
    np.testing.assert_allclose(words, tips[0], atol=1e-9)
