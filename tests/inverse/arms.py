"""Random arms of every family, written in random conventions, and a way to evaluate their inverse."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.derive.inverse.derive import derive_inverse
from kinegen.derive.inverse.family import Aim, Family
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.verify import reference
from kinegen.verify.singular_samples import Values

Floats = NDArray[np.float64]

DISTAL = {
    "planar 2R": ["R a . 0", "R b . 0"],
    "planar 3R": ["R a . 0", "R b . 0", "R c . 0"],
    "SCARA, joints RRP": ["R a . 0", "R b . 180", "P 0 . 0"],
    "SCARA, joints RRPR": ["R a . 0", "R b . 180", "P 0 . 0", "R 0 . 0"],
    "SCARA, joints RRRP": ["R a . 180", "R b . 0", "R 0 . 0", "P 0 . 0"],
    "SCARA, joints PRR": ["P 0 . 0", "R a . 0", "R b . 0"],
    "Cartesian arm": ["P a . 90", "P 0 . 60", "P b . 0"],
    "cylindrical arm": ["R 0 . 0", "P a . 90", "P 0 . 0"],
    "cylindrical arm, lift first": ["P 0 . 0", "R b . -90", "P c . 0"],
    "spherical arm": ["R a . -90", "R 0 . 90", "P 0 . 0"],
    "anthropomorphic arm": ["R 0 . 90", "R a . 0", "R b . 0"],
    "anthropomorphic arm, offset waist": ["R c . 60", "R a . 180", "R b . 0"],
    "arm with spherical wrist": ["R c . -90", "R a . 0", "R b . 90", "R 0 d -90", "R 0 0 90", "R 0 d 0"],
    "arm with spherical wrist, waist aslant": ["R 0 . 50", "R a . 0", "R 0 . 90", "R 0 d 90", "R 0 0 90", "R b c 30"],
    "arm with spherical wrist, equal links": ["R 0 0 90", "R d 0 0", "R 0 0 90", "R 0 d -90", "R 0 0 90", "R 0 c 0"],
    "Stanford": ["R 0 . -90", "R 0 b 90", "P 0 . 0", "R 0 0 -90", "R 0 0 90", "R 0 d 0"],
    "gantry with wrist": ["P 0 . 90", "P 0 . 90", "P a . 0", "R 0 . 90", "R 0 0 90", "R 0 c 0"],
    "UR type": ["R 0 a 90", "R -b 0 0", "R -c 0 0", "R 0 d 90", "R 0 a -90", "R 0 c 0"],
    "UR type, offset waist": ["R a . -90", "R b 0 180", "R c . 0", "R 0 d 90", "R 0 a 90", "R 0 c 30"],
    "arm whose axes 1, 2 meet": ["R 0 . -90", "R a b 90", "R c 0 0"],
    "axes 1, 2 meet, wrist": ["R 0 . 70", "R a b 50", "R c 0 90", "R 0 d -90", "R 0 0 90", "R 0 c 0"],
    "axes 1, 2 meet, wrist in line": ["R 0 . -90", "R 0 b 90", "R c 0 -90", "R 0 d 90", "R 0 0 -90", "R 0 c 0"],
    "spherical shoulder": ["R 0 . -90", "R 0 0 90", "R 0 b 90", "R a 0 0", "R b . 60", "R 0 c 0"],
    "Panda without joint 7": ["R 0 . -90", "R 0 0 90", "R c b 90", "R -c 0 -90", "R 0 a 90", "R d 0 90"],
    "UR type from the tool": ["R 0 c 90", "R 0 a -90", "R c d 0", "R b 0 0", "R 0 0 -90", "R 0 a 0"],
    "AL5D type": ["R 0 . 90", "R a 0 0", "R b 0 0", "R 0 0 90", "R 0 c 0"],
    "AL5D type, offset hand": ["R 0 . 90", "R a . 0", "R b . 180", "R c . 90", "R 0 d 0"],
}
"""Arms as distal rows: joint, a, d, alpha; a dot is a random offset. The names are for people who read a failure."""

REDUNDANT = {
    "Panda": ("j7", ["R 0 . -90", "R 0 0 90", "R c b 90", "R -c 0 -90", "R 0 a 90", "R d 0 90", "R 0 c 0"]),
    "UR on a rail": ("j1", ["P 0 . 90", "R 0 a 90", "R -b 0 0", "R -c 0 0", "R 0 d 90", "R 0 a -90", "R 0 c 0"]),
    "arm on a table": ("j1", ["R c . 50", "R c . -90", "R a . 0", "R b 0 90", "R 0 d -90", "R 0 0 90", "R 0 d 0"]),
    "turning tool": ("j7", ["R c . -90", "R a . 0", "R b 0 90", "R 0 d -90", "R 0 0 90", "R 0 d 30", "R c . 20"]),
    "sliding tool": ("j7", ["R c . -90", "R a . 0", "R b 0 90", "R 0 d -90", "R 0 0 90", "R 0 d 30", "P 0 . 0"]),
    "UR on a rail, turning tool": (
        "[j8, j1]",
        ["P 0 . 90", "R 0 a 90", "R -b 0 0", "R -c 0 0", "R 0 d 90", "R 0 a -90", "R 0 c 70", "R d . 0"],
    ),
    "table, rail and arm": (
        "[j1, j2]",
        ["R c . 50", "P a . 70", "R c . -90", "R a . 0", "R b 0 90", "R 0 d -90", "R 0 0 90", "R 0 d 0"],
    ),
    "spherical shoulder on a table": (
        "[j8, j1, j9]",
        [
            "R c . 50",
            "R 0 . -90",
            "R 0 0 90",
            "R 0 b 90",
            "R a 0 0",
            "R b . 60",
            "R 0 c 0",
            "P a . 70",
            "R c . 20",
        ],
    ),
    "AL5D on a rail": ("j1", ["P 0 . 90", "R 0 . 90", "R a 0 0", "R b 0 0", "R 0 0 90", "R 0 c 0"]),
    "table and elbow arm": ("[j2, j1]", ["R c . 50", "P a . 70", "R 0 . 90", "R a . 0", "R b . 0"]),
    "planar 3R on a table": ("[j1, j5]", ["R c . 50", "R a . 0", "R b . 0", "R c . 0", "P 0 . 30"]),
    "S-R-S, joint 1": ("j1", ["R 0 . -90", "R 0 0 90", "R 0 b 90", "R 0 0 -90", "R 0 a -90", "R 0 0 90", "R 0 c 0"]),
    "S-R-S, joint 7": ("j7", ["R 0 . -90", "R 0 0 90", "R 0 b 90", "R 0 0 -90", "R 0 a -90", "R 0 0 90", "R 0 c 0"]),
    "S-R-S": ("arm_angle", ["R 0 . -90", "R 0 0 90", "R 0 b 90", "R 0 0 -90", "R 0 a -90", "R 0 0 90", "R 0 c 0"]),
    "S-R-S, offset elbow": (
        "arm_angle",
        ["R 0 . -90", "R 0 0 90", "R c b 90", "R -c 0 -90", "R 0 a -90", "R 0 0 90", "R 0 c 0"],
    ),
    "S-R-S, equal links": (
        "arm_angle",
        ["R 0 . 90", "R 0 0 -90", "R 0 a -90", "R 0 0 90", "R 0 a 90", "R 0 0 -90", "R c . 0"],
    ),
}
"""Arms with more joints than a family has: what is given besides the pose, and the rows."""

LENGTHS = {"a": 0.43, "b": 0.37, "c": 0.11, "d": 0.29}


@dataclass(frozen=True, slots=True)
class Arm:
    """A robot, what it was recognised as, and its kernel."""

    robot: Robot
    family: Family
    program: Program
    params: tuple[float, ...]


@st.composite
def robots(draw: st.DrawFn, kind: str) -> Robot:
    """A robot of a kind, in a random convention, with random signs, offsets, base, tool, limits and parameters."""
    convention = draw(st.sampled_from(["standard", "modified", "ets"]))
    runtime = "true" if draw(st.booleans()) else "false"
    redundancy, given_rows = REDUNDANT[kind] if kind in REDUNDANT else ("", DISTAL[kind])
    rows = [row.split() for row in given_rows]
    before = [f"Rz({draw(_angles)})", f"Rx({draw(_angles)})", f"Tz({draw(_offsets)})"]
    after = [f"Rz({draw(_angles)})"] if kind.startswith(("planar", "SCARA")) else [f"Rx({draw(_angles)})", "Tx(c)"]
    lines: list[str] = []
    shifted = "a: 0, alpha: 0"
    for number, (letter, a, offset, alpha) in enumerate(rows, start=1):
        length = draw(_offsets) if offset == "." else offset
        turns = letter == "R"
        theta = draw(_turns if turns else _sideways if rows[1][0] == rows[0][0] == "P" else _quarters)
        d = length if turns else f"{draw(_strokes)} + {length}"
        limits = f", limits: [{draw(st.integers(-400, -100))}, {draw(st.integers(100, 400))}]" if turns else ""
        limits = limits if draw(st.booleans()) else ""
        if convention == "standard":
            row = f"theta: {theta}, d: {d}, a: {a}, alpha: {alpha}"
        elif convention == "modified":
            row = f"{shifted}, theta: {theta}, d: {d}"
            shifted = f"a: {a}, alpha: {alpha}"
        else:
            row = f"ets: [Ry(-90), Rx({theta}), Ry(90), Tz({d}), Tx({a}), Rx({alpha})]"
        lines.append(f"  - {{name: j{number}, {row}{limits}}}")
    if convention == "modified":
        _, a, _, alpha = rows[-1]
        after = [f"Tx({a})", f"Rx({alpha})", *after]
    body = "\n".join(
        ["joints:", *lines, f"base: {{ets: [{', '.join(before)}]}}", f"tool: {{ets: [{', '.join(after)}]}}"]
    )
    used = [name for name in LENGTHS if re.search(rf"\b{name}\b", re.sub(r"[a-z]+:", "", body))]
    head = [
        f"kinegen: 1\nname: arm\nconvention: {'standard' if convention == 'ets' else convention}",
        "units: {length: m, angle: deg}",
        *[f"redundancy: {redundancy}"] * bool(redundancy),
        *(["parameters:"] if used else []),
        *(f"  {name}: {{value: {LENGTHS[name]}, runtime: {runtime}}}" for name in used),
    ]
    text = "\n".join([*head, body])
    return loads(text, "arm.yaml")


_angles = st.sampled_from(["0", "0", "90", "180", "-90", "33"])
_quarters = st.sampled_from(["0", "90", "-90", "180"])
_sideways = st.sampled_from(["90", "-90"])
_offsets = st.sampled_from(["0", "0", "0.13", "-0.07", "c"])
_turns = st.sampled_from(["q", "q", "-q", "q + 90", "180 - q", "q - 30", "2*q"])
_strokes = st.sampled_from(["q", "-q", "q + 0.1", "0.5*q"])


def arm_of(robot: Robot) -> Arm:
    """Recognise a robot and derive its kernel."""
    family = recognise(robot)
    assert not isinstance(family, NotClosedForm), family.reasons
    program = lower(derive_inverse(robot, Quantity(Kind.INVERSE)))
    return Arm(robot, family, program, tuple(float(value) for _, value in family.axes.defaults))


def evaluate(arm: Arm, poses: Floats, given: Floats | None = None) -> tuple[Floats, Floats]:
    """All solutions for poses (N, 4, 4): joint vectors (N, branches, dof), and which hold (N, branches).

    All is computed in the number type of the poses; `given` (N,) or (N, numbers) is what the inverse is given besides.
    """
    entries = [*poses[:, :3].reshape(len(poses), 12).T, *([] if given is None else given.reshape(len(given), -1).T)]
    known = Values(arm.program, np.array(entries, poses.dtype), arm.params)
    results = np.stack([known.of(operand) for operand in arm.program.outputs], axis=1)
    branches = len(arm.family.branches)
    solutions = results[:, : branches * arm.robot.dof].reshape(len(poses), branches, arm.robot.dof)
    return solutions, results[:, branches * arm.robot.dof :]


def joint_vectors(robot: Robot, count: int, seed: int) -> Floats:
    """Random joint vectors within the limits."""
    low, high = np.array(joint_box(robot)).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


def errors(arm: Arm, solutions: Floats, poses: Floats) -> Floats:
    """How far each solution's pose (N, branches) is from what the target asks for."""
    errors = np.empty(solutions.shape[:2])
    for branch in range(solutions.shape[1]):
        reached = reference.pose(arm.robot, solutions[:, branch])[:, 0]
        difference = np.abs(reached - poses)[:, :3]
        errors[:, branch] = (difference[..., 3] if arm.family.aim is Aim.POSITION else difference.max(axis=2)).max(
            axis=1
        )
    return errors


def distances(arm: Arm, solutions: Floats, q: Floats) -> Floats:
    """How far each solution (N, branches) is from a joint vector, but for whole turns."""
    apart = np.abs(solutions - q[:, None])
    for joint, variable in zip(arm.family.joints, arm.robot.variables, strict=True):
        if variable.type is not JointType.PRISMATIC:
            turn = 2 * np.pi / abs(float(joint.rate))
            place = joint.number - 1
            apart[..., place] = np.abs((apart[..., place] + turn / 2) % turn - turn / 2)
    return apart.max(axis=2)
