"""Numbers of operations that hand and other searches have reached are not exceeded."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.io.load import load, loads
from kinegen.ir.lower import program_of
from kinegen.ir.program import count
from kinegen.model.outputs import parse_quantity
from kinegen.model.robot import Robot
from tests.operations.optimiser import PAIR
from tests.operations.tables import TABLES

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

ELBOW = """  - {name: j1, theta: q, d: 0.22, a: 0, alpha: 90}
  - {name: j2, theta: q, d: 0, a: 0.23, alpha: 0}
  - {name: j3, theta: q, d: 0, a: 0.33, alpha: 0}
"""

OTHERS = {
    "rpr_slide_across": """
  - {name: j1, theta: q, d: 0, a: 0.3, alpha: 0}
  - {name: j2, ets: [Ty(q)]}
  - {name: j3, theta: q, d: 0.1, a: 0.2, alpha: 0}
""",
    "tool_along_and_across": """
  - {name: j1, theta: q, d: 0.4, a: 0, alpha: 30}
  - {name: j2, theta: q, d: 0, a: 0.25, alpha: 0}
  - {name: j3, theta: q, d: 0.4, a: 0, alpha: 90}
  - {name: j4, theta: q, d: 0.7, a: 0, alpha: -90}
tool: {xyz: [0.1, 0, 0.2]}
""",
    "slides_along_inclined_axes": """
  - {name: j1, convention: modified, theta: q, d: 0.4, a: 0, alpha: -60}
  - {name: j2, convention: modified, theta: 0, d: q, a: 0.5, alpha: 0}
  - {name: j3, convention: modified, theta: q, d: 0.1, a: 0.3, alpha: -90}
  - {name: j4, convention: modified, theta: 0, d: q, a: 0.25, alpha: -60}
  - {name: j5, convention: modified, theta: q, d: 0, a: 0.25, alpha: -90}
  - {name: j6, convention: modified, theta: q, d: 0.3, a: 0.25, alpha: 0}
""",
    "mount_turned_by_three_angles": """
  - {name: j1, theta: q, d: 0.4, a: 0, alpha: 90}
  - {name: j2, theta: q, d: 0, a: 0.25, alpha: 0}
  - {name: j3, theta: q, d: 0.3, a: 0.1, alpha: 0}
base: {xyz: [0.1, 0.2, 0.3], rpy: [10, 20, 30]}
""",
    "mount_turned_by_two_angles": """
  - {name: j1, theta: q, d: 0.4, a: 0, alpha: 90}
  - {name: j2, theta: q, d: 0, a: 0.25, alpha: 0}
  - {name: j3, theta: q, d: 0.3, a: 0.1, alpha: 0}
base: {rpy: [0, 30, 45]}
""",
    "offsets_along_and_across": """
  - {name: j1, ets: [Rz(q), Tx(0.3), Ty(0.1)]}
  - {name: j2, ets: [Rz(q), Tx(0.2), Ty(0.4)]}
  - {name: j3, theta: q, d: 0, a: 0.5, alpha: 0}
""",
    "rppr_along_and_across": """
  - {name: j1, theta: q, d: 0, a: 0.13, alpha: 0}
  - {name: j2, theta: 0, d: q, a: 0, alpha: 0}
  - {name: j3, ets: [Tx(q)]}
  - {name: j4, theta: q, d: 0, a: 0.43, alpha: 0}
""",
    "rprr_slide_along_the_link": """
  - {name: j1, theta: q, d: 0, a: 0.1, alpha: 0}
  - {name: j2, ets: [Tx(q)]}
  - {name: j3, theta: q, d: 0, a: 0.3, alpha: 0}
  - {name: j4, theta: q, d: 0, a: 0.2, alpha: 0}
""",
    "turn_of_45_between_parallel_axes": """
  - {name: j1, theta: q, d: 0.22, a: 0, alpha: 90}
  - {name: j2, theta: q, d: 0, a: 0.23, alpha: 0}
  - {name: fixed, ets: [Tx(0.33), Rz(45), Ty(0.53)]}
  - {name: j4, theta: q, d: 0, a: 0.43, alpha: 0}
