"""The C between the kernels of a robot and Python: what cffi may call, and the reading of NumPy arrays.

In: the interface of a robot, a frozen record. Out: the declarations for cffi and the C text that goes into the
extension besides the emitted files. For an output `fk` of the robot `arm` the extension has

    arm_fk, arm_fk_batch     the kernels as emitted; `arm_f32_...` for float
    arm_fk_arrays            takes the addresses of two array objects, and declines (0) what is not plain
    arm_fk_pointers          the scalar kernel with plain pointers, for bound arguments
    kinegen_stamp            the digest of the sources
    kinegen_select           picks the variant of the batch kernels, by name or (an empty one) the best that this
                             processor can run; 0 if there is none
    kinegen_variant          what was picked, and the flags, in words

The last two are made by `dispatch.py`. The array handling (`kernel.py`) knows these names.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources

HEADER = "kinegen_glue.h"
"""Declares everything that cffi calls."""

GLUE = "kinegen_glue.c"
"""The only file besides cffi's that reads Python's headers."""


@dataclass(frozen=True, slots=True)
class OutputShape:
    """One output kind.

    Attributes:
        name: `fk`, `frames` or `position`.
        shape: Of the result for one configuration: (4, 4), (tips, 4, 4), (3,) or (tips, 3).
    """

    name: str
    shape: tuple[int, ...]

    @property
    def is_pose(self) -> bool:
        """Whether it holds matrices."""
        return self.shape[-2:] == (4, 4)

    def extents(self) -> str:
        """Extents of the output argument of the scalar kernel, as emitted."""
        inner = 16 if self.is_pose else 3
        outer = self.shape[:-2] if self.is_pose else self.shape[:-1]
        return "".join(f"[{extent}]" for extent in (*outer, inner))


@dataclass(frozen=True, slots=True)
class Interface:
    """What an extension offers.

    Attributes:
        symbol: Prefix of the robot's C names.
        dof: Number of joint values.
        outputs: The output kinds.
        reals: `double`, `float` or both, in this order.
        parameters: Names of the runtime parameters, in the order of the C struct.
    """

    symbol: str
    dof: int
    outputs: tuple[OutputShape, ...]
    reals: tuple[str, ...]
    parameters: tuple[str, ...] = ()

    def prefix(self, real: str) -> str:
        """Prefix of the names of one number type."""
        return self.symbol if real == "double" else f"{self.symbol}_f32"

    def headers(self) -> tuple[str, ...]:
        """The headers that declare the kernels."""
        return tuple(f"{self.prefix(real)}{part}.h" for real in self.reals for part in ("", "_batch"))


def declarations(interface: Interface) -> str:
    """What cffi is told: every function of the extension.

    Args:
        interface: The robot's interface.

    Returns:
        C declarations without macros.
    """
    lines = list(_FIXED)
    for real in interface.reals:
        prefix = interface.prefix(real)
        if interface.parameters:
            lines += [
                "typedef struct {",
                *(f"    {real} {name};" for name in interface.parameters),
                f"}} {prefix}_params;",
            ]
        for output in interface.outputs:
            q = [f"const {real} q[{interface.dof}]"] if interface.dof else []
            params = [f"const {prefix}_params *params"] if interface.parameters else []
            scalar = ", ".join([*q, *params, f"{real} out{output.extents()}"])
            batch = ", ".join(batch_arguments(interface, real))
            lines.append(f"void {prefix}_{output.name}({scalar});")
            lines.append(f"void {prefix}_{output.name}_batch({batch});")
            lines.append(f"{_pointers(interface, output, real)};")
    lines += [f"{_arrays(interface, output)};" for output in interface.outputs]
    return "\n".join(lines) + "\n"


def batch_arguments(interface: Interface, real: str) -> tuple[str, ...]:
    """The arguments of a batch kernel, as declared in the emitted header.

    Args:
        interface: The robot's interface.
        real: Number type.

    Returns:
        C declarations, each ending in the name.
    """
    params = (f"const {interface.prefix(real)}_params *params",) if interface.parameters else ()
    points = ("size_t n", f"const {real} *q", "ptrdiff_t q_pose", "ptrdiff_t q_joint")
    return (*points, *params, f"{real} *out", "ptrdiff_t out_stride", "int layout")


def glue(interface: Interface, digest: str) -> dict[str, str]:
    """The C that stands between the kernels and Python.

    Args:
        interface: The robot's interface.
        digest: What `stamp_of` says of the emitted sources.

    Returns:
        C text by file name, to be compiled beside the emitted files.
    """
    arrays = resources.files("kinegen.native").joinpath("arrays.h").read_text(encoding="utf-8")
    own = [f"{_pointers(interface, output, real)};" for output in interface.outputs for real in interface.reals]
    own += [*_FIXED, *(f"{_arrays(interface, output)};" for output in interface.outputs)]
    header = ["#include <stdint.h>", *(f'#include "{header}"' for header in interface.headers()), "", *own]
    # The robot's headers stand first: those of NumPy bring the macro I, which may be the name of a parameter.
    parts = [f'#include "{HEADER}"', '#include "arrays.h"', ""]
    parts += [f'const char *kinegen_stamp(void) {{ return "{digest}"; }}', ""]
    for output in interface.outputs:
        parts += [_pointers_definition(interface, output, real) for real in interface.reals]
        parts += [_arrays_definition(interface, output), ""]
    written = {HEADER: header, GLUE: parts}
    return {"arrays.h": arrays} | {name: "\n".join(lines) + "\n" for name, lines in written.items()}


_FIXED = (
    "const char *kinegen_stamp(void);",
    "int kinegen_select(const char *wanted);",
    "const char *kinegen_variant(void);",
)


def _pointers(interface: Interface, output: OutputShape, real: str) -> str:
    prefix = interface.prefix(real)
    params = f"const {prefix}_params *params, " if interface.parameters else ""
    return f"void {prefix}_{output.name}_pointers({params}const {real} *q, {real} *out)"


def _pointers_definition(interface: Interface, output: OutputShape, real: str) -> str:
    several = len(output.shape) > (2 if output.is_pose else 1)
    inner = 16 if output.is_pose else 3
    arguments = ["q"] * bool(interface.dof) + ["params"] * bool(interface.parameters)
    arguments.append(f"({real} (*)[{inner}])out" if several else "out")
    unused = "" if interface.dof else "    (void)q;\n"
    call = f"    {interface.prefix(real)}_{output.name}({', '.join(arguments)});"
    return f"{_pointers(interface, output, real)}\n{{\n{unused}{call}\n}}\n"


def _arrays(interface: Interface, output: OutputShape) -> str:
    params = [f"const {interface.prefix(real)}_params *params_{real}" for real in interface.reals]
    arguments = [*(params if interface.parameters else ()), "uintptr_t q", "uintptr_t out", "int layout"]
    return f"int {interface.symbol}_{output.name}_arrays({', '.join(arguments)})"


def _arrays_definition(interface: Interface, output: OutputShape) -> str:
    shape = ", ".join(str(extent) for extent in output.shape)
    values = f"{interface.dof}, {len(output.shape)}, {{{shape}}}, {int(output.is_pose)}"
    lines = [
        _arrays(interface, output),
        "{",
        f"    static const Output output = {{{values}}};",
        "    Arguments a;",
        "    if (!read_arrays(q, out, layout, &output, &a)) return 0;",
    ]
    for real in interface.reals:
        function = f"{interface.prefix(real)}_{output.name}"
        params = f"params_{real}, " if interface.parameters else ""
        lines += [
            f"    if (a.type == NPY_{real.upper()}) {{",
            f"        if (a.single) {function}_pointers({params}a.q, a.out);",
            f"        else {function}_batch(a.count, a.q, a.q_pose, a.q_joint, {params}a.out, a.out_stride, layout);",
            "        return 1;",
            "    }",
        ]
    return "\n".join([*lines, "    return 0;", "}"])
