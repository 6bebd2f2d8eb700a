"""The ros2_control plug-in against stand-ins of the headers: poses and Jacobians of all links, parameters, refusals."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.kernel_calls import links_of
from kinegen.backends.controllers.machine import home_of
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import load
from kinegen.model.robot import Robot
from kinegen.support.files.write import write_files
from kinegen.verify import reference
from tests.controllers.contract import contract, headers, missing
from tests.controllers.packages import FLAGS, HERE, kernels, machine, need, project, run, write_package
from tests.controllers.paths import with_parameter

pytestmark = pytest.mark.controllers

ROS = Controller.ROS2_CONTROL
CALLS = HERE / "standins" / "ros2" / "run.cpp"
EIGEN = Path("/usr/include/eigen3")

Numbers = NDArray[np.float64]
Answers = list[tuple[str, bool, list[float]]]


def compiled(place: Path, name: str, change: tuple[str, str] = ("", "")) -> Path:
    """The program that calls the plug-in of a robot, with a word of its source replaced."""
    need("gcc", "g++")
    if not EIGEN.exists():
        pytest.skip("Eigen is not installed (Debian: apt-get install libeigen3-dev)")
    folder = write_package(place, name, ROS)
    write_files(place / "standins", headers("ros2_control"))
    plugin = folder / "src" / "plugin.cpp"
    assert change[0] in plugin.read_text()
    plugin.write_text(plugin.read_text().replace(*change) if change[0] else plugin.read_text())
    objects = []
    for source in sorted((folder / "src").glob("*.c")):
        objects.append(source.with_suffix(".o"))
        run(["gcc", *FLAGS, "-c", source, "-o", objects[-1]], place)
    standins = place / "standins"
    includes = [f"-I{standins}", "-isystem", EIGEN, f"-I{folder / 'include'}", f"-I{folder / 'src'}"]
    flags = ["-std=c++17", "-O0", "-Wall", "-Wextra", "-Werror"]
    flags += ["-DPARAMETERS"] if kernels(name, ROS).robot.runtime_parameters else []
    flags += [f"-DPLUGIN={name}_kinematics::Plugin", "-include", f"{name}_kinematics/plugin.hpp"]
    run(["g++", *flags, *includes, plugin, CALLS, *objects, "-o", place / "run"], place)
    return place / "run"


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """A program for each robot that the tests call, compiled once."""
    return {name: compiled(tmp_path_factory.mktemp(name), name) for name in ("puma560_mm", "cell4", "tooled6")}


def ask(program: Path, *lines: str) -> tuple[Answers, str]:
    """What the plug-in gives, and its messages."""
    done = subprocess.run([program], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=60)
    rows = [line.split() for line in done.stdout.splitlines()]
    return [(word, good == "1", list(map(float, numbers))) for word, good, *numbers in rows], done.stderr


def home_line(name: str, order: Sequence[int] = ()) -> str:
    """Joint values at home in radians and metres, in the order of a controller."""
    arm, made = kernels(name, ROS).robot, machine(name, ROS)
    metres = made.millimetres / 1000
    q = [value * (1 if joint.turns else metres) for value, joint in zip(home_of(arm), made.joints, strict=True)]
    return "q " + " ".join(repr(float(q[place])) for place in order or range(arm.dof))


def expected(name: str, frame: str, other: Robot | None = None) -> tuple[Numbers, Numbers]:
    """Pose and Jacobian of the reference, in metres; with other parameters if need be."""
    arm, made = other or kernels(name, ROS).robot, machine(name, ROS)
    home = home_of(kernels(name, ROS).robot)
    metres = made.millimetres / 1000
    if frame == arm.root:
        return np.eye(4), np.zeros((6, arm.dof))
    pose = reference.frames(arm, [home])[frame][0].copy()
    pose[:3, 3] *= metres
    jacobian = reference.Kinematics(arm, [home]).jacobian(frame)[0].copy()
    jacobian[:3] *= metres
    jacobian[:, [not joint.turns for joint in made.joints]] /= metres
    return pose, jacobian


def require(answers: Iterable[tuple[str, bool, list[float]]], pose: Numbers, jacobian: Numbers) -> None:
    """Compare the five answers on a link with a pose and a Jacobian."""
    found = {word: np.array(numbers) for word, good, numbers in answers if good}
    dof = jacobian.shape[1]
    given = np.linspace(1e-3, 2e-3, dof)
    np.testing.assert_allclose(found["pose"].reshape(4, 4), pose, atol=1e-12)
    np.testing.assert_allclose(found["jacobian"].reshape(6, dof), jacobian, atol=1e-12)
    inverse = found["inverse"].reshape(dof, 6)
    np.testing.assert_allclose(inverse, np.linalg.pinv(jacobian, rcond=1e-9), atol=1e-7)
    np.testing.assert_allclose(found["twist"], jacobian @ given, atol=1e-14)
    np.testing.assert_allclose(found["deltas"], inverse @ jacobian @ given, atol=1e-12)


def require_all_links(program: Path, name: str) -> None:
    frames = ("base", *kernels(name, ROS).robot.frame_names)
    answers, errors = ask(program, "initialize kinematics", home_line(name), *(f"link {frame}" for frame in frames))
    assert errors == ""
    assert answers[0] == ("initialize", True, [])
    for place, frame in enumerate(frames):
        require(answers[1 + 5 * place : 6 + 5 * place], *expected(name, frame))


@pytest.mark.parametrize("name", ["puma560_mm", "cell4"])
def test_every_link_and_the_base_have_the_pose_and_jacobian_of_the_reference(
    name: str, programs: Mapping[str, Path]
) -> None:
    require_all_links(programs[name], name)


@pytest.mark.parametrize(
    "change",
    [
        ("row < 3 ? kMetre : 1.0", "row < 3 ? 1.0 : kMetre"),
        ("kJacobians[frame]", "kJacobians[kTool]"),
    ],
)
def test_an_altered_plug_in_is_noticed(change: tuple[str, str], tmp_path: Path) -> None:
    with pytest.raises(AssertionError):
        require_all_links(compiled(tmp_path, "puma560_mm", change), "puma560_mm")


def test_joints_are_matched_by_name_in_any_order(programs: Mapping[str, Path]) -> None:
    """Vectors and columns are in the order of the controller; names may be written as a URDF has them."""
    arm, order = kernels("puma560_mm", ROS).robot, (3, 0, 5, 1, 4, 2)
    names = " ".join(arm.variables[place].name.replace("_", "-") for place in order)
    lines = (f"strings joints {names}", "initialize kinematics", home_line("puma560_mm", order), "link tool")
    answers, errors = ask(programs["puma560_mm"], *lines)

    assert errors == ""
    pose, jacobian = expected("puma560_mm", "tool")
    require(answers[1:], pose, jacobian[:, list(order)])


def test_joints_for_a_pose_are_in_the_order_of_the_controller_and_its_base(programs: Mapping[str, Path]) -> None:
    home = home_line("cell4", (2, 3, 0, 1))
    lines = ("string base cell", "strings joints quill turn waist elbow", "initialize", home, "link tool", "follow")
    answers, errors = ask(programs["cell4"], *lines)

    assert errors == ""
    assert answers[-1][:2] == ("joints", True)
    np.testing.assert_allclose(answers[-1][2], list(map(float, home.split()[1:])), atol=1e-12)


TOOLS = {
    "straight": (0.01, -0.02, 0.12, np.pi / 2, 0.4363323129985824, np.pi),
    "level": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "gimbal": (0.2, 0.1, -0.05, -np.pi / 2, np.pi / 2, np.pi / 2),
    "turned": (-0.03, 0.25, 0.4, np.pi, -np.pi, 0.3),
}


@pytest.mark.parametrize("tool", TOOLS)
def test_runtime_parameters_are_another_tool_whose_poses_are_followed(tool: str, programs: Mapping[str, Path]) -> None:
    """Joints are those of the robot file whatever drives them; the tool has six numbers, set in either way."""
    arm, home = kernels("tooled6", ROS).robot, home_line("tooled6")
    names = [parameter.name for parameter in arm.runtime_parameters]
    given = list(zip(names, TOOLS[tool], strict=True))
    for place, value in enumerate((*(1000 * each for each in TOOLS[tool][:3]), *TOOLS[tool][3:])):
        arm = with_parameter(arm, place, value)
    pose, jacobian = expected("tooled6", "tool", arm)
    at_start = [f"double kinematics.parameters.{name} {value!r}" for name, value in given]
    later = [f"set {name} {value!r}" for name, value in given]
    for lines in ((*at_start, "initialize kinematics"), ("initialize kinematics", *later)):
        answers, errors = ask(programs["tooled6"], *lines, home, "link tool", "follow")
        assert errors == ""
        require(answers[-6:-1], pose, jacobian)
        assert answers[-1][:2] == ("joints", True)
        np.testing.assert_allclose(answers[-1][2], list(map(float, home.split()[1:])), atol=1e-9)


@pytest.mark.parametrize("line", ["string k.parameters.tool_y 1", "double k.parameters.tool_roll nan"])
def test_a_runtime_parameter_that_is_no_number_is_refused(line: str, programs: Mapping[str, Path]) -> None:
    answers, errors = ask(programs["tooled6"], line, "initialize k", home_line("tooled6"), "link tool", "set spindle 1")

    assert not any(good for _, good, _ in answers)
    assert f"parameter '{line.split()[1]}' is not a finite number such as 0.0" in errors.splitlines()[0]


def test_limits_of_actuator_readings_hold_for_joints_of_a_pose(programs: Mapping[str, Path]) -> None:
    """Bend and turn are within their limits, and the second motor of the wrist, which counts both, is not."""
    answers, _ = ask(
        programs["tooled6"],
        "initialize",
        *("q 0.2 1 0.5 0.4 -1 4.8", "link tool", "follow"),  # 3*(bend - turn) = -997 degrees
        *("q 0.2 1 0.5 0.4 -1 4.9", "link tool", "follow"),  # -1,014 degrees
    )

    assert [good for word, good, _ in answers if word == "joints"] == [True, False]


@pytest.mark.parametrize("joints", ["", "a b c d", "waist elbow quill quill", "waist elbow quill turn roll"])
def test_other_joints_are_refused_once_with_the_names(joints: str, programs: Mapping[str, Path]) -> None:
    answers, errors = ask(programs["cell4"], f"strings joints {joints}", "initialize kinematics")

    assert answers == [("initialize", False, [])]
    assert errors.count("\n") == 1
    assert "the robot has the joints waist, elbow, quill, turn, in any order" in errors


def test_the_parameters_base_and_tip_name_the_ends(programs: Mapping[str, Path]) -> None:
    """Names that the robot file does not have are names of its base and tool, below the word for kinematics."""
    lines = ("string arm.base base_link", "string arm.tip tool0", "string base other", home_line("cell4"))
    answers, _ = ask(
        programs["cell4"], *lines, "initialize arm", "link base_link", "link base", "link tool0", "link other"
    )

    for place, frame in enumerate(("base", "base", "tool")):
        require(answers[1 + 5 * place : 6 + 5 * place], *expected("cell4", frame))
    assert not any(good for _, good, _ in answers[16:])


def test_a_base_at_rest_takes_the_place_of_that_of_the_file(programs: Mapping[str, Path]) -> None:
    lines = ("string base cell", "initialize", home_line("cell4"), "link camera", "link cell", "link base")
    answers, errors = ask(programs["cell4"], *lines)

    cell = expected("cell4", "cell")[0]
    turn = np.kron(np.eye(2), cell[:3, :3].T)
    assert errors == ""
    for place, frame in enumerate(("camera", "cell", "base")):
        pose, jacobian = expected("cell4", frame)
        require(answers[1 + 5 * place : 6 + 5 * place], np.linalg.inv(cell) @ pose, turn @ jacobian)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("string k.base elbow", "parameter 'base' is 'elbow', which moves; the base is 'base'"),
        ("string k.tip base", "parameters 'base' and 'tip' are both 'base'"),
        ("strings k.tip tool", "parameter 'k.tip' is not the name of a link"),
        ("string joints waist", "parameter 'joints' is not a list of names"),
        ("string k.alpha 0.1", "parameter 'k.alpha' is not a number of 0.0 or more"),
        ("double k.alpha -0.1", "parameter 'k.alpha' is not a number of 0.0 or more"),
        ("double k.alpha nan", "parameter 'k.alpha' is not a number of 0.0 or more"),
    ],
)
def test_parameters_that_name_nothing_are_refused_at_the_start(
    line: str, message: str, programs: Mapping[str, Path]
) -> None:
    answers, errors = ask(programs["cell4"], line, "initialize k", home_line("cell4"), "link tool")

    assert not any(good for _, good, _ in answers)
    assert message in errors.splitlines()[0]


@pytest.mark.parametrize("alpha", [0.0, 5e-6, 0.01])
def test_the_parameter_alpha_damps_the_inverse_jacobian(alpha: float, programs: Mapping[str, Path]) -> None:
    lines = (f"double k.alpha {alpha}", "initialize k", home_line("cell4"), "link tool")
    answers, errors = ask(programs["cell4"], *lines)

    _, jacobian = expected("cell4", "tool")
    damped = np.linalg.inv(jacobian.T @ jacobian + alpha * np.eye(jacobian.shape[1])) @ jacobian.T
    (found,) = (numbers for word, good, numbers in answers if word == "inverse" and good)
    assert errors == ""
    np.testing.assert_allclose(np.array(found).reshape(damped.shape), damped, atol=1e-9)


def test_what_cannot_be_answered_is_refused(programs: Mapping[str, Path]) -> None:
    home = home_line("cell4")
    before, errors = ask(programs["cell4"], home, "link tool")
    assert "initialize() has not been called" in errors
    after, errors = ask(
        programs["cell4"], "initialize", home, "link spindle", home.rpartition(" ")[0], "link tool",
        home.rpartition(" ")[0] + " nan", "link tool", "q 1e300 0 0 0", "link tool", "difference 0",
    )  # fmt: skip

    assert not any(good for _, good, _ in (*before, *after[1:]))
    known = "base, camera, cell, elbow, quill, tool, turn, waist"
    assert f"no link 'spindle' (known are {known})" in errors


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_deltas_that_are_not_finite_are_refused(value: str, programs: Mapping[str, Path]) -> None:
    lines = ("initialize", home_line("cell4"), f"deltas {value}", "deltas 1e-3")
    answers, errors = ask(programs["cell4"], *lines)

    assert [good for _, good, _ in answers[1:]] == [False, False, True, True]
    assert "the joint deltas are not 4 finite numbers" in errors.splitlines()[0]
    assert "a number of the Cartesian delta is not finite" in errors.splitlines()[1]
    assert errors.count("\n") == 2


@pytest.mark.parametrize(
    ("line", "message"), [("q 0 0 0", "3 joint values instead of 4"), ("q 0 0 0 nan", "a joint value is not finite")]
)
def test_refused_joint_values_are_told_apart(line: str, message: str, programs: Mapping[str, Path]) -> None:
    _, errors = ask(programs["cell4"], "initialize", line, "link tool")

    assert errors.splitlines()[0].endswith(message)


def test_runtime_parameters_are_those_of_the_file_again_after_another_start(programs: Mapping[str, Path]) -> None:
    lines = ("initialize", "set tool_x 0.5", "initialize", home_line("tooled6"), "link tool")
    answers, errors = ask(programs["tooled6"], *lines)

    assert errors == ""
    require(answers[-5:], *expected("tooled6", "tool"))


def test_the_difference_of_two_poses_is_a_velocity(programs: Mapping[str, Path]) -> None:
    ((_, good, numbers),), _ = ask(programs["cell4"], "difference 0.5")

    assert good
    np.testing.assert_allclose(numbers, [1, 0, -2, 0, 0, 1.2], atol=1e-12)


URDF = """\
<robot name="t"><link name="base-link"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="tool0"/>
<joint name="j-1" type="revolute"><parent link="base-link"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1"/></joint>
<joint name="l1" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.3 0 0.1"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1"/></joint>
<joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0.3 0 0.1"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1"/></joint>
<joint name="f" type="fixed"><parent link="l3"/><child link="tool0"/><origin xyz="0.3 0 0.1"/></joint></robot>
"""


def test_links_of_a_urdf_are_known_by_their_names(tmp_path: Path) -> None:
    """Where a link and a joint share a name, the link is meant."""
    (tmp_path / "t.urdf").write_text(URDF)
    links = links_of(load(tmp_path / "t.urdf"), ScalarType.DOUBLE)

    places = {each.name: each.frame for each in links.named}
    assert (links.base, links.tip) == ('"base-link"', '"tool0"')
    assert {'"base-link"': -1, '"l1"': 0, '"l2"': 1, '"l3"': 2, '"tool0"': links.tool}.items() <= places.items()


@pytest.mark.parametrize("name", ["puma560", "cell4", "palletiser3", "tooled6"])
def test_the_example_has_every_parameter_that_the_controller_must_be_given(name: str) -> None:
    files = project(name, ROS)
    config = yaml.safe_load(files["config/controllers.yaml"])
    given = config["admittance_controller"]["ros__parameters"]
    kinds = {"string": str, "string_array": str, "double": float, "double_array": float, "bool_array": bool}

    for entry in contract("ros2_control")["groups"]["admittance_controller"]:
        value = given
        for word in entry["parameter"].split("."):
            value = value[word]
        values = value if entry["type"].endswith("array") else [value]
        assert isinstance(values, list)
        assert all(type(each) is kinds[entry["type"]] for each in values), entry["parameter"]
        assert len(values) == entry.get("size", len(values))
    known = {yaml.safe_load(each.name) for each in links_of(kernels(name, ROS).robot, ScalarType.DOUBLE).named}
    frames = [
        given[key]["frame"]["id"] for key in ("ft_sensor", "control", "fixed_world_frame", "gravity_compensation")
    ]
    assert {*frames, given["kinematics"]["base"], given["kinematics"]["tip"]} <= known
    assert config["controller_manager"]["ros__parameters"]["admittance_controller"]["type"]


def test_names_that_yaml_reads_as_truth_values_are_names_in_the_example() -> None:
    text = project("cell4", ROS)["config/controllers.yaml"]

    assert 'joints: ["waist", "elbow", "quill", "turn"]' in text
    assert not re.search(r" (?:id|base|tip): [^\"]", text)


def test_parameters_of_a_checkout_are_compared_both_ways(tmp_path: Path) -> None:
    entries = contract("ros2_control")["groups"]["admittance_controller"]
    tree: dict[str, object] = {"alpha": {"type": "double", "default_value": 0.1}}
    for entry in entries:
        *path, last = entry["parameter"].split(".")
        place = tree
        for word in path:
            place = place.setdefault(word, {})  # type: ignore[assignment]
        place[last] = {"type": entry["type"], "validation": {"fixed_size<>": entry.get("size")}}
    path = tmp_path / contract("ros2_control")["parameters"]["file"]
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump({"admittance_controller": tree}))
    assert missing("ros2_control", tmp_path, ["admittance_controller"]) == []

    del tree["joints"]
    tree["other"] = {"type": "string"}
    path.write_text(yaml.safe_dump({"admittance_controller": tree}))
    found = missing("ros2_control", tmp_path, ["admittance_controller"])
    assert [line.partition(": ")[2] for line in found] == ["joints string_array None", "other string None"]


def test_the_manifests_name_each_other() -> None:
    files = project("puma560", ROS)
    library, package = ET.fromstring(files["plugin.xml"]), ET.fromstring(files["package.xml"])  # noqa: S314 - our text
    (plugin,) = library.findall("class")

    assert package.findtext("name") == library.get("path") == "puma560_kinematics"
    assert re.search(r"project\(puma560_kinematics ", files["CMakeLists.txt"])
    assert plugin.get("type") == "puma560_kinematics::Plugin"
    assert "PLUGINLIB_EXPORT_CLASS(puma560_kinematics::Plugin, " in files["src/plugin.cpp"]
    config = yaml.safe_load(files["config/controllers.yaml"])["admittance_controller"]["ros__parameters"]
    assert config["kinematics"]["plugin_name"] == plugin.get("name")
    assert config["joints"] == [variable.name for variable in kernels("puma560").robot.variables]
    sources = re.findall(r"^  src/(\S+)$", files["CMakeLists.txt"], re.M)
    assert {f"src/{name}" for name in sources} <= files.keys()
