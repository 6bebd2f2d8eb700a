"""CasADi: the product of link matrices as an SX function, through `map`, and its generated C in a loop."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.library import libm_build, loop
from benchmarks.speed.peers import Peer


def peers(arm: Arm) -> Iterator[Peer]:
    """`map` and the generated C; CasADi has doubles alone."""
    casadi: Any = importlib.import_module("casadi")
    function = _function(casadi, arm)
    yield Peer(
        name="CasADi map",
        package="casadi",
        real="double",
        batch=lambda q: _batch(function, q),
        result=lambda result: np.asarray(result).T.reshape(-1, 4, 4),
        single=lambda q: (function, q),
        single_name="CasADi function",
    )
    text = _c_text(casadi, function, arm.dof)
    yield Peer(
        name="CasADi, its C in a loop",
        package="casadi",
        real="double",
        batch=lambda q: _loop(text, q),
        result=np.asarray,
    )


def _function(casadi: Any, arm: Arm) -> Any:
    """One pose, row by row in one column."""
    q = casadi.SX.sym("q", arm.dof)
    pose = casadi.SX.eye(4)
    for link in arm.links:
        theta = float(link.theta) + (q[link.joint] if link.joint is not None else 0)
        rows = link.matrix(casadi.cos(theta), casadi.sin(theta))
        pose = pose @ casadi.vertcat(*(casadi.horzcat(*row) for row in rows))
    return casadi.Function("fk", [q], [casadi.densify(pose.T.reshape((16, 1)))], {"cse": True})


def _batch(function: Any, q: Array) -> Callable[[], Any]:
    mapped, columns = function.map(len(q)), np.asfortranarray(q.T)
    return lambda: mapped(columns)


def _loop(text: str, q: Array) -> Callable[[], Array]:
    out = np.empty((len(q), 4, 4))
    run = loop(libm_build(), text, q, out, len(q))

    def evaluate() -> Array:
        run()
        return out

    return evaluate


def _c_text(casadi: Any, function: Any, dof: int) -> str:
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator("fk.c")
        generator.add(function)
        generator.generate(f"{folder}/")
        text = (Path(folder) / "fk.c").read_text(encoding="utf-8")
    return f"""{text}
#include <stddef.h>
void loop(size_t n, const double *q, double *out)
{{
    for (size_t i = 0; i < n; i++) {{
        const double *arg[] = {{q + {dof} * i}};
        double *res[] = {{out + 16 * i}};
        fk(arg, res, NULL, NULL, 0);
    }}
}}
"""
