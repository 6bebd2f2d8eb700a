"""What a package for a controller has in it, which arms are refused, and that the build writes it."""

from __future__ import annotations

import re
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import jinja2.meta
import pytest

from kinegen.backends.controllers.controller import Controller, macro_clash, require_name
from kinegen.backends.controllers.machine import require_arm
from kinegen.backends.controllers.project import MILL, RENDERED
from kinegen.backends.templates import environment
from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.ui.cli import main
from tests.controllers.contract import CONTRACTS, contract, headers, judged_by, missing
from tests.controllers.packages import HERE, file_of, kernels, need, project, run, write_package
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
    "two motors for a joint": (
        ARM
        + "joints:\n"
        + WAIST
        + LINK.format("shoulder", 500)
        + LINK.format("elbow", 400)
        + "actuators:\n  readings: {m1: angle, m2: angle, m3: angle, m4: angle}\n  joints:\n"
        + "    - {joint: waist, form: gear, actuator: m1, ratio: 2}\n"
        + "    - {joint: shoulder, form: gear, actuator: m2, ratio: 2}\n"
        + "    - {joint: elbow, value: m3 + m4}\n"
        + "  inverse: {m3: elbow/2, m4: elbow/2}\n",
        "klipper",
        "no Klipper package for arm: it has 4 readings of actuators for 3 joints",
    ),
    "limits of readings": (
        ARM
        + "joints:\n"
        + WAIST
        + LINK.format("shoulder", 500).replace("theta: q", "theta: q, limits: [10, 20]")
        + LINK.format("elbow", 400)
        + "actuators:\n  readings: {m1: angle, m2: {dimension: angle, limits: [30, 40]}, m3: angle}\n  joints:\n"
        + "".join(
            f"    - {{joint: {joint}, form: gear, actuator: m{k}, ratio: 1}}\n"
            for k, joint in enumerate(("waist", "shoulder", "elbow"), 1)
        ),
        "grblhal",
        "arm: no readings within their limits keep the joints within theirs",
    ),
    "eleven parameters": (
        ARM
        + "parameters:\n"
        + "".join(f"  p{k}: {{value: 1, runtime: true}}\n" for k in range(11))
        + "joints:\n"
        + WAIST
        + LINK.format("shoulder", "500 + p0 + p1 + p2 + p3 + p4 + p5")
        + LINK.format("elbow", "400 + p6 + p7 + p8 + p9 + p10"),
        "grblhal",
        "no grblHAL package for arm: it has 11 runtime parameters, and grblHAL has 10 settings for them",
    ),
    "angle": (
        (ARM + "joints:\n" + WAIST + LINK.format("elbow", 400) + LINK.format("turn", 0))
        .replace("a: 0, alpha: 90", "a: 600, alpha: 0")
        .replace("joints:", "parameters:\n  skew: {value: 10, dimension: angle, runtime: true}\njoints:", 1)
        + "  - {name: stroke, a: 0, alpha: 0, d: q, theta: skew}\n",
        "grblhal",
        "no grblHAL package for arm: runtime parameter 'skew' is an angle, and the package of an arm with 4 joints",
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
        "no ros2_control package for iiwa14: it has no closed-form inverse, which the package calls: no closed form",
    ),
    "runtime": (
        file_of("panda_joint_7").read_text().replace("d1: 0.333", "d1: {value: 0.333, runtime: true}"),
        "moveit2",
        "no MoveIt 2 package for panda_joint_7: d1 is a runtime parameter, and the search takes lengths as they are",
    ),
    "tree": (
        None,
        "linuxcnc",
        "no LinuxCNC package for hand: it has 5 tips, and is not a machine tool: that has three prismatic joints",
    ),
    "tree in MoveIt": (None, "moveit2", "no MoveIt 2 package for hand: it has 5 tips, and the package moves one tool"),
    "seven joints": (
        None,
        "moveit2",
        "no closed form has the joints RRRRRRR; with `redundancy:` in the robot file, a joint or arm_angle is given",
    ),
    "two values given": (
        ARM
        + "redundancy: [waist, shoulder]\njoints:\n"
        + WAIST
        + "".join(LINK.format(name, 300) for name in ("shoulder", "elbow", "wrist", "hand")),
        "moveit2",
        "no MoveIt 2 package for arm: its inverse is given 2 values (waist,shoulder), and the ranges are those of one",
    ),
    "a redundancy": (
        None,
        "ros2_control",
        "its inverse is given joint_7 in addition to the pose, which nothing there sets",
    ),
}

