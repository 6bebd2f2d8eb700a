"""The search for several tips: weights, free parts, errors of each tip, groups, and the form of the equations."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

TREE = "fork"
SEARCH, BATCH = f"{TREE}_numeric_inverse.c", f"{TREE}_numeric_inverse_batch.c"
FREE = "another target of what is free"


def _tips(name: str, file: str, old: str, new: str, message: str, *, real: str = "double", after: str = "") -> Sabotage:
    if real == "float":
        file = file.replace(TREE, f"{TREE}_f32")
    return Sabotage(
        f"search, tips: {name}", TREE, "numeric_inverse", file, old, new, real, after=after, message=message
    )


CASES = (
    _tips("what is free is read", SEARCH, r"\(weight > 0\) && \(entry < 12\)", "entry < 12", FREE),
    _tips("what is free is read in a batch", BATCH, r"\(weight > 0\) && \(entry < 12\)", "entry < 12", FREE),
    _tips(
        "what is free is read in float", SEARCH, r"\(weight > 0\) && \(entry < 12\)", "entry < 12", FREE, real="float"
    ),
    _tips("one tip that is a pose is enough", SEARCH, r"\(are_poses != 0\) && ", "", "searches for targets with"),
    _tips(
        "one tip that is a pose is enough in a batch", BATCH, r"\(are_poses != 0\) && ", "", "searches for targets with"
    ),
    _tips(
        "the distance of one tip is reported for both",
        SEARCH,
        r"= c->position_error\[t\];",
        "= c->position_error[0];",
        "errors that are not those",
        after="continue;",
    ),
    _tips("no tolerance is kept to", SEARCH, r"c->near\[g\] = 0;", "", "as solved|errors that are not|solves only"),
    _tips(
        "the angle of a free part is reported",
        BATCH,
        r"zero\(t->rotation_error\[tip\]\);",
        ";",
        f"{FREE}|errors that are not those|solves only",
    ),
    _tips(
        "a position has no weight",
        BATCH,
        r"weight = c->weights\[2 \* tip \+ r / 3\]",
        "weight = 1",
        "other steps|solves",
    ),
    _tips(
        "weights of rotations are those of positions",
        "_runtime/_tips_inverse.py",
        r"weights\.ravel\(\)",
        "weights[:, ::-1].ravel()",
        f"{FREE}|errors that are not those|solves only",
    ),
    _tips("the last joint is not first", SEARCH, r"x\[DOF - 1 - j\] \* roots", "x[j] * roots", "solves only"),
    _tips("a finger does not move its tip", SEARCH, r"\{1U, 1U, 1U, 0U", "{1U, 1U, 0U, 0U", "solves only"),
    _tips(
        "a lane is done as the target before",
        BATCH,
        r"t->done\[g\]\[own\] = 0;",
        "",
        "another|solves only|as solved|errors that are not",
    ),
    _tips("a limit is passed", BATCH, r"\(above > high\) \? high", "(above > high) ? high + 1", "break limits|another"),
    _tips(
        "NumPy reads what is free",
        "_runtime/_tips_search.py",
        r"effort\.weights > 0",
        "effort.weights >= 0",
        FREE,
    ),
    _tips(
        "NumPy reports distances in another order",
        "_runtime/_tips_search.py",
        r"parts\.swapaxes\(1, 2\)",
        "parts.swapaxes(1, 2)[:, ::-1]",
        "errors that are not those",
    ),
)
