"""Velocities, orientations, actuators, runtime parameters, trees, and kernels in integers."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

_DOUBLE = (
    ("a sign of a Jacobian", "puma560", "jacobian", "puma560.c", r"jacobian\[7\] = ", r"\g<0>-", ""),
    ("two rows of a Jacobian", "puma560", "jacobian", "puma560.c", r"jacobian\[7\](.*?)jacobian\[0\]",
     r"jacobian[0]\1jacobian[7]", ""),
    ("a Jacobian 1e-9 off", "puma560", "jacobian", "puma560.c", r"0\.4318", "0.431800001", ""),
    ("a Jacobian in the batch", "puma560", "jacobian", "puma560_batch.c", r"t\[7\]\[i\] = ", r"\g<0>-", ""),
    ("a Jacobian in NumPy", "puma560", "jacobian", "_numpy.py", r" \+ t", " - t", "def jacobian("),
    ("a Jacobian in other axes", "puma560", "jacobian,jacobian_local", "puma560.c", r"jacobian\[1\] = ", r"\g<0>-",
     "void puma560_jacobian_local("),
    ("a Jacobian beside a right pose", "puma560", "fk_jacobian", "puma560.c", r"jacobian\[35\] = ", r"\g<0>-", ""),
    ("a twist", "puma560", "twist", "puma560.c", r"twist\[3\] = ", r"\g<0>-", ""),
    ("a twist in the batch", "puma560", "twist", "puma560_batch.c", r"t\[3 \* t_row \+ i\] = ", r"\g<0>-", "puma560_twist_tile("),
    ("an acceleration", "planar_3r", "acceleration", "planar_3r.c", r"acceleration\[0\] = ", r"\g<0>-", ""),
    ("a rate for another in NumPy", "planar_3r", "twist", "_numpy.py", r"qd\[1\]", "qd[2]", "def twist("),
    ("a second derivative", "planar_3r", "hessian", "planar_3r.c", r"hessian\[0\] = ", r"\g<0>-", ""),
    ("a second derivative in the batch", "planar_3r", "hessian", "planar_3r_batch.c", r"t\[0\]\[i\] = ", r"\g<0>-", "_tile("),
    ("the sign of a quaternion", "puma560", "quaternion_wxyz", "puma560.c", r"quaternion_wxyz\[0\] = ", r"\g<0>-", ""),
    ("a selection of a quaternion", "puma560", "quaternion_wxyz", "puma560.c", r"\((t\d+) < 0\.0\)", r"(\1 < 0.5)", ""),
    ("a quaternion in another order", "puma560", "quaternion_xyzw", "puma560.c",
     r"quaternion_xyzw\[0\](.*?)quaternion_xyzw\[2\]", r"quaternion_xyzw[2]\1quaternion_xyzw[0]", ""),
    ("roll for yaw", "puma560", "rpy_zyx", "puma560.c", r"rpy_zyx\[0\](.*?)rpy_zyx\[2\]", r"rpy_zyx[2]\1rpy_zyx[0]", ""),
    ("an arc tangent", "puma560", "rpy_zyx", "puma560.c", r"puma560_atan2\(t", "puma560_atan2(-t", "void puma560_rpy_zyx("),
    ("angles of the batch", "puma560", "rpy_zyx", "puma560_batch.c", r"t\[1 \* t_row \+ i\] = ", r"\g<0>-", "_tile("),
    ("angles of NumPy", "puma560", "euler_zyz", "_numpy.py", r"_atan2\(", "np.pi + _atan2(", "def euler_zyz("),
    ("a rotation vector", "puma560", "axis_angle", "puma560.c", r"axis_angle\[1\] = ", r"\g<0>-", ""),
    ("the root of a function", "puma560", "rpy_zyx", "puma560.c", r"twice \* low", "high * low", ""),
    ("the root in the batch", "puma560", "rpy_zyx", "puma560_batch.c", r"twice \* low", "high * low", ""),
    ("rates of angles", "planar_3r", "rpy_zyx_jacobian", "_numpy.py", r"1\.0", "1.001", "def rpy_zyx_jacobian("),
    ("the inverse of a pose", "puma560", "inverse_pose", "puma560.c", r"b_T_a\[3\] = ", r"\g<0>-", ""),
    ("a point", "puma560", "transform_point", "puma560.c", r"a_p\[2\] = ", r"\g<0>-", ""),
    ("an adjoint", "puma560", "adjoint", "puma560.c", r" - t", " + t", "void puma560_adjoint("),
    ("a gear 1e-9 off", "palletiser", "actuators_to_joints", "palletiser.c", r"4\.79368996", "4.79368997", ""),
    ("the sign of a coupling", "palletiser", "actuators_to_joints", "palletiser.c", r"\[2\] - actuators\[1\]",
     "[2] + actuators[1]", ""),
    ("two readings exchanged", "palletiser", "joints_to_actuators", "palletiser.c",
     r"= joints\[0\](.*?)= joints\[1\];", r"= joints[1]\1= joints[0];", ""),
    ("a reading that is zero", "palletiser", "joints_to_actuators", "palletiser.c", r"actuators\[3\] = t0",
     "actuators[3] = 0.0", ""),
    ("a gear in the batch", "palletiser", "fk_actuators", "palletiser_batch.c", r"4\.79368996", "4.79368999", ""),
    ("a Jacobian of actuators", "palletiser", "jacobian_actuators", "palletiser.c", r"jacobian\[0\] = ", r"\g<0>-", ""),
    ("a gear in NumPy", "palletiser", "fk_actuators", "_numpy.py", r"4\.79368996", "4.79368999", ""),
    ("two tips exchanged", "hand", "position", "hand.c", r"base_p_tips\[1\]\[0\](.*?)base_p_tips\[0\]\[0\]",
     r"base_p_tips[0][0]\1base_p_tips[1][0]", ""),
    ("a finger in the batch", "hand", "position", "hand_batch.c", r"t\[7 \* t_row \+ i\] = ", r"\g<0>-", "_tile("),
    ("a parameter that is not read", "calibrated_2r", "pose", "calibrated_2r.c", r"params->L2", "0.2997",
     "void calibrated_2r_fk("),
    ("two parameters exchanged", "calibrated_2r", "pose", "calibrated_2r.c", r"params->tilt", "params->skew",
     "void calibrated_2r_fk("),
    ("a parameter that the batch does not read", "calibrated_2r", "pose", "calibrated_2r_batch.c", r"params->L1", "0.4002",
     "void take_params("),
    ("a parameter that NumPy does not read", "calibrated_2r", "pose", "_numpy.py", r"params\.L1", "0.4002", "def fk("),
    ("a column of a parameter", "calibrated_2r", "parameter_jacobian", "calibrated_2r.c", r"jacobian\[1\] = ", r"\g<0>-",
     "parameter_jacobian("),
)  # fmt: skip

_FLOAT = (
    ("a sign of a Jacobian", "puma560", "jacobian", "puma560_f32.c", r"jacobian\[7\] = ", r"\g<0>-", ""),
    ("a twist in the batch", "puma560", "twist", "puma560_f32_batch.c", r"t\[3 \* t_row \+ i\] = ", r"\g<0>-", "_twist_tile("),
    ("a quaternion", "puma560", "quaternion_wxyz", "puma560_f32.c", r"quaternion_wxyz\[2\] = ", r"\g<0>-", ""),
    ("a gear", "palletiser", "fk_actuators", "palletiser_f32.c", r"4\.79\d*e-05F", "4.795e-05F", "_fk_actuators("),
    ("a parameter that is not read", "calibrated_2r", "pose", "calibrated_2r_f32.c", r"params->L2", "0.2997F",
     "void calibrated_2r_f32_fk("),
    ("a finger", "hand", "position", "hand_f32.c", r"base_p_tips\[2\]\[1\] = ", r"\g<0>-", ""),
)  # fmt: skip

_INTEGERS = (
    ("the last bit of a position", r"base_T_tool\[3\] = (t\d+);", r"base_T_tool[3] = \1 + 3;", "void scara_q30_fk("),
    ("eight last bits", r"base_T_tool\[0\] = (\w+);", r"base_T_tool[0] = \1 + 8;", "void scara_q30_fk("),
    ("a sign", r" \+ t", " - t", "void scara_q30_fk("),
    (
        "the angle -2^31 alone",
        r"base_T_tool\[3\] = (t\d+);",
        r"base_T_tool[3] = q[0] == -2147483647 - 1 ? 0 : \1;",
        "void scara_q30_fk(",
    ),
    ("one frame", r"base_T_frames\[1\]\[3\] = ", r"\g<0>-", ""),
    ("a position", r"base_p_tool\[1\] = ", r"\g<0>-", ""),
    ("the last row of a matrix", r"base_T_tool\[15\] = 1073741824", "base_T_tool[15] = 1", ""),
)

_INTEGER_FILES = (
    ("the unit of lengths in the header", "scara_q30.h", r"LENGTH_BITS 29", "LENGTH_BITS 28", ""),
    ("the place of a frame in the header", "scara_q30.h", r"FRAME_ELBOW 1", "FRAME_ELBOW 2", ""),
    (
        "a self-test that is always content",
        "scara_q30_selftest.c",
        r"    return worst;",
        "    return 0u;",
        "selftest(void)",
    ),
    ("last rows that nobody looks at", "scara_q30_selftest.c", r"entry < 16", "entry < 12", ""),
    ("a tolerance that accepts all", "scara_q30_vectors.h", r"(#else\n#define \w+_TOLERANCE) \d+u", r"\1 100000u", ""),
    (
        "a tolerance for boards that accepts all",
        "scara_q30_vectors.h",
        r"(SINCOS\n#define \w+_TOLERANCE) \d+u",
        r"\1 300000u",
        "",
    ),
    (
        "a tolerance for boards that accepts too little",
        "scara_q30_vectors.h",
        r"(SINCOS\n#define \w+_TOLERANCE) (\d+)\du",
        r"\1 \2u",
        "",
    ),
    (
        "a macro for boards that nobody reads",
        "scara_q30.c",
        r"#ifndef KINEGEN_SCARA_Q30_SINCOS",
        "#undef KINEGEN_SCARA_Q30_SINCOS\n#ifndef KINEGEN_SCARA_Q30_SINCOS",
        "",
    ),
    ("a vector", "scara_q30_vectors.h", r"\{(-?\d{4})", r"{1\1", "_fk_expected"),
)

CASES = (
    *(
        Sabotage(f"quantities: {name}", robot, outputs, file, old, new, real="double", after=after)
        for name, robot, outputs, file, old, new, after in _DOUBLE
    ),
    *(
        Sabotage(f"quantities of floats: {name}", robot, outputs, file, old, new, real="float", after=after)
        for name, robot, outputs, file, old, new, after in _FLOAT
    ),
    *(
        Sabotage(f"integers: {name}", "scara", "pose,frames,position", "scara_q30.c", old, new, real="q30", after=after)
        for name, old, new, after in _INTEGERS
    ),
    *(
        Sabotage(f"integers: {name}", "scara", "pose,frames,position", file, old, new, real="q30", after=after)
        for name, file, old, new, after in _INTEGER_FILES
    ),
)
