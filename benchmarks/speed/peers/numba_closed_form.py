"""Numba: the closed form of the kernels as Python text, a loop with `prange`, fastmath off, one thread."""

from __future__ import annotations

import importlib
import importlib.util
import tempfile
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.peers import Peer
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement, Temporary, Variable

_SIGNS = {Operator.ADD: "+", Operator.SUB: "-", Operator.MUL: "*", Operator.DIV: "/"}


def peers(arm: Arm) -> Iterator[Peer]:
    """Both number types."""
    numba: Any = importlib.import_module("numba")
    numba.set_num_threads(1)
    for real in ("double", "float"):
        module = _module(arm, "float64" if real == "double" else "float32")
        yield Peer(
            name="Numba closed form, prange",
            package="numba",
            real=real,
            batch=partial(_batch, module),
            result=np.asarray,
            single=partial(_single, module),
            single_name="Numba closed form",
        )


def _batch(module: ModuleType, q: Array) -> Callable[[], Array]:
    out = np.empty((len(q), 4, 4), q.dtype)

    def run() -> Array:
        module.many(q, out)
        return out

    return run


def _single(module: ModuleType, q: Array) -> tuple[Callable[[Any], Any], Any]:
    return module.one, q


def _module(arm: Arm, real: str) -> ModuleType:
    """Written to a file, since Numba compiles functions that have a source."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"numba_{arm.name}_{real}.py"
        path.write_text(_text(arm.program, real), encoding="utf-8")
        spec = importlib.util.spec_from_file_location(path.stem, path)
        if spec is None or spec.loader is None:
            raise ImportError(path.stem)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        # Compiled now, while the file exists.
        q = np.zeros((2, arm.dof), real)
        module.many(q, np.empty((2, 4, 4), real))
        module.one(q[0])
    return module


def _text(program: Program, real: str) -> str:
    constants: dict[str, str] = {}

    def operand(value: Operand) -> str:
        match value:
            case Variable(index):
                return f"q[{index}]"
            case Constant(number):
                return constants.setdefault(f"np.{real}({float(number)!r})", f"k{len(constants)}")
            case Temporary(name):
                return name
        raise NotImplementedError("left out: runtime parameters")

    def expression(statement: Statement) -> str:
        operands = [operand(each) for each in statement.operands]
        if statement.operator is Operator.SINCOS:
            return f"math.sin({operands[0]}), math.cos({operands[0]})"
        if statement.operator is Operator.NEG:
            return f"-{operands[0]}"
        return f" {_SIGNS[statement.operator]} ".join(operands)

    zero, one = (operand(Constant(Fraction(number))) for number in (0, 1))
    body = [f"{', '.join(each.results)} = {expression(each)}" for each in program.statements]
    body += [f"T[{place // 4}, {place % 4}] = {operand(each)}" for place, each in enumerate(program.outputs)]
    body += [f"T[3, {column}] = {one if column == 3 else zero}" for column in range(4)]
    return _MODULE.format(
        constants="\n".join(f"{name} = {value}" for value, name in constants.items()),
        body="\n    ".join(body),
        real=real,
    )


_MODULE = """
import math

import numpy as np
from numba import njit, prange

{constants}


@njit(inline="always")
def pose(q, T):
    {body}


@njit(parallel=True, fastmath=False)
def many(q, out):
    for i in prange(q.shape[0]):
        pose(q[i], out[i])


@njit(fastmath=False)
def one(q):
    T = np.empty((4, 4), np.{real})
    pose(q, T)
    return T
"""
