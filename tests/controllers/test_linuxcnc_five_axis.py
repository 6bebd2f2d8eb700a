"""A five-axis machine inside LinuxCNC: a cone with a leaning tool, speeds, switches, a refusal, a jog."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.io.load import load
from tests.controllers.cone import cone_cases
from tests.controllers.halrun import SERIAL
from tests.controllers.modules import write_linuxcnc
from tests.emit.emitted import ROOT

pytestmark = [pytest.mark.controllers, SERIAL]


def test_the_frustum_of_a_cone_with_a_leaning_tool(tmp_path: Path) -> None:
    """The tip keeps to the path and the axis to its lean in every servo period."""
    folder = write_linuxcnc(tmp_path, load(ROOT / "robots" / "trunnion_mill.yaml"), solved=False)
    for what, measured, allowed in cone_cases(folder):
        print(f"{what:45} {measured:10.3g}")
        assert measured <= allowed, what
