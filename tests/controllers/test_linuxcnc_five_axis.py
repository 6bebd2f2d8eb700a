"""A five-axis machine inside LinuxCNC: a cone with a leaning tool, speeds, switches, a refusal, a jog."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.io.load import load
from tests.controllers.cone import axes, cone_cases
from tests.controllers.halrun import SERIAL
from tests.controllers.modules import write_linuxcnc
from tests.controllers.packages import file_of
from tests.emit.emitted import ROOT

pytestmark = [pytest.mark.controllers, SERIAL]


def test_the_frustum_of_a_cone_with_a_leaning_tool(tmp_path: Path) -> None:
    """The tip keeps to the path and the axis to its lean in every servo period."""
    folder = write_linuxcnc(tmp_path, load(ROOT / "robots" / "trunnion_mill.yaml"), solved=False)
    for what, measured, allowed in cone_cases(folder):
        print(f"{what:45} {measured:10.3g}")
        assert measured <= allowed, what


def test_the_frustum_of_a_cone_by_motors(tmp_path: Path) -> None:
    """The same program as for the machine without actuators, of which this one has the geometry."""
    machine = load(file_of("coupled_mill"))
    assert load(ROOT / "robots" / "trunnion_mill.yaml").frame_names == machine.frame_names
    for what, measured, allowed in cone_cases(write_linuxcnc(tmp_path, machine, solved=False), axes):
        print(f"{what:45} {measured:10.3g}")
        assert measured <= allowed, what
