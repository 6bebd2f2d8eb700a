"""Where a small angle keeps an arm out of its family, the message names what removes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.ui.cli import main

URDF = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="tip"/>
<joint name="j1" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="j2" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
<origin xyz="0.4 0 0" rpy="{angle} 0 0"/></joint>
<joint name="j3" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/><origin xyz="0.3 0 0"/>
<limit lower="-0.2" upper="0" effort="1" velocity="1"/></joint>
<joint name="j4" type="continuous"><parent link="d"/><child link="tip"/><axis xyz="0 0 1"/></joint></robot>
"""


def test_a_urdf_file_is_told_what_gives_it_a_family(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.format(angle="0.000003"), encoding="utf-8")
    main(["inspect", str(path), "--snap", "0"])
    told = " ".join(capsys.readouterr().out.split())
    main(["inspect", str(path), "--snap", "1e-05"])

    assert "no closed-form inverse" in told
    assert "--snap 1e-05 takes angles within 1e-05 rad of a multiple of 15 degrees as that multiple" in told
    assert "SCARA" in capsys.readouterr().out


def test_an_angle_that_is_meant_gets_no_such_advice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.format(angle="0.3"), encoding="utf-8")
    main(["inspect", str(path)])

    assert "--snap" not in capsys.readouterr().out
