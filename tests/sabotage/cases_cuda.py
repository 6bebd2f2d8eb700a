"""Wrong text in the CUDA form."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

ONE, SINE = "_FUNCTION void fk(", "Pair<double> sincos("
ROWS, MAJOR = "void fk_rows(", "void fk_joint_major("

_POSE = (
    ("a sign", r" \+ t", " - t", ONE),
    ("two entries exchanged", r"base_T_tool\[7\] = (\w+);(.*?)base_T_tool\[3\] = (\w+);",
     r"base_T_tool[3] = \1;\2base_T_tool[7] = \3;", ONE),
    ("a length 1e-12 off", r"Real\(0\.4318\)", "Real(0.431800000001)", ONE),
    ("a term that is missing", r"= (\w+) \+ \w+;", r"= \1;", ONE),
    ("the last row of a matrix", r"base_T_tool\[15\] = Real\(1\.0\)", "base_T_tool[15] = Real(2.0)", ONE),
    ("a strip by a selection", r"base_T_tool\[3\] = (\w+);", r"base_T_tool[3] = q[1] < Real(-1) ? 0 : \1;", ONE),
    ("a coefficient in its last digit", r"0\.1666666666666663", "0.16666666666666627", SINE),
    ("the name of a function", r"void fk\(", "void pose(", ""),
    ("a limit of a joint", r"either<Real>\(-2\.7925268031909276", "either<Real>(-2.7926", "bool within_limits("),
    ("a limit of clamp", r"either<Real>\(-2\.7925268031909276", "either<Real>(-2.7926", "void clamp("),
    ("an enumerator of another joint", r"waist = 0,\n    shoulder = 1", r"waist = 1,\n    shoulder = 0", ""),
    ("another number of joints", r"dof = 6", "dof = 7", ""),
    ("the digest of another robot", r"model = 0x(\w)\w", r"model = 0x\1\1", ""),
    ("last rows that are kept", r"index % 16 < kept", "index % 16 <= kept", ""),
)  # fmt: skip
_KERNELS = (
    ("a warp that meets too late", r"__syncwarp\(\);", "", ROWS),
    ("a warp that does not meet after its results", r"\}\n        __syncwarp\(\);\n        scatter", "}\n        scatter", ROWS),
    ("a width that is too small", r"rows \+ 0, q \+ base", "rows + 1, q + base", ROWS),
    ("a last configuration that is forgotten", r"lane < count", "lane < count - 1", ROWS),
    ("a step of the grid", r"const long long step = .*;", "const long long step = 1LL << 40;", ROWS),
    ("a stride of rows", r"base \* q_stride", "base * 6", ROWS),
    ("a stride of columns", r"q\[3 \* q_stride \+ i\]", "q[3 * n + i]", MAJOR),
    ("a column of results", r"base_T_tool \+ i, base_T_tool_stride", "base_T_tool + i, n", MAJOR),
    ("a kernel of the other layout", r"fk_rows<double, 12>", "fk_rows<double, 16>", ""),
    ("a kernel of the other type", r"fk_rows<float, 16>\(n", "fk_joint_major<float>(n", ""),
    ("the name of a kernel", r"puma560_f32_fk_rows\(", "puma560_f32_pose_rows(", ""),
)  # fmt: skip
_INVERSE = (
    ("a branch with another sign", r"solutions\[7\] = (\w+);", r"solutions[7] = -\1;"),
    ("a branch that is always valid", r"valid\[1\] = \w+;", "valid[1] = true;"),
    ("a root in its last digits", r"half_r = r \* 0\.5;", "half_r = r * 0.25;"),
    ("a coefficient of the arc tangent", r"0\.19999999999957793", "0.1999999999995779"),
)
_PARAMETERS = (
    ("a parameter that is ignored", r"params\.(\w+)", r"Params<Real>{}.\1", ONE, "cuh"),
    ("a default of a parameter", r"struct Params \{\n    Real \w+ = Real\(", r"\g<0>1e-9 + ", "", "cuh"),
    ("parameters in another order", r"given\[0\]", "given[1]", "params_of(", "cu"),
)


def _case(name: str, robot: str, outputs: str, old: str, new: str, after: str = "", end: str = "cuh") -> Sabotage:
    errors, options = (CompileError, ProofError), ("--languages=cuda",)
    return Sabotage(
        f"CUDA: {name}", robot, outputs, f"cuda/{robot}.{end}", old, new, "double", options, after=after, errors=errors
    )


CASES = (
    *(_case(name, "puma560", "pose", *rest) for name, *rest in _POSE),
    *(_case(name, "puma560", "pose", *rest, end="cu") for name, *rest in _KERNELS),
    *(_case(name, "puma560", "inverse", *rest) for name, *rest in _INVERSE),
    *(_case(name, "calibrated_2r", "pose", *rest) for name, *rest in _PARAMETERS),
)
