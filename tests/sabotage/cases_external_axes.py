"""Inverses with several joints given, of a tool in the frame of a workpiece: values change places or are not looked at."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

CELL, ARM = "ur5_track_table", "hanging_arm"
OUTPUTS = {CELL: "pose@tool_tip/workpiece,inverse@tool_tip/workpiece", ARM: "pose,inverse"}
KERNEL = "_inverse_tool_tip_in_workpiece("


def _case(
    name: str,
    file: str,
    old: str,
    new: str,
    message: str,
    *,
    robot: str = CELL,
    after: str = KERNEL,
    count: int = 1,
) -> Sabotage:
    return Sabotage(
        f"external axes: {name}",
        robot,
        OUTPUTS[robot],
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
        "the angle of the table is that of the track",
        ".c",
        r"SINCOS\(redundancy\[1\]",
        "SINCOS(redundancy[0]",
        "misses the joint vectors|off by|the self-test",
    ),
    _case(
        "the table turns the other way",
        "_batch.c",
        r"sincos\(redundancy\[([^]]*)\]",
        r"sincos(-redundancy[\1]",
        "misses the joint vectors|off by",
        after="_inverse_tool_tip_in_workpiece_tile(",
    ),
    _case(
        "the limit of the second value is not looked at",
        "_batch.c",
        r"select_lt\(redundancy\[[^]]*\], 12\.56637061",
        "select_lt(0.0, 12.56637061",
        "solves for targets with a redundancy of table above its limit",
        after="_inverse_tool_tip_in_workpiece_tile(",
    ),
    _case(
        "the lower limit of the first value is not looked at",
        "_numpy.py",
        r"redundancy\[0\] > \(",
        "abs(redundancy[0]) > (",
        "solves for targets with a redundancy of track below its limit",
        after="def inverse_tool_tip_in_workpiece",
    ),
    _case(
        "another value is returned",
        ".c",
        r"solutions\[3\]\[7\] = redundancy\[1\];",
        "solutions[3][7] = 0.5 * redundancy[1];",
        "the self-test|misses the joint vectors|off by",
    ),
    _case(
        "the choice takes joints of the start for the values",
        ".c",
        r"\(workpiece_T_tool_tip, redundancy, solutions",
        "(workpiece_T_tool_tip, q0, solutions",
        "nearest",
        after="_inverse_nearest(",
    ),
    _case(
        "a batch of choices takes the second value for the first",
        "_batch.c",
        r"redundancy \+ first \* redundancy_pose, redundancy_pose",
        "redundancy + first * redundancy_pose + redundancy_joint, redundancy_pose",
        "nearest",
        after="_inverse_nearest_batch(",
    ),
    _case(
        "the values come in the order of the chain",
        "_numpy.py",
        r"redundancy\[([01])\]",
        r"redundancy[1 - \1]",
        "misses the joint vectors|off by|solves for targets",
        robot=ARM,
        after="def inverse",
        count=0,
    ),
)
