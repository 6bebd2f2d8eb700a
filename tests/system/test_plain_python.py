"""From text to every emitted file, sympy, mpmath, Jinja2 and PyYAML are enough."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from kinegen.ui.cli import main
from tests.system.plain_python import digests

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(__file__).with_name("plain_python.py")
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))
USUAL = ("scara", "hand", "motoman_l3", "puma560")
"""Inverses in closed form, a tree, actuators."""

URDF = """<robot name="arm"><link name="base"/><link name="tip"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.5" rpy="0 1.5707963 0"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>
"""
MJCF = """<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="tip" pos="0 0 0.5" euler="0 1.5707963 0">
<joint name="turn" axis="0 0 1" range="-1 1"/><geom size="0.1"/></body></worldbody></mujoco>
"""
TABLE = "joint,theta,d,a,alpha\n1,q,0.5,0.25,90\n2,q,0,0.5,0\n"

COMMANDS = (
    "check {file} {table}",
    "fk {file} {table} {angles}",
    "show {file} {table}",
    "show {file} {table} --output jacobian --format latex",
    "convert {file} {table} --to pinocchio -o {folder}/out.py --force",
    "convert {file} {table} --convention modified -o {folder}/out.yaml --force",
)


def plain(*arguments: str | Path, lines: str = "") -> subprocess.CompletedProcess[str]:
    """Run the program that takes packages away."""
    command = [sys.executable, PROGRAM, *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, input=lines, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[] if path.stem in USUAL else pytest.mark.long) for path in ROBOTS],
    ids=lambda path: path.stem,
)
def test_every_emitted_text_is_the_same_without_them(path: Path) -> None:
    done = plain(path)

    assert done.stderr == ""
    assert json.loads(done.stdout)[str(path)] == digests(path)


@pytest.mark.parametrize(
    ("name", "text", "angles"),
    [
        ("arm.urdf", URDF, "10"),
        ("arm.xml", MJCF, "10"),
        ("arm.csv", TABLE, "10 20"),
        ("arm.yaml", (ROOT / "robots" / "scara.yaml").read_text(encoding="utf-8"), "10 20 0.1"),
    ],
    ids=["urdf", "mjcf", "csv", "yaml"],
)
def test_commands_say_the_same_without_them(
    name: str,
    text: str,
    angles: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    table = "--table standard,m,deg" if file.suffix == ".csv" else ""
    lines = [each.format(file=file, angles=angles, table=table, folder=tmp_path) for each in COMMANDS]
    monkeypatch.setenv("COLUMNS", "80")

    done = plain(lines="\n".join(lines))

    codes = [main(line.split()) for line in lines]
    here = capsys.readouterr()
    assert (done.returncode, done.stdout, done.stderr) == (max(codes), here.out, here.err)
    assert max(codes) == 0
