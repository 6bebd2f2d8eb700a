"""Comments and guards of the C files, and the array handling that comes with every package."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

EITHER = (ProofError, CompileError)

# Name, file, place, what it becomes, after, message.
_HEADERS = (
    ("an error bound that is too small", "puma560.h", r"\|px\| <= \d\.\de", "|px| <= 1.0e", "Pose of the tool", "it states"),
    ("an error bound that is too large", "puma560.h", r"rotation entries <= \S+e-15", "rotation entries <= 9.9e-15", "Pose of the tool", "it states"),
    ("an error bound of floats", "puma560_f32.h", r"\|pz\| <= \d\.\de-(\d)", r"|pz| <= 1.0e-\1", "Pose of the tool", "it states"),
    ("the bound of another exponent", "puma560.h", r"any entry <= (\S+)e-15", r"any entry <= \1e-16", "Geometric Jacobian", "it states"),
    ("the bound of a position is missing", "puma560.h", r"\|py\| <= \S+ m, ", "", "Position of the tool", "it states"),
    ("no bound at all", "puma560.h", r"Proven error:", "Errors are small:", "Position of the tool", "it states 'nothing'"),
    ("the bound of angles without limits", "puma560.h", r"(too: \|px\| <= )\S+", r"\g<1>1.0e-13", "Pose of the tool", "it states"),
    ("a lower limit in the comment", "puma560.h", r"-2\.79253 to", "-2.89253 to", "", "is not joint waist"),
    ("an upper limit in the comment", "puma560.h", r"to 0\.785399", "to 0.885399", "", "is not joint shoulder"),
    ("the sign of a limit in the comment", "puma560.h", r"-1\.74533 to", "1.74533 to", "", "is not joint wrist_bend"),
    ("limits of floats in the comment", "puma560_f32.h", r"to 2\.96706", "to 2.96705", "", "is not joint forearm"),
    ("a joint without limits that has some", "puma560.h", r"rad  no limits", "rad  -1 to 1", "", "is not joint elbow"),
    ("a joint with limits that has none", "puma560.h", r"-2\.79253 to 2\.79253", "no limits", "", "is not joint waist"),
    ("joints in another order", "puma560.h", r"q\[0\]  waist   ( .*?)q\[1\]  shoulder", r"q[0]  shoulder\1q[1]  waist   ", "", "is not joint waist"),
    ("a joint of another kind", "puma560.h", r"flange      revolute ", "flange      prismatic", "", "is not joint flange"),
    ("a joint in another unit", "puma560.h", r"revolute   rad", "revolute   deg", "", "is not joint waist"),
    ("a joint is missing", "puma560.h", r" \*   q\[5\]  flange[^\n]*\n", "", "", "lists 5 joint values"),
    ("the guard of another header", "puma560_f32.h", r"(#ifndef) KINEGEN_PUMA560_F32_H_INCLUDED\n(#define) KINEGEN_PUMA560_F32_H_INCLUDED", r"\1 KINEGEN_PUMA560_H_INCLUDED\n\2 KINEGEN_PUMA560_H_INCLUDED", "", "is that of puma560"),
    ("the guard of the batch is that of the batch of floats", "puma560_batch.h", r"(#ifndef) KINEGEN_PUMA560_BATCH_H_INCLUDED\n(#define) KINEGEN_PUMA560_BATCH_H_INCLUDED", r"\1 KINEGEN_PUMA560_F32_BATCH_H_INCLUDED\n\2 KINEGEN_PUMA560_F32_BATCH_H_INCLUDED", "", "is that of"),
    ("a guard that guards nothing", "puma560.h", r"#define KINEGEN_PUMA560_H_INCLUDED", "#define KINEGEN_PUMA560_H", "", "no include guard"),
    ("fast-math is a warning", "puma560.c", r"#error \"-ffast", '#warning "-ffast', "", "does not refuse options"),
    ("fast-math of floats is a warning", "puma560_f32.c", r"#error \"-ffast", '#warning "-ffast', "", "does not refuse options"),
    ("fast-math of a batch is a warning", "puma560_batch.c", r"#error \"-ffast", '#warning "-ffast', "", "does not refuse options"),
    ("finite-math is a warning", "puma560.c", r"#error \"-ffinite", '#warning "-ffinite', "", "does not refuse options"),
    ("finite-math of a batch of floats", "puma560_f32_batch.c", r"#if __FINITE_MATH_ONLY__ != 0", "#if __FINITE_MATH_ONLY__ > 1", "", "does not refuse options"),
    ("reciprocals may be taken", "puma560.c", r" \|\| defined\(__RECIPROCAL_MATH__\)", "", "", "does not refuse options"),
    ("zeros may lose their signs", "puma560.c", r"defined\(__NO_SIGNED_ZEROS__\)", "defined(__SIGNED_ZEROS__)", "", "does not refuse options"),
    ("the guard is in a comment", "puma560.c", r"#if defined\(__FAST_MATH__\).*?#endif\n", r"/* \g<0> */", "", "does not refuse options"),
    ("a short double is taken", "puma560.c", r"#if DBL_MANT_DIG != 53", "#if DBL_MANT_DIG == 24", "", "does not refuse options"),
    ("a header with another size of a result", "puma560.h", r"double base_T_tool\[16\]", "double base_T_tool[12]", "", "does not take double base_T_tool of 16"),
    ("a header with inputs of the other type", "puma560_f32.h", r"fk\(const float q", "fk(const double q", "", "conflicting types"),
    ("a header with columns for rows", "puma560.h", r"4x4 matrix, row by row", "4x4 matrix, column by column", "", "does not say that base_T_tool holds"),
    ("a header with another cost", "puma560.h", r"Costs 38 mult", "Costs 37 mult", "", "does not say that it costs"),
    ("a header with better sines", "puma560.h", r"within 0\.85 units", "within 0.5 units", "", "does not say that sines are"),
    ("a header with sines of larger angles", "puma560_f32.h", r"up to 12000 rad;", "up to 20000 rad;", "", "does not say that sines are"),
    ("a header that C++ mangles", "puma560.h", r'extern "C" \{', 'extern "D" {', "", 'are not extern "C"'),
    ("a counter of calls", "puma560_batch.c", r"(puma560_fk_batch\([^{]*\{)", r"\1\n    static int calls; calls++;", "", "calls outlives a call"),
    ("a variable of the file", "puma560.c", r"\nvoid puma560_fk\(", "\nint more = 1;\nvoid puma560_fk(", "", "more outlives a call"),
    ("a constant of two megabytes of stack", "puma560_batch.c", r"(puma560_fk_batch\([^{]*\{)", r"\1\n    enum { WASTE = 1 << 18 }; volatile double waste[WASTE]; waste[0] = 0;", "", "has 262,144 entries"),
    ("as much stack as there are joint vectors", "puma560_batch.c", r"(puma560_fk_batch\([^{]*\{)", r"\1\n    volatile double waste[n + 1]; waste[0] = 0;", "", "no constant says"),
    ("two megabytes of stack", "puma560_batch.c", r"(puma560_fk_batch\([^{]*\{)", r"\1\n    volatile double waste[262144]; waste[0] = 0;", "", "has 262,144 entries"),
    ("single constants are taken", "puma560_batch.c", r"1 / \(1 - \(int\)", "1 / (2 - (int)", "", "does not refuse options"),
)  # fmt: skip

# Name, file, place, what it becomes.
_SHARED = (
    ("helpers are not waited for", "_runtime/_threads.py", r"helper\.result\(\)", "pass"),
    ("no lock", "_runtime/_threads.py", r"            with lock:\n", "            with contextlib.suppress():\n"),
    ("the pool stays in a child", "_runtime/_threads.py", r"_pools\.clear", "list"),
    ("errors are lost", "_runtime/_threads.py", r"helper\.result\(\)", "helper.exception()"),
    ("warnings", "_runtime/_threads.py", r'all="ignore"', 'all="warn"'),
    ("no threads", "_runtime/_threads.py", r"wanted or cores", "1"),
    ("another kernel unpickles", "_runtime/_kernel.py", r"return self\.__name__  # pickled", 'return "jacobian"  # pickled'),
    ("bind without a layout", "_runtime/_kernel.py", r"out=self\._given\(results\), layout=layout", "out=self._given(results)"),
    ("read-only results", "_runtime/_kernel.py", r"if not out\.flags\.writeable", "if False"),
    ("types of results", "_runtime/_kernel.py", r"if out\.dtype != each\.dtype\(dtype\)", "if False"),
    ("shapes of results", "_runtime/_kernel.py", r"if out\.shape != shape", "if False"),
    ("objects", "_runtime/_engines.py", r'"fiub"', '"fiubO"'),
    ("complex numbers", "_runtime/_engines.py", r'"fiub"', '"fiubc"'),
    ("masked arrays", "_runtime/_engines.py", r"isinstance\(values, np\.ma\.MaskedArray\)", "False"),
    ("nothing overlaps", "_runtime/_overlap.py", r"return bool\(np\.shares_memory[^\n]*", "return False"),
    ("nothing overlaps itself", "_runtime/_overlap.py", r"return array\.size > 0", "return False"),
    ("overlap that takes long", "_runtime/_overlap.py", r"return True", "return False"),
    ("a sum of singular values", "_runtime/_measures.py", r"\.prod\(", ".sum("),
    ("a ratio upside down", "_runtime/_measures.py", r"values\[\.\.\., 0\] / values\[\.\.\., -1\]", "values[..., -1] / values[..., 0]"),
    ("spoilt Jacobians", "_runtime/_measures.py", r"values, np\.nan\)", "values, 0.0)"),
    ("sines of other libraries", "_runtime/xp.py", r"xp\.sin\(guarded\)", "1.0001 * xp.sin(guarded)"),
    ("last rows of other libraries", "_runtime/xp.py", r"0\.0, 0\.0, 0\.0, 1\.0", "0.0, 0.0, 1.0, 0.0"),
    ("the range of other libraries", "_runtime/xp.py", r"12000\.0", "100000.0"),
    ("selections of other libraries", "_runtime/xp.py", r"model\.like\(first\), model\.like\(second\)", "model.like(second), model.like(first)"),
    ("moments", "_runtime/_derivatives.py", r"\(y \* fz - z \* fy\)", "(z * fy - y * fz)"),
    ("gradients", "_runtime/_gradients.py", r"tijn,tin->jn", "tijn,tjn->in"),
    ("number types of XLA", "_runtime/_xla.py", r"11: np\.dtype\(np\.float32\)", "11: np.dtype(np.float64)"),
    ("gradients of JAX", "_runtime/jax.py", r"return ", "return 2 * "),
    ("gradients of PyTorch", "_runtime/torch.py", r"return ", "return 2 * "),
    ("an infinity within limits", "_runtime/_limits.py", r" & np\.isfinite\(array\)", ""),
    ("parameters", "_runtime/_parameters.py", r"isinstance\(value, \(float, int\)\)", "True"),
    ("names of frames", "_runtime/_names.py", r"places\[0\]", "places[-1]"),
    ("signatures", "_runtime/_signature.py", r"\n\n\n", "\n\n\n\n"),
    ("calls in C", "_runtime/_quick.py", r"made is not base", "made is base"),
    ("ctypes", "_runtime/_plain.py", r'"l": ctypes\.c_int32', '"l": ctypes.c_uint32'),
    ("a comment", "_runtime/_threads.py", r"$", "  # "),
    ("the folder's own text", "_runtime/__init__.py", r"the same", "another"),
    ("the licence", "_runtime/_kernel.py", r"^# SPDX[^\n]*\n", ""),
)  # fmt: skip

_OUTPUTS = "pose,frames,position,jacobian"

CASES: tuple[Sabotage, ...] = (
    *(
        Sabotage(f"text: {name}", "puma560", _OUTPUTS, file, old, new, after=after, message=message, real="both", errors=EITHER)
        for name, file, old, new, after, message in _HEADERS
    ),
    *(
        Sabotage(
            f"shared: {name}", "puma560", _OUTPUTS, file, old, new, real="double", options=("--no-compile",),
            message=f"{file} is not the file of this name that comes with kinegen",
        )
        for name, file, old, new in _SHARED
    ),
    *(
        Sabotage(
            f"shared: targets, {name}", "puma560", "inverse", "_runtime/_targets.py", old, new, real="double",
            options=("--no-compile",), message=r"_targets\.py is not the file of this name",
        )
        for name, old, new in (
            ("scaled rotations", r"\(x, x, 1\), \(y, y, 1\), \(z, z, 1\), ", ""),
            ("reflections", r"across\[2\] \* z\[2\] < 0", "across[2] * z[2] < -9"),
            ("any last row", r"\(m\[12\] != 0\) \| ", ""),
        )
    ),
)  # fmt: skip
