"""Real MJCF files: the pose of every body is MuJoCo's, and the rest is refused in a line."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from kinegen.io import xml
from kinegen.io.format import Imported
from kinegen.io.mjcf import included
from kinegen.verify import reference
from tests.imports.files import imported, mjcf_files, shown, written_names

pytestmark = pytest.mark.imports

SAMPLES = 100
REFUSED = ("<mujocoinclude>", "coordinate: global", "closed loops", "unknown type 'fixed'", "nothing to compute")
REFUSED += ("makes bodies when MuJoCo", "a joint in a <frame>", "two of the", "is included twice", "is not linear")
_UNSEEN = (
    "asset",
    "visual",
    "sensor",
    "actuator",
    "tendon",
    "contact",
    "keyframe",
    "size",
    "option",
    "custom",
    "statistic",
)
_UNSEEN += ("extension", "deformable")
_SHAPES = (
    "geom",
    "site",
    "camera",
    "light",
    "inertial",
    "composite",
    "plugin",
    "tendon",
    "material",
    "mesh",
    "general",
)
_SHAPES += ("position", "velocity", "motor", "pair", "equality", "muscle", "texture", "flexcomp")


def bare(path: Path) -> str:
    """A model without what needs other files than text: bodies with joints, each of one kilogram."""
    root = tree(included(xml.parse(path.read_bytes()), path, (path.parent.parent,)))
    for tag in _UNSEEN:
        for element in root.findall(tag):
            root.remove(element)
    for parent in [each for each in root.iter() if each.tag != "equality"]:
        for element in [each for each in parent if each.tag in _SHAPES and each.tag != "equality"]:
            parent.remove(element)
    for equality in root.findall("equality"):
        for element in list(equality):
            if element.tag != "joint":
                equality.remove(element)
    for compiler in root.findall("compiler"):
        for key in (
            "settotalmass",
            "meshdir",
            "texturedir",
            "assetdir",
            "inertiafromgeom",
            "boundmass",
            "boundinertia",
        ):
            compiler.attrib.pop(key, None)
        for child in list(compiler):
            compiler.remove(child)
    for body in root.iter("body"):
        if body is not root and body.get("mocap") != "true":
            body.insert(0, ET.Element("inertial", pos="0 0 0", mass="1", diaginertia="1 1 1"))
    return ET.tostring(root, encoding="unicode")


def tree(element: xml.Element) -> ET.Element:
    """The same elements for the standard library, which writes them."""
    copy = ET.Element(element.tag, element.attrib)
    copy.extend(tree(child) for child in element)
    return copy


def largest_gap(path: Path, found: Imported, base: str) -> float:
    """The greatest difference of any entry of the pose of any body in the base, over random joint vectors."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(bare(path))
    data = mujoco.MjData(model)
    q = np.random.default_rng(7).uniform(-1, 1, (SAMPLES, found.robot.dof))
    poses = reference.frames(found.robot, q)
    joints = [_joint(model, names) for names in written_names(found).values()]
    links = {link: model.body(link).id for link, _ in found.report.links if _has_body(model, link)}
    frames = dict(found.report.links)
    worst = 0.0
    for place, values in enumerate(q):
        data.qpos[:] = model.qpos0
        for joint, value in zip(joints, values, strict=True):
            data.qpos[model.jnt_qposadr[joint]] = value
        _follow(model, data)
        mujoco.mj_kinematics(model, data)
        root = np.linalg.inv(_pose(data, model.body(base or "world").id))
        for link, body in links.items():
            mine = np.broadcast_to(poses[frames[link]], (SAMPLES, 4, 4))[place]
            worst = max(worst, float(np.abs(root @ _pose(data, body) - mine).max()))
    return worst


def _joint(model, names: tuple[str, ...]) -> int:  # noqa: ANN001 - MuJoCo has no types
    """The number of a joint; one without a name is the only one of its body."""
    import mujoco

    for name in names:
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if number >= 0:
            return number
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name.rpartition("_joint")[0])
        if body >= 0:
            return int(model.body_jntadr[body]) + int(name.rpartition("_joint")[2] or "1") - 1
    raise AssertionError(names)


def _has_body(model, name: str) -> bool:  # noqa: ANN001
    import mujoco

    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0)


def _follow(model, data) -> None:  # noqa: ANN001
    """Put joints where the equalities want them; MuJoCo does that by forces."""
    import mujoco

    for number in range(model.neq):
        if model.eq_type[number] == mujoco.mjtEq.mjEQ_JOINT and model.eq_active0[number]:
            first, second = model.eq_obj1id[number], model.eq_obj2id[number]
            place = model.jnt_qposadr[first]
            other = model.jnt_qposadr[second]
            turned = 0.0 if second < 0 else data.qpos[other] - model.qpos0[other]
            data.qpos[place] = model.qpos0[place] + model.eq_data[number][0] + model.eq_data[number][1] * turned


def _pose(data, body: int) -> np.ndarray:  # noqa: ANN001
    pose = np.eye(4)
    pose[:3, 3], pose[:3, :3] = data.xpos[body], data.xmat[body].reshape(3, 3)
    return pose


@pytest.mark.parametrize("path", mjcf_files(), ids=shown)
def test_all_bodies_are_where_mujoco_puts_them(path: Path) -> None:
    found, base = imported(path)
    if found is None:
        assert any(reason in base for reason in REFUSED), base
        assert "\n" not in base
        return
    assert largest_gap(path, found, base) < 1e-12


def test_the_arms_of_robosuite_and_many_others_are_read() -> None:
    found = {path: imported(path)[0] for path in mjcf_files()}
    arms = [path for path in found if path.name == "robot.xml" and "robosuite" in str(path)]

    assert len(arms) >= 12
    assert all(found[path] is not None for path in arms)
    assert sum(each is not None for each in found.values()) >= 50
