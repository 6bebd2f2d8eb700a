"""The complete inverse: solutions that are lost, double, beyond limits, or of what is not a pose."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

ARM = "xarm6"
SOURCE, NUMPY = f"{ARM}_complete_inverse.c", "_runtime/_elimination.py"
MISSES = "misses the joint vectors"


def _complete(name: str, file: str, old: str, new: str, message: str) -> Sabotage:
    return Sabotage(f"complete: {name}", ARM, "pose,complete_inverse", file, old, new, message=message)


CASES = (
    _complete("one solution fewer", SOURCE, r"return count;", "return count - (count > 1);", MISSES),
    _complete(
        "only the first half of the roots",
        SOURCE,
        r"i < DEGREE; i\+\+\) \{\n        const double sq",
        "i < 8; i++) {\n        const double sq",
        MISSES,
    ),
    _complete(
        "roots with a solution in common pass",
        SOURCE,
        r"\} else \{\n            sure = 0;",
        "} else if (place == MOST) {\n            sure = 0;",
        "misses the joint vectors",
    ),
    _complete("the reach is forgotten", SOURCE, r"base_T_tool\[i\] / reach", "base_T_tool[i]", MISSES),
    _complete("limits are passed", SOURCE, r"found\.q\[s\]\[j\] <= high", "found.q[s][j] <= high + 1", "break limits"),
    _complete(
        "NumPy loses the last root", NUMPY, r"\(roots\.imag >= 0\)", "(roots.imag >= 0) & (np.arange(16) < 8)", MISSES
    ),
    _complete("NumPy takes a wrong sign", NUMPY, r"-angles if table\.backwards", "angles if table.backwards", MISSES),
)
