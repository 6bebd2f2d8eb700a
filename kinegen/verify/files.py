"""The files of a package beside its kernels: tables, headers, the functions in them, self-tests and vectors.

In: a package in its folder. Out: nothing, or the first file that does not say or do what the robot asks for.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.emit.accuracy import NUMBER_TYPES
from kinegen.emit.nearest import NAME as NEAREST
from kinegen.emit.reals import Real
from kinegen.errors import ProofError
from kinegen.ir.lower import program_of
from kinegen.naming import default_params, vectors_file
from kinegen.native.compiler import find_compiler
from kinegen.outputs import INVERSES, SOLVERS, Kind, Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import JointType, Robot
from kinegen.verify.joint_limits import require_limits, require_python_limits
from kinegen.verify.known import quantity_frames
from kinegen.verify.probe import TYPES, Probe, Spoilable, compile_probe
from kinegen.verify.routines import require_routines
from kinegen.verify.selftests import SPOILT_JOINTS, Deltas, require_selftest
from kinegen.verify.spread import COARSE, FloatArray, coarse_spread
from kinegen.verify.straight import require_straight
from kinegen.verify.tables import DRIVEN, default_parameters, require_tables
from kinegen.verify.tolerances import shaped
from kinegen.verify.types import require_types
from kinegen.verify.vectors import vector_inputs
from kinegen.verify.worst import worst_number

Spreads = tuple[tuple[FloatArray, FloatArray], ...]

OVER = 4
"""A kernel is spoilt by so many times what rounding may do to a number."""

SPOILT = 64
"""Integer kernels are spoilt by so many units."""


@contextmanager
def compiled_probes(
    robot: Robot, package: ModuleType, folder: Path, quantities: tuple[Quantity, ...], reals: tuple[str, ...]
) -> Iterator[Mapping[str, Future[Probe]]]:
    """Compile the probes of a package while other things are done.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        folder: Where its files lie, and where more are put.
        quantities: The quantities it was built for.
        reals: Its number types, `double` and `float`.

    Yields:
        For each number type the probe to come, which raises a CompileError where a file does not compile or a header
        lacks a macro; none of a package without C. What is not finished at the end is given up.
    """
    stop, pool = Event(), ThreadPoolExecutor(1)
    try:
        if package.backend == "c":
            tested, compiler = _tested(robot, package, quantities), find_compiler()
            compile_one = partial(
                compile_probe,
                robot,
                folder,
                kernels=tested.kernels,
                macros=tuple(tested.macros),
                compiler=compiler,
                stop=stop,
            )
            yield {real: pool.submit(compile_one, real) for real in reals}
        else:
            yield {}
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def require_files(
    robot: Robot,
    package: ModuleType,
    folder: Path,
    quantities: tuple[Quantity, ...],
    probes: Mapping[str, Future[Probe]],
    reals: tuple[str, ...],
) -> None:
    """Check what a package has beside its kernels.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        folder: Where its files lie.
        quantities: The quantities it was built for.
        probes: Its probes, from `compiled_probes`.
        reals: Its number types, `double` and `float`.

    Raises:
        CompileError: If a file does not compile, or a header lacks a macro.
        ProofError: If a table, a macro, a default, a function or a self-test is wrong.
    """
    programs = tuple(quantity for quantity in quantities if quantity not in SOLVERS)
    require_tables(robot, package, programs)
    require_python_limits(robot, package)
    require_types(robot, package, folder)
    straight = tuple(quantity for quantity in programs if quantity.kind not in INVERSES)
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in (".c", ".py")}
    require_straight(robot, texts, straight, reals)
    if package.backend != "c":
        return
    tested = _tested(robot, package, quantities)
    spreads = _spreads(robot, tested.programs)
    for real in reals:
        probe = probes[real].result()
        require_macros(robot, probe, tested.macros)
        require_limits(robot, probe)
        _require_defaults(robot, probe)
        require_routines(robot, probe)
        deltas = [_deltas(kernel, spreads.get(each), real) for each, kernel in zip(tested.programs, tested.kernels)]
        deltas += [(_joint_deltas(robot),) for _ in tested.choices]
        text = (folder / vectors_file(robot.name, real)).read_text(encoding="utf-8")
        explain = partial(worst_number, robot, package, text, tested.programs, real)
        require_selftest(robot, probe, (*tested.programs, *tested.choices), tested.kernels, deltas, explain)


@dataclass(frozen=True, slots=True)
class _Tested:
    """What the self-tests of a package are about.

    Attributes:
        programs: What their kernels compute.
        choices: Those among them of which one solution is chosen, by a function of its own.
        kernels: The kernels, then these functions.
        macros: The macros of the headers, with their values.
    """

    programs: tuple[Quantity, ...]
    choices: tuple[Quantity, ...]
    kernels: tuple[Spoilable, ...]
    macros: Mapping[str, int]


def _tested(robot: Robot, package: ModuleType, quantities: Sequence[Quantity]) -> _Tested:
    # The inverse of a machine has a proof of its own, and no part in the self-test.
    programs = tuple(each for each in quantities if each not in SOLVERS and each.kind is not Kind.AXIS_INVERSE)
    choices = tuple(quantity for quantity in programs if quantity.kind is Kind.INVERSE)
    kernels = [_spoilable(getattr(package, quantity.function), quantity) for quantity in programs]
    kernels += [Spoilable(NEAREST, 2 + bool(robot.redundancy), (robot.dof,), is_choice=True) for _ in choices]
    macros = header_macros(robot, programs, len(getattr(package, "BRANCHES", ())))
    return _Tested(programs, choices, tuple(kernels), macros)


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
    name = default_params(robot.name, probe.real)
    found = (TYPES[probe.real] * len(wanted)).in_dll(probe.library, name)
    tiny = float(np.finfo(probe.real if probe.real == "double" else "float32").eps)
    for parameter, value in zip(wanted, found, strict=True):
        if not math.isclose(value, wanted[parameter], rel_tol=tiny):
            reason = f"{name} holds {value} for {parameter}, expected {wanted[parameter]}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _spoilable(kernel: Any, quantity: Quantity) -> Spoilable:
    results = tuple(math.prod(array.shape) for array in kernel.results)
    return Spoilable(quantity.function, sum(array.size > 0 for array in kernel.inputs), results)


def _spreads(robot: Robot, quantities: Sequence[Quantity]) -> dict[Quantity, Spreads]:
    """For each kernel and result the largest numbers at the test vectors, and how far units of floats move them."""
    programs = [program_of(robot, quantity) for quantity in quantities if quantity.kind not in INVERSES]
    inputs = vector_inputs(robot, programs)
    found = {}
    for program in programs:
        plain, spread = coarse_spread(robot, program, inputs)
        sizes = shaped(program, np.abs(plain).max(axis=0, keepdims=True))
        found[program.quantity] = tuple(
            zip(sizes, shaped(program, spread.max(axis=0, keepdims=True), 0.0), strict=True)
        )
    return found


def _joint_deltas(robot: Robot) -> tuple[float, ...]:
    """By how much each joint value of a chosen solution is spoilt: an angle, or a part of the reach."""
    strokes = [variable.type is JointType.PRISMATIC for variable in robot.variables]
    return tuple(SPOILT_JOINTS * (reach(robot) if stroke else 1.0) for stroke in strokes)


def _deltas(spoilt: Spoilable, spreads: Spreads | None, real: str) -> Deltas:
    """By how much each number is spoilt: a few times what rounding may do to it; infinite where that is anything."""
    if spreads is None:
        return tuple((SPOILT_JOINTS,) * size for size in spoilt.results)
    unit = 0.5 ** NUMBER_TYPES[Real(real)].precision
    part = unit * 2.0**COARSE.precision
    return tuple(
        tuple(float(each) for each in (OVER * (spread * part + unit * np.maximum(1.0, size))).flat)
        for size, spread in spreads
    )
