"""Targets that leave a joint free of a folded SCARA, of planar arms and of five joints: solved, and q0 is kept."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.family import Aim
from kinegen.derive.inverse.singular_configurations import free_end, in_line
from kinegen.io.load import loads
from kinegen.model.branches import FreeEnd, InLine
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import nearest, reference
from kinegen.verify.free_joint_samples import is_freed, joints_freed
from tests.builds.workshop import assemble
from tests.inverse.arms import Floats, joint_vectors

HEAD = "kinegen: 1\nname: {name}\nconvention: standard\nunits: {{length: m, angle: deg}}\njoints:\n"

SCARA = """\
  - {{name: j1, theta: q, d: 0.4, a: 0.3, alpha: 0, limits: {0}}}
  - {{name: j2, theta: q, d: 0, a: 0.3, alpha: 180, limits: {1}}}
  - {{name: z, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 0.2]}}
"""
TURN = "  - {{name: j4, theta: {3}, d: 0, a: 0, alpha: 0, limits: {2}}}\n"

FIVE = """\
  - {{name: j1, theta: q, d: 0.07, a: {4}, alpha: 90, limits: {0}}}
  - {{name: j2, theta: q, d: 0, a: 0.15, alpha: 0, limits: {1}}}
  - {{name: j3, theta: q, d: 0, a: {5}, alpha: 0, limits: [-180, 180]}}
  - {{name: j4, theta: q + 90, d: 0, a: 0, alpha: 90, limits: {2}}}
  - {{name: j5, theta: q, d: 0.08, a: 0, alpha: 0, limits: {3}}}
"""

ARMS = {
    "scara_point": SCARA.format("[-130, 130]", "[-180, 180]"),
    "scara_point_away": SCARA.format("[30, 130]", "[90, 270]"),
    "scara": (SCARA + TURN).format("[-130, 60]", "[-180, 180]", "[-90, 40]", "q"),
    "scara_away": (SCARA + TURN).format("[20, 160]", "[100, 300]", "[-200, -100]", "-q"),
    "five": FIVE.format("[20, 200]", "[-90, 200]", "[-190, 190]", "[-60, 30]", 0, 0.18),
    "five_equal": FIVE.format("[-150, 150]", "[-20, 200]", "[-100, 60]", "[-90, 60]", 0.03, 0.15),
}
"""Arms with links of equal length, and five joints whose last axis comes onto that of the waist; some far from 0."""

Made = tuple[ModuleType, Robot]


@pytest.fixture(scope="module", params=ARMS)
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("packages")
    path = folder / f"{request.param}.yaml"
    path.write_text(HEAD.format(name=request.param) + ARMS[request.param], encoding="utf-8")
    quantities = (Quantity.POSE, Quantity(Kind.INVERSE))
    package = assemble(str(folder / request.param), folder / "packages", compiled=False, quantities=quantities)
    return package, loads(path.read_text(encoding="utf-8"), path.name)


def freed(robot: Robot, count: int) -> Floats:
    """Joint vectors within the limits that share their pose with others: folded, or the tool on the waist's axis."""
    family = family_of(robot)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nearest, "_PLANTED", count)
        return np.concatenate([nearest.joints_in_line(robot, family), joints_freed(robot, family, count)])


def apart(robot: Robot, q: Floats, targets: Floats) -> float:
    """How far joint vectors lead from targets, in what the arm is solved for."""
    away = np.abs(reference.pose(robot, q)[:, 0] - targets)[:, :3]
    return float((away[..., 3] if family_of(robot).aim is Aim.POSITION else away).max())


@pytest.mark.parametrize(("kind", "same"), [(np.float64, 1e-13), (np.float32, 5e-6)])
def test_a_joint_vector_that_reaches_the_target_is_kept(arm: Made, kind: type, same: float) -> None:
    package, robot = arm
    q = freed(robot, 150)
    found, exists = package.inverse(reference.pose(robot, q)[:, 0].astype(kind), nearest=q.astype(kind))

    assert len(q) >= 100
    assert exists.all()
    np.testing.assert_allclose(found, q, atol=same)


@pytest.mark.parametrize(("kind", "off"), [(np.float64, 1e-14), (np.float32, 3e-6)])
def test_a_target_is_solved_within_the_limits_wherever_q0_is(arm: Made, kind: type, off: float) -> None:
    package, robot = arm
    q = freed(robot, 150)
    targets = reference.pose(robot, q)[:, 0]
    wanted = np.random.default_rng(4).uniform(-4, 4, q.shape)
    found, exists = package.inverse(targets.astype(kind), nearest=wanted.astype(kind))
    low, high = np.array(joint_box(robot)).T
    room = 1e-12 if kind is np.float64 else 3e-3

    assert exists.all()
    assert apart(robot, found.astype(float), targets) < off
    assert (found >= low - room).all()
    assert (found <= high + room).all()


def test_other_targets_are_solved_as_before(arm: Made) -> None:
    package, robot = arm
    q = joint_vectors(robot, 200, 5)
    found, exists = package.inverse(reference.pose(robot, q)[:, 0], nearest=q)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "pairs", "end"),
    [
        ("scara_point", [], 0),
        ("scara", [(0, 1, 3, True)], None),
        ("scara_away", [(0, 1, 3, False)], None),
        ("five", [], 0),
        ("five_equal", [(1, 2, 3, False)], 0),
    ],
)
def test_what_is_free_is_known(name: str, pairs: list[tuple[int, int, int, bool]], end: int | None) -> None:
    family = family_of(loads(HEAD.format(name=name) + ARMS[name], "arm.yaml"))
    lines: tuple[InLine, ...] = in_line(family)
    free: FreeEnd | None = free_end(family)

    assert [(each.first, each.middle, each.last, each.are_opposed) for each in lines] == pairs
    assert (None if free is None else free.joint) == end


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [("scara", "a: 0.3, alpha: 180", "a: 0.3001, alpha: 180"), ("scara_point", "[-180, 180]", "[-170, 170]")],
)
def test_links_that_do_not_fold_leave_nothing_free(name: str, old: str, new: str) -> None:
    text = HEAD.format(name=name) + ARMS[name]
    family = family_of(loads(text.replace(old, new), "arm.yaml"))

    assert old in text
    assert in_line(family) == ()
    assert free_end(family) is None


def test_a_hand_beside_the_axis_of_the_waist_does_not_leave_it_free() -> None:
    robot = loads(HEAD.format(name="five") + ARMS["five"], "arm.yaml")
    end, q = free_end(family_of(robot)), joints_freed(robot, family_of(robot), 5)
    target = reference.pose(robot, q)[0, 0]
    tilted = target.copy()
    tilted[:3, :3] = target[:3, :3] @ np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    tilted[:3, 3] -= 0.08 * (tilted[:3, 2] - target[:3, 2])

    assert is_freed(end, target, q, False)
    assert not is_freed(end, tilted, q, False)
