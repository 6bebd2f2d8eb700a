"""Closed-form inverses and the search: limits, reach, targets that are not poses, names of branches, `nearest=`."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

ARM = "flat_arm"
DOUBLE, SINGLE = f"{ARM}.c", f"{ARM}_f32.c"
BATCH, SINGLE_BATCH = f"{ARM}_batch.c", f"{ARM}_f32_batch.c"
SEARCH, SINGLE_SEARCH = f"{ARM}_numeric_inverse.c", f"{ARM}_f32_numeric_inverse.c"
SCALAR, TILE = "_inverse(", "_inverse_tile("


def _inverse(
    name: str, file: str, old: str, new: str, message: str, *, real: str = "double", count: int = 1, after: str = SCALAR
) -> Sabotage:
    return Sabotage(
        f"inverse: {name}",
        ARM,
        "pose,inverse",
        file,
        old,
        new,
        real=real,
        count=count,
        after=after,
        message=message,
    )


def _search(name: str, old: str, new: str, message: str, *, real: str = "double", file: str = "") -> Sabotage:
    named = file or (SEARCH if real == "double" else SINGLE_SEARCH)
    return Sabotage(f"search: {name}", ARM, "pose,numeric_inverse", named, old, new, real=real, message=message)


MISSES, BREAKS = "misses the joint vectors", "that break a limit"

CASES = (
    # Solutions that are not there.
    _inverse(
        "float is never valid", SINGLE, r"valid\[(\d)\] = t\d+;", r"valid[\1] = 0.0F;", MISSES, real="float", count=2
    ),
    _inverse(
        "float batch is never valid",
        SINGLE_BATCH,
        r"t\[([67])\]\[i\] = t\d+;",
        r"t[\1][i] = 0.0F;",
        MISSES,
        real="float",
        count=2,
        after=TILE,
    ),
    _inverse("float loses a branch", SINGLE, r"valid\[1\] = t\d+;", "valid[1] = 0.0F;", MISSES, real="float"),
    _inverse("double loses a branch", DOUBLE, r"valid\[0\] = t\d+;", "valid[0] = 0.0;", MISSES),
    _inverse(
        "NumPy loses a branch in float",
        "_numpy.py",
        r"t95 = np\.where\(t94 <",
        "t95 = np.where(t94 + 9 <",
        MISSES,
        real="float",
        after="def inverse(",
    ),
    _inverse(
        "float limits have the room of double", SINGLE, r"2\.620384F", "2.6179938F", MISSES, real="float", count=4
    ),
    _inverse("a lower limit is too strict", DOUBLE, r"\(-2\.96705\d+\)", "(-2.9)", MISSES, count=2),
    _inverse(
        "float reach has the tolerance of double",
        SINGLE,
        r"t67 \* 8\.17\d+e-05F",
        "t67 * (-1e-05F)",
        "no solution for|misses",
        real="float",
    ),
    # Solutions that break limits.
    _inverse("scalar ignores the limits of the elbow", DOUBLE, r"2\.6179939\d+", "99.0", BREAKS, count=4),
    _inverse("float ignores the limits of the elbow", SINGLE, r"2\.620384F", "99.0F", BREAKS, real="float", count=4),
    _inverse("batch ignores an upper limit", BATCH, r"2\.79252\d+", "99.0", BREAKS, count=2, after=TILE),
    _inverse(
        "NumPy ignores an upper limit",
        "_numpy.py",
        r"else 2\.79252\d+",
        "else 99.0",
        BREAKS,
        count=2,
        after="def inverse(",
    ),
    _inverse("limits are a hundredth too wide", DOUBLE, r"2\.79252\d+", "2.8025", BREAKS, count=2),
    # Solutions that cannot be.
    _inverse(
        "scalar solves beyond reach", DOUBLE, r"\(t70 < t74\) \? 1\.0 : 0\.0", "1.0", "out of reach|differs|not finite"
    ),
    _inverse(
        "float solves beyond reach",
        SINGLE,
        r"\(t70 < t74\) \? 1\.0F : 0\.0F",
        "1.0F",
        "out of reach|differs|not finite",
        real="float",
    ),
    _inverse(
        "scalar takes what is not a rotation",
        DOUBLE,
        r"\(t45 < 9e-12\)",
        "(t45 < 9e+12)",
        "with a rotation|with a reflection",
    ),
    _inverse(
        "float takes what is not a rotation",
        SINGLE,
        r"\(t45 < 9e-08F\)",
        "(t45 < 9e+08F)",
        "with a rotation|with a reflection",
        real="float",
    ),
    _inverse(
        "a tolerance of rotations a hundred times too wide",
        DOUBLE,
        r"\(t45 < 9e-12\)",
        "(t45 < 9e-4)",
        "scaled|sheared",
    ),
    _inverse(
        "batch takes reflections",
        BATCH,
        r"9e-12, t5, 0\.0",
        "9e+12, t5, 0.0",
        "with a rotation|with a reflection",
        after=TILE,
    ),
    _inverse(
        "an infinite position is solved",
        DOUBLE,
        r"valid\[1\] = t\d+;",
        "valid[1] = (t4 > 1e300) ? 1.0 : t120;",
        "with an infinity",
    ),
    # What solutions are.
    _inverse(
        "the elbow is off by 1e-4 in float",
        SINGLE,
        r"solutions\[1\] = t94;",
        "solutions[1] = t94 + 1e-4F;",
        "differs",
        real="float",
    ),
    _inverse(
        "a whole turn too many", DOUBLE, r"solutions\[0\] = t90;", "solutions[0] = t90 + 6.283185307179586;", BREAKS
    ),
    _inverse("branches in the other order", DOUBLE, r"solutions\[(\d)\]", r"solutions[(\1 + 3) % 6]", "", count=6),
    _inverse(
        "names of branches exchanged",
        "__init__.py",
        r'"elbow up",\s+"elbow down"',
        '"elbow down", "elbow up"',
        "which is not elbow",
        after="BRANCHES",
    ),
    # The nearest solution.
    _inverse(
        "nearest takes the farthest",
        "_inverse.py",
        r"distances\.argmin",
        "np.where(valid, distances, -1).argmax",
        "is nearer",
        after="def _nearest",
    ),
    _inverse(
        "nearest adds no whole turns",
        "_inverse.py",
        r"np\.round\(\(wanted - solutions\) / turns\)",
        "0 * solutions",
        "is nearer",
        after="",
    ),
    _inverse(
        "nearest adds turns beyond the limits",
        "_inverse.py",
        r"np\.maximum\(most, 0\)\)",
        "np.maximum(most, 0) + 1)",
        "breaks a limit|is nearer",
        after="",
    ),
    _inverse("nearest takes NaN", "_inverse.py", r" & is_near", "", "near to a joint value of nan", after=""),
    _inverse(
        "the limits of nearest are others",
        "__init__.py",
        r"limits=LIMITS,",
        "limits=(None, None, None),",
        "breaks a limit|is nearer",
        after="",
    ),
    # The search.
    _search(
        "searches for what is not a pose",
        r"is_pose\(base_T_tool\) == 0",
        "is_pose(base_T_tool) == 2",
        "searches for targets with",
    ),
    _search(
        "takes reflections",
        r"off\[3 \+ i\] = z\[i\] - across;",
        "off[3 + i] = 0;",
        "searches for targets with",
        real="float",
    ),
    _search("keeps to no budget", r"evaluations >= search->budget", "evaluations < 0", "more steps than allowed"),
    _search("takes all steps", r"iteration < steps", "iteration < ITERATIONS", "more steps than allowed"),
    _search(
        "a limit is passed",
        r"next > highest\[j\]\) \? highest\[j\]",
        "next > highest[j]) ? highest[j] + 1",
        "break limits|solves only",
    ),
    _search(
        "NumPy searches for what is not a pose",
        r"_are_poses\(targets\)",
        "np.ones(count, bool)",
        "searches for targets with",
        file="_search.py",
    ),
)
