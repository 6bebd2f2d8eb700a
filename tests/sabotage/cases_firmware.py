"""What firmware gets beside the kernels: accepted differences of self-tests, the pair, guards against options."""

from __future__ import annotations

from kinegen.errors import CompileError
from tests.sabotage.case import Sabotage

WIDE = "{1e9, 1e9, 1e9, 1e9, 1e9, 1e9}"

_ACCEPTED = (
    ("the part that accepts all", "puma560_vectors.h", r"560_TOLERANCE 1\.0", "560_TOLERANCE 1e9", ""),
    ("the part that accepts nothing", "puma560_vectors.h", r"560_TOLERANCE 1\.0", "560_TOLERANCE 1e-6", ""),
    ("the part of floats that accepts all", "puma560_f32_vectors.h", r"F32_TOLERANCE 1\.0F", "F32_TOLERANCE 1e9F", ""),
    ("a rotation held like a position in mm", "puma560_vectors.h", r"\{\S+,", "{0.1,", "puma560_fk_accepted"),
    ("a rotation of floats", "puma560_f32_vectors.h", r"\{\S+,", "{1.0F,", "puma560_f32_fk_accepted"),
    ("an entry of a frame", "puma560_vectors.h", r"\{\S+,", "{0.1,", "puma560_frames_accepted"),
    ("an entry that accepts nothing", "puma560_vectors.h", r"\{\S+, \S+,", "{1e-15, 1e-25,", "puma560_fk_accepted"),
    ("differences that vanish", "puma560_selftest.c", r"difference / whole", "0.0 * difference / whole", ""),
    ("differences that shrink", "puma560_f32_selftest.c", r"difference / whole", "difference / (whole * 1e9F)", ""),
    ("differences of one entry", "puma560_selftest.c", r"\w+_read\(&\w+_accepted\[[^]]*\]\)",
     r"\g<0> * ((entry == 4) ? 1e9 : 1)", ""),
    ("last rows that may be anything", "puma560_selftest.c", r"\? worst : -1\.0;", "? worst : worst;", "_worst_constant"),
    ("last rows of floats that nobody looks at", "puma560_f32_selftest.c", r"entry < 16", "entry < 12", ""),
    ("one entry of the last rows", "puma560_selftest.c", r"entry = 12", "entry = 13", ""),
    ("main forgets the vectors", "puma560_selftest.c", r"return \(right && ", "return (", "int main"),
    ("main compares with another number", "puma560_selftest.c", r"worst <= PUMA560_TOLERANCE", "worst <= 1e30", "int main"),
    ("a pair that is never good enough", "puma560_vectors.h", r"PAIR_TOLERANCE \d\S+", "PAIR_TOLERANCE 1e-25", ""),
    ("a pair of floats that is never good enough", "puma560_f32_vectors.h", r"PAIR_TOLERANCE \d\S+",
     "PAIR_TOLERANCE 1e-25F", ""),
    ("the sine of a pair", "puma560_vectors.h", r"\{(\S+), (\S+),", r"{\1, 0.125,", "puma560_pairs_expected"),
)  # fmt: skip

_LIMITS = (
    ("a limit that is not within", "puma560.c", r"q\[1\] >= PUMA", "q[1] > PUMA", "puma560_within_limits(", "within_limits gives 0"),
    ("an upper limit of floats", "puma560_f32.c", r"q\[4\] <= PUMA", "q[4] < PUMA", "puma560_f32_within_limits(", "within_limits gives 0"),
    ("NaN that is within", "puma560_f32.c", r"\(\(q\[2\] >= (\w+\[2\])\) && \(q\[2\] <= (\w+\[2\])\)\)",
     r"(!((q[2] < \1) || (q[2] > \2)))", "puma560_f32_within_limits(", "within_limits gives 1"),
    ("a joint that is not looked at", "puma560.c", r"within = \(\(q\[5\][^;]*;", "", "puma560_within_limits(", "within_limits gives 1"),
    ("clamping to the other limit", "puma560.c", r"\(q\[0\] < PUMA560_LIMITS_LOW\[0\]\) \? PUMA560_LIMITS_LOW", "(q[0] < PUMA560_LIMITS_LOW[0]) ? PUMA560_LIMITS_HIGH",
     "void puma560_clamp(", "clamp gives"),
    ("clamping of another joint", "puma560_f32.c", r"above4 > PUMA560_F32_LIMITS_HIGH\[4\]", "above4 > PUMA560_F32_LIMITS_HIGH[3]", "void puma560_f32_clamp(", "clamp gives"),
    ("clamping that loses NaN", "puma560.c", r"\(q\[1\] < (\w+\[1\])\) \? \w+\[1\] : q\[1\]", r"(q[1] >= \1) ? q[1] : \1", "void puma560_clamp(", "clamp gives"),
    ("a limit rounded inwards", "puma560.c", r"(-?\d\.\d+?)\d\d,", r"\g<1>,", "PUMA560_LIMITS_LOW[", "LIMITS_LOW holds"),
)  # fmt: skip

_GUARDS = (
    ("a guard that refuses what is right", "puma560.c", r"#if defined\(__FAST_MATH__\)", "#if !defined(__FAST_MATH__)"),
    ("a guard of the batch", "puma560_f32_batch.c", r"#if defined\(__FAST_MATH__\)", "#if !defined(__FAST_MATH__)"),
    ("constants that are said to be short", "puma560_batch.c", r"\(int\)0\.9+", "(int)1.0"),
)

CASES = (
    *(
        Sabotage(f"firmware: {name}", "puma560", "pose,frames", file, old, new, after=after)
        for name, file, old, new, after in _ACCEPTED
    ),
    *(
        Sabotage(f"firmware: {name}", "puma560", "pose,frames", file, old, new, after=after, message=message)
        for name, file, old, new, after, message in _LIMITS
    ),
    *(
        Sabotage(f"firmware: {name}", "puma560", "pose,frames", file, old, new, errors=(CompileError,))
        for name, file, old, new in _GUARDS
    ),
    Sabotage(
        "firmware: angles held like strokes",
        "puma560",
        "pose,inverse",
        "puma560_selftest.c",
        r"(extents\[\w+\] \w+ = )\{[^}]*\}",
        rf"\g<1>{WIDE}",
    ),
    Sabotage(
        "firmware: solutions that are never near enough",
        "puma560",
        "pose,inverse",
        "puma560_vectors.h",
        r"INVERSE_TOLERANCE \d\S+",
        "INVERSE_TOLERANCE 1e-25",
    ),
)
