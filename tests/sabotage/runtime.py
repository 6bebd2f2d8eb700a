r"""Alterations of the array handling in `kinegen/runtime/vendored/`, each with the quick tests that must fail.

A build refuses a package in which one of these files is another than the one installed with kinegen. So the files are
as right as the tests of the shared source: `test_runtime.py` alters the source in a copy of the repository and runs
there the tests that are named here.
"""

from __future__ import annotations

from dataclasses import dataclass

THREADS = "tests/native/test_threads.py"
CALLS = "tests/native/test_refusals.py"
LOADING = "tests/native/test_load.py"
XP = "tests/native/test_xp.py"
DERIVATIVES = "tests/native/test_derivatives.py"
LIMITS = "tests/native/test_bounds.py"
NAMES = "tests/native/test_named_parts.py"
ABSENT = "tests/native/test_absent.py"

BUILDING = LOADING, XP
"""Those that build packages; the others need nothing but the files themselves."""


@dataclass(frozen=True, slots=True)
class Alteration:
    """One alteration.

    Attributes:
        name: What is wrong, unique among all.
        file: The file in `kinegen/runtime/vendored/`.
        old: Plain text, which is there once.
        new: What replaces it.
        tests: The file of tests of which one must fail.
    """

    name: str
    file: str
    old: str
    new: str
    tests: str


