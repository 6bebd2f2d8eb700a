"""Ways to call: layouts, tails, strides, blocks, threads, arrays for the result, number types, and variants."""

from __future__ import annotations

from pathlib import Path

from tests.sabotage.case import Sabotage

BATCH, BATCH_F32 = "puma560_batch.c", "puma560_f32_batch.c"
FK, FK_F32 = "void puma560_fk_batch(", "void puma560_f32_fk_batch("
LATE = r"for (int i = 0; i < count; i++) if (start > 0 && layout == 0) t[3][i] = 0;\n        \g<0>"

_BATCHES = (
    ("a joint stride that is ignored", BATCH, r"1 \* q_joint", "1", "puma560_fk_tile("),
    ("a configuration stride that is ignored", BATCH, r"i \* q_pose \+ 2", "i * 6 + 2", "puma560_fk_tile("),
    ("the joint stride of a tail", BATCH, r"first \+ number \* joint", "first + number", ""),
    ("the configuration stride of a tail", BATCH, r"from\[i \* pose\]", "from[i]", ""),
    ("a tail that is 1e-6 off", BATCH, r"copy\[number\]\[i\] = from\[i \* pose\]", r"\g<0> + 1e-6", ""),
    ("a tail that is NaN", BATCH, r"copy\[number\]\[i\] = from\[i \* pose\]", r"\g<0> * (count < 16 ? 0.0 / 0.0 : 1)", ""),
    ("a tail of one", BATCH, r"copy\[number\]\[i\] = from\[i \* pose\]", r"\g<0> + (count == 1)", ""),
    ("a tail of fifteen", BATCH, r"copy\[number\]\[i\] = from\[i \* pose\]", r"\g<0> + (count == 15)", ""),
    ("the last of a tail is not written", BATCH, r"\(int\)left : TILE;\n        const ptrdiff_t",
     "(int)left - 1 : TILE;\n        const ptrdiff_t", FK),
    ("the second tile", BATCH, r"if \(layout == 2\) \{", LATE, FK),
    ("a tail in the joint-major layout", BATCH, r"to\[i\] = t\[row\]\[i\];\n            \}\n        \} else \{(.*?)to\[i\] = ",
     r"to[i] = t[row][i];\n            }\n        } else {\1to[i] = -", "void store_rows("),
    ("the stride of results", BATCH, r"\(results, 1, count, base_T_tool \+ first \* base_T_tool_stride, base_T_tool_stride, 1",
     "(results, 1, count, base_T_tool + first * base_T_tool_stride, 16, 1", FK),
)  # fmt: skip

_RUNTIME = (
    ("threads leave out a block", "_runtime/_threads.py", r"work\(\*block\)",
     "threading.current_thread() is threading.main_thread() and work(*block)"),
    ("a long batch is cut wrong", "_runtime/_threads.py", r"array\[start : start \+ step\]",
     "array[start - (start > 0) : start - (start > 0) + step]"),
    ("out= is not written", "_runtime/_kernel.py", r"direct\(id\(q\), id\(out\), 0\)", "direct(id(q), id(other := out.copy()), 0)"),
    ("bound arrays are copied", "_runtime/_engines.py", r"from_buffer\(items\[array\.dtype\], array\)", "from_buffer(items[array.dtype], array.copy())"),
    ("the copy of other types is turned round", "_runtime/_engines.py", r'np\.array\(array, real, order="C"\)',
     'np.array(array[..., ::-1], real, order="C")'),
    ("results of the copy are not brought back", "_runtime/_engines.py", r"array\[\.\.\.\] = buffer", "array[...] = 0"),
    ("float16 is rounded once more", "_runtime/_engines.py", r'np\.array\(array, real, order="C"\)',
     'np.round(np.array(array, real, order="C"), 3)'),
    ("the NumPy form in blocks", "_runtime/_engines.py", r"return rows\n", "return rows[:, ::-1]\n"),
    ("the last rows of the NumPy form", "_runtime/_engines.py", r"\(0\.0, 0\.0, 0\.0, 1\.0\)", "(0.0, 0.0, 1.0, 0.0)"),
)  # fmt: skip

