"""At least a hundred real URDF files: the pose of every link is Pinocchio's, and the rest is refused in a line."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.format import ReadOptions
from kinegen.io.load import load_with_report
from kinegen.model.joint_bounds import joint_box
from kinegen.verify import reference
from tests.imports.files import imported, shown, urdf_files, written_names

pytestmark = pytest.mark.imports

SAMPLES = 100
REFUSED = ("is not a number", "not valid XML", "zero byte", "expected 3 numbers", "which is not in the file")
REFUSED += ("occurs twice in one", "the lower limit exceeds", "has no links", "nothing to compute")


def mimics(path: Path) -> list[tuple[str, str, float, float]]:
    """Joints that follow others: name, master, multiplier, offset, masters before those that follow them."""
    found = []
    for joint in ET.parse(path).getroot().findall("joint"):  # noqa: S314 - files of known packages
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") != "fixed":
            factor, offset = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            found.append((joint.get("name", ""), mimic.get("joint", ""), factor, offset))
    return found * 3  # chains of followers settle


def poses_by_pinocchio(path: Path, links: list[str], names: dict[str, tuple[str, ...]], q: np.ndarray) -> np.ndarray:
    """The pose of each link in the root, for each row of q: (rows, links, 4, 4)."""
    import pinocchio

    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    known = set(model.names)
    frames = [model.getFrameId(link, pinocchio.FrameType.BODY) for link in links]
    written = [next(name for name in names[variable] if name in known) for variable in names]
    result = np.empty((len(q), len(links), 4, 4))
    for row, values in zip(result, q, strict=True):
        value = dict(zip(written, values, strict=True))
        for name, master, factor, offset in mimics(path):
            value[name] = factor * value.get(master, 0.0) + offset
        full = pinocchio.neutral(model)
        for name, angle in value.items():
            joint = model.joints[model.getJointId(name)]
            pair = [math.cos(angle), math.sin(angle)]
            full[joint.idx_q : joint.idx_q + joint.nq] = pair if joint.nq == 2 else angle
        pinocchio.framesForwardKinematics(model, data, full)
        for place, frame in enumerate(frames):
            row[place] = data.oMf[frame].homogeneous
    return result


@pytest.mark.parametrize("path", urdf_files(), ids=shown)
def test_all_links_are_where_pinocchio_puts_them(path: Path) -> None:
    found, message = imported(path)
    if found is None:
        assert any(reason in message for reason in REFUSED), message
        assert "\n" not in message
        return
    low, high = np.array(joint_box(found.robot)).T
    q = np.random.default_rng(7).uniform(low, high, (SAMPLES, found.robot.dof))
    poses = reference.frames(found.robot, q)
    links = dict(found.report.links)
    theirs = poses_by_pinocchio(path, list(links), written_names(found), q)
    for place, frame in enumerate(links.values()):
        np.testing.assert_allclose(np.broadcast_to(poses[frame], theirs[:, place].shape), theirs[:, place], atol=1e-12)

    # Snapped, no tip is farther away than the report says.
    snapped = load_with_report(path, ReadOptions())
    moved = reference.frames(snapped.robot, q)
    for tip in found.robot.tips:
        gap = np.linalg.norm((moved[tip] - poses[tip])[..., :3, 3], axis=-1)
        assert gap.max() <= snapped.report.effect + 1e-12


def test_at_least_a_hundred_are_read() -> None:
    found = [imported(path)[0] for path in urdf_files()]

    assert sum(each is not None for each in found) >= 100
    assert sum(each is None for each in found) <= 12
