"""The files of a package beside its kernels: tables, headers, the functions in them, self-tests and vectors.

In: a package in its folder. Out: nothing, or the first file that does not say or do what the robot asks for.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.naming import prefix
from kinegen.native.compiler import find_compiler
from kinegen.outputs import Kind, Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.verify.known import quantity_frames
from kinegen.verify.probe import TYPES, Probe, Spoilable, compile_probe
from kinegen.verify.routines import require_routines
from kinegen.verify.samples import input_samples, vector_samples
from kinegen.verify.selftests import require_selftest
from kinegen.verify.straight import require_straight
from kinegen.verify.tables import DRIVEN, default_parameters, require_tables
from kinegen.verify.tolerances import accepted_error

SPOILT = 64
"""Kernels are spoilt by so many accepted errors."""


def require_files(
    robot: Robot, package: ModuleType, folder: Path, quantities: tuple[Quantity, ...], reals: tuple[str, ...]
) -> None:
    """Check what a package has beside its kernels.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        folder: Where its files lie, and where more may be put.
        quantities: The quantities it was built for.
        reals: Its number types, `double` and `float`.

    Raises:
        CompileError: If a file does not compile, or a header lacks a macro.
        ProofError: If a table, a macro, a default, a function or a self-test is wrong.
    """
    programs = tuple(quantity for quantity in quantities if quantity.kind is not Kind.NUMERIC_INVERSE)
    require_tables(robot, package, programs)
    straight = tuple(quantity for quantity in programs if quantity.kind is not Kind.INVERSE)
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in (".c", ".py")}
    require_straight(robot, texts, straight, reals)
    if package.backend != "c":
        return
    compiler, macros = find_compiler(), header_macros(robot, programs, len(getattr(package, "BRANCHES", ())))
    size = max(_size(robot, package, quantity) for quantity in programs)
    kernels = [_spoilable(getattr(package, quantity.function), quantity) for quantity in programs]
    for real in reals:
        probe = compile_probe(robot, folder, real, kernels, tuple(macros), compiler)
        require_macros(robot, probe, macros)
        _require_defaults(robot, probe)
        require_routines(robot, probe)
        require_selftest(robot, probe, programs, kernels, SPOILT * accepted_error(robot, real) * size)


def header_macros(robot: Robot, quantities: Sequence[Quantity], branches: int = 0) -> dict[str, int]:
    """The macros of a header after the robot's prefix, with their values."""
    kinds = {quantity.kind for quantity in quantities}
    found = {"DOF": robot.dof}
    lists: dict[str, Sequence[str]] = {}
    if robot.is_tree:
        lists["TIP"] = robot.tips
    if Kind.FRAMES in kinds:
        lists["FRAME"] = quantity_frames(robot, Quantity.FRAMES)
    if kinds & set(DRIVEN):
        lists["ACTUATOR"] = tuple(reading.name for reading in robot.actuators.readings)
    if Kind.PARAMETER_JACOBIAN in kinds:
        lists["PARAMETER"] = tuple(parameter.name for parameter in robot.varied_parameters)
    for word, names in lists.items():
        found[f"{word}S"] = len(names)
        found |= {f"{word}_{name}": index for index, name in enumerate(names)}
    if Kind.INVERSE in kinds:
        found["BRANCHES"] = branches
    return found


def require_macros(robot: Robot, probe: Probe, macros: Mapping[str, int]) -> None:
    """Compare the macros of a header with what they must be.

    Raises:
        ProofError: Naming the macro.
    """
    found = (ctypes.c_long * len(macros)).in_dll(probe.library, "kinegen_macros")
    for (name, wanted), value in zip(macros.items(), found, strict=True):
        if value != wanted:
            reason = f"{name} of the {probe.real} header is {value}, expected {wanted}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _require_defaults(robot: Robot, probe: Probe) -> None:
    """The values of the runtime parameters in the C files, which are those of the file, rounded once."""
    wanted = default_parameters(robot)
    if not wanted:
        return
    name = f"{prefix(robot.name, probe.real)}_default_params"
    found = (TYPES[probe.real] * len(wanted)).in_dll(probe.library, name)
    tiny = float(np.finfo(probe.real if probe.real == "double" else "float32").eps)
    for parameter, value in zip(wanted, found, strict=True):
        if not math.isclose(value, wanted[parameter], rel_tol=tiny):
            reason = f"{name} holds {value} for {parameter}, expected {wanted[parameter]}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _spoilable(kernel: Any, quantity: Quantity) -> Spoilable:
    results = tuple(math.prod(array.shape) for array in kernel.results)
    return Spoilable(quantity.function, sum(array.size > 0 for array in kernel.inputs), results)


def _size(robot: Robot, package: ModuleType, quantity: Quantity) -> float:
    """The largest number that a kernel returns for the test vectors, or the reach of the robot, or 1."""
    kernel = getattr(package, quantity.function)
    size = max(1.0, reach(robot, robot.frame_names))
    if quantity.kind is not Kind.INVERSE:
        inputs = input_samples(robot, kernel.inputs, vector_samples(robot))
        found = kernel(*(inputs[array.name] for array in kernel.inputs))
        for result in found if isinstance(found, tuple) else (found,):
            size = max(size, float(np.nanmax(np.abs(result), initial=0.0)))
    return size
