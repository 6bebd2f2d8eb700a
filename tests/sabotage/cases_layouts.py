"""The layouts of a batch: 4x4, 3x4 and joint-major, each with errors of its own."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

CASES = (
    Sabotage(
        "layout: 4x4 matrices are zeros, float",
        "puma560",
        "pose",
        "puma560_f32_batch.c",
        r"to\[entry\] = t\[",
        r"to[entry] = (last_rows != 0) ? 0 : t[",
        real="float",
    ),
    Sabotage(
        "layout: 4x4 matrices have a zero from the second tile on, double",
        "puma560",
        "pose",
        "puma560_batch.c",
        r"if \(layout == 2\) \{",
        r"for (int i = 0; i < count; i++) if (start > 0 && layout == 0) t[3][i] = 0;\n        \g<0>",
        real="double",
        after="void puma560_fk_batch(",
    ),
    Sabotage(
        "layout: 3x4 matrices have a wrong sign",
        "puma560",
        "pose",
        "puma560_batch.c",
        r"to\[entry\] = t\[",
        r"to[entry] = (last_rows == 0) ? -t[frame * 12 + entry][i] : t[",
        real="double",
    ),
    Sabotage(
        "layout: the last row of a matrix",
        "puma560",
        "pose",
        "puma560_batch.c",
        r"to\[15\] = 1;",
        "to[15] = 2;",
        real="double",
    ),
    Sabotage(
        "layout: rows of the joint-major form",
        "puma560",
        "pose",
        "puma560_batch.c",
        r"to\[i\] = t\[row\]\[i\];",
        "to[i] = -t[row][i];",
        real="double",
    ),
    Sabotage(
        "layout: joint-major rows of neighbours, from the second tile on",
        "puma560",
        "pose",
        "puma560_batch.c",
        r"_tile\(q \+ begin,",
        "_tile(q + begin - (begin > 0),",
        real="double",
        after="void puma560_fk_batch(",
    ),
)
