"""Inverses of arms that are nearly of a family: the residual, the arm's own numbers, and what loops leave to others."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

ARM = "ur5_calibrated"


def _case(name: str, file: str, old: str, new: str, *, after: str = "_inverse(", count: int = 1) -> Sabotage:
    return Sabotage(
        f"nearly: {name}", ARM, "inverse", f"{ARM}{file}", old, new, real="double", count=count, after=after
    )


CASES = (
    _case(
        "the residual is not looked at",
        ".c",
        r"\((t\d+) < 8\.271806125530277e-25\)",
        r"(\1 < 1.0)",
        count=0,
    ),
    _case(
        "a length of the arm is off by its last digit",
        "_batch.c",
        r"\b0\.09481\b",
        "0.09482",
        after="_inverse_tile(",
        count=0,
    ),
    _case(
        "a loop takes what was left for another number",
        "_batch.c",
        r"= w\[3\]\[i\];",
        "= w[4][i];",
        after="_inverse_tile(",
    ),
)
