"""Tables, macros, defaults, test vectors, self-tests and firmware packages."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

USUAL = "pose,frames,position"
EITHER = (ProofError, CompileError)
"""Without a macro that others need, a file does not compile."""

_TABLES = (
    ("DOF", "puma560", USUAL, "__init__.py", r"^DOF = 6", "DOF = 7"),
    ("two joints exchanged", "puma560", USUAL, "__init__.py", r'"waist",\n    "shoulder"', '"shoulder",\n    "waist"'),
    ("a limit", "puma560", USUAL, "__init__.py", r"-2\.7925268", "-2.7925267"),
    ("a limit that is missing", "puma560", USUAL, "__init__.py", r"\(-2\.79.*?\),", "None,"),
    ("two frames exchanged", "puma560", USUAL, "__init__.py", r'"forearm",\n    "wrist_bend"',
     '"wrist_bend",\n    "forearm"'),
    ("two tips exchanged", "hand", "position", "__init__.py", r'"thumb_tip",\n    "index_tip"',
     '"index_tip",\n    "thumb_tip"'),
    ("names of other tips", "hand", "position", "__init__.py", "names=TIPS", "names=TIPS[::-1]"),
    ("parts of other tips", "hand", "position", "_runtime/_names.py", r"\(\.\.\., i, ", "(..., i - 1, "),
    ("parts of other tips, joint-major", "hand", "position", "_runtime/_names.py", r"slice\(i \* size", "slice(i * size - size"),
    ("a type with another argument", "puma560", USUAL, "__init__.pyi", r"threads: int = 1", "workers: int = 1"),
    ("a type without a kernel", "puma560", USUAL, "__init__.pyi", r"position: _Kernel_position", "location: Any"),
    ("a type with another name", "puma560", USUAL, "__init__.pyi", r'"position",', '"location",'),
    ("two actuators exchanged", "palletiser", "actuators_to_joints", "__init__.py", r'"m1",\n    "m2"',
     '"m2",\n    "m1"'),
    ("the range of an actuator", "palletiser", "actuators_to_joints", "__init__.py", r"0\.5235987", "0.5235986"),
    ("the unit of an actuator", "palletiser", "actuators_to_joints", "__init__.py", r'"rad",\n    "",', '"rad",\n    "rad",'),
    ("a range that is not looked at", "palletiser", "actuators_to_joints", "_runtime/_actuators.py",
     r" & \(array <= high\)", ""),
    ("NaN is let through", "palletiser", "actuators_to_joints", "_runtime/_actuators.py",
     r"outside = ~\(.*?\(array <= high \+ room\)\)", "outside = (array < low - room) | (array > high + room)"),
    ("readings are refused", "palletiser", "actuators_to_joints", "_runtime/_actuators.py", r"array >= low\)([\s\S]*?)array >= low - room", r"array > low)\1array > low + room"),
    ("two parameters exchanged", "calibrated_2r", "parameter_jacobian", "__init__.py",
     r'"tilt",\n    "skew"', '"skew",\n    "tilt"'),
    ("a default of a parameter", "calibrated_2r", "pose", "__init__.py", r"0\.4002", "0.4003"),
    ("a default of a parameter in C", "calibrated_2r", "pose", "calibrated_2r.c", r"0\.4002,", "0.4003,"),
    ("a default of a parameter in C, float", "calibrated_2r", "pose", "calibrated_2r_f32.c", r"0\.4002F,", "0.4003F,"),
    ("two defaults in C exchanged", "calibrated_2r", "pose", "calibrated_2r.c", r"0\.4002,(.*?)0\.2997,", r"0.2997,\g<1>0.4002,"),
    ("DOF in the header", "puma560", USUAL, "puma560.h", r"DOF 6", "DOF 7"),
    ("the number of frames in the header", "puma560", USUAL, "puma560.h", r"FRAMES 7", "FRAMES 8"),
    ("the place of a frame in the header", "puma560", USUAL, "puma560.h", r"FRAME_ELBOW 2", "FRAME_ELBOW 3"),
    ("the place of a frame in the float header", "puma560", USUAL, "puma560_f32.h", r"FRAME_ELBOW 2", "FRAME_ELBOW 3"),
    ("a macro that is missing", "puma560", USUAL, "puma560.h", r"#define PUMA560_FRAME_TOOL 6\n", ""),
    ("the place of a tip in the header", "hand", "position", "hand.h", r"TIP_INDEX_TIP 1", "TIP_INDEX_TIP 2"),
    ("the place of an actuator in the header", "palletiser", "actuators_to_joints", "palletiser.h",
     r"ACTUATOR_M3 2", "ACTUATOR_M3 1"),
    ("the place of a parameter in the header", "calibrated_2r", "parameter_jacobian", "calibrated_2r.h",
     r"PARAMETER_TILT 2", "PARAMETER_TILT 3"),
)  # fmt: skip

_SELFTESTS = (
    ("a self-test that is always content", "puma560_selftest.c", r"    return worst;", "    return 0.0;", "puma560_selftest(void)"),
    ("a main that is always content", "puma560_selftest.c", r"return .{1,40} \? 0 : 1;", "return 0;", "int main"),
    ("a main that is never content", "puma560_selftest.c", r"return .{1,40} \? 0 : 1;", "return 1;", "int main"),
    ("a loop over one vector", "puma560_selftest.c", r"vector < PUMA560_VECTORS", "vector < 1", ""),
    ("a loop over some entries", "puma560_selftest.c", r"entry < 12", "entry < 11", ""),
    ("a kernel that is left out", "puma560_selftest.c", r"puma560_frames\([^;]*;", r"continue; \g<0>", ""),
    ("differences that are not negative", "puma560_selftest.c", r"\? -difference : difference", "? 0.0 : difference", ""),
    ("a vector 1e-9 off", "puma560_vectors.h", r"(\d\.\d{8})\d{4,}", r"\g<1>9", "_fk_expected"),
    ("a vector of another place", "puma560_vectors.h", r"\{(-?\d\.\d{8}\d+), (-?\d\.\d{8}\d+)", r"{\2, \1", "_frames_expected"),
    ("a joint vector", "puma560_vectors.h", r"-2\.7919921875", "-2.7919921", ""),
    ("a tolerance that accepts all", "puma560_vectors.h", r"560_TOLERANCE 1\.0", "560_TOLERANCE 1e6", ""),
    ("a tolerance that accepts nothing", "puma560_vectors.h", r"560_TOLERANCE 1\.0", "560_TOLERANCE 1e-9", ""),
    ("fewer vectors", "puma560_vectors.h", r"VECTORS 16", "VECTORS 2", ""),
    ("a self-test of floats that is always content", "puma560_f32_selftest.c", r"    return worst;", "    return 0.0F;",
     "puma560_f32_selftest(void)"),
    ("a vector of floats", "puma560_f32_vectors.h", r"(\d\.\d{2})\d{4,}F", r"\g<1>F", "_fk_expected"),
)  # fmt: skip

_PACKAGES = (
    ("cmake", "src/puma560_f32.c"),
    ("cmake", "include/puma560_f32.h"),
    ("cmake", "test/puma560_f32_vectors.h"),
    ("platformio", "src/puma560_f32.c"),
    ("arduino", "src/puma560_f32.c"),
    ("arduino", "src/selftest/puma560_f32_selftest.c"),
    ("esp-idf", "src/puma560_f32.c"),
)

CASES = (
    *(
        Sabotage(f"tables: {name}", robot, outputs, file, old, new, errors=EITHER)
        for name, robot, outputs, file, old, new in _TABLES
    ),
    *(
        Sabotage(f"self-tests: {name}", "puma560", "pose,frames", file, old, new, after=after)
        for name, file, old, new, after in _SELFTESTS
    ),
    *(
        Sabotage(
            f"packages: {file} of {package} after the proof",
            "puma560",
            "pose",
            file,
            r"F\b|PUMA560",
            r"\g<0> ",
            real="float",
            options=(f"--package={package}",),
            message="differs from the one that was verified",
        )
        for package, file in _PACKAGES
    ),
)
