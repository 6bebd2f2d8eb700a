"""The ros2_control plug-in against stand-ins of the headers: pose, Jacobian, its inverse, what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.home import home_of
from kinegen.robot.model import TOOL
from tests.controllers.packages import FLAGS, HERE, kernels, machine, need, project, run, run_with, write_package

pytestmark = pytest.mark.controllers

STANDIN = HERE / "standins" / "ros2"


def answers(place: Path, name: str, change: tuple[str, str] = ("", "")) -> dict[str, list[str]]:
    """What the plug-in gives at home, by the words of the program that calls it."""
    need("gcc", "g++")
    if not Path("/usr/include/eigen3").exists():
        pytest.skip("Eigen is not installed (Debian: apt-get install libeigen3-dev)")
    folder = write_package(place, name, Controller.ROS2_CONTROL)
    plugin = folder / "src" / "plugin.cpp"
    assert change[0] in plugin.read_text()
    plugin.write_text(plugin.read_text().replace(*change) if change[0] else plugin.read_text())
    objects = []
    for source in sorted((folder / "src").glob("*.c")):
        objects.append(source.with_suffix(".o"))
        run(["gcc", *FLAGS, "-c", source, "-o", objects[-1]], place)
    includes = [f"-I{STANDIN}", "-isystem", "/usr/include/eigen3", f"-I{folder / 'include'}", f"-I{folder / 'src'}"]
    flags = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror"]
    run(["g++", *flags, *includes, plugin, STANDIN / "run.cpp", *objects, "-o", place / "run"], place)
    made = machine(name, Controller.ROS2_CONTROL)
    q = [
        v if joint.turns else v * made.millimetres / 1000 for v, joint in zip(home_of(kernels(name).robot), made.joints)
    ]
    rows = [line.split() for line in run_with(place / "run", " ".join(map(repr, q))).splitlines()]
    return {f"{row[0]}{k}" if row[0] == "good" else row[0]: row[1:] for k, row in enumerate(rows)}


def numbers(words: list[str], *shape: int) -> NDArray[np.float64]:
    return np.array(words, dtype=float).reshape(shape)


def require(found: dict[str, list[str]], name: str) -> None:
    """Compare with the reference, in metres."""
    arm, made = kernels(name).robot, machine(name, Controller.ROS2_CONTROL)
    metres, n = made.millimetres / 1000, arm.dof
    pose = reference.pose(arm, [home_of(arm)])[0, 0].copy()
    pose[:3, 3] *= metres
    jacobian = reference.Kinematics(arm, [home_of(arm)]).jacobian(TOOL)[0].copy()
    jacobian[:3] *= metres
    for k, joint in enumerate(made.joints):
        jacobian[:, k] /= 1 if joint.turns else metres
    assert found["refused"] == ["000"]
    assert [words for key, words in found.items() if key.startswith("good")] == [["1"], ["10"]]
    np.testing.assert_allclose(numbers(found["pose"], 4, 4), pose, atol=1e-12)
    np.testing.assert_allclose(numbers(found["jacobian"], 6, n), jacobian, atol=1e-12)
    np.testing.assert_allclose(numbers(found["product"], n, n), np.eye(n), atol=1e-10)
    np.testing.assert_allclose(numbers(found["deltas"], n), 0, atol=1e-13)
    np.testing.assert_allclose(numbers(found["difference"], 6), [1, 0, -2, 0, 0, 1.2], atol=1e-12)


@pytest.mark.parametrize("name", ["puma560", "puma560_mm", "scara4"])
def test_it_gives_what_the_reference_gives(name: str, tmp_path: Path) -> None:
    require(answers(tmp_path, name), name)


@pytest.mark.parametrize(
    "change",
    [
        ("row < 3 ? kMetre : 1.0", "row < 3 ? 1.0 : kMetre"),
        ("link_name != tip_", "link_name == tip_"),
        ("* delta_theta", "* -delta_theta"),
    ],
)
def test_an_altered_plug_in_is_noticed(change: tuple[str, str], tmp_path: Path) -> None:
    with pytest.raises((AssertionError, ValueError)):
        require(answers(tmp_path, "puma560_mm", change), "puma560_mm")


def test_the_manifests_name_each_other() -> None:
    files = project("puma560", Controller.ROS2_CONTROL)
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
