"""What every package holds: the C files as they were proved, one licence, nothing that varies."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import jinja2.meta
import pytest

from kinegen.emit.environment import environment, template_folder
from kinegen.emit.packages.ecosystem import Ecosystem
from kinegen.emit.packages.layout import LAYOUTS
from kinegen.emit.packages.project import emit_project
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError
from kinegen.naming import prefix
from kinegen.robot.extent import joint_box
from kinegen.write import is_generated, write_files
from tests.emit.emitted import ROOT, kernels, texts, vectors
from tests.packages.packages import ROBOTS, example_joints, project

TEMPLATES = template_folder(ROOT / "kinegen") / "packages"
EVERY = [(robot, ecosystem) for robot in ROBOTS for ecosystem in Ecosystem]


@pytest.mark.parametrize(("robot", "ecosystem"), EVERY)
@pytest.mark.parametrize("reals", [(Real.FLOAT,), (Real.DOUBLE,), (Real.DOUBLE, Real.FLOAT)], ids="-".join)
def test_the_c_files_are_those_that_were_proved(robot: str, ecosystem: Ecosystem, reals: tuple[Real, ...]) -> None:
    files = project(robot, ecosystem, reals)
    held = {path.rpartition("/")[2]: text for path, text in files.items()}
    wanted = [f"{prefix(robot, real)}{end}" for real in reals for end in (".h", ".c", "_selftest.c", "_vectors.h")]

    assert {name: held[name] for name in wanted} == {name: texts(robot)[name] for name in wanted}
    assert sum(path.endswith((".h", ".c")) and "example" not in path for path in files) == len(wanted)


@pytest.mark.parametrize("ecosystem", Ecosystem)
def test_two_prints_are_the_same_and_name_no_date_or_place(ecosystem: Ecosystem) -> None:
    first = project("puma560", ecosystem)
    again = emit_project(kernels("puma560"), vectors("puma560"), texts("puma560"), ecosystem.reals, ecosystem)

    assert list(first) == list(again)
    assert dict(first) == dict(again)
    for text in first.values():
        assert not re.search(r"20[23]\d-\d\d|/home/|/tmp/|/root/|/work", text)
        assert text.endswith("\n")
        assert not text.endswith("\n\n")
        assert not re.search(r"[ \t]+$", text, re.M)
        assert "\n\n\n" not in text


@pytest.mark.parametrize("ecosystem", Ecosystem)
def test_every_file_says_where_it_comes_from(ecosystem: Ecosystem, tmp_path: Path) -> None:
    """All but those that hold no comments: JSON, and the licence, whose words are fixed."""
    write_files(tmp_path, project("puma560", ecosystem))
    silent = {path.name for path in tmp_path.rglob("*") if path.is_file() and not is_generated(path)}

    assert silent <= {"library.json", "LICENSE"}


def test_the_licence_is_the_one_that_the_project_promises() -> None:
    ours = (ROOT / "LICENSE").read_text(encoding="utf-8")
    grant = project("puma560", Ecosystem.CMAKE)["LICENSE"].partition("\n\n")[2]

    assert grant in ours


@pytest.mark.parametrize("ecosystem", Ecosystem)
def test_the_readme_tells_frames_units_functions_and_the_check(ecosystem: Ecosystem) -> None:
    readme = project("puma560", ecosystem)["README.md"]

    for word in ("base_T_tool", "lengths in m", "wrist_bend", "puma560_f32_fk", "PUMA560_F32_TOLERANCE", "0BSD"):
        assert word in readme
    assert all(len(line) <= 120 or line.startswith("|") for line in readme.splitlines())


def test_what_a_description_holds_stays_text() -> None:
    """A description is data from strangers; no format may take it for more."""
    awkward = 'An "arm" \\ with */ $<TARGET:x> ${X} | a table\'s #1 *arm* `code` <b>'
    arm = kernels("blocks")
    arm = replace(arm, robot=replace(arm.robot, description=awkward))
    files = {
        ecosystem: emit_project(arm, vectors("blocks"), texts("blocks"), (Real.FLOAT,), ecosystem)
        for ecosystem in Ecosystem
    }

    shown = awkward.replace("*/", "* /")
    assert json.loads(files[Ecosystem.PLATFORMIO]["library.json"])["description"] == f"Forward kinematics: {shown}."
    assert f"sentence=Forward kinematics: {shown}.\n" in files[Ecosystem.ARDUINO]["library.properties"]
    assert "<b>" not in files[Ecosystem.CMAKE]["README.md"].replace("\\<b\\>", "")
    assert "TARGET:x" not in files[Ecosystem.CMAKE]["CMakeLists.txt"]


@pytest.mark.parametrize("length", [0, 230, 500])
def test_a_description_of_any_length_fits_every_manifest(length: int) -> None:
    arm = kernels("blocks")
    arm = replace(arm, robot=replace(arm.robot, description="x" * length))
    files = emit_project(arm, vectors("blocks"), texts("blocks"), (Real.FLOAT,), Ecosystem.PLATFORMIO)

    assert 1 <= len(json.loads(files["library.json"])["description"]) <= 255


def test_a_name_that_arduino_keeps_for_itself_is_refused() -> None:
    arm = kernels("blocks")
    arm = replace(arm, robot=replace(arm.robot, name="Arduino_arm"))

    with pytest.raises(KinegenError, match="'Arduino_arm' begins as only Arduino's own libraries may"):
        emit_project(arm, vectors("blocks"), {}, (Real.FLOAT,), Ecosystem.ARDUINO)


def test_templates_are_all_used_and_take_the_context_alone() -> None:
    rendered = {name for layout in LAYOUTS.values() for name in layout.rendered.values()}
    present = {path.relative_to(TEMPLATES).as_posix(): path for path in TEMPLATES.rglob("*.jinja")}

    assert {name for name in present if not name.startswith("_")} == rendered
    for path in present.values():
        names = jinja2.meta.find_undeclared_variables(environment().parse(path.read_text(encoding="utf-8")))
        assert names <= {"p"}


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_example_stands_within_the_limits(robot: str) -> None:
    arm = kernels(robot).robot
    values = example_joints(project(robot, Ecosystem.CMAKE)["examples/pose.c"])

    assert all(low <= value <= high for value, (low, high) in zip(values, joint_box(arm), strict=True))