""",
    "tool_turned_by_45": f"{ELBOW}tool: {{xyz: [0.1, 0.02, 0.03], rpy: [0, 0, 45]}}",
    "base_tilted_by_45": f"{ELBOW}base: {{xyz: [0, 0, 0.03], rpy: [45, 0, 0]}}",
    "twists_with_rational_tangent": """
  - {name: j1, theta: q, d: 0.22, a: 0, alpha: atan(1/2)}
  - {name: j2, theta: q, d: 0.32, a: 0, alpha: -atan(1/2)}
  - {name: j3, theta: q, d: 0.42, a: 0.33, alpha: 0}
""",
    "orthogonal_3r": """
  - {name: j1, theta: q, d: 0, a: 1, alpha: -90}
  - {name: j2, theta: q, d: 1, a: 2, alpha: 90}
  - {name: j3, theta: q, d: 0.5, a: 1.5, alpha: 0}
""",
    "euler_zyz": "  - {name: j1, ets: [Rz(q)]}\n  - {name: j2, ets: [Ry(q)]}\n  - {name: j3, ets: [Rz(q)]}",
    "roll_pitch_yaw": "  - {name: j1, ets: [Rz(q)]}\n  - {name: j2, ets: [Ry(q)]}\n  - {name: j3, ets: [Rx(q)]}",
    "gantry_with_wrist": """
  - {name: j1, ets: [Tx(q)]}
  - {name: j2, ets: [Ty(q)]}
  - {name: j3, ets: [Tz(q)]}
  - {name: j4, ets: [Rz(q)]}
  - {name: j5, ets: [Ry(q)]}
  - {name: j6, ets: [Rz(q), Tz(0.1)]}
""",
    "two_arms": """
  - {name: left_1, parent: base, ets: [Ty(0.2), Rz(20), Ry(30), Rx(40), Rz(q)]}
  - {name: left_2, parent: left_1, ets: [Tz(0.3), Rz(10), Ry(50), Rx(-25), Rz(q)]}
  - {name: left_3, parent: left_2, ets: [Tx(0.4), Rz(q)]}
  - {name: right_1, parent: base, ets: [Ty(-0.2), Rz(-20), Ry(30), Rx(-40), Rz(q)]}
  - {name: right_2, parent: right_1, ets: [Tz(0.3), Rz(-10), Ry(50), Rx(25), Rz(q)]}
  - {name: right_3, parent: right_2, ets: [Tx(0.4), Rz(q)]}
frames:
  left: {parent: left_3, tip: true, ets: [Tx(0.3)]}
  right: {parent: right_3, tip: true, ets: [Tx(0.3)]}
""",
    "level_tool": """
  - {name: j1, theta: q, d: 0.22, a: 0.13, alpha: 90}
  - {name: j2, theta: q, d: 0, a: 0.23, alpha: 0}
  - {name: j3, theta: q, d: 0, a: 0.33, alpha: 0}
  - {name: level_1, theta: -j2, d: 0, a: 0, alpha: 0}
  - {name: level_2, theta: -j3, d: 0, a: 0.43, alpha: -90}
  - {name: j6, theta: q, d: 0.62, a: 0, alpha: 0}
