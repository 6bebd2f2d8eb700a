"""Kernels that write beside their results or to their inputs, and kernels that crash."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

BESIDE = "writes outside its results"
_POSE, _LAST = r"(base_T_tool\[15\] = 1\.0F?;)", "base_T_tool[15]"


def _after(extra: str) -> str:
    return rf"\1\n    {extra}"


# Name, robot, outputs, file, place, what is added, number types, message.
_SCALAR = (
    ("one behind a pose", "puma560", "pose", "puma560.c", _POSE, "base_T_tool[16] = 0.0;", "double"),
    ("one behind a pose of floats", "puma560", "pose", "puma560_f32.c", _POSE, "base_T_tool[16] = 0.0F;", "float"),
    ("one in front of a pose", "puma560", "pose", "puma560.c", _POSE, "base_T_tool[-1] = 0.0;", "double"),
    ("a row behind a pose", "puma560", "pose", "puma560.c", _POSE, "base_T_tool[19] = 1.0;", "double"),
    ("half the guard behind a pose", "puma560", "pose", "puma560.c", _POSE, "base_T_tool[47] = 1.0;", "double"),
    ("its own value behind a pose", "puma560", "pose", "puma560.c", _POSE, "base_T_tool[16] = base_T_tool[3];", "double"),
    ("NaN behind a pose", "puma560", "pose", "puma560.c", _POSE, "base_T_tool[16] = 0.0 / (q[0] - q[0]);", "double"),
    ("a byte behind a pose", "puma560", "pose", "puma560.c", _POSE, "((char *)base_T_tool)[128] = 0;", "double"),
    ("a double behind a pose of floats", "puma560", "pose", "puma560_f32.c", _POSE, "*(double *)(base_T_tool + 16) = 0.0;", "float"),
    ("behind a Jacobian", "planar_3r", "jacobian", "planar_3r.c", r"(jacobian\[\d+\] = [^;]*;)", "jacobian[18] = 0;", "double"),
    ("behind a position", "puma560", "position", "puma560.c", r"(base_p_tool\[0\] = [^;]*;)", "base_p_tool[3] = 0;", "double"),
    ("in front of a position", "puma560", "position", "puma560_f32.c", r"(base_p_tool\[0\] = [^;]*;)", "base_p_tool[-1] = 0;", "float"),
    ("a frame too many", "planar_3r", "frames", "planar_3r.c", r"(base_T_frames\[0\]\[0\] = [^;]*;)", "base_T_frames[4][0] = 0;", "double"),
    ("a frame in front", "planar_3r", "frames", "planar_3r.c", r"(base_T_frames\[0\]\[0\] = [^;]*;)", "base_T_frames[-1][3] = 0;", "double"),
    ("behind a Hessian", "planar_3r", "hessian", "planar_3r.c", r"(hessian\[\d+\]\[?\d*\]? = [^;]*;)", "((double *)hessian)[54] = 0;", "double"),
    ("behind a quaternion", "puma560", "quaternion_wxyz", "puma560.c", r"(quaternion_wxyz\[0\] = [^;]*;)", "quaternion_wxyz[4] = 0;", "double"),
    ("behind a twist", "puma560", "twist", "puma560.c", r"(twist\[0\] = [^;]*;)", "twist[6] = 0;", "double"),
    ("behind the tips of a tree", "fork", "pose", "fork.c", r"(base_T_tips\[0\]\[0\] = [^;]*;)", "base_T_tips[FORK_TIPS][0] = 0;", "double"),
    ("behind the validity of solutions", "puma560", "inverse", "puma560.c", r"(valid\[0\] = [^;]*;)", "valid[PUMA560_BRANCHES] = 0;", "double"),
    ("behind the solutions", "puma560", "inverse", "puma560.c", r"(valid\[0\] = [^;]*;)", "solutions[PUMA560_BRANCHES][0] = 0;", "double"),
)  # fmt: skip

_INPUTS = (
    ("joint values are changed", "puma560.c", "((double *)q)[0] += 1e-9;", "double"),
    ("joint values of floats are changed", "puma560_f32.c", "((float *)q)[5] = 0.0F;", "float"),
)

_DEATHS = (
    ("far behind a pose", "base_T_tool[1000000000] = 0.0;", "SIGSEGV"),
    ("an address that is none", "*(volatile int *)8 = 0;", "SIGSEGV"),
    ("an instruction that is none", "__builtin_trap();", r"SIG(ILL|TRAP)"),
    ("a division of whole numbers by zero", "{ volatile int zero = 0; base_T_tool[0] += 1 % zero; }", "SIGFPE"),
)

_BATCH = (
    ("batch: one behind", r"^( *)(puma560_fk_tile\(q_tile)", r"\1base_T_tool[n * base_T_tool_stride] = 0.0;\n\1\2"),
    ("batch: one in front", r"^( *)(puma560_fk_tile\(q_tile)", r"\1base_T_tool[-1] = 0.0;\n\1\2"),
)

CASES: tuple[Sabotage, ...] = (
    *(
        Sabotage(f"memory: {name}", robot, outputs, file, old, _after(extra), real=real, message=BESIDE)
        for name, robot, outputs, file, old, extra, real in _SCALAR
    ),
    *(
        Sabotage(f"memory: {name}", "puma560", "pose", file, _POSE, _after(extra), real=real, message="changes its inputs")
        for name, file, extra, real in _INPUTS
    ),
    *(
        Sabotage(f"memory: {name}", "puma560", "pose", "puma560.c", _POSE, _after(extra), real="double", message=word)
        for name, extra, word in _DEATHS
    ),
    *(
        Sabotage(f"memory: {name}", "puma560", "pose", "puma560_batch.c", old, new, real="double", message=BESIDE)
        for name, old, new in _BATCH
    ),
    Sabotage("memory: clamp writes behind", "puma560", "pose", "puma560.c", r"(void puma560_clamp\([^{]*\{)",
             r"\1\n    clamped[6] = 0.0;", real="double", message=BESIDE),
    Sabotage("memory: q30 writes behind", "puma560", "pose", "puma560_q30.c", r"(base_T_tool\[15\] = [^;]*;)",
             _after("base_T_tool[16] = 0;"), real="q30", message=BESIDE),
    Sabotage("memory: q30 writes in front", "puma560", "pose", "puma560_q30.c", r"(base_T_tool\[15\] = [^;]*;)",
             _after("base_T_tool[-1] = 0;"), real="q30", message=BESIDE),
    Sabotage("memory: q30 crashes", "puma560", "pose", "puma560_q30.c", r"(base_T_tool\[15\] = [^;]*;)",
             _after("*(volatile int *)8 = 0;"), real="q30", message=r"C q30 pose crashes \(SIGSEGV\)"),
)  # fmt: skip
