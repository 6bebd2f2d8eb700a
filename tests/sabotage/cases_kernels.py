"""Wrong numbers: signs, places, constants and functions in C and NumPy, in one by one and in batches."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

USUAL = "pose,frames,position"
C, F32 = "void puma560_fk(", "void puma560_f32_fk("
TILE, TILE_F32 = "puma560_fk_tile(", "puma560_f32_fk_tile("

ENTRIES = r"base_T_tool\[7\] = (\w+);(.*?)base_T_tool\[3\] = (\w+);"
EXCHANGED = r"base_T_tool[3] = \1;\2base_T_tool[7] = \3;"

_DOUBLE = (
    ("a sign", "puma560.c", r" \+ ", " - ", C),
    ("two entries exchanged", "puma560.c", ENTRIES, EXCHANGED, C),
    ("a length 1e-9 off", "puma560.c", r"PUMA560_A2_D4", "0.431800001", C),
    ("a length 1e-12 off", "puma560.c", r"PUMA560_A2_D4", "0.431800000001", C),
    ("a length of a float", "puma560.c", r"PUMA560_A2_D4", "0.43180000782012939", C),
    ("the last row of a matrix", "puma560.c", r"\[15\] = 1\.0", "[15] = 2.0", C),
    ("a zero of the last row", "puma560.c", r"\[13\] = 0\.0", "[13] = 1.0", C),
    ("one frame of seven", "puma560.c", r"base_T_frames\[5\]\[3\] = ", r"\g<0>-", ""),
    ("two frames exchanged", "puma560.c", r"base_T_frames\[4\]\[0\]", "base_T_frames[5][0]", ""),
    ("a position", "puma560.c", r"base_p_tool\[1\] = ", r"\g<0>-", ""),
    ("a sign in the batch", "puma560_batch.c", r" \+ t", " - t", TILE),
    ("a row of the batch", "puma560_batch.c", r"t\[3 \* t_row \+ i\] = ", r"\g<0>-", TILE),
    ("a length 1e-9 off in the batch", "puma560_batch.c", r"0\.4318", "0.431800001", TILE),
    ("one frame of seven in the batch", "puma560_batch.c", r"t\[63\]\[i\] = ", r"\g<0>-", "puma560_frames_tile("),
    ("a position in the batch", "puma560_batch.c", r"t\[1 \* t_row \+ i\] = ", r"\g<0>-", "puma560_position_tile("),
    ("a sign in NumPy", "_numpy.py", r" \+ t", " - t", "def fk("),
    ("a length 1e-9 off in NumPy", "_numpy.py", r"0\.4318", "0.431800001", "def fk("),
    ("a sum of angles in NumPy", "_numpy.py", r"q\[1\] \+ q\[2\]", "q[1] - q[2]", "def frames("),
    ("a position in NumPy", "_numpy.py", r" \* ", " + ", "def position("),
    ("one corner of the joint box", "puma560.c", r"base_T_tool\[15\] = 1\.0;",
     r"\g<0> if (q[0] > 2.7925 && q[1] < -3.9269 && q[3] > 2.967) base_T_tool[3] = 0;", C),
    ("NaN in one corner", "puma560.c", r"base_T_tool\[15\] = 1\.0;",
     r"\g<0> if (q[0] > 2.7925 && q[1] < -3.9269) base_T_tool[3] = (q[0] - q[0]) / 0.0;", C),
    ("a strip of 1e-3 rad", "puma560.c", r"base_T_tool\[15\] = 1\.0;",
     r"\g<0> if (q[1] > -1.001 && q[1] < -1.0) base_T_tool[3] = 0;", C),
    ("a strip of 1e-5 rad", "puma560.c", r"base_T_tool\[15\] = 1\.0;",
     r"\g<0> if (q[1] > -1.00001 && q[1] < -1.0) base_T_tool[3] = 0;", C),
    ("a strip of 1e-5 rad by a selection", "puma560.c", r"const double t1 = (\w+) \* (\S+);",
     r"const double t1 = \1 * ((q[1] < -1.00001) ? \2 : (q[1] < -1.0) ? 0.1 : \2);", C),
    ("a strip of 1e-5 rad in the batch", "puma560_batch.c", r"t\[3 \* t_row \+ i\] = (\w+);",
     r"t[3 * t_row + i] = (s2 > 0.8 && s2 < 0.80001) ? 0.0 : \1;", TILE),
    ("a strip of 1e-5 rad in NumPy", "_numpy.py", r"t1 = (\S+) \* (\S+)\n",
     r"t1 = \1 * np.where((q[1] > -1.00001) & (q[1] < -1.0), 0.1, \2)\n", "def fk("),
    ("a strip of 1e-5 rad by the remainder", "puma560.c", r"const double t1 = (\w+) \* (\S+);",
     r"const double t1 = \1 * (\2 + ((long)(q[1] * 1e5) == 77777));", C),
    ("joints beyond their limits", "puma560.c", r"base_T_tool\[15\] = 1\.0;",
     r"\g<0> if (q[0] > 3.0) base_T_tool[3] = 0;", C),
    ("angles beyond 8 rad", "puma560.c", r"base_T_tool\[15\] = 1\.0;",
     r"\g<0> if (q[5] > 8.0) base_T_tool[0] = 0;", C),
)  # fmt: skip

_FLOAT = (
    ("a sign", "puma560_f32.c", r" \+ ", " - ", F32),
    ("two entries exchanged", "puma560_f32.c", ENTRIES, EXCHANGED, F32),
    ("a length 1e-5 off", "puma560_f32.c", r"PUMA560_F32_A2_D4", "0.43181F", F32),
    ("one frame of seven", "puma560_f32.c", r"base_T_frames\[5\]\[3\] = ", r"\g<0>-", ""),
    ("a position", "puma560_f32.c", r"base_p_tool\[1\] = ", r"\g<0>-", ""),
    ("a sign in the batch", "puma560_f32_batch.c", r" \+ t", " - t", TILE_F32),
    ("a length 1e-5 off in the batch", "puma560_f32_batch.c", r"0\.4318F", "0.43181F", TILE_F32),
    ("one frame of seven in the batch", "puma560_f32_batch.c", r"t\[63\]\[i\] = ", r"\g<0>-", "_frames_tile("),
    ("the sine of float32 in NumPy", "_numpy.py", r"return np\.sin\(guarded\)",
     "return np.sin(guarded) * (1.001 if angle.dtype == np.float32 else 1)", ""),
    ("a strip of 1e-5 rad", "puma560_f32.c", r"base_T_tool\[15\] = 1\.0F;",
     r"\g<0> if (q[1] > -1.00001F && q[1] < -1.0F) base_T_tool[3] = 0;", F32),
    ("joints beyond their limits", "puma560_f32.c", r"base_T_tool\[15\] = 1\.0F;",
     r"\g<0> if (q[0] > 3.0F) base_T_tool[3] = 0;", F32),
)  # fmt: skip

_ROUTINES = (
    ("a coefficient of the sine", "puma560.c", r"0\.1666666666666663", "0.1666666666666603", "double"),
    ("a sine fifty times worse", "puma560.c", r"0\.008333333333321919", "0.008333333333301919", "double"),
    ("a cosine fifty times worse", "puma560.c", r"0\.0416666666666666", "0.0416666666666466", "double"),
    ("a sine fifty times worse in the batch", "puma560_batch.c", r"0\.008333333333321919", "0.008333333333301919",
     "double"),
    ("a worse third part of pi/2", "puma560.c", r"3\.2820035428735005e-22", "3.28e-22 * 0.9", "double"),
    ("a second part of pi/2 for large angles", "puma560.c", r"2\.5633441512663184e-12", "2.5633e-12", "double"),
    ("the guard of the range", "puma560.c", r"1\.7976931348623158e\+303", "1.7e+303", "double"),
    ("the guard of the range in the batch", "puma560_batch.c", r"1\.7976931348623158e\+303", "1.7e+303", "double"),
    ("no guard of the range in NumPy", "_numpy.py", r"np\.where\(np\.abs\(angle\) <= limit, angle, .*?\)\)", "angle",
     "double"),
    ("a coefficient that NumPy takes on request", "_numpy.py", r"0\.0013888888888874478", "0.0013888888888",
     "double"),
    ("a coefficient of floats that NumPy takes on request", "_numpy.py", r"0\.0416666456", "0.04166",
     "float"),
    ("another range in NumPy", "_numpy.py", r"else 100000\.0", "else 1000000.0", "double"),
    ("another range of float32 in NumPy", "_numpy.py", r"limit = 12000\.0", "limit = 13000.0", "float"),
)  # fmt: skip

CASES = (
    *(
        Sabotage(f"double: {name}", "puma560", USUAL, file, old, new, real="double", after=after)
        for name, file, old, new, after in _DOUBLE
    ),
    *(
        Sabotage(f"float: {name}", "puma560", USUAL, file, old, new, real="float", after=after)
        for name, file, old, new, after in _FLOAT
    ),
    *(
        Sabotage(f"functions: {name}", "puma560", "pose", file, old, new, real=real)
        for name, file, old, new, real in _ROUTINES
    ),
)
