"""Real arms with six or seven joints from other packages, those that are installed or downloaded.

ssik's arms are read out of its modules without running them; Robotics Toolbox and pybotics are asked for their tables;
URDF and MJCF come from the packages that `scripts/get_descriptions.py` downloads.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.arms.chains import Array, Link, robot_of
from kinegen.errors import KinegenError
from kinegen.io.format import ReadOptions
from kinegen.io.load import load
from kinegen.model.robot import JointType, Robot

DESCRIPTIONS = Path(__file__).resolve().parents[2] / "build" / "descriptions"
JOINTS = (6, 7)
BAKED = ("_JOINT_T_LEFTS", "_JOINT_AXES", "_JOINT_TYPES", "_JOINT_T_RIGHTS", "_JOINT_LIMITS")
"""Constants of a module of ssik: a list with an entry for each joint."""


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm.

    Attributes:
        source: The package that it is from.
        name: What it is called there.
        robot: The arm as kinegen reads it.
    """

    source: str
    name: str
    robot: Robot


def all_arms(source: str, name: str) -> Iterator[Arm]:
    """The arms of every package; of files with the same geometry in a package, the first.

    Args:
        source: Only packages whose name has this in it.
        name: Only arms whose name has this in it.
    """
    for package, arms in (("ssik", ssik), ("Robotics Toolbox", toolbox), ("pybotics", pybotics)):
        if source in package:
            yield from arms(name)
    seen = set()
    for arm in descriptions(source, name):
        mark = (arm.source, arm.robot.rows, arm.robot.tool)
        if _is_arm(arm.robot) and mark not in seen:
            seen.add(mark)
            yield arm


def _is_arm(robot: Robot) -> bool:
    """Whether it has six or seven joints and all of them turn: legs and arms on lifts are something else."""
    return robot.dof in JOINTS and all(each.type is not JointType.PRISMATIC for each in robot.variables)


def ssik(wanted: str = "") -> Iterator[Arm]:
    """The arms that are baked into modules of ssik."""
    spec = importlib.util.find_spec("ssik")
    if spec is None or spec.origin is None:
        return
    for path in sorted((Path(spec.origin).parent / "prebuilt").glob("*/*_ik.py")):
        name = f"{path.parent.name}_{path.stem.removesuffix('_ik')}"
        if wanted not in name:
            continue
        known = _constants(path, BAKED)
        links = [
            Link(np.array(before), tuple(axis), kind != "prismatic", np.array(after), limits)
            for before, axis, kind, after, limits in zip(*(known[each] for each in BAKED), strict=True)
        ]
        yield Arm("ssik", name, robot_of(name, links))


def _constants(path: Path, names: tuple[str, ...]) -> dict[str, Any]:
    """Values of constants of a module: numbers, text and lists, in `np.array(...)` or not."""
    found = {}
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            name = statement.targets[0].id
            if name in names:
                found[name] = ast.literal_eval(_Plain().visit(statement.value))
    return found


class _Plain(ast.NodeTransformer):
    """`np.array(x)` as `x`, `np.pi` and `math.inf` as numbers."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        found: ast.AST = self.visit(node.args[0])
        return found

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        return ast.Constant(getattr(math, node.attr))


def toolbox(wanted: str = "") -> Iterator[Arm]:
    """The tables of Robotics Toolbox for Python."""
    if importlib.util.find_spec("roboticstoolbox") is None:
        return
    models: Any = importlib.import_module("roboticstoolbox.models.DH")
    for name in (each for each in sorted(models.__all__) if wanted in each):
        try:
            made = getattr(models, name)()
        except TypeError:
            continue
        if made.n in JOINTS:
            links = [_link(each) for each in made.links]
            links[0] = Link(made.base.A @ links[0].before, *_after(links[0], np.eye(4)))
            links[-1] = Link(links[-1].before, *_after(links[-1], made.tool.A))
            yield Arm("Robotics Toolbox", name, robot_of(f"rtb_{name.lower()}", links))


def _after(link: Link, more: Array) -> tuple[Any, ...]:
    return link.axis, link.turns, link.after @ more, link.limits


def _link(link: Any) -> Link:
    """A row of a table: what is before the turn, and what is after it with the turn's offset."""
    turns = bool(link.isrevolute)
    whole = np.array(link.A(0.0).A)
    before = np.eye(4)
    if link.mdh:
        c, s = math.cos(link.alpha), math.sin(link.alpha)
        before = np.array([[1, 0, 0, link.a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
    limits = None
    if link.qlim is not None:
        low, high = map(float, np.ravel(link.qlim))
        limits = low, high
    axis = (0.0, 0.0, -1.0 if link.isflip else 1.0)
    return Link(before, axis, turns, np.linalg.inv(before) @ whole, limits)


def pybotics(wanted: str = "") -> Iterator[Arm]:
    """The modified tables of pybotics: rows of alpha, a, theta and d, in rad and mm."""
    if importlib.util.find_spec("pybotics") is None:
        return
    models: Any = importlib.import_module("pybotics.predefined_models")
    for name in ("abb_irb120", "kuka_lbr_iiwa_7", "mecademic_meca500", "puma560", "ur10"):
        if wanted not in name:
            continue
        links = []
        for alpha, a, theta, d in getattr(models, name)():
            c, s = math.cos(alpha), math.sin(alpha)
            before = np.array([[1, 0, 0, a / 1e3], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
            c, s = math.cos(theta), math.sin(theta)
            after = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d / 1e3], [0, 0, 0, 1.0]])
            links.append(Link(before, (0.0, 0.0, 1.0), True, after, None))
        yield Arm("pybotics", name, robot_of(f"pybotics_{name}", links))


def descriptions(source: str = "", wanted: str = "") -> Iterator[Arm]:
    """URDF and MJCF of downloaded packages; where fingers or cameras follow, the arm ends before them."""
    for path in sorted(DESCRIPTIONS.rglob("*")):
        if path.suffix not in (".urdf", ".xacro", ".xml"):
            continue
        if path.suffix == ".xml" and b"<mujoco" not in path.read_bytes():
            continue
        package = re.sub(r"-[0-9.]+$", "", path.relative_to(DESCRIPTIONS).parts[0])
        name = f"{path.parent.name}/{path.name}"
        robot = _described(path) if source in package and wanted in name else None
        if robot is not None:
            yield Arm(package, name, robot)


def _described(path: Path) -> Robot | None:
    """The arm of a file: the robot itself, or its chain of six or seven joints up to where it forks."""
    packages = (("around", str(path.parent.parent)),)
    try:
        robot = load(path, ReadOptions(packages=packages))
        if not robot.is_tree and robot.dof in JOINTS:
            return robot
        stem = _stem(robot)
        return load(path, ReadOptions(packages=packages, tips=(stem,))) if stem else None
    except KinegenError:
        return None


def _stem(robot: Robot) -> str:
    """The last row before the first fork, if six or seven joints lead to it; else nothing."""
    parents = [row.parent for row in robot.rows]
    chain, at = 0, robot.root
    while parents.count(at) == 1:
        at = robot.rows[parents.index(at)].name
        chain += 1
    return at if chain in JOINTS else ""
