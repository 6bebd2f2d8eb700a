"""Surveys of arms whose workspaces are known."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.errors import KinegenError
from kinegen.model.robot import Robot
from kinegen.tools.workspace.options import MOST_SAMPLES, SurveyOptions
from kinegen.tools.workspace.sampling import _voxel, survey
from kinegen.tools.workspace.tip_samples import joint_ranges
from kinegen.tools.workspace.voxels import Grid, Voxels, least_size
from tests.chains import robots
from tests.workspace import arms

KNOWN = {
    "annulus": (arms.TWO_LINKS, pi * (0.8**2 - 0.2**2), 0.005),
    "half an annulus": (arms.SECTOR, pi / 2 * (0.8**2 - 0.2**2), 0.005),
    "annulus in a slanting plane": (arms.TILTED, pi * (0.8**2 - 0.2**2), 0.005),
    "annulus of three links": (arms.THREE_LINKS, pi * (1.8**2 - 0.2**2), 0.005),
    "shell": (arms.SHELL, 4 / 3 * pi * (1**3 - 0.5**3), 0.02),
    "box": (arms.BOX, 1.0 * 0.8 * 0.5, 0.02),
    "ring": (arms.RING, pi * (0.8**2 - 0.2**2) * 0.6, 0.02),
    "line": (arms.LINE, 0.7, 0.01),
}
REACHES = {
    "annulus": (arms.TWO_LINKS, "base", 0.2, 0.8),
    "annulus, a first link longer than the others": (
        arms.THREE_LINKS.replace("a: 1,", "a: 3,").replace("0.6", "1").replace("0.2", "0.5"),
        "axis",
        1.5,
        4.5,
    ),
    "disc": (arms.THREE_LINKS.replace("0.6", "1").replace("0.2", "1"), "base", 0.0, 3.0),
    "shell": (arms.SHELL, "base", 0.5, 1.0),
    "ring, from the base": (arms.RING, "base", (0.2**2 + 0.1**2) ** 0.5, (0.8**2 + 0.7**2) ** 0.5),
    "ring, from its axis": (arms.RING, "axis", 0.2, 0.8),
    "ring, height": (arms.RING, "z", 0.1, 0.7),
    "box": (arms.BOX, "x", -0.4, 0.6),
    "half an annulus": (arms.SECTOR, "x", -0.3, 0.8),
    "six joints": ("human_arm", "z", -0.71, 0.71),
    "seven joints with limits": ("iiwa14", "z", -0.376, 1.306),
}


@pytest.mark.parametrize("name", KNOWN)
def test_a_known_workspace_is_measured(name: str) -> None:
    joints, exact, tolerance = KNOWN[name]

    assert arms.measured(arms.surveyed(joints, 1_000_000)) == pytest.approx(exact, rel=tolerance)


@pytest.mark.parametrize("name", REACHES)
def test_a_known_reach_is_found_to_many_digits(name: str) -> None:
    joints, figure, low, high = REACHES[name]
    found = {each.name: each for each in arms.surveyed(joints).extremes}[figure]

    assert (found.low, found.high) == (pytest.approx(low, abs=1e-5), pytest.approx(high, abs=1e-5))


def test_only_what_was_reached_counts() -> None:
    """Counts never fall, and every voxel has a joint vector within the limits that leads into it."""
    workspace = arms.surveyed("iiwa14")
    assert workspace.tally
    half, full, searched, _ = workspace.tally.counts
    q, voxels = workspace.tally.q, workspace.tally.voxels
    cells = np.floor((workspace.tip.position(q) - voxels.corner[:, None]) / voxels.size).astype(int)

    assert half.hit <= full.hit <= searched.hit == voxels.count == q.shape[1]
    assert ((workspace.samples.bounds[:, :1] <= q) & (q <= workspace.samples.bounds[:, 1:])).all()
    assert len(np.unique(cells, axis=1).T) == voxels.count
    assert voxels.hit[tuple(cells)].all()


def test_the_search_finds_the_rim_that_samples_miss() -> None:
    """Six joints, whose workspace is a ball: few samples come near its surface."""
    workspace = arms.surveyed("human_arm", samples=500_000, voxel=0.05)
    assert workspace.tally
    ball = 4 / 3 * pi * 0.71**3
    sampled, searched = (workspace.tally.counts[place].measure or 0.0 for place in (1, 2))

    assert sampled < 0.95 * ball
    assert 0.96 * ball < searched < ball


def test_the_first_half_is_what_half_as_many_samples_give() -> None:
    full, half = arms.surveyed(arms.SHELL, 200_000, 0.1).tally, arms.surveyed(arms.SHELL, 100_000, 0.1).tally
    assert full
    assert half

    assert full.counts[0] == half.counts[1]


def test_smaller_voxels_come_nearer() -> None:
    exact = pi * (0.8**2 - 0.2**2)
    errors = [abs(arms.measured(arms.surveyed(arms.TWO_LINKS, 1_000_000, voxel)) - exact) for voxel in (0.2, 0.02)]

    assert errors[1] < errors[0] / 4


def test_threads_change_nothing() -> None:
    robot, tip = arms.robot(arms.SHELL), arms.tip(arms.SHELL)
    one, three = (
        survey(robot, tip, joint_ranges(robot), SurveyOptions(200_000, threads=threads)).tally for threads in (1, 3)
    )
    assert one
    assert three

    assert one.counts == three.counts
    assert (one.voxels.hit == three.voxels.hit).all()
    assert (one.q == three.q).all()


def test_another_seed_gives_other_samples_of_the_same_region() -> None:
    first, second = arms.surveyed(arms.TWO_LINKS), arms.surveyed(arms.TWO_LINKS, seed=7)
    assert first.tally
    assert second.tally

    assert not (first.tally.q[:, :10] == second.tally.q[:, :10]).any()
    assert arms.measured(first) == pytest.approx(arms.measured(second), rel=0.005)


@settings(max_examples=10)
@given(robots(most_rows=5, runtime=False))
def test_whatever_the_robot_the_survey_holds_together(robot: Robot) -> None:
    """Chains and trees of any joints, evaluated by the NumPy form of their kernels."""
    tip = arms.formula_tip(robot)
    workspace = survey(robot, tip, joint_ranges(robot), SurveyOptions(500))
    points = tip.position(workspace.samples.at(np.arange(500)))
    low, high = (np.array([getattr(each, end) for each in workspace.extremes[:3]])[:, None] for end in ("low", "high"))

    assert (low <= points).all()
    assert (points <= high).all()
    assert (workspace.tally is None) == (len(workspace.shape.axes) == 0)
    if workspace.tally:
        hits = [count.hit for count in workspace.tally.counts[:3]]
        assert hits == sorted(hits)
        assert workspace.tally.q.shape == (robot.dof, hits[-1])


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_the_fewest_samples_do(samples: int) -> None:
    tally = arms.surveyed(arms.SHELL, samples).tally

    assert tally
    assert 1 <= tally.counts[1].hit <= samples
    assert tally.counts[2].measure is None


@pytest.mark.parametrize(("voxel", "message"), [(1e-9, "too small"), (1e-300, "too small"), (5.0, "too large")])
def test_voxels_that_make_no_sense_are_refused(voxel: float, message: str) -> None:
    with pytest.raises(KinegenError, match=f"voxels of .* m are {message} for a region of .* m: expected .* m or"):
        arms.surveyed(arms.SHELL, 1000, voxel)


def test_values_beyond_the_kernel_are_refused() -> None:
    with pytest.raises(KinegenError, match="expected limits of a few turns"):
        arms.surveyed(arms.TWO_LINKS.replace("theta: q,", "theta: q, limits: [0, 5e6],"))


@pytest.mark.parametrize("samples", [0, -1, MOST_SAMPLES + 1])
def test_samples_beyond_what_the_sequence_holds_are_refused(samples: int) -> None:
    with pytest.raises(KinegenError, match=r"samples \(expected 1 to 1e11\)"):
        SurveyOptions(samples)


@pytest.mark.parametrize(
    "lengths", [(1.0,), (1.0, 0.3), (1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.5, 0.01), (1e3, 1e3, 1e3), (1.0, 1e-3, 1e-3)]
)
def test_the_default_voxel_fits_into_the_grid_for_any_number_of_samples(lengths: tuple[float, ...]) -> None:
    """A few samples show how large the region is; the others reach further, in every direction and bit by bit."""
    extent = np.array(lengths)
    for samples in (10**3, 10**6, 10**8, 3 * 10**8, 10**9, MOST_SAMPLES):
        grid = Grid(_voxel(SurveyOptions(samples), extent, "m"), len(lengths), "m")
        for further in (1.0, 1.02, 1.05, 1.08, 1.1):
            corners = np.stack([-further / 2 * extent, further / 2 * extent], axis=1)
            grid.add(grid.cells(corners), np.arange(2))
    grid = Grid(least_size(extent) / 4, len(lengths), "m")
    cells = grid.cells(np.stack([-extent / 2, extent / 2], axis=1))
    with pytest.raises(KinegenError, match="are too small for a region of"):
        grid.add(cells, np.arange(2))


@pytest.mark.parametrize("name", KNOWN)
def test_the_true_measure_is_between_the_inner_voxels_and_all_that_were_hit(name: str) -> None:
    """Also where flat faces along the grid make the figure larger than the region, as those of a gantry do."""
    text, right, _ = KNOWN[name]
    workspace = arms.surveyed(text)
    assert workspace.tally
    found, dimension = workspace.tally.counts[2], workspace.shape.dimension

    assert found.inside * found.voxel**dimension < right < found.hit * found.voxel**dimension


def test_the_default_voxel_is_one_that_the_samples_fill() -> None:
    """As fine as a twentieth of the box and finer, and hardly one of the inner voxels is missing."""
    tally = arms.surveyed(arms.SHELL, 1_000_000).tally
    assert tally
    inner = Voxels(tally.voxels.size, tally.voxels.corner, tally.voxels.hit)
    radius = np.linalg.norm(inner.corner + (np.argwhere(np.ones_like(inner.hit)) + 0.5) * inner.size, axis=1)
    within = (radius > 0.5 + inner.size) & (radius < 1 - inner.size)

    assert inner.size <= 2 / 40
    assert inner.hit.reshape(-1)[within].mean() > 0.9999
