"""The fit: derivatives, parameters found again, and what cannot be distinguished."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.tools.calibrate.arm_model import from_vector, to_vector
from kinegen.tools.calibrate.evaluation import cross_validated, errors, outliers, regions, suggest
from kinegen.tools.calibrate.fitted_parameters import choose
from kinegen.tools.calibrate.measurements import Kind
from kinegen.tools.calibrate.options import Loss
from kinegen.tools.calibrate.residuals import make_problem
from kinegen.tools.calibrate.solve import fit
from kinegen.verify import reference
from tests.calibrate.simulated import ROBOTS, SIGMA, arm_of, joint_vectors, measured, wrong

TABLE = ("theta", "a", "d", "alpha")


LONGER = [pytest.param(name, marks=pytest.mark.long) for name in ("puma560", "panda", "stanford")]


@pytest.mark.parametrize("name", ["ur5", "scara", "calibrated_2r", *LONGER])
def test_the_prepared_arm_has_the_poses_of_the_file(name: str) -> None:
    _, arm = arm_of(ROBOTS / f"{name}.yaml", *TABLE, "base", "tool")
    q = joint_vectors(arm, 10)

    expected = reference.frames(load(ROBOTS / f"{name}.yaml"), q)["tool"]

    assert arm.poses(arm.start, q) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", ["scara", "calibrated_2r", *LONGER])
def test_derivatives_are_those_of_the_poses(name: str) -> None:
    _, arm = arm_of(ROBOTS / f"{name}.yaml", *TABLE, "base", "tool")
    q, values, step = joint_vectors(arm, 5), wrong(arm, share=3.0), 1e-6

    _, linear, angular = arm.derivatives(values, q)

    for column, unit in enumerate(np.eye(len(values)) * step):
        low, high = arm.poses(values - unit, q), arm.poses(values + unit, q)
        turn = to_vector(high[:, :3, :3] @ low[:, :3, :3].swapaxes(1, 2)) / (2 * step)
        assert linear[..., column] == pytest.approx((high - low)[:, :3, 3] / (2 * step), abs=1e-8)
        assert angular[..., column] == pytest.approx(turn, abs=1e-8)


def test_residuals_of_every_kind_have_their_derivatives() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE, "base", "tool")
    random, rows = np.random.default_rng(3), 22
    kinds = (*[Kind.POSE] * 4, *[Kind.POSITION] * 3, *[Kind.DISTANCE] * 3, *[Kind.PLANE] * 4, *[Kind.SPHERE] * 8)
    base = measured(arm, arm.start, joint_vectors(arm, rows))
    names = ["", *[""] * 9, *["floor"] * 4, *["ball"] * 8]
    anchored = replace(
        base,
        kinds=(*kinds[:17], *[Kind.ANCHOR] * 5),
        fixtures=tuple(names[:17]) + ("post",) * 5,
        to_q=random.uniform(-1, 1, base.q.shape),
        rotations=from_vector(random.normal(size=(rows, 3))),
        lengths=np.where([kind is Kind.SPHERE for kind in kinds[:17]] + [False] * 5, np.nan, 0.7),
    )
    with pytest.raises(KinegenError, match="'ball' has 3 rows"):
        make_problem(arm, anchored)
    problem = make_problem(arm, replace(anchored, lengths=np.full(rows, 0.7), kinds=(*kinds[:14], *[Kind.SPHERE] * 8),
                                        fixtures=(*names[:14], *["ball"] * 8)))  # fmt: skip
    with pytest.raises(KinegenError, match="'floor' has 3 rows"):
        make_problem(arm, problem.measured.part(np.r_[0:13, 14:22]))
    values = problem.start + 0.05 * random.normal(size=len(problem.start))

    step = 1e-6 * np.eye(len(values))
    numeric = [(problem.residuals(values + each) - problem.residuals(values - each)) / 2e-6 for each in step]

    scale = np.abs(problem.jacobian(values)).max()
    assert problem.jacobian(values) == pytest.approx(np.stack(numeric, axis=1), abs=1e-8 * scale)


@pytest.mark.parametrize("name", ["ur5", "puma560"])
@pytest.mark.parametrize("kind", [Kind.POSE, Kind.POSITION])
def test_what_is_known_is_found_again(name: str, kind: Kind) -> None:
    """The truth is the fit to measurements without noise, which has the same fixed parameters and no residual."""
    _, arm = arm_of(ROBOTS / f"{name}.yaml", *TABLE)
    q, values = joint_vectors(arm, 40), wrong(arm)

    exact = fit(make_problem(arm, measured(arm, values, q, kind, noise=0)), Loss.HUBER)
    found = fit(make_problem(arm, measured(arm, values, q, kind)), Loss.HUBER)

    # Positions alone leave combinations that only second order distinguishes: far less than the noise.
    assert errors(exact.problem, exact.values).worst < (1e-9 if kind is Kind.POSE else 0.1 * SIGMA)
    assert [each.name for each in found.tied] == [each.name for each in exact.tied]
    off = np.abs(found.values - exact.values)[found.free] / found.sigma[found.free]
    assert off.max() < 3.5
    assert np.sqrt(np.mean(off**2)) < 1.4
    assert abs(found.chi_square - 1) < 3 * np.sqrt(2 / found.freedom)


def test_what_cannot_be_told_apart_is_named_and_keeps_its_value() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE, "base", "tool")
    found = fit(make_problem(arm, measured(arm, wrong(arm), joint_vectors(arm, 40))), Loss.HUBER)

    partners = {each.name: [name for name, _ in each.partners] for each in found.tied}

    assert partners == {
        "d_base_turn": ["base_z"],
        "theta_base_turn": ["base_rz"],
        "a_wrist_3": ["tool_x"],
        "alpha_wrist_3": ["tool_rx"],
        "d_wrist_3": ["tool_z"],
        "theta_wrist_3": ["tool_rz"],
    }
    for name in partners:
        place = arm.names.index(name)
        assert found.values[place] == arm.start[place]
        assert found.sigma[place] == 0.0
    assert all(each.exact for each in found.tied)


def test_an_outlier_is_found_and_does_little_harm() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE)
    good = measured(arm, wrong(arm), joint_vectors(arm, 40))
    moved = good.positions.copy()
    moved[7, 0] += 0.005
    clean = fit(make_problem(arm, good), Loss.HUBER)

    found = fit(make_problem(arm, replace(good, positions=moved)), Loss.HUBER)

    assert [each.line for each in outliers(found)] == [good.lines[7]]
    assert outliers(clean) == ()
    assert (np.abs(found.values - clean.values) / clean.sigma).max() < 2.5


def test_cross_validation_sees_the_noise_and_regions_cover_every_row() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE)
    found = fit(make_problem(arm, measured(arm, wrong(arm), joint_vectors(arm, 40))), Loss.HUBER)

    crossed = cross_validated(found, Loss.HUBER, 5, 0)

    assert crossed is not None
    assert errors(found.problem, found.values).rms < crossed.rms < 3 * 5e-5 * np.sqrt(3)
    assert np.sqrt(np.mean(found.problem.residuals(found.values) ** 2)) < crossed.chi < 1.6
    found_regions = regions(found)
    assert len(found_regions) == 18
    for variable in arm.robot.variables:
        assert sum(region.rows for region in found_regions if region.joint == variable.name) == 40
    assert all(region.after < region.before for region in found_regions if region.rows)


def test_unstated_uncertainties_are_estimated() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE)
    good = measured(arm, wrong(arm), joint_vectors(arm, 60))
    vague = replace(good, sigma=good.sigma * 20, sigma_angle=good.sigma_angle / 5, stated=False)

    found, stated = (fit(make_problem(arm, each), Loss.HUBER) for each in (vague, good))

    assert found.problem.measured.sigma[0] == pytest.approx(5e-5, rel=0.15)
    assert found.problem.measured.sigma_angle[0] == pytest.approx(1e-4, rel=0.15)
    assert found.sigma[found.free] == pytest.approx(stated.sigma[stated.free], rel=0.2)


def test_suggested_poses_know_more_than_random_ones() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE)
    values = wrong(arm)
    q = joint_vectors(arm, 12)
    found = fit(make_problem(arm, measured(arm, values, q)), Loss.HUBER)

    better = suggest(found, 6, 0)
    random = joint_vectors(arm, 6, seed=9) * np.pi
    after = [
        fit(make_problem(arm, measured(arm, values, np.vstack([q, more]))), Loss.HUBER).sigma
        for more in (np.array([each.q for each in better]), random)
    ]

    assert all(abs(angle) <= 2 * np.pi for each in better for angle in each.q)
    assert 0 < better[-1].gain <= better[0].gain < 1
    assert np.log(after[0][found.free]).mean() < np.log(after[1][found.free]).mean()


def test_too_few_rows_are_refused() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE)
    few = measured(arm, arm.start, joint_vectors(arm, 3))

    with pytest.raises(KinegenError, match="3 rows measure 18 numbers, too few for"):
        fit(make_problem(arm, few), Loss.HUBER)


def test_a_pose_that_is_measured_again_shows_nothing_new() -> None:
    """As many numbers as one likes at three joint vectors, with other errors each time, are 18 for the unknowns."""
    times, (_, arm) = 10, arm_of(ROBOTS / "ur5.yaml", *TABLE)
    few = measured(arm, arm.start, np.repeat(joint_vectors(arm, 3), times, axis=0))

    assert (few.residuals, few.independent) == (18 * times, 18)
    with pytest.raises(
        KinegenError,
        match=rf": {3 * times} rows measure 18 numbers at different joint vectors, too few for 18 unknowns",
    ):
        fit(make_problem(arm, few), Loss.HUBER)


def test_poses_that_are_measured_twice_are_enough_where_once_is() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", *TABLE)
    many = measured(arm, arm.start, np.repeat(joint_vectors(arm, 20), 2, axis=0))

    assert many.independent == many.residuals / 2
    assert fit(make_problem(arm, many), Loss.HUBER).free.any()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("thta",), "names nothing .*did you mean theta"),
        (("beta",), "varies nothing"),
        (("a_elbow", "nothing"), "'nothing' names nothing"),
    ],
)
def test_words_that_mean_nothing_are_refused(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(KinegenError, match=message):
        choose(load(ROBOTS / "ur5.yaml"), words)


def test_runtime_parameters_that_are_not_varied_keep_their_values(tmp_path: Path) -> None:
    """They stay arguments of the kernels, and have no column in the derivative."""
    text = (ROBOTS / "ur5.yaml").read_text(encoding="utf-8").replace("a2: -0.425", "a2: {value: -0.425, runtime: true}")
    (tmp_path / "ur5.yaml").write_text(text, encoding="utf-8")
    _, arm = arm_of(tmp_path / "ur5.yaml", "theta_shoulder", "d_wrist_1")
    _, same = arm_of(ROBOTS / "ur5.yaml", "theta_shoulder", "d_wrist_1")
    q = joint_vectors(arm, 5)

    found, expected = (each.derivatives(each.start + np.array([0.1, 0.2]), q) for each in (arm, same))

    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, abs=1e-12)


def test_many_rows_take_little_memory() -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", "theta")
    many = measured(arm, wrong(arm), joint_vectors(arm, 5_000))

    found = fit(make_problem(arm, many), Loss.HUBER)

    assert found.tied == ()
    assert 0.95 < found.chi_square < 1.05