FILES = {
    "six joints": "puma560",
    "five joints": "al5d",
    "plane": "planar_3r",
    "no closed form": "iiwa14",
    "tree": "hand",
    "tree in MoveIt": "hand",
    "seven joints": "iiwa14",
    "a redundancy": "panda_joint_7",
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


@pytest.mark.parametrize(
    ("name", "package", "refused"),
    [
        ("On", "grblhal", True),
        ("On", "klipper", False),
        ("N_AXIS", "grblhal", True),
        ("DEFAULT_X_STEPS_PER_MM", "grblhal", True),
        ("noinline", "klipper", True),
        ("ARM_REACH", "klipper", True),
        ("ARM_FOLLOWED", "ros2_control", True),
        ("arm_length", "grblhal", False),
    ],
)
def test_runtime_parameters_that_are_macros_there_are_refused(name: str, package: str, refused: bool) -> None:
    text = ARM + f"parameters:\n  {name}: {{value: 500, runtime: true}}\njoints:\n" + WAIST
    arm = loads(text + LINK.format("shoulder", name) + LINK.format("elbow", 400), "arm.yaml")

    words = f"runtime parameter {name!r} may be a macro of " if refused else ""
    assert macro_clash(arm, Controller(package)).startswith(words)
    assert bool(macro_clash(arm, Controller(package))) == refused
    with pytest.raises(KinegenError, match=re.escape(words)) if refused else nullcontext():
        require_arm(arm, Controller(package))


@pytest.mark.parametrize(
    ("package", "name", "is_refused"),
    [
        *(("linuxcnc", name, True) for name in ("kinematics", "hal", "rtapi", "emcpos", "rtapi_app", "rtapi_math")),
        *(("klipper", name, True) for name in ("itersolve", "compiler", "trapq", "list", "corexy", "shaper")),
        ("linuxcnc", "corexy", False),
        ("klipper", "kinematics", False),
    ],
)
def test_a_name_that_the_controller_has_itself_is_refused_in_one_line(
    package: str, name: str, *, is_refused: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "arm.yaml"
    links = LINK.format("shoulder", 500) + LINK.format("elbow", 400)
    path.write_text(ARM.replace("name: arm", f"name: {name}") + "joints:\n" + WAIST + links)

    failed = main(["build", str(path), "--package", package, "--no-compile", "-o", str(tmp_path / "out")])

    assert failed == is_refused
    if is_refused:
        (line,) = capsys.readouterr().err.strip().splitlines()
        maker = Controller(package).makers_name
        assert f"no {maker} package for {name}: {maker} has a file of that name" in line
        assert "give the robot another name" in line


def test_modules_that_start_linuxcnc_are_in_one_group() -> None:
    """`make test-controllers` gives a group to one process; two LinuxCNC at once fail."""
    starts = re.compile(r"^from tests\.controllers\.\w+ import .*\b(?:MODULES|run_package|tried|cone_cases)\b", re.M)
    marked = re.compile(r"^pytestmark = \[pytest\.mark\.controllers, SERIAL\]$", re.M)
    texts = {path.name: path.read_text(encoding="utf-8") for path in HERE.glob("test_*.py")}
    found = {name for name, text in texts.items() if starts.search(text)}

    assert found == {name for name, text in texts.items() if marked.search(text)}
    assert len(found) > 3


@pytest.mark.controllers
@pytest.mark.parametrize("name", ["linuxcnc", "klipper"])
def test_headers_of_the_contract_are_no_names_of_robots(name: str) -> None:
    robot = kernels("scara4").robot
    for header in headers(name):
        with pytest.raises(KinegenError, match="has a file of that name"):
            require_name(replace(robot, name=header.removesuffix(".h")), Controller(name))


def test_more_than_nine_joints_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = "".join(LINK.format(f"j{k}", 100) for k in range(10))
    (tmp_path / "arm.yaml").write_text(ARM + "joints:\n" + rows)

    assert (
        main(["build", str(tmp_path / "arm.yaml"), "--package", "linuxcnc", "--no-compile", "-o", str(tmp_path)]) == 1
    )

    assert (
        "it has no closed-form inverse, which the package calls: no closed form has the joints RRRRRRRRRR"
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


@pytest.mark.controllers
@pytest.mark.parametrize("controller", [each for each in Controller if each is not Controller.LINUXCNC])
def test_the_self_test_of_a_readme_runs(controller: Controller, tmp_path: Path) -> None:
    need("gcc")
    folder = write_package(tmp_path, "scara", controller)
    command = (folder / "README.md").read_text().partition("## Self-test")[2].split("```sh\n")[1].partition("```")[0]

    run(["sh", "-ec", command], folder)


def test_a_readme_says_where_switches_of_a_motor_without_limits_are() -> None:
    limited, endless = (project(name, Controller.GRBLHAL)["README.md"] for name in ("coupled3", "capitals3"))

    assert "and at 0 where it has 1000000" not in limited
    assert "and at 0 where it has 1000000" in endless
    assert "which is in the unit of its travel" in limited


@pytest.mark.parametrize("controller", list(Controller))
def test_templates_take_the_context_alone(controller: Controller) -> None:
    folder = TEMPLATES / controller.value
    present = {path.relative_to(TEMPLATES).as_posix() for path in folder.rglob("*.jinja")}

    shared = {name for name in present if Path(name).name.startswith("_")}
    mills = set(MILL.values()) if controller.has_mills else set()
    assert present - shared == set(RENDERED[controller].values()) | mills
    for name in present:
        names = jinja2.meta.find_undeclared_variables(
            environment().parse((TEMPLATES / name).read_text(encoding="utf-8"))
        )
        assert names <= {"robot", "kernels", "m", "h"}


def test_no_text_of_a_package_claims_another_licence() -> None:
    """Glue is ours: no copyright lines of others, and the licence of the controller is named in words alone."""
    for controller in Controller:
        for path, text in project("scara", controller).items():
            assert "Copyright" not in text
            if path.endswith((".c", ".h", ".cpp", ".hpp", ".py")):
                assert "SPDX-License-Identifier: 0BSD" in text


def tried(*words: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "scripts/try_controllers.py", *map(str, words)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.controllers
@pytest.mark.parametrize(
    ("name", "lacking"),
    [
        ("grblhal", "planner.h: float feed_rate"),
        ("klipper", "klippy/stepper.py: def PrinterStepper("),
        ("linuxcnc", "src/hal/hal.h: extern int hal_init(const char *name);"),
        ("ros2_control", "kinematics_interface.hpp: virtual bool initialize("),
        ("moveit2", "kinematics_base.hpp: virtual bool getPositionIK("),
    ],
)
def test_the_script_for_a_checkout_names_what_it_lacks(name: str, lacking: str, tmp_path: Path) -> None:
    done = tried(name, tmp_path)

    assert done.returncode != 0
    assert lacking in done.stderr


def test_a_run_says_what_it_judges_each_package_by(monkeypatch: pytest.MonkeyPatch) -> None:
    said = {path.stem: judged_by(path.stem) for path in CONTRACTS.glob("*.yaml")}

    assert said.keys() == {each.value for each in Controller}
    for controller in Controller:
        assert said[controller.value].startswith(controller.makers_name)
        assert re.search(r" [0-9a-f]{7} \(20\d\d-\d\d-\d\d\)", said[controller.value])
    monkeypatch.setenv("PATH", "")
    assert judged_by("linuxcnc").endswith("; it is not installed, so nothing ran inside it")


ROS = ("kinematics_interface", "kdl", "logging", "parameters", "pluginlib")


@pytest.mark.parametrize("name", sorted(path.stem for path in CONTRACTS.glob("*.yaml")))
def test_no_contract_defines_a_function_twice(name: str) -> None:
    """Such a stand-in does not compile."""
    for group, entries in contract(name)["groups"].items():
        defined = [each["stand_in"] for each in entries if "{return" in each.get("stand_in", "")]
        assert len(defined) == len(set(defined)), group


@pytest.mark.parametrize(
    ("name", "groups", "altered", "count"),
    [
        ("grblhal", (), "planner.h: float feed_rate", 60),
        ("klipper", (), "klippy/toolhead.py: def limit_speed(self, speed, accel):", 30),
        ("linuxcnc", (), "src/hal/hal.h: extern int hal_init(const char *name);", 40),
        ("ros2_control", ROS, "rclcpp/include/rclcpp/logger.hpp: class Logger", 25),
        ("moveit2", (), "rclcpp/include/rclcpp/logger.hpp: class Logger", 80),
    ],
)
def test_every_entry_of_a_contract_is_looked_up(
    name: str, groups: tuple[str, ...], altered: str, count: int, tmp_path: Path
) -> None:
    """Files of the words of all entries are a checkout; without one of these words they are not."""
    words: dict[str, list[str]] = {}
    for line in missing(name, tmp_path, groups):
        path, _, text = line.partition(": ")
        words.setdefault(path, []).append(text)
    for path, texts in words.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("\n".join(texts))

    assert len(words) > 7
    assert sum(map(len, words.values())) > count
    assert missing(name, tmp_path, groups) == []
    path, _, text = altered.partition(": ")
    (tmp_path / path).write_text((tmp_path / path).read_text().replace(text, text.replace(" ", "  other ")))
    assert missing(name, tmp_path, groups) == [altered]
