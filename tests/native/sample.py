"""Small hand-written robots for the array handling: C, NumPy form and package, with the interfaces of emitted ones.

The arithmetic is made up and exact to follow: number r of frame f is `q[r % dof] * (r + 1) + (f + offset)`, one
multiplication and one addition, so that C without contraction and NumPy give the same bits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.emit.files import stamp_of
from kinegen.naming import EXTENSION
from kinegen.native.flags import Flags
from kinegen.native.glue import Interface, OutputShape
from kinegen.native.package import build_extension

ROOT = Path(__file__).resolve().parents[2]
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
    """

    name: str
    dof: int = 3
    tips: int = 0
    reals: tuple[str, ...] = ("double", "float")
    parameter: bool = False

    @property
    def outputs(self) -> tuple[OutputShape, ...]:
        """Its output kinds."""
        lead = (self.tips,) if self.tips else ()
        shapes = {"fk": (*lead, 4, 4), "frames": (2, 4, 4), "position": (*lead, 3)}
        return tuple(OutputShape(name, shape) for name, shape in shapes.items())

    @property
    def interface(self) -> Interface:
        """What its extension offers."""
        return Interface(self.name, self.dof, self.outputs, self.reals, ("offset",) * self.parameter)

    def reference(self, output: OutputShape, q: Any, offset: float | None = None, layout: str = "4x4") -> Any:
        """What the kernel should give, computed apart from it: plain NumPy in the type of q."""
        if offset is None:
            offset = 2.0 if self.parameter else 0.0
        if layout == "joint_major":
            q = q.T
        real = q.dtype.type
        ones = np.ones(q.shape[:-1], q.dtype)
        numbers = np.stack(
            [
                (q[..., r % self.dof] if self.dof else ones) * real(r + 1) + real(f + offset)
                for f in range(frames(output))
                for r in range(12 if output.is_pose else 3)
            ],
            axis=-1,
        )
        if layout == "joint_major":
            return numbers.T
        if not output.is_pose:
            return numbers.reshape(q.shape[:-1] + output.shape)
        upper = numbers.reshape(*q.shape[:-1], *output.shape[:-2], 3, 4)
        if layout == "3x4":
            return upper
        last = np.broadcast_to(np.array([0, 0, 0, 1], q.dtype), (*upper.shape[:-2], 1, 4))
        return np.concatenate([upper, last], axis=-2)

    def sources(self) -> dict[str, str]:
        """The C files that the emitters would have written."""
        code = Path(__file__).with_name("sample.c").read_text(encoding="utf-8")
        files = {}
        for real in self.reals:
            prefix = self.interface.prefix(real)
            files |= {f"{prefix}.h": self._header(real), f"{prefix}_batch.h": f'#include "{prefix}.h"\n'}
            files |= {f"{prefix}.c": self._macros(real, 0) + code, f"{prefix}_batch.c": self._macros(real, 1) + code}
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
        package.mkdir(parents=True)
        kernel = (ROOT / "kinegen/native/kernel.py").read_text(encoding="utf-8")
        (package / "_kernel.py").write_text(f"# A banner.\n{kernel}", encoding="utf-8")
        (package / "_numpy.py").write_text(self._numpy(), encoding="utf-8")
        (package / "__init__.py").write_text(self._init(), encoding="utf-8")
        if native:
            content = build_extension(self.interface, self.sources(), FLAGS, cache).content
            (package / EXTENSION).write_bytes(content)
        return package

    def _init(self) -> str:
        reals = tuple(DTYPES[real] for real in self.reals)
        lines = ["from typing import NamedTuple", "from . import _numpy", "from ._kernel import Kernel, load_native"]
        lines += ["class Params(NamedTuple):", "    offset: float = 2.0"] if self.parameter else []
        lines += [f'_native = load_native("{stamp_of(self.sources())}")']
        lines += [
            f'{output.name} = Kernel("{output.name}", module=__name__, symbol="{self.name}", dof={self.dof}, '
            f"shape={output.shape}, reals={reals}, formula=_numpy.{output.name}, native=_native, "
            f'params={"Params()" if self.parameter else None}, doc="The {output.name}.")'
            for output in self.outputs
        ]
        return "\n".join([*lines, "backend = fk.backend", ""])

    def _numpy(self) -> str:
        lines = []
        point = f"q[r % {self.dof}]" if self.dof else "1.0"
        for output in self.outputs:
            places = f"for f in range({frames(output)}) for r in range({12 if output.is_pose else 3})"
            lines += [f"def {output.name}(q{', params' * self.parameter}):"]
            lines += [f"    offset = {'params.offset' if self.parameter else '0.0'}"]
            lines += [f"    return [{point} * (r + 1.0) + (f + offset) {places}]"]
        return "\n".join([*lines, ""])

    def _header(self, real: str) -> str:
        """Every prototype of one number type; the batch header repeats none."""
        prefix = self.interface.prefix(real)
        params = f"const {prefix}_params *params, " if self.parameter else ""
        q = f"const {real} q[{self.dof}], " if self.dof else ""
        batch = (
            f"size_t n, const {real} *q, ptrdiff_t q_pose, ptrdiff_t q_joint, {params}{real} *out, ptrdiff_t s, int l"
        )
        lines = ["#pragma once", "#include <stddef.h>"]
        lines += [f"typedef struct {{ {real} offset; }} {prefix}_params;"] if self.parameter else []
        for output in self.outputs:
            lines += [f"void {prefix}_{output.name}({q}{params}{real} out{output.extents()});"]
            lines += [f"void {prefix}_{output.name}_batch({batch});"]
        return "\n".join([*lines, ""])

    def _macros(self, real: str, batches: int) -> str:
        prefix = self.interface.prefix(real)
        values = {
            "REAL": real,
            "NAME(x)": f"{prefix}_##x",
            "DOF": self.dof,
            "PARAMETER": int(self.parameter),
            "TIPS": max(self.tips, 1),
            "SEVERAL": int(self.tips > 0),
            "BATCHES": batches,
        }
        return "".join(f"#define {name} {value}\n" for name, value in values.items()) + f'#include "{prefix}.h"\n'


def frames(output: OutputShape) -> int:
    """Number of frames in a result."""
    return math.prod(output.shape) // (16 if output.is_pose else 3)
