"""Inverses of seven joints: what is given besides the pose is lost, not checked, or taken for another target."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

ARM, ANGLE = "panda_joint_7", "iiwa14_arm_angle"


def _case(
    name: str,
    file: str,
    old: str,
    new: str,
    message: str,
    *,
    robot: str = ARM,
    after: str = "_inverse(",
    count: int = 1,
) -> Sabotage:
    return Sabotage(
        f"redundancy: {name}",
        robot,
        "pose,inverse",
        f"{robot}{file}" if file.endswith(".c") else file,
        old,
        new,
        real="double",
        count=count,
        after=after,
        message=message,
    )


CASES = (
    _case(
        "another value is returned",
        ".c",
        r"solutions\[2\]\[6\] = redundancy\[0\];",
        "solutions[2][6] = 0.5 * redundancy[0];",
        "the self-test|misses the joint vectors|off by",
    ),
    _case(
        "its limit is not looked at",
        "_batch.c",
        r"select_lt\(redundancy\[[^]]*\], 2\.897300118",
        "select_lt(0.0, 2.897300118",
        "solves for targets with a redundancy above its limit",
        after="_inverse_tile(",
    ),
    _case(
        "a batch takes that of the first target",
        "_batch.c",
        r"redundancy \+ first \* redundancy_pose, redundancy_pose",
        "redundancy, redundancy_pose",
        "nearest",
        after="_inverse_nearest_batch(",
    ),
    _case(
        "the choice takes a joint of the start for it",
        ".c",
        r"\(base_T_tool, redundancy, solutions",
        "(base_T_tool, q0, solutions",
        "nearest",
        after="_inverse_nearest(",
    ),
    _case(
        "NumPy turns the other way",
        "_numpy.py",
        r"_sincos\(redundancy\[0\]\)",
        "_sincos(-redundancy[0])",
        "misses the joint vectors",
        robot=ANGLE,
        after="def inverse",
    ),
)