""",
}
"""Arms that no table of angles and lengths describes: rows of the file, and what follows them."""

# An arm, a quantity, and numbers of multiplications, additions, and pairs of a sine and a cosine.
REACHED = """
puma560 pose 40 20 6
fu_gonzalez_lee_puma pose 43 23 6
ur5 pose 35 21 6
universal_robots_ur5 pose 35 21 6
panda pose 68 36 7
iiwa14 pose 58 29 7
siciliano_dlr pose 58 28 7
human_arm pose 76 37 9
stanford pose 39 18 5
kuka_kr6 pose 41 23 6
tsai_scorbot pose 20 12 5
schilling_rhino pose 22 13 5
al5d pose 20 11 5
motoman_l3 pose 18 8 5
elbow_5r_without_offset pose 20 11 5
shoulder_offset_5r pose 20 12 5
elbow_5r_with_column pose 20 11 5
elbow_5r_upright_wrist pose 20 12 5
elbow_5r_turned_tool pose 20 11 5
spherical_joint pose 12 4 3
spherical_wrist pose 15 4 3
euler_zyz pose 12 4 3
roll_pitch_yaw pose 12 4 3
gantry_with_wrist pose 15 7 3
orthogonal_3r pose 22 11 3
gimbal_offsets pose 20 8 3
offsets_90 pose 20 10 4
four_parallel_7r pose 24 18 7
schilling_adept pose 4 5 3
antiparallel_4r pose 8 9 4
planar_4r_alternating pose 8 9 4
planar_6r_reversed_joints pose 4 8 3
twist_30 pose 23 10 3
rrprrr_twists_30_45 pose 68 37 5
prrrrr_twists_30 pose 33 22 3
prr_twist_60 pose 12 5 2
rrprrr_reversed_slide pose 32 17 4
prprr_twists_30_60 pose 24 18 2
prpr_twist_60 pose 18 10 2
turn_of_45_between_parallel_axes pose 12 7 3
tool_turned_by_45 pose 14 9 3
base_tilted_by_45 pose 18 11 3
hanging_arm pose 10 6 3
rpr_shift_and_slide position 6 3 2
tool_along_and_across pose 38 22 4
mount_turned_by_three_angles position 17 15 3
mount_turned_by_two_angles pose 29 19 3
slides_along_inclined_axes pose 44 27 4
slides_along_inclined_axes position 16 13 3
rpr_slide_across position 6 4 2
offsets_along_and_across position 10 8 3
turn_of_45_between_parallel_axes position 8 7 3
twists_60 position 7 5 2
twists_with_rational_tangent position 15 10 3
ur_modified_offsets position 14 12 5
ur5 jacobian 34 15 5
puma560 jacobian 32 13 5
panda jacobian 88 41 6
iiwa14 jacobian 77 35 6
jaco2 jacobian 61 32 5
twists_45 jacobian 39 23 3
stanford jacobian 40 16 4
rppr_along_and_across jacobian 4 4 2
rprr_slide_along_the_link jacobian 6 9 3
palletiser jacobian 10 4 3
two_arms pose 78 56 6
two_arms position 36 26 6
two_arms frames 110 72 8
two_arms jacobian_world 54 38 4
level_tool jacobian 10 4 3
level_tool twist 13 10 3
planar_3r twist 12 8 3
twist_45_and_back twist 27 15 3
tsai_scorbot twist 23 16 4
universal_robots_ur5 twist 36 25 5
""".split("\n")[1:-1]


def robot_of(name: str) -> Robot:
    file = ROBOTS / f"{name}.yaml"
    if file.exists():
        return load(str(file))
    if name in OTHERS:
        header = f"kinegen: 1\nname: {name}\nconvention: standard\nunits: {{length: m, angle: deg}}\njoints:\n"
        return loads(header + OTHERS[name].lstrip("\n"), f"{name}.yaml")
    return next(table for table in TABLES if table.name == name).robot()


def weight(multiplications: int, additions: int, pairs: int) -> int:
    return 2 * (multiplications + additions + PAIR * pairs)


@pytest.mark.parametrize("line", REACHED)
def test_no_more_operations_than_have_been_reached(line: str) -> None:
    name, kind, *numbers = line.split()

    found = count(program_of(robot_of(name), parse_quantity(kind)))

    assert weight(found.multiplications, found.additions, found.sine_cosines) <= weight(*map(int, numbers))


TREE = """
  - {name: j1, theta: q, d: 0.4, a: 0.1, alpha: 90}
  - {name: j2, theta: q, d: 0.1, a: 0.3, alpha: -90}
  - {name: j3, theta: q, d: 0.2, a: 0.1, alpha: 90}
  - {name: left, parent: j3, theta: q, d: 0.1, a: 0.1, alpha: 0}
  - {name: right, parent: j3, theta: q, d: 0.3, a: 0.2, alpha: 0}
"""


def test_two_tips_share_the_pose_of_their_trunk() -> None:
    """From the base outwards; each tip by itself takes 64 multiplications and 40 additions."""
    robot = loads(f"kinegen: 1\nname: t\nconvention: standard\nunits: {{length: m, angle: deg}}\njoints:{TREE}", "t")
    found = count(program_of(robot, parse_quantity("pose")))

    assert len(robot.tips) == 2
    assert (found.multiplications, found.additions, found.sine_cosines) == (58, 39, 5)
