"""The inverse of five-axis machines: a branch, a limit, the singular pose or the tool length is wrong."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

TRUNNION, NUTATING = "trunnion_mill", "nutating_mill"
OUTPUTS = "pose@cutter/workpiece,axis_inverse@cutter/workpiece"
AFTER = "axis_inverse_cutter_in_workpiece("


def _case(name: str, file: str, old: str, new: str, message: str, *, robot: str = TRUNNION, count: int = 1) -> Sabotage:
    whole = f"{robot}{file}" if file.endswith(".c") else file
    return Sabotage(
        f"machine: {name}", robot, OUTPUTS, whole, old, new, real="double", count=count, after=AFTER, message=message
    )


CASES = (
    _case(
        "the table stays where it is for any tool",
        ".c",
        r"< 5\.\d*e-26\)",
        "< 1e-2)",
        "misses|another solution",
        count=0,
    ),
    _case(
        "a vertical tool moves the table",
        ".c",
        r"SINCOS\(q_near\[1\]",
        "SINCOS(0.5 * q_near[1]",
        "moves the first joint",
    ),
    _case(
        "directions out of reach are solved",
        ".c",
        r"\(\(-1\.8\d*e-12\) < (t\d+)\)",
        r"(-3.0 < \1)",
        "out of reach",
        robot=NUTATING,
    ),
    _case(
        "NumPy forgets the tool length",
        "_numpy.py",
        r"params\.tool_length \+",
        "0.5 * params.tool_length +",
        "misses|another solution|solution",
        robot=NUTATING,
    ),
)
