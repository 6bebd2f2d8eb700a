"""The MoveIt plug-in of arms with actuators and with runtime parameters: limits of readings, values of the node."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.controllers.elementary import Model, Numbers
from tests.controllers.moveit_programs import CALLS, NO_IK_SOLUTION, OK, Arm, altered, ask, compiled, files_of
from tests.controllers.packages import file_of
from tests.controllers.test_moveit2 import POSITION_ONLY, newton

pytestmark = pytest.mark.controllers

NAMES = ("coupled3", "tooled6", "driven7", "geared3")
"""A palletiser with a parallelogram, a differential wrist, one with seven joints, and a linear actuator."""

SPACE = "robot_description_kinematics.arm.parameters"


class Programs(Mapping[str, Path]):
    """The programs, each of which is compiled when it is asked for; what calls the plug-ins is compiled once."""

    def __init__(self, make: pytest.TempPathFactory) -> None:
        self._make, self._made = make, dict[str, Path]()

    def __getitem__(self, name: str) -> Path:
        if name not in self._made:
            calls = [program.parent / f"{CALLS.stem}_cpp.o" for program in self._made.values()][:1]
            place = self._make.mktemp(name)
            self._made[name] = compiled(place, name, others=calls or [CALLS])
            for each in calls:
                (place / each.name).write_bytes(each.read_bytes())
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    return Programs(tmp_path_factory)


def palletiser(q: Numbers) -> list[tuple[float, float, float]]:
    waist, shoulder, elbow = np.degrees(q)
    return [(-2 * waist, -340, 340), (shoulder, 32, 128), (shoulder + elbow, -70, 40)]


def wrist(q: Numbers) -> list[tuple[float, float, float]]:
    bend, turn = np.degrees(q[4:])
    return [(3 * (bend + turn), -1000, 1000), (3 * (bend - turn), -1000, 1000)]


def seven(q: Numbers) -> list[tuple[float, float, float]]:
    return [(-50 * (q[5] - q[6]), -180, -40), (-50 * (q[5] + q[6]), -100, 60)]


def ram(q: Numbers) -> list[tuple[float, float, float]]:
    return [(math.sqrt(0.8**2 + 0.9**2 - 2 * 0.8 * 0.9 * math.cos(q[1])), 0.5, 1.5)]


READINGS: Mapping[str, Callable[[Numbers], list[tuple[float, float, float]]]] = {
    "coupled3": palletiser,
    "tooled6": wrist,
    "driven7": seven,
    "geared3": ram,
}
"""The readings that have limits, by joint values, written out; degrees, metres, and radians for seven joints."""


def can_be(name: str, q: Numbers, room: float = 1e-6) -> bool:
    return all(low - room <= reading <= high + room for reading, low, high in READINGS[name](q))


def arm_of(programs: Mapping[str, Path], name: str, parameters: Mapping[str, float] | None = None,
           before: Sequence[str] = ()) -> Arm:  # fmt: skip
    """The plug-in with a model whose parameters may be others than those of the file."""
    is_point = name in ("coupled3", "geared3")
    model = Model(file_of(name), gripper=not is_point, parameters=parameters or {})
    return Arm(programs[name], model, before=[POSITION_ONLY, *before] if is_point else before)


def driven(arm: Arm, name: str, rng: np.random.Generator) -> Numbers:
    """Joint values that the actuators can bring about."""
    while True:
        q = arm.model.random(rng)
        if can_be(name, q, -1e-3):
            return q


def point(arm: Arm, name: str) -> slice:
    """The columns of a pose that a target sets."""
    return slice(3, 4) if name in ("coupled3", "geared3") else slice(0, 4)


def compared(name: str, program: Path) -> None:
    """No solution is outside the limits of a reading, and that of the seed is the first."""
    arm, rng = arm_of({name: program}, name), np.random.default_rng(3)
    outside = 0
    for _ in range(30):
        q, free = driven(arm, name, rng), arm.model.random(rng)
        same, branches, other, *_, far = arm.ask(
            arm.seed(q),
            arm.target(q),
            "ik",
            "all",
            arm.seed(free),
            "ik",
            arm.target(free),
            "search 2 60 1000000",
            "all",
        )
        np.testing.assert_allclose(arm.joints(same)[0], q, atol=1e-8)
        assert branches.code == OK
        columns = point(arm, name)
        for each in np.vstack([arm.joints(branches), *(arm.joints(found) for found in (other, far) if found.good)]):
            assert can_be(name, each)
        for each in arm.joints(branches):
            np.testing.assert_allclose(arm.tip(each)[:3, columns], arm.tip(q)[:3, columns], atol=1e-6)
        outside += not can_be(name, free)
    assert outside > 3


@pytest.mark.parametrize("name", NAMES)
def test_solutions_are_within_the_limits_of_readings(name: str, programs: Mapping[str, Path]) -> None:
    compared(name, programs[name])


def test_all_solutions_offered_are_within_them_turns_of_joints_too(programs: Mapping[str, Path]) -> None:
    """Steps on the product of elementary transforms find the branches; a turn of each must be offered if one can be."""
    arm, rng = arm_of(programs, "tooled6"), np.random.default_rng(5)
    q = np.radians([20.0, 50.0, -40.0, 60.0, 100.0, 230.0])
    assert can_be("tooled6", q)
    _, offered, _, every = arm.ask(arm.seed(q), arm.target(q), "search 2 60 1000000", "all")
    rows = arm.require_reached(offered, arm.tip(q))
    assert all(can_be("tooled6", row) for row in rows)

    branches = {tuple(np.round(np.remainder(each + math.pi, 2 * math.pi), 4)) for each in newton(arm, arm.tip(q), rng)}
    possible = set()
    for branch in branches:
        values = np.array(branch) - math.pi
        for turn in (-2 * math.pi, 0.0, 2 * math.pi):
            moved = values + np.array([0, 0, 0, 0, 0, turn])
            if np.abs(moved[5]) <= 2 * math.pi and can_be("tooled6", moved):
                possible.add(branch)
                assert np.abs(rows - moved).max(axis=1).min() < 1e-3
    assert len(branches) >= 2
    assert len(arm.joints(every)) == len(possible)


def test_another_turn_is_taken_where_the_nearest_one_is_outside(programs: Mapping[str, Path]) -> None:
    """Beside a sum of both wrist joints of 330 degrees, where 333.3 is the most; the flipped wrist is nearer still."""
    arm = arm_of(programs, "tooled6")
    seed = np.radians([20.0, 50.0, -40.0, 60.0, 100.0, 230.0])
    target = seed + np.radians([0, 0, 0, 0, 0, 10.0])
    assert not can_be("tooled6", target)
    found, every = arm.ask(arm.seed(seed), arm.target(target), "ik", "all")
    rows = arm.require_reached(every, arm.tip(target))
    np.testing.assert_array_equal(arm.joints(found)[0], rows[0])
    away = np.linalg.norm(rows - seed, axis=1)
    assert (np.diff(away) >= 0).all()
    back = target - np.radians([0, 0, 0, 0, 0, 360.0])
    assert np.abs(rows - back).max(axis=1).min() < 1e-9


@pytest.mark.parametrize(("shoulder", "elbow", "good"), [
    (128.0, -100.0, True), (32.0, -60.0, True), (128.001, -100.0, False), (31.999, -60.0, False),
    (60.0, -130.0, True), (60.0, -130.001, False), (100.0, -60.0, True), (100.0, -59.999, False),
])  # fmt: skip
def test_a_target_that_leads_exactly_to_the_limit_of_a_reading_is_reached(
    shoulder: float, elbow: float, good: bool, programs: Mapping[str, Path]
) -> None:
    """The other branch of the palletiser is outside the limits of its elbow."""
    arm = arm_of(programs, "coupled3")
    q = np.radians([30.0, shoulder, elbow])
    (found,) = arm.ask(arm.seed(q), arm.target(q), "ik")
    assert found.good == good
    assert good or found.code == NO_IK_SOLUTION


def test_an_altered_plug_in_is_noticed(programs: Mapping[str, Path]) -> None:
    program = altered(programs["tooled6"], "tooled6", "arm", "if (!has_readings(q, query) && ", "if (false && ")
    with pytest.raises(AssertionError):
        compared("tooled6", program)


OTHER = {"tool_x": 150.0, "tool_z": -80.0}
GIVEN = [f"parameter double {SPACE}.tool_x 0.15", f"parameter double {SPACE}.tool_z -0.08"]


@pytest.mark.parametrize("declared", [[], ["declare"]])
def test_runtime_parameters_are_those_of_the_node(declared: list[str], programs: Mapping[str, Path]) -> None:
    """With them the arm is that of the model, and without them it is not, since two lengths differ."""
    arm = arm_of(programs, "coupled3", OTHER, [*GIVEN, *declared])
    rng = np.random.default_rng(4)
    for _ in range(6):
        q = driven(arm, "coupled3", rng)
        fk, ik = arm.ask(arm.seed(q), f"fk {' '.join(arm.model.poses(q))}", arm.target(q), arm.seed(q + 0.01), "ik")
        arm.require_links(fk, q)
        np.testing.assert_allclose(arm.joints(ik)[0], q, atol=1e-8)
    wrong = arm_of(programs, "coupled3", OTHER)
    (answer,), errors = ask(wrong.program, *wrong.begin)
    assert not answer.good
    assert "the model and the robot file are different arms" in errors or "from the point" in errors


def test_the_tool_may_be_set_between_calls(programs: Mapping[str, Path]) -> None:
    """The tip of the group is then that of the new tool, for poses and for joints."""
    arm, other = (arm_of(programs, "coupled3", each) for each in ({}, OTHER))
    q = np.radians([30.0, 80.0, -90.0])
    lines = [
        "set tool_x 0.15",
        "set tool_z -0.08",
        arm.seed(q),
        "fk gripper",
        other.target(q),
        arm.seed(q + 0.05),
        "ik",
    ]
    *sets, fk, ik = arm.ask(*lines)
    assert [each.good for each in sets] == [True, True]
    np.testing.assert_allclose(fk.rows(7)[0][:3], other.tip(q)[:3, 3], atol=1e-12)
    np.testing.assert_allclose(arm.joints(ik)[0], q, atol=1e-9)
    refused = arm.ask("set tool_y 0.1", "set tool_x nan", "set tool_x inf", arm.seed(q), "fk gripper")
    assert [each.good for each in refused] == [False, False, False, True]
    np.testing.assert_allclose(refused[-1].rows(7)[0][:3], arm.tip(q)[:3, 3], atol=1e-12)


def test_two_plug_ins_have_their_own_parameters(programs: Mapping[str, Path]) -> None:
    arm, other = (arm_of(programs, "coupled3", each) for each in ({}, OTHER))
    q = np.radians([30.0, 80.0, -90.0])
    fk, begin = [arm.seed(q), "fk gripper"], "initialize arm 0.1 pedestal gripper"
    lines = ["another", begin, "set tool_x 0.15", "set tool_z -0.08", *fk, "first", *fk, "another", begin, *fk]
    begun, *sets, second, first, again, third = arm.ask(*lines)
    assert all(each.good for each in (begun, *sets, again))
    for found, model in ((second, other), (first, arm), (third, arm)):
        np.testing.assert_allclose(found.rows(7)[0][:3], model.tip(q)[:3, 3], atol=1e-12)
    assert np.abs(other.tip(q) - arm.tip(q)).max() > 0.01


@pytest.mark.parametrize("value", ["double nan", "double inf", "double -inf", "integer 0", "bool true", "string x"])
@pytest.mark.parametrize("declared", [[], ["declare"]])
def test_what_is_not_a_finite_number_is_refused_in_one_line(
    value: str, declared: list[str], programs: Mapping[str, Path]
) -> None:
    kind, number = value.split()
    arm = arm_of(programs, "tooled6", before=[f"parameter {kind} {SPACE}.tool_yaw {number}", *declared])
    (answer, ik), errors = ask(arm.program, *arm.begin, arm.seed(np.zeros(6)), "ik")
    assert not answer.good
    assert not ik.good
    first = errors.splitlines()[0]
    assert first.startswith(
        f"tooled6_moveit_kinematics: parameter '{SPACE}.tool_yaw' is not a finite number such as 0.0"
    )
    assert errors.count("\n") == 2


def test_parameters_that_leave_no_arm_are_refused(programs: Mapping[str, Path]) -> None:
    """A length of 1e300 m makes every pose of the robot file infinite."""
    for number in ("1e300", "1e12"):
        arm = arm_of(programs, "coupled3", before=[f"parameter double {SPACE}.tool_x {number}"])
        (answer,), errors = ask(arm.program, *arm.begin)
        assert not answer.good
        assert errors.count("\n") == 1


@pytest.mark.parametrize("name", ["coupled3", "tooled6", "driven7"])
def test_the_example_has_every_parameter_with_its_value_of_the_file(name: str) -> None:
    (group,) = yaml.safe_load(files_of(name)["config/kinematics.yaml"]).values()
    known = {
        "coupled3": {"tool_x": 0.1, "tool_z": -0.05},
        "tooled6": {"tool_x": 0.01, "tool_y": -0.02, "tool_z": 0.12, "tool_roll": math.pi / 2,
                    "tool_pitch": math.radians(25), "tool_yaw": math.pi},
    }  # fmt: skip
    assert group.get("parameters", {}) == pytest.approx(known.get(name, {}))
    readme = " ".join(files_of(name)["README.md"].split())
    assert ("robot_description_kinematics.GROUP.parameters" in readme) == (name in known)
    assert f"`{name}_joints_to_actuators`" in readme
