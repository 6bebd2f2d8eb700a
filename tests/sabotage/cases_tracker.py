"""The inverse along a path: leaps, bounds that are passed, wrong reasons, and state that a refused step changes."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

ARM = "puma560"
SOURCE, NUMPY = f"{ARM}_inverse_tracker.c", "_runtime/_tracking.py"


def _tracker(name: str, file: str, old: str, new: str, message: str) -> Sabotage:
    return Sabotage(f"tracker: {name}", ARM, "pose,inverse_tracker", file, old, new, message=message)


CASES = (
    _tracker(
        "the branch is chosen by its number",
        SOURCE,
        r"apart\[branch\] < least",
        "(double)branch < least",
        "inverse_tracker (follows a path|does not follow|gives status)",
    ),
    _tracker("a joint may move further", SOURCE, r"max_step\[j\] : 0", "max_step[j] * 1.5 : 0", "more than max_step"),
    _tracker(
        "a refused step moves",
        SOURCE,
        r"if \(status > 0\) \{",
        "if (status > -3) {",
        "inverse_tracker (gives status|breaks a limit|does not end)",
    ),
    _tracker(
        "no target is a pose", SOURCE, r"is_pose\(base_T_tool\) == 0", "is_pose(base_T_tool) == 2", "gives status"
    ),
    _tracker("another joint is named", SOURCE, r"found = j;", "found = 5;", "does not end at the limit"),
    _tracker(
        "errors are reported as none",
        SOURCE,
        r"position_error = puma560_sqrt\(dot\(e, e, 3\)\);",
        "position_error = 0;",
        "inverse_tracker.*differs from the reference",
    ),
    _tracker("any start serves", SOURCE, r"\? serves : 0;", "? serves : 1;", "begins with"),
    _tracker("speeds are not damped", SOURCE, r"damping = square \*", "damping = 0 *", "other joint speeds"),
    _tracker("a residual is left out", SOURCE, r"twist\[i\] - dot\(", "twist[i] + dot(", "another residual"),
    _tracker("bounds of speeds are halved", SOURCE, r"\(most / size\)", "(most / (size + size))", "another part"),
    _tracker("NumPy moves further", NUMPY, r"max_step, 0\)", "2 * max_step, 0)", "more than max_step"),
    _tracker("NumPy names another joint", NUMPY, r"int\(excess\.argmax\(\)\)", "5", "does not end at the limit"),
)
