"""Random files in: every link is where a plain evaluation puts it, exactly or within what the report says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.io.format import Imported, ReadOptions
from kinegen.io.load import load_with_report
from kinegen.verify import reference
from tests.formats.plain import plain_urdf
from tests.formats.plain_mjcf import Model
from tests.formats.random_files import models, urdf

EXACT = 1e-12


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory):  # noqa: ANN201 - a function
    folder = tmp_path_factory.mktemp("random")

    def imported(text: str, suffix: str, snap: float | None) -> Imported:
        path = folder / f"random.{suffix}"
        path.write_text(text)
        return load_with_report(path, ReadOptions(snap=snap))

    return imported


def farthest(found: Imported, plain: dict[str, np.ndarray], q: list[float]) -> tuple[float, float]:
    """How far apart any two frames are: by position, by entries of the rotation."""
    poses = reference.frames(found.robot, q)
    gaps = [np.abs(poses[frame][0] - plain[link]) for link, frame in found.report.links if link in plain]
    lengths = [
        np.linalg.norm((poses[frame][0] - plain[link])[:3, 3]) for link, frame in found.report.links if link in plain
    ]
    assert gaps
    return float(max(lengths)), float(max(gap[:3, :3].max() for gap in gaps))


@settings(deadline=None, max_examples=60)
@given(text=urdf())
def test_urdf(read, text: str) -> None:  # noqa: ANN001 - a fixture
    for snap in (0.0, None):
        found = read(text, "urdf", snap)
        names = [variable.name for variable in found.robot.variables]
        for seed in range(3):
            q = list(np.random.default_rng(seed).uniform(-2, 2, len(names)))
            shift, turn = farthest(found, plain_urdf(text, dict(zip(names, q, strict=True))), q)
            assert shift <= EXACT + found.report.effect
            assert turn <= EXACT if snap == 0 else turn < 0.05


@settings(deadline=None, max_examples=60)
@given(model=models())
def test_mjcf(read, model: Model) -> None:  # noqa: ANN001 - a fixture
    found = read(model.text, "xml", 0.0)
    names = [variable.name for variable in found.robot.variables]
    for seed in range(3):
        q = list(np.random.default_rng(seed).uniform(-2, 2, len(names)))
        plain = model.poses(dict(zip(names, q, strict=True)))
        shift, turn = farthest(found, plain, q)
        assert max(shift, turn) <= EXACT


@settings(deadline=None, max_examples=30)
@given(model=models())
def test_mjcf_with_snapping(read, model: Model) -> None:  # noqa: ANN001 - a fixture
    found = read(model.text, "xml", None)
    names = [variable.name for variable in found.robot.variables]
    q = list(np.random.default_rng(0).uniform(-2, 2, len(names)))
    shift, _ = farthest(found, model.poses(dict(zip(names, q, strict=True))), q)
    # Slides have no limits here, so the report cannot know how far they lengthen the arm.
    slides = sum(joint.slides for body in model.bodies for joint in body.joints)
    turned = sum(each.digits for each in found.report.changed) * 1e-2
    assert shift <= EXACT + found.report.effect + slides * 4 * turned