_PARAMS = (
    ("the stride of parameters is ignored", "calibrated_2r_batch.c", r"\? i : 0\) \* params_stride", "? i : 0) * 0", ""),
    ("parameters stay those of the first tile", "calibrated_2r_batch.c", r"params \+ first \* params_stride", "params",
     "void calibrated_2r_fk_batch("),
    ("parameters of full tiles in the joint-major layout", "calibrated_2r_batch.c",
     r"params \+ \(ptrdiff_t\)begin \* params_stride", "params", "void calibrated_2r_fk_batch("),
    ("parameters of a tail", "calibrated_2r_batch.c", r"\(i < count\) \? i : 0", "(i + 1 < count) ? i : 0", "void take_params("),
    ("one set for all is taken along the batch", "calibrated_2r_f32_batch.c", r"if \(params_stride == 0\)",
     "if (params_stride >= 0)", "void take_params("),
    ("what follows from parameters stays that of the first", "calibrated_2r_batch.c",
     r"calibrated_2r_fk_from_params\(p\);", r"if (params_stride == 0) \g<0>", "void calibrated_2r_fk_params("),
    ("the table of parameters lacks one", "_runtime/_engines.py", r"table\[\.\.\., place\] = array",
     "table[..., place] = array if place else array.flat[0]", ""),
    ("parameters of the NumPy form are turned round", "_runtime/_engines.py", r"array\.reshape\(-1\) for array in",
     "array.reshape(-1)[::-1] for array in", ""),
    ("one parameter for all configurations", "_runtime/_kernel.py", r"np\.broadcast_to\(array, lead\) for",
     "np.broadcast_to(array.ravel()[:1], lead) for", ""),
)  # fmt: skip

_INVERSES = (
    ("parameters of a choice stay those of the first block", "pose,inverse", "flat_arm_batch.c",
     r"params \+ first \* params_stride, params_stride", "params, params_stride", "inverse_nearest_batch(",
     "nearest inverse gives another"),
    ("solutions take the parameters of the first tile", "pose,inverse", "flat_arm_batch.c",
     r"params \+ first \* params_stride", "params", "void flat_arm_inverse_batch(", "inverse gives another"),
    ("parameters of all parts of a search are those of the first", "pose,numeric_inverse", "_runtime/_numeric_inverse.py",
     r"self\.params\[first:last\]", "self.params[: last - first]", "", "with one set for all|of its own parameters"),
    ("a search takes one set for all", "pose,numeric_inverse", "_runtime/_numeric_inverse.py",
     r'ffi\.from_buffer\(item, params\), 1', "ffi.from_buffer(item, params), 0", "", "of its own parameters"),
    ("a search in NumPy takes the first set", "pose,numeric_inverse", "_runtime/_numeric_inverse.py",
     r"task\.params\[0\]\.tolist\(\)", "whole.params[0].tolist()", "", "of its own parameters"),
)  # fmt: skip

_OTHERS = (
    ("positions are zeros from the second tile on", "puma560", "position", BATCH, r"if \(layout == 2\) \{",
     LATE.replace("t[3]", "t[2]"), "double"),
    ("positions of floats have the wrong sign", "puma560", "position", BATCH_F32,
     r"out\[i \* out_stride \+ row\] = t", "out[i * out_stride + row] = -t", "float"),
    ("frames of floats in the second tile", "puma560", "frames", BATCH_F32, r"if \(layout == 2\) \{",
     LATE.replace("t[3]", "t[63]"), "float"),
    ("Jacobians of floats in the second tile", "puma560", "jacobian", BATCH_F32, r"if \(layout == 2\) \{",
     LATE.replace("t[3]", "t[0]"), "float"),
    ("Jacobians in the second tile", "puma560", "jacobian", BATCH, r"if \(layout == 2\) \{",
     LATE.replace("t[3]", "t[0]"), "double"),
    ("poses of actuators in the second tile", "palletiser", "fk_actuators", "palletiser_batch.c",
     r"if \(layout == 2\) \{", LATE, "double"),
    ("the second result in the joint-major layout", "puma560", "fk_jacobian", BATCH, r"store_rows(\w*)\(results \+ 12",
     r"store_rows\1(results + 11", "double"),
    ("rates with a stride", "puma560", "twist", BATCH, r"1 \* qd_joint", "1", "double"),
    ("the strides of a pose", "puma560", "inverse_pose", BATCH, r"a_T_b\[i \* a_T_b_pose", "a_T_b[i * 16", "double"),
)  # fmt: skip

