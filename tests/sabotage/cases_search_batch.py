"""The search for many targets: what lanes keep of the target before, seeds, limits."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

ARM = "flat_arm"
BATCH, SINGLE_BATCH = f"{ARM}_numeric_inverse_batch.c", f"{ARM}_f32_numeric_inverse_batch.c"


def _batch(name: str, old: str, new: str, message: str, *, real: str = "double") -> Sabotage:
    file = BATCH if real == "double" else SINGLE_BATCH
    return Sabotage(f"search batch: {name}", ARM, "pose,numeric_inverse", file, old, new, real=real, message=message)


CASES = (
    _batch("a lane keeps the least error of the target before", r"t->least\[own\] = 1e\+30;\n", "\n", "gives another"),
    _batch("the seed forgets where a part begins", r"c->first \+ \*next", "*next", "gives another"),
    _batch("a limit is passed", r"\(above > high\) \? high", "(above > high) ? high + 1", "break limits|another"),
    _batch(
        "a lane has the parameters of stalling of another",
        r"t->before\[own\] = error;",
        "t->before[0] = error;",
        "gives another",
        real="float",
    ),
)
