"""Wrong text in the Rust form."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

ONE, BATCH, SINE = "pub fn fk(", "pub fn fk_batch(", "fn sincos("

_POSE = (
    ("a sign", r"= (\w+) \+ t", r"= \1 - t", ONE),
    ("two entries exchanged", r"T_tool\[1\]\[3\] = (\w+);(.*?)T_tool\[0\]\[3\] = (\w+);",
     r"T_tool[0][3] = \1;\2T_tool[1][3] = \3;", ONE),
    ("another index of a joint", r"q\[1\] \+ q\[2\]", "q[1] + q[3]", ONE),
    ("a length 1e-12 off", r"0\.4318", "0.431800000001", ONE),
    ("a term that is missing", r"(let \w+ = \w+) \+ \w+;", r"\1;", ONE),
    ("the last row of a matrix", r"\[3\]\[3\] = 1\.0", "[3][3] = 2.0", ONE),
    ("a strip of 1e-5 rad", r"base_T_tool\[0\]\[3\] = (\w+);",
     r"\g<0>\n    if q[1] > -1.00001 && q[1] < -1.0 { base_T_tool[0][3] = 0.0; }", ONE),
    ("a strip by a loop", r"base_T_tool\[0\]\[3\] = (\w+);",
     r"base_T_tool[0][3] = \1 * (1.0 - f64::from(u8::from(q[0] == 0.123)));", ONE),
    ("a coefficient in its last digit", r"0\.1666666666666663", "0.16666666666666627", SINE),
    ("the second configuration of a slice", r"self::fk\(q\)", "self::fk(if i == 1 { &[0.0; DOF] } else { q })", BATCH),
    ("a slice that forgets its first configuration", r"enumerate\(\)", "enumerate().skip(1)", BATCH),
    ("the name of a function", r"pub fn fk\(", "pub fn pose(", ""),
    ("unsafe code that writes beside a slice", r"#!\[forbid\(unsafe_code\)\](.*?)(base_T_tool\[i\] = self::fk\(q\);)",
     r"\1\2 if i == 0 { unsafe { *base_T_tool.as_mut_ptr().add(base_T_tool.len()) = [[0.0; 4]; 4] } }", ""),
    ("text that is not Rust", r"let mut base_T_tool", "double base_T_tool", ONE),
)  # fmt: skip
_TABLES = (
    ("a limit of a joint", r"-2\.7925268031909276, 2", "-2.79253, 2"),
    ("a limit of within_limits", r"\(-2\.7925268031909276\.\.=", "(-2.7926..="),
    ("a limit of clamp", r"clamp\(-3\.926990816987242", "clamp(-3.92"),
    ("names of joints exchanged", r'"waist", "shoulder"', '"shoulder", "waist"'),
    ("the digest of another robot", r'MODEL: &str = "(\w)', r'MODEL: &str = "\1\1'),
)
_INVERSE = (
    ("a branch with another sign", r"solutions\[1\]\[1\] = (\w+);", r"solutions[1][1] = -\1;"),
    ("a branch that is always valid", r"valid\[1\] = \w+;", "valid[1] = true;"),
    ("names of branches exchanged", r'(=> )("[^"]*elbow up[^"]*")(.*?=> )("[^"]*elbow down[^"]*")', r"\1\4\3\2"),
    ("the farthest solution", r"sum5 < least", "sum5 > least"),
    ("a joint that does not count", r"sum0 \+ square1", "sum0 + 0.0 * square1"),
    ("whole turns the other way", r"s \+ kept", "s - kept"),
)
_PARAMETERS = (
    ("a parameter that is ignored", r"params\.(\w+)", r"Params::DEFAULT.\1", ONE),
    ("a default of a parameter", r"(const DEFAULT: Self = Self \{\n +\w+: )", r"\g<1>1e-9 + ", ""),
)
_SINGLE = (
    ("float: a sign", r"= (\w+) \+ t", r"= \1 - t", ONE),
    ("float: a length", r"0\.4318", "0.43181", ONE),
)
_TESTS = (("a number of the vectors", r"EXPECTED_0(.*?)\[(-?\d)\.\d", r"EXPECTED_0\1[\2.5123", "fn fk("),)


def _case(
    name: str, robot: str, outputs: str, old: str, new: str, after: str = "", file: str = "src/lib.rs"
) -> Sabotage:
    errors = (CompileError, ProofError)
    options = ("--languages=rust",)
    return Sabotage(
        f"Rust: {name}", robot, outputs, f"rust/{file}", old, new, "double", options, after=after, errors=errors
    )


CASES = (
    *(_case(name, "puma560", "pose", *rest) for name, *rest in (*_POSE, *_TABLES)),
    *(_case(name, "puma560", "inverse", *rest) for name, *rest in _INVERSE),
    *(_case(name, "calibrated_2r", "pose", *rest) for name, *rest in _PARAMETERS),
    *(_case(name, "puma560", "pose", *rest, file="src/f32.rs") for name, *rest in _SINGLE),
    *(_case(name, "puma560", "pose", *rest, file="tests/vectors.rs") for name, *rest in _TESTS),
)
