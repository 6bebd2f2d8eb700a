"""From any robot to a table: every pose stays, the joint vector stays, and what was exact is exact."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.io.robot_file.write import write
from kinegen.model.dh_conversion import Converted, to_convention
from kinegen.model.robot import TOOL, Convention, Robot
from kinegen.verify import reference
from tests.chains import robots

ROBOTS = sorted((Path(__file__).parents[2] / "robots").glob("*.yaml"))
MOVING = [path for path in ROBOTS if load(path).dof]
TABLES = (Convention.STANDARD, Convention.MODIFIED)


def furthest(before: Robot, found: Converted, rng: np.random.Generator, scale: float = 2.0) -> float:
    """The greatest difference of any frame at random joint vectors, relative to the size of the robot."""
    q = rng.uniform(-scale, scale, (20, before.dof))
    params = {each.name: 0.9 * float(rng.uniform(0.2, 0.4)) for each in before.runtime_parameters}
    kept = {name: value for name, value in params.items() if name in {each.name for each in found.robot.parameters}}
    old, new = reference.frames(before, q, params), reference.frames(found.robot, q, kept)
    pairs = [*found.frames, *((frame.name, frame.name) for frame in before.frames)]
    pairs += [] if before.is_tree else [(TOOL, TOOL)]
    size = 1 + max(float(np.abs(pose).max()) for pose in old.values())
    return max(float(np.abs(old[a] - new[b]).max()) for a, b in pairs) / size


@pytest.mark.parametrize("convention", TABLES)
@pytest.mark.parametrize("path", MOVING, ids=lambda path: path.stem)
def test_the_robots_of_the_project_keep_every_pose(path: Path, convention: Convention) -> None:
    robot = load(path)

    found = to_convention(robot, convention)

    assert {row.convention for row in found.robot.rows} == {convention}
    assert [each.name for each in found.robot.variables] == [each.name for each in robot.variables]
    assert [each.limits for each in found.robot.variables] == [each.limits for each in robot.variables]
    assert found.robot.actuators == robot.actuators
    assert furthest(robot, found, np.random.default_rng(1)) < 1e-13
    assert not found.rounded


@pytest.mark.parametrize("path", MOVING, ids=lambda path: path.stem)
def test_there_and_back(path: Path) -> None:
    """To elementary rows, to a modified table, to a standard table, to a file, and read again."""
    robot = load(path)
    elementary = to_convention(robot, Convention.ETS).robot
    modified = to_convention(elementary, Convention.MODIFIED).robot
    standard = to_convention(modified, Convention.STANDARD).robot

    again = loads(write(standard), path.name)

    q = np.random.default_rng(2).uniform(-2, 2, (10, robot.dof))
    wanted = reference.pose(robot, q)
    size = 1 + np.abs(wanted).max()
    assert np.abs(reference.pose(again, q) - wanted).max() / size < 1e-13
    assert [each.name for each in again.variables] == [each.name for each in robot.variables]


@pytest.mark.parametrize("name", ["puma560", "puma560_mm", "ur5", "iiwa14", "panda", "stanford", "xarm6", "fanuc_10l"])
def test_tables_of_industrial_arms_come_back_as_they_were(name: str) -> None:
    """Both tables of an arm have one set of numbers, so the way back gives the table of the maker."""
    robot = load(ROBOTS[0].parent / f"{name}.yaml")
    other = Convention.MODIFIED if robot.convention is Convention.STANDARD else Convention.STANDARD

    back = to_convention(to_convention(robot, other).robot, robot.convention).robot

    rows = [(row.name, row.alpha, row.a, row.d, row.theta) for row in robot.rows if row.variable]
    found = [(row.name, row.alpha, row.a, row.d, row.theta) for row in back.rows]
    differing = [(old, new) for old, new in zip(rows, found, strict=True) if old != new]
    # The last row takes what is behind it: a flange row of the maker is a frame now.
    assert len(differing) <= (robot.rows[-1].variable is None)


@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
@given(robots(most_rows=9))
def test_random_robots_keep_every_pose(robot: Robot) -> None:
    for convention in (*TABLES, Convention.ETS):
        if robot.dof or convention is Convention.ETS:
            found = to_convention(robot, convention)
            assert furthest(robot, found, np.random.default_rng(3)) < 1e-13
            assert found.robot.tips == robot.tips or len(found.robot.tips) == len(robot.tips)


@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(robots(most_rows=7, runtime=True))
def test_runtime_parameters_stay_parameters(robot: Robot) -> None:
    """At other values of the parameters than the file's, too."""
    used = {each.name for each in robot.runtime_parameters}

    for convention in TABLES if robot.dof else ():
        found = to_convention(robot, convention)
        assert {each.name for each in found.robot.runtime_parameters} <= used
        assert furthest(robot, found, np.random.default_rng(4)) < 1e-13


