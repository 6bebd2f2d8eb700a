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