ALTERATIONS = (
    # Threads
    Alteration("helpers are not waited for", "_threads.py", "                helper.result()", "                pass", THREADS),
    Alteration("errors of helpers are lost", "_threads.py", "helper.result()", "helper.exception()", THREADS),
    Alteration("blocks are taken without a lock", "_threads.py", "            with lock:\n                block", "            with contextlib.nullcontext():\n                block", THREADS),
    Alteration("a forked child keeps the pool", "_threads.py", "after_in_child=_pools.clear", "after_in_child=list", THREADS),
    Alteration("warnings of NumPy are printed", "_threads.py", 'np.errstate(all="ignore")', "np.errstate()", THREADS),
    Alteration("threads=0 is one", "_threads.py", "wanted or cores", "wanted or 1", THREADS),
    Alteration("any number of threads", "_threads.py", "min(wanted or cores, 4 * cores)", "(wanted or cores)", THREADS),
    Alteration("threads below 0", "_threads.py", "if wanted < 0:", "if wanted < -9:", THREADS),
    Alteration("threads=1.5 is one", "_threads.py", "operator.index(threads)", "int(threads)", THREADS),
    Alteration("the last block is left out", "_threads.py", "range(0, len(first), step)", "range(0, len(first) - step + 1, step)", THREADS),
    Alteration("blocks begin one too late", "_threads.py", "array[start : start + step]", "array[start + 1 : start + step]", THREADS),
    Alteration("blocks of several axes are too large", "_threads.py", "step = limit // inner", "step = limit", THREADS),
    Alteration("no helpers", "_threads.py", "range(workers - 1)", "range(0)", THREADS),
    Alteration("a pool for each call", "_threads.py", '_pools.get("") or _pools.setdefault("", ', '(lambda pool: pool)(', THREADS),
    # Kernels
    Alteration("what is missing is forgotten", "_absent.py", "(*outputs, output)", "(*outputs,)", ABSENT),
    Alteration("any name is an output", "_absent.py", "if not output or output in outputs:", "if False:", ABSENT),
    Alteration("fk is missing as fk", "_absent.py", '"fk" if output == "pose" else output: output', "output: output", ABSENT),

    Alteration("a kernel unpickles as another", "_kernel.py", "return self.__name__  # pickled", 'return "jacobian"  # pickled', CALLS),
    Alteration("bind forgets its layout", "_kernel.py", "out=self._given(results), layout=layout)", "out=self._given(results))", CALLS),
    Alteration("bind forgets its parameters", "_kernel.py", "return partial(self, *inputs, params=params, out", "return partial(self, *inputs, out", CALLS),
    Alteration("bind does not look at types", "_kernel.py", "array.dtype not in self._reals or array.dtype != real", "False", CALLS),
    Alteration("bind takes any number of arrays", "_kernel.py", "if len(arrays) != len(self.inputs) + len(self.results):", "if False:", CALLS),
    Alteration("a result that is read-only", "_kernel.py", "if not out.flags.writeable:", "if False:", CALLS),
    Alteration("the type of out is not looked at", "_kernel.py", "if out.dtype != each.dtype(dtype):", "if False:", CALLS),
    Alteration("the shape of out is not looked at", "_kernel.py", "if out.shape != shape:", "if False:", CALLS),
    Alteration("out may be masked", "_kernel.py", "isinstance(out, np.ma.MaskedArray) or not", "not", CALLS),
    Alteration("out may overlap itself", "_kernel.py", "if overlaps_itself(out):", "if False:", CALLS),
    Alteration("out may overlap inputs", "_kernel.py", "            check_apart(self.__name__, label, out, others)", "            list(others)", CALLS),
    Alteration("the number of inputs is not looked at", "_kernel.py", "        if len(inputs) != len(self.inputs):\n            names = \", \".join(array.name for array in self.inputs)\n            number", "        if False:\n            names = \", \".join(array.name for array in self.inputs)\n            number", CALLS),
    Alteration("any layout", "_kernel.py", "if layout not in _LAYOUTS or", "if", CALLS),
    Alteration("single precision becomes double", "_kernel.py", 'array.dtype.itemsize <= 4 for array in arrays)', 'array.dtype.itemsize <= 2 for array in arrays)', CALLS),
    Alteration("double precision becomes single", "_kernel.py", "array.dtype.itemsize <= 4 for array in arrays)", "array.dtype.itemsize <= 8 for array in arrays)", CALLS),
    Alteration("the number of joints is not looked at", "_kernel.py", "elif array.shape[max(0, array.ndim - len(inner)) :] != inner:", "elif False:", CALLS),
    # Inputs
    Alteration("objects are let through", "_engines.py", 'if array.dtype.kind not in "fiub":', 'if array.dtype.kind not in "fiubO":', CALLS),
    Alteration("complex numbers are let through", "_engines.py", 'if array.dtype.kind not in "fiub":', 'if array.dtype.kind not in "fiubc":', CALLS),
    Alteration("masked arrays are let through", "_engines.py", "if isinstance(values, np.ma.MaskedArray):", "if False:", CALLS),
    Alteration("dates are let through", "_engines.py", 'if array.dtype.kind not in "fiub":', 'if array.dtype.kind not in "fiubM":', CALLS),
    Alteration("the last row of a pose", "_engines.py", "= (0.0, 0.0, 0.0, 1.0)", "= (0.0, 0.0, 1.0, 0.0)", CALLS),
    Alteration("parameters of every configuration are the first", "_engines.py", "        if any(array.strides):\n", "        if False:\n", CALLS),
    Alteration("an extension of other sources", "_engines.py", "    if _stamp(native) != stamp:\n        raise", "    if False:\n        raise", LOADING),
    Alteration("an extension that is cut short", "_engines.py", "sections + size * count > path.stat().st_size", "False", LOADING),
    # Memory that is shared
    Alteration("nothing overlaps", "_overlap.py", "return bool(np.shares_memory(first, second, max_work=effort))", "return False", CALLS),
    Alteration("nothing overlaps itself", "_overlap.py", "            return array.size > 0", "            return False", CALLS),
    Alteration("what takes too long does not overlap", "_overlap.py", "    except RuntimeError:\n        return True", "    except RuntimeError:\n        return False", CALLS),
    Alteration("everything overlaps itself", "_overlap.py", "if size > 1)", "if size > 0)", CALLS),
    # Measures
    Alteration("manipulability is a sum", "_measures.py", "values.prod(axis=-1)", "values.sum(axis=-1)", CALLS),
    Alteration("the condition number is upside down", "_measures.py", "values[..., 0] / values[..., -1]", "values[..., -1] / values[..., 0]", CALLS),
    Alteration("measures of NaN are 0", "_measures.py", "np.where(finite[..., 0], values, np.nan)", "values", CALLS),
    Alteration("measures warn", "_measures.py", 'np.errstate(divide="ignore", invalid="ignore")', "np.errstate()", CALLS),
    Alteration("measures of vectors", "_measures.py", 'array.ndim < 2', "array.ndim < 0", CALLS),
    # Targets
    Alteration("scaled rotations are targets", "_targets.py", "(x, x, 1), (y, y, 1), (z, z, 1), ", "", CALLS),
    Alteration("skew rotations are targets", "_targets.py", ", (x, y, 0), (y, z, 0), (z, x, 0)", "", CALLS),
    Alteration("reflections are targets", "_targets.py", "+ across[2] * z[2] < 0", "+ across[2] * z[2] < -9", CALLS),
    Alteration("any last row is a target's", "_targets.py", "yield (m[12] != 0) | (m[13] != 0) | (m[14] != 0) | (m[15] != 1)", "yield m[15] != 1", CALLS),
    Alteration("NaN is a target", "_targets.py", "yield sum(m) * 0 != 0", "yield m[0] * 0 > 0", CALLS),
    Alteration("one target: scaled rotations", "_targets.py", "abs(a * a + b * b + c * c - 1) <= allowed", "True", CALLS),
    Alteration("one target: reflections", "_targets.py", "        and abs(b * f - c * e - g) <= allowed\n        and abs(c * d - a * f - h) <= allowed\n        and abs(a * e - b * d - i) <= allowed\n", "", CALLS),
    Alteration("one target: NaN positions", "_targets.py", "        and x - x == y - y == z - z == 0\n", "", CALLS),
    Alteration("floats are held to the limits of doubles", "_targets.py", "np.dtype(np.float32): 1e-4", "np.dtype(np.float32): 1e-7", CALLS),
    # Arrays of other libraries
    Alteration("xp: sine", "xp.py", "Entry(xp, xp.sin(guarded))", "Entry(xp, 1.0001 * xp.sin(guarded))", XP),
    Alteration("xp: cosine is a sine", "xp.py", "Entry(xp, xp.cos(guarded))", "Entry(xp, xp.sin(guarded))", XP),
    Alteration("xp: last row", "xp.py", "(0.0, 0.0, 0.0, 1.0)", "(0.0, 0.0, 1.0, 0.0)", XP),
    Alteration("xp: range of float32", "xp.py", 'limit = 12000.0 if', 'limit = 100000.0 if', XP),
    Alteration("xp: selection turned round", "xp.py", "model.like(first), model.like(second)))", "model.like(second), model.like(first)))", XP),
    Alteration("xp: arc tangent of exchanged sides", "xp.py", "arctan(up + (up - up), along + (along - along))", "arctan(along + (along - along), up + (up - up))", XP),
    Alteration("xp: an infinity has an arc tangent", "xp.py", "arctan(up + (up - up), along + (along - along))", "arctan(up, along)", XP),
    Alteration("xp: differences turned round", "xp.py", "return self._made(_plain(other) - self.value)", "return self._made(self.value - _plain(other))", XP),
    Alteration("xp: whole numbers", "xp.py", 'if "float" not in str(array.dtype):', "if False:", XP),
    Alteration("xp: the number of joints", "xp.py", "if tuple(array.shape[-1:]) != each.shape:", "if False:", XP),
    # Derivatives
    Alteration("moment of a gradient", "_derivatives.py", "(y * fz - z * fy).sum(-1)", "(z * fy - y * fz).sum(-1)", DERIVATIVES),
    Alteration("rate of a rotation", "_derivatives.py", "wz * x - wx * z", "wx * z - wz * x", DERIVATIVES),
    Alteration("rate of the last row", "_derivatives.py", "rows[0] * 0.0", "rows[0]", DERIVATIVES),
    Alteration("forces are moments", "_derivatives.py", "*(gradient[..., row, 3] for row in range(3)), *moments]", "*moments, *(gradient[..., row, 3] for row in range(3))]", DERIVATIVES),
    Alteration("axes of the Hessian", "_derivatives.py", "hessian.swapaxes(-3, -2).swapaxes(-2, -1)", "hessian.swapaxes(-3, -2)", DERIVATIVES),
    Alteration("rates of a twist", "_derivatives.py", ".sum(-1).swapaxes(-2, -1)", ".sum(-1)", DERIVATIVES),
    Alteration("rows of a position", "_derivatives.py", "matrix(sources[0])[..., :3, :]", "matrix(sources[0])[..., 3:, :]", DERIVATIVES),
    Alteration("rows of a position by parameters", "_derivatives.py", "Part(slopes[..., :3, :])", "Part(slopes[..., 3:, :])", DERIVATIVES),
    Alteration("parameters without a column", "_derivatives.py", "if lacking:", "if False:", DERIVATIVES),
    Alteration("xp: parameters of the robot file", "xp.py", "checked_params(name, params, kernel._params)", "kernel._params", XP),
    Alteration("gradients: the other sign", "_gradients.py", 'np.einsum("tijn,tin->jn", blocks', '-np.einsum("tijn,tin->jn", blocks', DERIVATIVES),
    Alteration("gradients: axes of the Hessian", "_gradients.py", "blocks.transpose(0, 2, 3, 1, 4)", "blocks.transpose(0, 2, 1, 3, 4)", DERIVATIVES),
    Alteration("gradients: the rest of a batch", "_gradients.py", "if count:", "if count > _BLOCK:", DERIVATIVES),
    Alteration("XLA: arguments may be written", "_xla.py", "array.flags.writeable = False", "array.flags.writeable = True", DERIVATIVES),
    Alteration("XLA: errors are lost", "_xla.py", "return _failed(frame, f", "return None and _failed(frame, f", DERIVATIVES),
    Alteration("XLA: number types exchanged", "_xla.py", "{11: np.dtype(np.float32), 12: np.dtype(np.float64)}", "{12: np.dtype(np.float32), 11: np.dtype(np.float64)}", DERIVATIVES),
    Alteration("XLA: every stage computes", "_xla.py", "if frame.stage != _EXECUTE:", "if False:", DERIVATIVES),
    # Limits, parameters, actuators
    Alteration("an infinity is within limits", "_limits.py", " & np.isfinite(array)", "", LIMITS),
    Alteration("the lower limit does not count", "_limits.py", "(array >= low) & ", "", LIMITS),
    Alteration("a limit itself is outside", "_limits.py", "(array <= high)", "(array < high)", LIMITS),
    Alteration("clamp takes the other side", "_limits.py", "np.minimum(np.maximum(array, low), high)", "np.maximum(np.minimum(array, low), high)", LIMITS),
    Alteration("masked joint values have limits", "_limits.py", " or isinstance(q, np.ma.MaskedArray)", "", LIMITS),
    Alteration("parameters of another package", "_parameters.py", "type(params) is not type(usual)", "False", LIMITS),
    Alteration("parameters are not looked at", "_parameters.py", "isinstance(value, (float, int)) for", "True for", LIMITS),
    Alteration("readings beyond the range", "_actuators.py", " & (array >= low - room) & (array <= high + room)", "", LIMITS),
    Alteration("readings that are NaN", "_actuators.py", "~(np.isfinite(array) & (array >= low - room) & (array <= high + room))", "(array < low - room) | (array > high + room)", LIMITS),
    # Results by name
    Alteration("a tuple is an array", "_names.py", " or isinstance(result, tuple) == (len(self.results) == 1):", ":", NAMES),
    Alteration("any number of arrays", "_names.py", "len(arrays) != len(self.results) or ", "", NAMES),
    Alteration("any array", "_names.py", "        if not fits:", "        if False:", NAMES),
    Alteration("an array of any kind", "_names.py", "if not isinstance(array, np.ndarray):", "if False:", NAMES),
    Alteration("parts of the first name", "_names.py", "tuple((..., i, *tail) for tail in tails)", "tuple((..., 0, *tail) for tail in tails)", NAMES),
    Alteration("columns of the first name", "_names.py", "slice(i * size, (i + 1) * size)", "slice(0, size)", NAMES),
    Alteration("the part of the first result alone", "_names.py", "tuple(array[place] for array, place in zip(whole, places, strict=True))", "whole[0][places[0]]", NAMES),
    Alteration("options that are forgotten", "_names.py", "is_plain = params is None", "is_plain = True or params is None", NAMES),
    Alteration("a layout of another name", "_names.py", "if layout not in _LAYOUTS:", "if False:", NAMES),
)  # fmt: skip