def chain(rng: random.Random, rows: int) -> str:
    """A chain of elementary rows whose axes are skew, parallel, intersecting or on one line."""
    quarter = ["0", "90", "-90", "180"]
    lines = []
    for number in range(rows):
        turn = rng.choice([*quarter * 2, "30", "atan(3/4)", "45", "17.3"])
        shifts = [rng.choice(["0", "0", "0.25", "-1/3", "0.0825"]) for _ in range(3)]
        axis = rng.choice("xyz")
        move = f"R{axis}(q)" if rng.random() < 0.75 else f"T{axis}(q)"
        fixed = [
            f"{rng.choice(['Rx', 'Ry', 'Rz'])}({turn})",
            *(f"T{a}({s})" for a, s in zip("xyz", shifts, strict=True)),
        ]
        lines.append(f"  - {{name: j{number}, ets: [{', '.join([*fixed, move])}]}}")
    head = "kinegen: 1\nname: chain\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
    return head + "\n".join(lines) + "\n"


@pytest.mark.parametrize("rows", [1, 2, 3, 5, 9, 20])
def test_chains_of_every_kind_of_neighbour(rows: int) -> None:
    rng = random.Random(rows)
    for _ in range(max(1, 12 // rows)):
        robot = loads(chain(rng, rows), "chain.yaml")
        for convention in TABLES:
            found = to_convention(robot, convention)
            assert len(found.robot.rows) == rows
            assert furthest(robot, found, np.random.default_rng(5)) < 1e-13


def test_a_chain_of_240_rows() -> None:
    robot = loads(chain(random.Random(240), 240), "chain.yaml")

    found = to_convention(robot, Convention.STANDARD)

    assert len(found.robot.rows) == 240
    assert len(found.robot.frames) <= 200
    assert found.dropped
    assert furthest(robot, found, np.random.default_rng(6)) < 1e-12
    assert len(loads(write(found.robot), "again.yaml").rows) == 240


def test_angles_and_lengths_are_roots_where_they_are() -> None:
    text = (
        "kinegen: 1\nname: r\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: one, ets: [Rz(q)]}\n"
        "  - {name: two, ets: [Tx(0.1), Ty(0.3), Tz(0.2), Ry(30), Rx(45), Rz(q)]}\n"
        "  - {name: three, ets: [Tx(0.1), Ty(0.3), Rz(q)]}\n"
    )
    found = to_convention(loads(text, "r.yaml"), Convention.STANDARD)

    written = write(found.robot)

    assert not found.rounded
    assert "sqrt(10)" in written
    assert "atan(" in written
    assert loads(written, "r.yaml").digest == found.robot.digest


def test_what_no_expression_is_gets_rounded_and_named() -> None:
    text = (
        "kinegen: 1\nname: r\nconvention: standard\nunits: {length: m, angle: rad}\njoints:\n"
        "  - {name: one, ets: [Rz(q)]}\n"
        "  - {name: two, ets: [Tx(0.1), Ry(0.3), Rx(0.2), Ty(0.4), Rz(q)]}\n"
    )
    found = to_convention(loads(text, "r.yaml"), Convention.STANDARD)

    assert found.rounded == ("one to two",)
    assert furthest(loads(text, "r.yaml"), found, np.random.default_rng(7)) < 1e-14


def test_followers_screws_and_sliders_keep_their_rules() -> None:
    text = (
        "kinegen: 1\nname: r\nconvention: modified\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: screw, alpha: 0, a: 0, theta: q, d: 0.01*q/(2*pi)}\n"
        "  - {name: slide, alpha: 90, a: 0.3, theta: 0, d: q, limits: [0, 0.4]}\n"
        "  - {name: mimic, alpha: 90, a: 0.2, theta: 2*screw + 10, d: 0.1*slide}\n"
        "  - {name: last, alpha: 30, a: 0.1, theta: -q, d: 0}\n"
    )
    robot = loads(text, "r.yaml")

    found = to_convention(robot, Convention.STANDARD)

    assert [(row.name, row.type) for row in found.robot.rows] == [(row.name, row.type) for row in robot.rows]
    assert furthest(robot, found, np.random.default_rng(8)) < 1e-13
    assert loads(write(found.robot), "r.yaml").digest == found.robot.digest
    assert any(line.startswith("slide: the lateral position of its axis") for line in found.free)


def test_a_table_that_has_the_convention_is_left_alone() -> None:
    robot = load(ROBOTS[0].parent / "puma560.yaml")

    found = to_convention(robot, robot.convention)

    assert found.robot == robot
    assert found.frames == tuple((row.name, row.name) for row in robot.rows)


def test_no_joint_is_one_line() -> None:
    robot = load(ROBOTS[0].parent / "blocks.yaml")

    with pytest.raises(KinegenError, match="has no joint, so there is no standard table"):
        to_convention(robot, Convention.STANDARD)
    with pytest.raises(KinegenError, match="cannot be converted to hayati"):
        to_convention(robot, Convention.HAYATI)


def test_a_conversion_that_moves_a_frame_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The poses before and after are compared by the reference, which knows nothing of this package."""
    from kinegen.model.dh_conversion import convert

    robot = load(ROBOTS[0].parent / "ur5.yaml")
    place = convert.place

    def wrong(*args: object) -> object:
        placed = place(*args)  # type: ignore[arg-type]
        row = placed.rows[2]
        length = replace(row.a, value=Fraction(1, 7)) if hasattr(row.a, "value") else None
        placed.rows[2] = replace(row, d=length or placed.rows[0].d)
        return placed

    monkeypatch.setattr(convert, "place", wrong)

    with pytest.raises(KinegenError, match="the conversion moves frame"):
        to_convention(robot, Convention.MODIFIED)
