"""Voxels and the samples that fill them, without any robot."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.tools.workspace.tip_samples import spread
from kinegen.tools.workspace.voxels import _OFFSET, Grid, Voxels

places = st.floats(-3, 3, allow_nan=False)


def ball(dimensions: int, radius: float, middle: list[float]) -> Voxels:
    """All voxels of edge 1 that a ball touches."""
    half = int(radius) + 6
    corner = np.floor(np.array(middle[:dimensions])) - half
    low = np.stack(np.meshgrid(*(np.arange(2 * half + 2) + start for start in corner), indexing="ij"), axis=-1)
    away = np.maximum(np.maximum(low - middle[:dimensions], middle[:dimensions] - low - 1), 0)
    return Voxels(1.0, corner, (away**2).sum(axis=-1) < radius**2)


@settings(max_examples=30)
@given(st.integers(1, 3), st.floats(8, 20), st.lists(places, min_size=3, max_size=3))
def test_a_ball_measures_what_it_should(dimensions: int, radius: float, middle: list[float]) -> None:
    """Voxels stand off the origin as those of a grid do: a round ball whose faces lie on theirs touches too few."""
    middle = [place + off for place, off in zip(middle, _OFFSET, strict=True)]
    exact = (2 * radius, pi * radius**2, 4 / 3 * pi * radius**3)[dimensions - 1]
    tolerance = (1.0, 4 * radius**0.5, 12 * radius)[dimensions - 1]

    assert ball(dimensions, radius, middle).measure == pytest.approx(exact, abs=tolerance)


def test_a_missing_voxel_never_adds_to_the_measure() -> None:
    whole = ball(3, 9.5, [0.0, 0.0, 0.0])
    generator = np.random.default_rng(1)
    measures = [
        Voxels(1.0, whole.corner, whole.hit & (generator.random(whole.hit.shape) < share)).measure
        for share in (1.0, 0.99, 0.9, 0.5, 0.1)
    ]

    assert measures == sorted(measures, reverse=True)
    assert measures[-1] == 0


@settings(max_examples=30)
@given(st.integers(1, 3), st.integers(0, 2**32), st.integers(1, 60))
def test_a_grid_that_grows_forgets_nothing(dimensions: int, seed: int, batches: int) -> None:
    generator = np.random.default_rng(seed)
    grid = Grid(0.5, dimensions, "m")
    points = generator.normal(0, 3, (dimensions, 40 * batches)) + generator.uniform(-20, 20, (dimensions, 1))
    start = 0
    for part in np.array_split(points, batches, axis=1):
        grid.add(grid.cells(part), start + np.arange(part.shape[1]))
        start += part.shape[1]

    for voxels in (grid.whole(), grid.halves()):
        cells = np.floor((points - voxels.corner[:, None]) / voxels.size).astype(int)
        unique, first = np.unique(cells, axis=1, return_index=True)
        assert voxels.hit[tuple(cells)].all()
        assert voxels.count == unique.shape[1]
        if voxels.size == 0.5:
            assert (grid.firsts() == np.sort(first)).all()


def test_the_frontier_is_every_free_voxel_beside_one_that_was_hit() -> None:
    grid = Grid(2.0, 2, "m")
    points = np.array([[0.1, 1.1], [0.1, 0.1]])
    grid.add(grid.cells(points), np.arange(5, 7))

    cells, sources = grid.frontier(0)
    low, high = grid.corners(cells)

    assert cells.shape == (2, 6)
    assert set(sources) == {5, 6}
    assert (grid.cells((low + high) / 2) == cells).all()
    assert (grid.cells(low) == cells).all()
    assert (grid.cells(high) == cells).all()
    assert grid.frontier(6)[0].shape == (2, 3)


@pytest.mark.parametrize("dimensions", [1, 2, 3, 6])
def test_samples_are_even(dimensions: int) -> None:
    """All 64 boxes of equal size get their share of 6400 samples within a fifth; random ones miss it by a third."""
    points = np.stack([*spread(np.arange(6400), np.full(dimensions, 0.5))])
    sides = {1: (64,), 2: (8, 8), 3: (4, 4, 4), 6: (2,) * 6}[dimensions]
    boxes = np.ravel_multi_index(tuple((points * np.array(sides)[:, None]).astype(int)), sides)

    assert ((points >= 0) & (points < 1)).all()
    assert np.abs(np.bincount(boxes, minlength=64) - 100).max() <= 20
