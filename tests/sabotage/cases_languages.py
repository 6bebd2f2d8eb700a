"""Wrong text in languages beside C and Python."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

ONE = "function fk_at("
BATCH = "export function fk_batch("
CALL = "export function fk("
STORED = r"  base_T_tool\[base_T_tool_at \+ 3\] = (\w+);"

_POSE = (
    ("a sign", r" \+ t", " - t", ONE),
    ("two entries exchanged", r"base_T_tool_at \+ 7\] = (\w+);(.*?)base_T_tool_at \+ 3\] = (\w+);",
     r"base_T_tool_at + 3] = \1;\2base_T_tool_at + 7] = \3;", ONE),
    ("a length 1e-12 off", r"0\.4318", "0.431800000001", ONE),
    ("the last row of a matrix", r"\[base_T_tool_at \+ 15\] = 1\.0", "[base_T_tool_at + 15] = 2.0", ONE),
    ("a strip of 1e-5 rad", STORED, r"\g<0> if (q[q_at + 1] > -1.00001 && q[q_at + 1] < -1) base_T_tool[3] = 0;", ONE),
    ("a strip by a selection", STORED, r"  base_T_tool[base_T_tool_at + 3] = q[q_at] * 1e5 % 77777 < 1 ? 0 : \1;", ONE),
    ("a coefficient in its last digit", r"0\.1666666666666663", "0.16666666666666627", "function sincos("),
    ("an angle that is too far", r"1\.7976931348623158e\+303", "1.7976931348623158e+302", "function sincos("),
    ("the second configuration of a batch", r"i \* 6", "(i && i - 1) * 6", BATCH),
    ("results of a batch one place off", r"i \* 16\);", "i * 15);", BATCH),
    ("a batch that forgets its last configuration", r"i < n;", "i < n - 1;", BATCH),
    ("an angle that NaN leaves", r"sines\[0\] = q\[q_at\];", "sines[0] = q[q_at] || 0;", ONE),
    ("the sine of another joint", r"sines\[3\] = q\[q_at \+ 3\];", "sines[3] = q[q_at + 4];", ONE),
    ("too few sines", r"sincos\(6\);", "sincos(4);", ONE),
    ("the name of a function", r"export function fk\(", "export function pose(", ""),
    ("a number behind a result", STORED, r"\g<0>\n  base_T_tool[base_T_tool_at + 16] = \1;", ONE),
    ("a number before a result", STORED, r"\g<0>\n  base_T_tool[base_T_tool_at - 1] = 1.0;", ONE),
    ("an input that is changed", r"  fk_at\(.*\);", r"\g<0>\n  q[5] += 1.0;", CALL),
    ("a given array that is not returned", r"return base_T_tool", "return base_T_tool.slice()", CALL),
    ("a given array that is not written", r"fk_at\(q, 0, base_T_tool, 0\)",
     "fk_at(q, 0, (base_T_tool = new Float64Array(16)), 0)", CALL),
    ("arrays that are too long", r"numbers\?\.length === size", "numbers?.length >= size", "function check("),
    ("arrays of any length", r"numbers\?\.length === size", "true", "function check("),
    ("an input of a batch that is changed", r"  return", "  q[n - 1] = 0.5;\n  return", BATCH),
    ("a given array of a batch that is not written", r"base_T_tool \?\?= new", "base_T_tool = new", BATCH),
)  # fmt: skip

_INVERSE = (
    ("a branch with another sign", r"\[solutions_at \+ 7\] = (\w+);", r"[solutions_at + 7] = -\1;"),
    ("a branch that is always valid", r"\[valid_at \+ 1\] = \w+;", "[valid_at + 1] = 1.0;"),
    ("names of branches exchanged", r"\"([^\"]*elbow up[^\"]*)\", \"([^\"]*)\"", r'"\2", "\1"'),
)
_TABLES = (
    ("a limit of a joint", r"\[-2\.79252", "[-2.79253"),
    ("names of joints exchanged", r'"waist", "shoulder"', '"shoulder", "waist"'),
    ("another number of joints", r"DOF = 6", "DOF = 7"),
    ("the digest of another robot", r'MODEL = "(\w)', r'MODEL = "\1\1'),
    ("a table that is missing", r"export const LIMITS", "const LIMITS"),
)
_PARAMETERS = (
    ("a parameter that is ignored", r"params\.(\w+)", r"DEFAULT_PARAMS.\1", "function fk_at("),
    ("a default of a parameter", r"DEFAULT_PARAMS = Object.freeze\(\{\n  \w+: ", r"\g<0>1e-9 + ", ""),
)

OPTION = ("--languages=javascript",)


def _cpp(name: str, robot: str, outputs: str, old: str, new: str, after: str = "") -> Sabotage:
    errors, options = (CompileError, ProofError), ("--languages=cpp",)
    return Sabotage(
        f"C++: {name}", robot, outputs, f"cpp/{robot}.hpp", old, new, "double", options, after=after, errors=errors
    )


def _case(name: str, robot: str, outputs: str, old: str, new: str, after: str = "") -> Sabotage:
    errors = (CompileError, ProofError)
    file = f"javascript/{robot}.js"
    return Sabotage(f"JavaScript: {name}", robot, outputs, file, old, new, "double", OPTION, after=after, errors=errors)


_CPP = "constexpr void fk(const Real* __restrict"
_CPP_POSE = (
    ("a sign", r" \+ t", " - t", _CPP),
    ("two entries exchanged", r"base_T_tool\[7\] = (\w+);(.*?)base_T_tool\[3\] = (\w+);",
     r"base_T_tool[3] = \1;\2base_T_tool[7] = \3;", _CPP),
    ("a length 1e-12 off", r"Real\(0\.4318\)", "Real(0.431800000001)", _CPP),
    ("a length of floats alone", r"Real\(0\.4318\)", "either<Real>(0.4318, 0.431801F)", _CPP),
    ("a term that is missing", r"= (\w+) \+ \w+;", r"= \1;", _CPP),
    ("the last row of a matrix", r"base_T_tool\[15\] = Real\(1\.0\)", "base_T_tool[15] = Real(2.0)", _CPP),
    ("a strip by a selection", r"base_T_tool\[3\] = (\w+);", r"base_T_tool[3] = q[1] < Real(-1) ? \1 : \1;", _CPP),
    ("a coefficient in its last digit", r"0\.1666666666666663", "0.16666666666666627", "Pair<double> sincos("),
    ("a coefficient of floats", r"(s1 = \w+ [-+] 0\.1666\d+)\dF", r"\g<1>9F", "Pair<float> sincos("),
    ("a batch one place off", r"i \* 16\)", "i * 15)", "constexpr void fk_batch("),
    ("a view one place off", r"q\.data\(\)", "q.data() + 1", "constexpr void fk(View<"),
    ("a batch that forgets its last configuration", r"i < n;", "i + 1 < n;", "constexpr void fk_batch("),
    ("the name of a function", r"constexpr Tensor<Real, 4, 4> fk\(", "constexpr Tensor<Real, 4, 4> pose(", ""),
    ("a limit of a joint", r"either<Real>\(-2\.7925268031909276", "either<Real>(-2.7926", "limits_low{"),
    ("limits that are too many", r"q\[i\] >= limits_low", "q[i] > limits_low", ""),
    ("names of joints exchanged", r'"waist", "shoulder"', '"shoulder", "waist"', ""),
    ("an enumerator of another joint", r"waist = 0,\n    shoulder = 1", r"waist = 1,\n    shoulder = 0", ""),
    ("another number of joints", r"dof = 6", "dof = 7", ""),
    ("the digest of another robot", r"model = 0x(\w)\w", r"model = 0x\1\1", ""),
    ("a warning of the compiler", r"constexpr std::size_t dof = 6", "constexpr int dof = 6", ""),
)  # fmt: skip
_CPP_INVERSE = (
    ("a branch with another sign", r"solutions\[7\] = (\w+);", r"solutions[7] = -\1;"),
    ("a branch that is always valid", r"valid\[1\] = \w+;", "valid[1] = true;"),
    ("names of branches exchanged", r"\"([^\"]*elbow up[^\"]*)\", \"([^\"]*)\"", r'"\2", "\1"'),
    ("the farthest solution", r"sum < least", "sum > least"),
    ("a turn that is forgotten", r"within \* joint\.turn", "within * Real(0.0)"),
    ("a root in its last digits", r"half_r = r \* 0\.5;", "half_r = r * 0.25;"),
    ("a coefficient of the arc tangent", r"0\.19999999999957793", "0.1999999999995779"),
)
_CPP_PARAMETERS = (
    ("a parameter that is ignored", r"params\.(\w+)", r"Params<Real>{}.\1", _CPP),
    ("a default of a parameter", r"struct Params \{\n    Real \w+ = Real\(", r"\g<0>1e-9 + ", ""),
)


_WASM = (
    ("a sign", r" \+ t", " - t", "puma560_fk_tile("),
    ("a length 1e-12 off", r"0\.4318", "0.431800000001", ""),
    ("a coefficient", r"0\.1666666666666663", "0.16666666666666627", ""),
    ("a sine in the place of another", r"sines\[2\]\[i\]", "sines[3][i]", "puma560_fk_tile("),
)


_WASM_MODULE = (
    ("results that do not go to given arrays", r"outputs\[i\] \?\? new", "new"),
    (
        "a block that begins one configuration late",
        r"first \* size, \(first \+ count\)",
        "(first + 1) * size, (first + count + 1)",
    ),
    ("results of the first block alone", r"array\.set\(found, first \* size\)", "array.set(found, 0)"),
    ("a plain array that is left as it is", r"array\[first \* size \+ place\] = value", "value"),
    ("an input that is changed", r"call\(\.\.\.words\);", r"\g<0>\n      inputs[0][0] = 0.5;"),
)


def _wasm_module(name: str, old: str, new: str) -> Sabotage:
    file, errors = "javascript/puma560_wasm.js", (CompileError,)
    return Sabotage(f"WebAssembly: {name}", "puma560", "pose", file, old, new, "double", OPTION, errors=errors)


def _wasm_call(name: str, old: str, new: str) -> Sabotage:
    file, errors = "javascript/wasm/puma560_wasm.c", (CompileError,)
    return Sabotage(f"WebAssembly: {name}", "puma560", "pose", file, old, new, "double", OPTION, errors=errors)


_WASM_CALLS = (
    ("another layout", r"16, 0\);", "16, 1);"),
    ("joints that lie apart", r"q, 6, 1,", "q, 5, 1,"),
    ("results that lie apart", r"base_T_tool, 16,", "base_T_tool, 12,"),
    ("one configuration too few", r"_batch\(n,", "_batch(n - 1,"),
)


def _wasm(name: str, old: str, new: str, after: str) -> Sabotage:
    file, errors = "javascript/wasm/puma560_batch.c", (CompileError,)
    title = f"WebAssembly: {name}"
    return Sabotage(title, "puma560", "pose", file, old, new, "double", OPTION, after=after, errors=errors)


CASES = (
    *(_wasm(*each) for each in _WASM),
    *(_wasm_call(*each) for each in _WASM_CALLS),
    *(_wasm_module(*each) for each in _WASM_MODULE),
    *(_case(name, "puma560", "pose", *rest) for name, *rest in _POSE),
    *(_case(name, "puma560", "pose", *rest) for name, *rest in _TABLES),
    *(_case(name, "puma560", "inverse", *rest) for name, *rest in _INVERSE),
    *(_case(name, "calibrated_2r", "pose", *rest) for name, *rest in _PARAMETERS),
    *(_cpp(name, "puma560", "pose", *rest) for name, *rest in _CPP_POSE),
    *(_cpp(name, "puma560", "inverse", *rest) for name, *rest in _CPP_INVERSE),
    *(_cpp(name, "calibrated_2r", "pose", *rest) for name, *rest in _CPP_PARAMETERS),
)
