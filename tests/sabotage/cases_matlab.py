"""Wrong text in the MATLAB form."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

DOUBLE, SINGLE, SINE = "= in_double(q, n", "= in_single(q, n", "= sincos_double("
STORED = r"base_T_tool\(13, :\) = (\w+);"

_POSE = (
    ("a sign", r"= (\w+) \+ t", r"= \1 - t", DOUBLE),
    ("two entries exchanged", r"base_T_tool\(13, :\) = (\w+);(.*?)base_T_tool\(14, :\) = (\w+);",
     r"base_T_tool(14, :) = \1;\2base_T_tool(13, :) = \3;", DOUBLE),
    ("another row of the joint vector", r"q\(2, :\) \+ q\(3, :\)", "q(2, :) + q(4, :)", DOUBLE),
    ("a length 1e-12 off", r"0\.4318", "0.431800000001", DOUBLE),
    ("a matrix product", r"(\w+) \.\* (\w+);\n", r"\1 * \2;\n", DOUBLE),
    ("the last row of a matrix", r"base_T_tool\(16, :\) = 1\.0", "base_T_tool(16, :) = 2.0", DOUBLE),
    ("a strip of 1e-5 rad", STORED, r"\g<0>\nbase_T_tool(13, q(2, :) > -1.00001 & q(2, :) < -1) = 0;", DOUBLE),
    ("a strip by a comparison", STORED, r"base_T_tool(13, :) = \1 .* (q(1, :) ~= 0.123);", DOUBLE),
    ("a coefficient in its last digit", r"0\.1666666666666663", "0.16666666666666627", SINE),
    ("an angle that is too far", r"1\.7976931348623158e\+303", "1.7976931348623158e+302", SINE),
    ("a matrix that is turned", r"reshape\(base_T_tool, 4, 4, n\)",
     "permute(reshape(base_T_tool, 4, 4, n), [2, 1, 3])", ""),
    ("configurations in another order", r"base_T_tool = (reshape\(.*?, n\));", r"base_T_tool = flip(\1, 3);", ""),
    ("doubles for singles", r"if isa\(q, 'single'\)", "if false", ""),
    ("text that is not MATLAB", r"n = size\(q, 2\);", "n = size(q, 2;", ""),
)  # fmt: skip
_SINGLE = (
    ("single: a sign", r"= (\w+) \+ t", r"= \1 - t"),
    ("single: a length", r"0\.4318", "0.43181"),
    ("single: a constant that is a double", r"single\(0\.4318\)", "0.43181"),
)
_TABLES = (
    ("a limit of a joint", r"\[-2\.7925268031909276", "[-2.7926"),
    ("names of joints exchanged", r"'waist', 'shoulder'", "'shoulder', 'waist'"),
    ("another number of joints", r"DOF = 6", "DOF = 7"),
    ("the digest of another robot", r"MODEL = '(\w)", r"MODEL = '\1\1"),
    ("a table that is missing", r"found\.LIMITS = [^\n]*\n", ""),
)
_INVERSE = (
    ("inverse", "a branch with another sign", r"solutions\(8, :\) = (\w+);", r"solutions(8, :) = -\1;"),
    ("inverse", "a branch that is always valid", r"valid\(2, :\) = \w+;", "valid(2, :) = 1.0;"),
    ("inverse", "a selection the other way", r"less = \(a < b\)", "less = (b < a)"),
    ("inverse", "a root in its last digit", r"r = sqrt\(x \+ 0\);", "r = sqrt(x) .* (1 + eps);"),
    ("info", "names of branches exchanged", r"('[^']*elbow up[^']*'), ('[^']*')", r"\2, \1"),
    ("inverse_nearest", "the farthest solution", r"sum6 < least", "sum6 > least"),
    ("inverse_nearest", "a joint that does not count", r"sum1 \+ square2", "sum1 + 0 * square2"),
    ("inverse_nearest", "whole turns the other way", r"moved = s \+ kept", "moved = s - kept"),
    ("inverse_nearest", "a solution near to NaN", r"q\(:, ~exists\) = NaN;", ""),
)
_OTHERS = (
    ("within_limits", "a limit that does not count", r"all\(q >= low", "all(q > low"),
    ("clamp", "NaN as a limit", r"clamped\(q < low\) = low\(q < low\);", "clamped = max(q, low);"),
)
_PARAMETERS = (
    ("a parameter that is ignored", "fk", r"params\.(\w+)", "1.0", DOUBLE),
    ("a default of a parameter", "default_params", r"params\.\w+ = ", r"\g<0>1e-9 + ", ""),
)
_MEX = (
    ("a sign", "csrc/puma560_mex_batch.c", r"= (\w+) \+ t", r"= \1 - t", "puma560_mex_fk_tile("),
    ("a length 1e-12 off", "csrc/puma560_mex_batch.c", r"0\.4318", "0.431800000001", ""),
    ("two entries exchanged", "csrc/puma560_mex_batch.c", r"t\[13 \* t_row \+ i\] = (\w+);(.*?)t\[12 \* t_row \+ i\] = (\w+);",
     r"t[12 * t_row + i] = \1;\2t[13 * t_row + i] = \3;", ""),
    ("a length of singles", "csrc/puma560_mex_f32_batch.c", r"0\.4318", "0.43181", ""),
    ("pieces that overlap", "puma560_mex.c", r"16 \* first, 16,", "15 * first, 16,", ""),
    ("a piece that is left out", "puma560_mex.c", r"piece < pieces", "piece + 1 < pieces", ""),
    ("another class", "puma560_mex.c", r"mxSINGLE_CLASS : mxDOUBLE", "mxDOUBLE_CLASS : mxDOUBLE", ""),
    ("a number behind its results", "csrc/puma560_mex_batch.c", r"\n\}\n", "\n    base_T_tool[n * 16] = 0.0;\n}\n",
     "void puma560_mex_fk_batch("),
    ("a number before its results", "csrc/puma560_mex_batch.c", r"\n\}\n", "\n    base_T_tool[-1] = 0.0;\n}\n",
     "void puma560_mex_fk_batch("),
    ("an input that is changed", "csrc/puma560_mex_batch.c", r"\n\}\n", "\n    ((double *)q)[2] = 0.0;\n}\n",
     "void puma560_mex_fk_batch("),
    ("a warning of the compiler", "puma560_mex.c", r"size_t n = 0;", "size_t n = 0; int unused;", ""),
)  # fmt: skip


def _case(name: str, robot: str, outputs: str, file: str, old: str, new: str, after: str = "") -> Sabotage:
    errors, options = (CompileError, ProofError), ("--languages=matlab",)
    path = f"matlab/{file}"
    return Sabotage(f"MATLAB: {name}", robot, outputs, path, old, new, "double", options, after=after, errors=errors)


CASES = (
    *(_case(name, "puma560", "pose", "+puma560/fk.m", *rest) for name, *rest in _POSE),
    *(_case(name, "puma560", "pose", "+puma560/fk.m", *rest, SINGLE) for name, *rest in _SINGLE),
    *(_case(name, "puma560", "pose", "+puma560/info.m", *rest) for name, *rest in _TABLES),
    *(_case(name, "puma560", "inverse", f"+puma560/{file}.m", *rest) for file, name, *rest in _INVERSE),
    *(_case(name, "puma560", "pose", f"+puma560/{file}.m", *rest) for file, name, *rest in _OTHERS),
    *(_case(name, "calibrated_2r", "pose", f"+calibrated_2r/{file}.m", *rest) for name, file, *rest in _PARAMETERS),
    *(_case(f"MEX: {name}", "puma560", "pose", *rest) for name, *rest in _MEX),
    _case(
        "a number of the vectors",
        "puma560",
        "pose",
        "run_tests.m",
        r"'rows', \[ \.\.\.\n +-?\d\.",
        r"\g<0>5123",
        "check('fk'",
    ),
)
