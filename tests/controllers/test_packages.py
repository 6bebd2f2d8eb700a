"""What a package for a controller has in it, which arms are refused, and that the build writes it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import jinja2.meta
import pytest

from kinegen.cli import main
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.project import RENDERED
from kinegen.emit.environment import environment
from tests.controllers.packages import file_of, kernels, project
from tests.emit.emitted import ROOT

TEMPLATES = ROOT / "templates" / "controllers"

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: mm, angle: deg}
"""

WAIST = "  - {name: waist, a: 0, alpha: 90, d: 600, theta: q}\n"
LINK = "  - {{name: {}, a: {}, alpha: 0, d: 0, theta: q}}\n"

REFUSED = {
    "runtime": (
        ARM
        + "parameters:\n  l: {value: 500, runtime: true}\njoints:\n"
        + WAIST
        + LINK.format("shoulder", "l")
        + LINK.format("elbow", 400),
        "linuxcnc",
        "no LinuxCNC package for arm: parameter 'l' is a runtime parameter, which nothing there sets",
    ),
    "actuators": (
        ARM
        + "joints:\n"
        + WAIST
        + LINK.format("shoulder", 500)
        + LINK.format("elbow", 400)
        + "actuators:\n  readings:\n"
        + "".join(f"    m{k}: {{dimension: angle}}\n" for k in (1, 2, 3))
        + "  joints:\n"
        + "".join(
            f"    - {{joint: {joint}, form: gear, actuator: m{k}, ratio: 2}}\n"
            for k, joint in enumerate(("waist", "shoulder", "elbow"), 1)
        ),
        "klipper",
        "no Klipper package for arm: it has `actuators:`, and the package moves joints",
    ),
    "six joints": (
        None,
        "klipper",
        "no Klipper package for puma560: it moves arms of 3 joints for a position; this one has 6 joints",
    ),
    "five joints": (
        None,
        "linuxcnc",
        "vertical; 6 for a pose; this one has 5 joints and is solved for the pose",
    ),
    "plane": (
        None,
        "grblhal",
        "no grblHAL package for planar_3r: it moves arms of 3 joints for a position; 4 with a tool that",
    ),
    "no closed form": (
        None,
        "ros2_control",
        "no ros2_control package for iiwa14: it has no closed-form inverse, which the package calls: no family",
    ),
    "tree": (None, "linuxcnc", "no LinuxCNC package for hand: it has 5 tips, and the package moves one tool"),
}

FILES = {
    "six joints": "puma560",
    "five joints": "al5d",
    "plane": "planar_3r",
    "no closed form": "iiwa14",
    "tree": "hand",
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_arm_that_no_controller_moves_is_refused_in_one_line(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, package, message = REFUSED[case]
    path = file_of(FILES[case]) if text is None else tmp_path / "arm.yaml"
    if text is not None:
        path.write_text(text)

    assert main(["build", str(path), "--package", package, "--no-compile", "-o", str(tmp_path / "out")]) == 1

    (line, *more) = capsys.readouterr().err.strip().splitlines()
    assert message in line
    assert not (tmp_path / "out").exists()
    assert not more


def test_more_than_nine_joints_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = "".join(LINK.format(f"j{k}", 100) for k in range(10))
    (tmp_path / "arm.yaml").write_text(ARM + "joints:\n" + rows)

    assert (
        main(["build", str(tmp_path / "arm.yaml"), "--package", "linuxcnc", "--no-compile", "-o", str(tmp_path)]) == 1
    )

    assert (
        "it has no closed-form inverse, which the package calls: no family of closed forms has the joints RRRRRRRRRR"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("package", [each.value for each in Controller])
def test_another_number_type_is_refused(package: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    build = ["build", str(file_of("scara")), "--package", package, "--real", "q30", "--no-compile", "-o", str(tmp_path)]

    assert main(build) == 1
    assert f"is in {Controller(package).reals[0].value}; leave the number type out" in capsys.readouterr().err


@pytest.mark.parametrize("package", [each.value for each in Controller])
def test_the_build_writes_the_package_where_the_controller_is_named(
    package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    assert main(["build", str(file_of("scara")), "--package", package, "--no-compile"]) == 0

    folder = tmp_path / package / "scara"
    files = project("scara", Controller(package))
    assert {path: (folder / path).read_text(encoding="utf-8") for path in files} == dict(files)


@pytest.mark.parametrize("controller", list(Controller))
def test_a_package_says_what_a_builder_needs(controller: Controller) -> None:
    files = project("scara", controller)
    readme = files["README.md"]

    assert {"README.md", "LICENSE"} <= files.keys()
    assert kernels("scara").robot.digest in readme
    assert re.search(r"## Licence\n\nThe files here are 0BSD; ", readme)
    assert all(variable.name in readme for variable in kernels("scara").robot.variables)
    assert all(text.endswith("\n") and "{{" not in text for path, text in files.items() if path != "install.sh")
    assert not any(
        re.search(r"[ \t]+$", text, re.M) for path, text in files.items() if not path.startswith("selftest/")
    )


@pytest.mark.parametrize("controller", list(Controller))
def test_templates_take_the_context_alone(controller: Controller) -> None:
    folder = TEMPLATES / controller.value
    present = {path.relative_to(TEMPLATES).as_posix() for path in folder.rglob("*.jinja")}

    assert present == set(RENDERED[controller].values())
    for name in present:
        names = jinja2.meta.find_undeclared_variables(
            environment().parse((TEMPLATES / name).read_text(encoding="utf-8"))
        )
        assert names <= {"m"}


def test_no_text_of_a_package_claims_another_licence() -> None:
    """Glue is ours: no copyright lines of others, and the licence of the controller is named in words alone."""
    for controller in Controller:
        for path, text in project("scara", controller).items():
            assert "Copyright" not in text
            if path.endswith((".c", ".h", ".cpp", ".hpp", ".py")):
                assert "SPDX-License-Identifier: 0BSD" in text


def checkout(place: Path, kind: str) -> Path:
    """The stand-ins in the form of a checkout."""
    standins = Path(__file__).resolve().parent / "standins"
    if kind == "grblhal":
        return standins / "grblhal" / "grbl"
    (place / "klippy").mkdir()
    (place / "klippy" / "chelper").symlink_to(standins / "klipper")
    return place


@pytest.mark.controllers
@pytest.mark.parametrize("kind", ["grblhal", "klipper"])
def test_the_script_for_a_checkout_compiles_against_its_headers(kind: str, tmp_path: Path) -> None:
    command = [sys.executable, "scripts/try_controllers.py", kind, str(checkout(tmp_path, kind))]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"the package for {kind} compiles against ")


@pytest.mark.controllers
def test_the_script_for_a_checkout_refuses_other_headers(tmp_path: Path) -> None:
    command = [sys.executable, "scripts/try_controllers.py", "grblhal", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode != 0
