"""Kernels of a made-up arm straight from the shared array handling: no build, no compiler.

Joint 1 turns about z, joint 2 slides along the x axis that it turns. The formulas are the NumPy form of an emitter.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kinegen.runtime.vendored._engines import Array
from kinegen.runtime.vendored._kernel import Kernel

MODULE = "tests.native.plain_arm"
Q = Array("q", (2,))
POSE = Array("base_T_tool", (4, 4), is_pose=True)
JACOBIAN = Array("jacobian", (6, 2))
HESSIAN = Array("hessian", (2, 6, 2))


class Params(NamedTuple):
    """The runtime parameter: what is added to the stroke."""

    offset: float = 0.5


_PLAIN = Params(0.0)


def _pose(q: Any, params: Any = _PLAIN) -> Any:
    c, s, r = np.cos(q[0]), np.sin(q[0]), q[1] + params.offset
    return c, -s, 0.0, r * c, s, c, 0.0, r * s, 0.0, 0.0, 1.0, 0.25


def _jacobian(q: Any, params: Any = _PLAIN) -> Any:
    c, s, r = np.cos(q[0]), np.sin(q[0]), q[1] + params.offset
    return -r * s, c, r * c, s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0


def _hessian(q: Any) -> Any:
    c, s, r = np.cos(q[0]), np.sin(q[0]), q[1]
    by_1 = -r * c, -s, -r * s, c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    by_2 = -s, 0.0, c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return *by_1, *by_2


def _twist(q: Any, qd: Any) -> Any:
    j = _jacobian(q)
    return tuple(j[2 * row] * qd[0] + j[2 * row + 1] * qd[1] for row in range(6))


def kernel(name: str, formula: Any, inputs: Any, results: Any, **options: Any) -> Kernel[Any]:
    """A kernel of this module."""
    reals = options.pop("reals", ("float64", "float32"))
    return Kernel(
        name, module=MODULE, symbol="", inputs=inputs, results=results, reals=reals, formula=formula, **options
    )


fk = kernel("fk", _pose, (Q,), (POSE,))
jacobian = kernel("jacobian", _jacobian, (Q,), (JACOBIAN,))
hessian = kernel("hessian", _hessian, (Q,), (HESSIAN,))
position = kernel("position", lambda q: _pose(q)[3::4], (Q,), (Array("base_p_tool", (3,)),))
twist = kernel("twist", _twist, (Q, Array("qd", (2,))), (Array("twist", (6,)),))
fk_jacobian = kernel("fk_jacobian", lambda q: (*_pose(q), *_jacobian(q)), (Q,), (POSE, JACOBIAN))
single = kernel("single", _pose, (Q,), (POSE,), reals=("float32",))
varied = kernel("varied", _pose, (Q,), (POSE,), params=Params())
