"""Ranges of a redundancy: ends that are lost or moved, limits that are not looked at, and a nearest that is not."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

JOINT, ANGLE = "panda_joint_7", "iiwa14_arm_angle"
WRONG = "misses the joint vector|leaves out values|contains values"


def _case(name: str, robot: str, old: str, new: str, message: str = WRONG, *, file: str = "") -> Sabotage:
    source = file or f"{robot}_redundancy_range.c"
    return Sabotage(f"ranges: {name}", robot, "pose,redundancy_range", source, old, new, real="double", message=message)


CASES = (
    _case("the root is lost on one side", ANGLE, r"insert\(e, wrapped\(middle - half\)\);", ""),
    _case("a limit is seen backwards", ANGLE, r"\(joint == 2\) \|\| \(joint > 4\)", "(joint == 2) || (joint > 5)"),
    _case("upper limits are forgotten", ANGLE, r"add_limit\(&a, line, q, j, highest\[j\], &e\);", ""),
    _case("the second elbow is left out", ANGLE, r"find_half\(target, BRANCHES / 2, r\);", ""),
    _case("parts are never halved", JOINT, r"level\[depth\] < DEPTH", "level[depth] < 0"),
    _case(
        "a change counts as settled",
        JOINT,
        r"stays_invalid\(a, b, c, i\) : 0;",
        "stays_invalid(a, b, c, i) : 1;",
    ),
    _case("the nearest is not refined", JOINT, r"i < STEPS", "i < 0", "not the nearest|as the nearest to itself"),
    _case(
        "the nearest of the first interval",
        ANGLE,
        r"if \(nearest\.distance < best->distance\)",
        "if (best->distance > 1e300)",
        "not the nearest",
    ),
    _case(
        "NumPy sees limits backwards",
        ANGLE,
        r"turn = turn\.T if joint in \(2, 5, 6\) else turn",
        "turn = turn.T",
        file="_runtime/_range_search.py",
    ),
)
