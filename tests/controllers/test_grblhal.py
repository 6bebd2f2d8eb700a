"""The grblHAL plug-in against a stand-in of the interface: straight moves, steps and back, alarms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.controllers.controller import Controller
from tests.controllers.packages import FLAGS, HERE, kernels, machine, need, run, run_with, write_package

pytestmark = pytest.mark.controllers

STANDIN = HERE / "standins" / "grblhal"
STEPS = 1000.0


def compiled(place: Path, name: str, change: tuple[str, str] | None = None) -> Path:
    """The plug-in in the machine of these tests; with one alteration of its text where asked."""
    need("gcc")
    folder = write_package(place, name, Controller.GRBLHAL)
    plugin = folder / f"{name}_plugin.c"
    if change is not None:
        assert change[0] in plugin.read_text()
        plugin.write_text(plugin.read_text().replace(*change))
    sources = [plugin, folder / f"{name}_f32.c", folder / f"{name}_f32_follow.c", folder / "example" / "my_plugin.c"]
    includes = [f"-I{STANDIN}", f"-I{folder}"]
    run(
        ["gcc", *FLAGS, "-DKINEMATICS_API", *includes, *sources, STANDIN / "machine.c", "-lm", "-o", place / "machine"],
        place,
    )
    return place / "machine"


def moved(program: Path, name: str, targets: Sequence[Sequence[float]]) -> list[tuple[NDArray[np.float64], int]]:
    """For each target the planned places, shape (N, 8): motors, then the position that their steps stand for."""
    home = [joint.home for joint in machine(name, Controller.GRBLHAL).joints]
    rows = [[STEPS] * 4, home + [0.0] * (4 - len(home)), *targets]
    text = "\n".join(" ".join(repr(float(number)) for number in row) for row in rows)
    found: list[tuple[NDArray[np.float64], int]] = []
    places: list[list[float]] = []
    for line in run_with(program, text).splitlines():
        word, *numbers = line.split()
        if word == "place":
            places.append([float(number) for number in numbers])
        else:
            found.append((np.array(places).reshape(-1, 8), int(numbers[0])))
            places = []
    return found


def home_of(name: str) -> NDArray[np.float64]:
    """Position of the tool at home in mm, and its angle c in degrees for arms that turn it."""
    made = machine(name, Controller.GRBLHAL)
    return np.array([*made.home[:3], made.home[5] if made.coordinates == "XYZC" else 0.0])


@pytest.mark.parametrize("name", ["scara4", "scara", "palletiser3", "anthropomorphic_arm"])
def test_straight_moves_are_straight(name: str, tmp_path: Path) -> None:
    made = machine(name, Controller.GRBLHAL)
    at, dof = home_of(name), kernels(name).robot.dof
    side = made.reach * made.millimetres / 40
    corners = [at + side * np.array(step) for step in ([1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 0])]
    ends = [corner + np.array([0, 0, 0, 5.0 * k if dof == 4 else 0]) for k, corner in enumerate(corners)]

    moves = moved(compiled(tmp_path, name), name, ends)

    begin = at
    for end, (places, alarm) in zip(ends, moves, strict=True):
        assert alarm == 0
        assert len(places) >= np.linalg.norm((end - begin)[:3]) - 1e-3
        parts = np.arange(1, len(places) + 1)[:, None] / len(places)
        expected = begin + parts * (end - begin)
        np.testing.assert_allclose(places[:, 4 : 4 + max(3, dof)], expected[:, : max(3, dof)], atol=0.03)
        for place in places[:: max(1, len(places) // 7)]:
            q = [value * joint.scale for value, joint in zip(place, made.joints)]
            exact = reference.pose(kernels(name).robot, [q])[0, 0, :3, 3] * made.millimetres
            np.testing.assert_allclose(place[4:7], exact, atol=0.03)
        begin = end


@pytest.mark.parametrize("name", ["scara4", "palletiser3"])
def test_a_move_out_of_reach_ends_before_it_with_an_alarm(name: str, tmp_path: Path) -> None:
    at = home_of(name)
    ((places, alarm), (back, silent)) = moved(compiled(tmp_path, name), name, [at + np.array([9000, 0, 0, 0]), at])

    assert alarm == 1
    assert silent == 0
    assert len(places) > 0
    assert np.isfinite(places).all()
    assert np.abs(np.diff(places[:, :4], axis=0)).max() < 5
    np.testing.assert_allclose(back[-1, 4:7], at[:3], atol=0.03)


@pytest.mark.parametrize(
    "change",
    [
        ("#define DEGREES 57.2957795F", "#define DEGREES 57.5F"),
        ("        return (place_t *)motors;\n", "        return (place_t *)from;\n"),
        ("done == pieces) ? to[i]", "done == pieces) ? from[i]"),
        ("position[1] = pose[7]", "position[1] = pose[11]"),
    ],
    ids=["degrees", "another buffer", "end", "row"],
)
def test_an_altered_plug_in_is_noticed(change: tuple[str, str], tmp_path: Path) -> None:
    with pytest.raises((AssertionError, IndexError)):  # noqa: PT012 - the compiler may notice it too
        places, _ = moved(
            compiled(tmp_path, "scara4", change), "scara4", [home_of("scara4") + np.array([20, 0, 0, 0])]
        )[0]
        np.testing.assert_allclose(places[-1, 4:7], home_of("scara4")[:3] + np.array([20, 0, 0]), atol=0.03)
        q = [value * joint.scale for value, joint in zip(places[-1], machine("scara4", Controller.GRBLHAL).joints)]
        exact = reference.pose(kernels("scara4").robot, [q])[0, 0, :3, 3]
        np.testing.assert_allclose(exact, places[-1, 4:7], atol=0.03)
