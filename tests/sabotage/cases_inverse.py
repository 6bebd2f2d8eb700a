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


def _nearest(
    name: str,
    file: str,
    old: str,
    new: str,
    message: str,
    *,
    real: str = "double",
    count: int = 1,
    after: str = "_inverse_nearest",
) -> Sabotage:
    return _inverse(f"nearest: {name}", file, old, new, message, real=real, count=count, after=after)


def _search(name: str, old: str, new: str, message: str, *, real: str = "double", file: str = "") -> Sabotage:
    named = file or (SEARCH if real == "double" else SINGLE_SEARCH)
    return Sabotage(f"search: {name}", ARM, "pose,numeric_inverse", named, old, new, real=real, message=message)


MISSES, BREAKS = "misses the joint vectors", "that break a limit"

CASES = (
    # Solutions that are not there.
    _inverse(
        "float is never valid", SINGLE, r"valid\[(\d)\] = t\d+;", r"valid[\1] = 0U;", MISSES, real="float", count=2
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
    _inverse("float loses a branch", SINGLE, r"valid\[1\] = t\d+;", "valid[1] = 0U;", MISSES, real="float"),
    _inverse("double loses a branch", DOUBLE, r"valid\[0\] = t\d+;", "valid[0] = 0U;", MISSES),
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
        "scalar solves beyond reach", DOUBLE, r"\(t70 < t74\) \? 1U : 0U", "1U", "out of reach|differs|not finite"
    ),
    _inverse(
        "float solves beyond reach",
        SINGLE,
        r"\(t70 < t74\) \? 1U : 0U",
        "1U",
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
        "valid[1] = (t4 > 1e300) ? 1U : t120;",
        "with an infinity",
    ),
    # What solutions are.
    _inverse(
        "the elbow is off by 1e-4 in float",
        SINGLE,
        r"solutions\[0\]\[1\] = t94;",
        "solutions[0][1] = t94 + 1e-4F;",
        "differs",
        real="float",
    ),
    _inverse(
        "a whole turn too many",
        DOUBLE,
        r"solutions\[0\]\[0\] = t90;",
        "solutions[0][0] = t90 + 6.283185307179586;",
        BREAKS,
    ),
    _inverse("branches in the other order", DOUBLE, r"solutions\[(\d)\]\[", r"solutions[1 - \1][", "", count=6),
    _inverse(
        "names of branches exchanged",
        "__init__.py",
        r'"elbow up",\s+"elbow down"',
        '"elbow down", "elbow up"',
        "which is not elbow",
        after="BRANCHES",
    ),
    # The nearest solution.
    # Self-tests that do not look at the choice.
    _nearest(
        "a self-test that accepts any choice",
        f"{ARM}_selftest.c",
        r"worst = flat_arm_worst_part\(worst, chosen[^;]*;",
        "(void)extents;",
        "passes with number 0 of inverse_nearest wrong",
        after="_choice(",
    ),
    _nearest(
        "a self-test of floats that forgets the choice",
        f"{ARM}_f32_selftest.c",
        r"nearest = apart;",
        "nearest = nearest;",
        "passes with number 0 of inverse_nearest wrong",
        real="float",
        after="_selftest_inverse(void)",
    ),
    _nearest(
        "a self-test that takes what is too far away",
        f"{ARM}_selftest.c",
        r"== 0\) \? worst : -1\.0",
        "== 0) ? worst : worst",
        "passes with number 0 of inverse_nearest wrong",
        after="_choice(",
    ),
    _nearest(
        "a self-test that takes numbers for nothing",
        f"{ARM}_selftest.c",
        r"\(size >= 0\.0\) \? -1\.0",
        "(size >= 0.0) ? worst",
        "passes with number 0 of inverse_nearest wrong",
        after="_choice(",
    ),
    _nearest("a turn too many", DOUBLE, r"= within \* turn", "= (within + 1.0) * turn", "is nearer", after="_turned("),
    _nearest("no whole turns", DOUBLE, r"= within \* turn", "= 0.0 * turn", "is nearer", after="_turned("),
    _nearest(
        "float counts turns down instead of to the nearest",
        SINGLE,
        r"turns \+ 12582912",
        "turns - 0.5F + 12582912",
        "is nearer",
        real="float",
        after="_turned(",
    ),
    _nearest(
        "does not turn back at a limit",
        DOUBLE,
        r"nearest > highest\) \? 1",
        "nearest > 99.0) ? 1",
        "is nearer",
        after="_turned(",
    ),
    _nearest(
        "ignores the limits of the hand",
        DOUBLE,
        r"(_turned\(s\[2\], q0\[2\], \S+, \S+,) \S+ \S+;",
        r"\1 -99.0, 99.0);",
        "breaks a limit",
    ),
    _nearest(
        "takes the second nearest", DOUBLE, r"\(sum2 < least\)", "((sum2 > least) || (least > 1e300))", "is nearer"
    ),
    _nearest("takes the last solution", DOUBLE, r"\(sum2 < least\)", "(sum2 < 1e300)", "is nearer"),
    _nearest("a joint does not count", DOUBLE, r"apart1 \* apart1", "apart1 * 0.0", "is nearer"),
    _nearest(
        "a joint counts twice in float",
        SINGLE,
        r"apart2 \* apart2",
        "apart2 * apart2 * 2.0F",
        "is nearer",
        real="float",
    ),
    _nearest(
        "a joint of another branch", DOUBLE, r"chosen\[1\] = moved1;", "chosen[1] += moved1;", "is nearer|none of"
    ),
    _nearest(
        "takes what is not valid",
        DOUBLE,
        r"valid\[branch\] != 0U",
        "valid[branch] <= 1U",
        "find what is valid|breaks a limit",
    ),
    _nearest("one is always found", DOUBLE, r"return serves;", "return 1;", "does not find what is valid"),
    _nearest("numbers where there is none", DOUBLE, r"chosen\[2\] \+ nothing", "chosen[2]", "gives numbers"),
    _nearest(
        "is near to what is far away",
        DOUBLE,
        r"\(\(q0\[1\] >= \S+ && \(q0\[1\] <= \S+ \?",
        "1 ?",
        "near to a joint value of 1e\\+16",
    ),
    _nearest(
        "the batch takes the last solution",
        BATCH,
        r"distance < before",
        "distance < 1e300",
        "is nearer",
        count=0,
        after="_take_nearer(",
    ),
    _nearest(
        "the float batch has a joint of another branch",
        SINGLE_BATCH,
        r"\(distance < before\) \? moved0 : ",
        "(distance < 1e30F) ? moved0 : ",
        "is nearer|none of",
        real="float",
        after="_take_nearer(",
    ),
    _nearest("the batch reads another joint vector", BATCH, r"\(first \+ i\) \* q0_pose", "i * q0_pose", "is nearer"),
    _nearest(
        "the batch writes rows elsewhere",
        BATCH,
        r"joint \* q_stride \+ place",
        "joint * q_stride + i",
        "gives another result",
    ),
    _nearest(
        "NumPy takes the last solution",
        "_runtime/_nearest.py",
        r"distance < least",
        "distance < 1e300",
        "NumPy .* is nearer",
        after="",
    ),
    _nearest(
        "NumPy adds no whole turns", "_runtime/_nearest.py", r"np\.round\(", "0 * (", "NumPy .* is nearer", after=""
    ),
    _nearest(
        "NumPy is near to what is far",
        "_runtime/_nearest.py",
        r" & self\._are_near\(q0\)",
        "",
        "near to a joint value",
        after="",
    ),
    _nearest(
        "NumPy has other limits",
        "__init__.py",
        r"-6\.10865\d+, 6\.98131\d+",
        "-99.0, 99.0",
        "breaks a limit",
        after="turnings",
    ),
    _nearest(
        "NumPy has another turn",
        "__init__.py",
        r"\(6\.283185307179586",
        "(6.2831",
        "is nearer",
        count=3,
        after="turnings",
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
        file="_runtime/_search.py",
    ),
)