_TURNED = (
    ("the configuration stride of a full tile", "pose", r"load_columns\(first \+ i \* pose, pose", "load_columns(first + i * 6, 6"),
    ("the last four numbers of a full tile", "pose", r"&copy\[2\]\[i\]", "&copy[1][i]"),
    ("neighbours of a full tile", "pose", r"first\[number \* joint \+ i\]", "first[number * TILE + i]"),
    ("the last four numbers of a Jacobian", "jacobian", r"to \+ first, out_stride", "to + first - (first == 32), out_stride"),
)  # fmt: skip

VARIANTS = {
    "baseline": "!defined(__AVX2__)",
    "avx2": "defined(__AVX2__) && !defined(__AVX512F__)",
    "avx512": "defined(__AVX512F__)",
}
"""When the compiler makes a variant."""


def _can_run(variant: str) -> bool:
    """Whether this processor has it; what it cannot run here cannot be compared either."""
    words = Path("/proc/cpuinfo").read_text(encoding="utf-8").split() if Path("/proc/cpuinfo").exists() else []
    return variant == "baseline" or {"avx2": "avx2", "avx512": "avx512vl"}[variant] in words


CASES = (
    Sabotage(
        "calls: one configuration of an input for all",
        "puma560",
        "twist",
        "_runtime/_kernel.py",
        r"np\.broadcast_to\(array, shape\)",
        "np.resize(array, shape) * 1.001",
        real="double",
        count=0,
    ),
    *(
        Sabotage(f"calls: {name}", "puma560", "pose", file, old, new, real="double", after=after)
        for name, file, old, new, after in _BATCHES
    ),
    *(Sabotage(f"calls: {name}", "puma560", "pose", file, old, new, real="both") for name, file, old, new in _RUNTIME),
    *(
        Sabotage(f"calls: {name}", "calibrated_2r", "pose", file, old, new, real="both", after=after)
        for name, file, old, new, after in _PARAMS
    ),
    *(
        Sabotage(
            f"calls: {name}",
            "flat_arm",
            outputs,
            file,
            old,
            new,
            real="double",
            options=("--wrt=a_shoulder,a_elbow",),
            after=after,
            message=message,
        )
        for name, outputs, file, old, new, after, message in _INVERSES
    ),
    *(
        Sabotage(f"calls: {name}", robot, outputs, file, old, new, real=real)
        for name, robot, outputs, file, old, new, real in _OTHERS
    ),
    *(
        Sabotage(
            f"calls: {name}, turned in registers",
            "puma560",
            outputs,
            BATCH,
            old,
            new,
            real="double",
            options=("--portable",),
        )
        for name, outputs, old, new in _TURNED
        if _can_run("avx2")
    ),
    *(
        Sabotage(
            f"variants: a length of {real}, {variant} alone",
            "puma560",
            "pose",
            file,
            rf"const {real} t1 = 0\.4318(F?) \* t0;",
            rf"\n#if {condition}\n const {real} t1 = 0.4319\1 * t0;\n#else\n\g<0>\n#endif\n",
            real=real,
            options=("--portable",),
        )
        for variant, condition in VARIANTS.items()
        if _can_run(variant)
        for real, file in (("double", BATCH), ("float", BATCH_F32))
    ),
)
