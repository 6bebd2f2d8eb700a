"""Small hand-written robots for the array handling: C, NumPy form and package, with the interfaces of emitted ones.

The arithmetic is made up and exact to follow: number r of block f of result k is
`x[r % size] * (r + 1) + (f + k + offset)`, where x holds the numbers of all inputs, one multiplication and one
addition, so that C without contraction and NumPy give the same bits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.files import stamp_of
from kinegen.backends.python.vendored import emit_vendored
from kinegen.model.outputs import Array
from kinegen.runtime.cffi_interface import Function, Interface
from kinegen.runtime.extension import build_extension, lay_out
from kinegen.runtime.flags import Flags
from kinegen.support.naming import EXTENSION

FLAGS = Flags(contraction=False, optimisation="1")
DTYPES = {"double": "float64", "float": "float32"}


@dataclass(frozen=True)
class Sample:
    """A made-up robot.

    Attributes:
        name: Its name.
        dof: Number of joint values.
        tips: Number of tips; 0 for a chain.
        reals: Number types of the C.
        parameter: Whether it has the runtime parameter `offset`, 2.0 in the file; otherwise it is 0.
        several: Whether it has the functions of several inputs and results beside the usual ones.
    """

    name: str
    dof: int = 3
    tips: int = 0
    reals: tuple[str, ...] = ("double", "float")
    parameter: bool = False
    several: bool = False

    @cached_property
    def functions(self) -> tuple[Function, ...]:
        """Its kernels: pose, two frames, position; with `several` those of more inputs and results."""
        q, qd = Array("q", (self.dof,)), Array("qd", (self.dof,))
        frames = Array("base_T_frames", (2, 4, 4), is_pose=True, per_frame=True)
        usual = (
            Function("fk", (q,), (self._pose(),)),
            Function("frames", (q,), (frames,)),
            Function("position", (q,), (self._for_tips("base_p_tool", (3,)),)),
        )
        if not self.several:
            return usual
        jacobian, pose = self._for_tips("jacobian", (6, self.dof)), Array("a_T_b", (4, 4), is_pose=True)
        twist = self._for_tips("twist", (6,))
        return (
            *usual,
            Function("moving", (q, qd), (self._pose(), jacobian)),
            Function("twist", (q, qd), (twist,)),
            Function("inverse_pose", (pose,), (Array("b_T_a", (4, 4), is_pose=True),)),
            Function("transform", (pose, Array("point", (3,))), (Array("moved", (3,)),)),
            Function("hessian", (q,), (Array("hessian", (self.dof, 6, self.dof)),)),
            Function("adjoint", (pose,), (Array("adjoint", (6, 6)),)),
        )

    def function(self, name: str) -> Function:
        """One of its kernels."""
        return next(function for function in self.functions if function.name == name)

    @property
    def interface(self) -> Interface:
        """What its extension offers."""
        return Interface(self.name, self.functions, self.reals, ("offset",) * self.parameter)

    def _pose(self) -> Array:
        if self.tips:
            return Array("base_T_tips", (self.tips, 4, 4), is_pose=True, per_frame=True)
        return Array("base_T_tool", (4, 4), is_pose=True)

    def _for_tips(self, name: str, shape: tuple[int, ...]) -> Array:
        return Array(name, (self.tips, *shape), per_frame=True) if self.tips else Array(name, shape)

    def reference(self, function: Function, *inputs: Any, offset: float | None = None, layout: str = "4x4") -> Any:
        """What the kernel should give, computed apart from it: plain NumPy in the type of the inputs.

        Args:
            function: The kernel.
            inputs: The inputs; their leading axes broadcast.
            offset: The runtime parameter; by default that of the file.
            layout: Of inputs and results.

        Returns:
            The result, or a tuple of several.
        """
        if offset is None:
            offset = 2.0 if self.parameter else 0.0
        rows = [_rows(array, given, layout) for array, given in zip(function.inputs, inputs, strict=True)]
        lead = np.broadcast_shapes(*(given.shape[:-1] for given in rows))
        x = np.concatenate([np.broadcast_to(given, (*lead, given.shape[-1])) for given in rows], axis=-1)
        results = tuple(_result(array, k, x, offset, layout) for k, array in enumerate(function.results))
        return results if len(results) > 1 else results[0]

    def sources(self) -> dict[str, str]:
        """The C files that the emitters would have written."""
        code = Path(__file__).with_name("sample.c").read_text(encoding="utf-8")
        files = {}
        for real in self.reals:
            prefix = self.interface.prefix(real)
            head = f'#define REAL {real}\n#include "{prefix}.h"\n{code}'
            files |= {f"{prefix}.h": self._header(real), f"{prefix}_batch.h": f'#include "{prefix}.h"\n'}
            scalar = "".join(self._scalar(function, real) for function in self.functions)
            batch = "".join(self._batch(function, real) for function in self.functions)
            files |= {f"{prefix}.c": head + scalar, f"{prefix}_batch.c": head + batch}
        return files

    def write(self, folder: Path, cache: Path, *, native: bool = True) -> Path:
        """Write the whole package.

        Args:
            folder: Where the package folder goes.
            cache: Cache of compiled extensions.
            native: Whether to compile.

        Returns:
            The package folder.
        """
        package = folder / self.name
        lay_out(package, emit_vendored(()))
        (package / "_numpy.py").write_text(self._numpy(), encoding="utf-8")
        (package / "__init__.py").write_text(self._init(), encoding="utf-8")
        if native:
            extension = build_extension(self.interface, self.sources(), FLAGS, cache)
            extension.keep()
            content = extension.content
            (package / EXTENSION).write_bytes(content)
        return package

    def _init(self) -> str:
        reals = tuple(DTYPES[real] for real in self.reals)
        lines = ["from typing import NamedTuple", "from . import _numpy"]
        lines += ["from ._runtime._engines import Array, load_native", "from ._runtime._kernel import Kernel"]
        lines += ["class Params(NamedTuple):", "    offset: float = 2.0"] if self.parameter else []
        lines += [f'_native = load_native("{stamp_of(self.sources())}")']
        lines += [
            f'{function.name} = Kernel("{function.name}", module=__name__, symbol="{self.name}", '
            f"inputs={_listed(function.inputs)}, results={_listed(function.results)}, "
            f"reals={reals}, formula=_numpy.{function.name}, native=_native, "
            f'params={"Params()" if self.parameter else None}, doc="The {function.name}.")'
            for function in self.functions
        ]
        return "\n".join([*lines, "backend = fk.backend", ""])

    def _numpy(self) -> str:
        lines = []
        for function in self.functions:
            names = [array.name for array in function.inputs]
            lines += [f"def {function.name}({', '.join(names + ['params'] * self.parameter)}):"]
            lines += [f"    x = [{', '.join(f'*{name}' for name in names)}] or [1.0]"]
            lines += [f"    offset = {'params.offset' if self.parameter else '0.0'}", "    numbers = []"]
            for k, array in enumerate(function.results):
                places = f"for f in range({array.blocks}) for r in range({array.size // array.blocks})"
                lines += [f"    numbers += [x[r % len(x)] * (r + 1.0) + (f + {k} + offset) {places}]"]
            lines += ["    return numbers"]
        return "\n".join([*lines, ""])

    def _header(self, real: str) -> str:
        """Every prototype of one number type; the batch header repeats none."""
        prefix = self.interface.prefix(real)
        lines = ["#pragma once", "#include <stddef.h>"]
        lines += [f"typedef struct {{ {real} offset; }} {prefix}_params;"] if self.parameter else []
        for function in self.functions:
            lines += [f"{self._head(function, real, batch)};" for batch in (False, True)]
        return "\n".join([*lines, ""])

    def _head(self, function: Function, real: str, batch: bool) -> str:
        name = f"{self.interface.prefix(real)}_{function.name}"
        params = [f"const {self.interface.prefix(real)}_params *params"] * self.parameter
        if batch:
            names = [array.name for array in function.inputs]
            inputs = [f"const {real} *{name}, ptrdiff_t {name}_pose, ptrdiff_t {name}_joint" for name in names]
            results = [f"{real} *{array.name}, ptrdiff_t {array.name}_stride" for array in function.results]
            params += ["ptrdiff_t params_stride"] * self.parameter
            return f"void {name}_batch({', '.join(['size_t n', *inputs, *params, *results, 'int layout'])})"
        inputs = [f"const {real} {array.name}[{array.stored}]" for array in function.inputs if array.size]
        results = [f"{real} {_extents(array)}" for array in function.results if array.size]
        return f"void {name}({', '.join([*inputs, *params, *results]) or 'void'})"

    def _scalar(self, function: Function, real: str) -> str:
        lines = list(self._gathered(function, "{name}", "1"))
        for k, array in enumerate(function.results):
            if array.size:
                lines.append(self._computed(function, k, f"(REAL *){array.name}"))
        return "\n    ".join([f"{self._head(function, real, False)}\n{{", *lines]) + "\n}\n"

    def _batch(self, function: Function, real: str) -> str:
        lines, own = ["for (ptrdiff_t i = 0; i < (ptrdiff_t)n; ++i) {"], "params[i * params_stride].offset"
        lines += self._gathered(function, "{name} + i * {name}_pose", "{name}_joint")
        for k, array in enumerate(function.results):
            numbers = array.blocks * array.stored
            if array.size:
                place = f"{array.name}_one, {numbers}, {array.size // array.blocks}, {array.stored}"
                lines += [f"REAL {array.name}_one[{numbers}];", self._computed(function, k, f"{array.name}_one", own)]
                lines += [f"scatter({place}, i, {array.name}, {array.name}_stride, layout);"]
        return "\n    ".join([f"{self._head(function, real, True)}\n{{", *lines, "}"]) + "\n}\n"

    def _gathered(self, function: Function, place: str, step: str) -> Iterator[str]:
        """Statements that put all inputs one after the other."""
        yield f"REAL x[{_total(function) + 1}] = {{0}};"
        first = 0
        for array in function.inputs:
            if array.size:
                where, stride = (text.format(name=array.name) for text in (place, step))
                yield f"gather({where}, {stride}, {array.size}, x + {first});"
            first += array.size

    def _computed(self, function: Function, k: int, out: str, offset: str = "params->offset") -> str:
        array, offset = function.results[k], offset if self.parameter else "0"
        numbers = f"{array.blocks}, {array.size // array.blocks}, {array.stored}"
        return f"compute(x, {_total(function)}, {k}, {offset}, {numbers}, {out});"


def _total(function: Function) -> int:
    return sum(array.size for array in function.inputs)


def _extents(array: Array) -> str:
    return f"{array.name}{f'[{array.blocks}]' if array.per_frame else ''}[{array.stored}]"


def _listed(arrays: tuple[Array, ...]) -> str:
    return f"({', '.join(f'Array({array.name!r}, {array.shape}, {array.is_pose})' for array in arrays)},)"


def _rows(array: Array, values: Any, layout: str) -> Any:
    """The numbers that are read of an input, on its last axis; the configurations are the axes before."""
    if layout == "joint_major":
        return values.T
    upper = values[..., :3, :] if array.is_pose else values
    return upper.reshape(*values.shape[: values.ndim - len(array.shape)], array.size)


def _result(array: Array, k: int, x: Any, offset: float, layout: str) -> Any:
    real, size = x.dtype.type, x.shape[-1]
    lead, ones = x.shape[:-1], np.ones(x.shape[:-1], x.dtype)
    numbers = [
        (x[..., r % size] if size else ones) * real(r + 1) + real(f + k + offset)
        for f in range(array.blocks)
        for r in range(array.size // array.blocks)
    ]
    table = np.stack(numbers, axis=-1) if numbers else np.empty((*lead, 0), x.dtype)
    if layout == "joint_major":
        return table.T
    if not array.is_pose:
        return table.reshape(lead + array.shape)
    upper = table.reshape(*lead, *array.shape[:-2], 3, 4)
    if layout == "3x4":
        return upper
    last = np.broadcast_to(np.array([0, 0, 0, 1], x.dtype), (*upper.shape[:-2], 1, 4))
    return np.concatenate([upper, last], axis=-2)
