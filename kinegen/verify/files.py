"""The files of a package beside its kernels: tables, headers, the functions in them, self-tests and vectors.

In: a package in its folder. Out: nothing, or the first file that does not say or do what the robot asks for.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Event
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.backends.accuracy import NUMBER_TYPES
from kinegen.backends.inverse import NEAREST_FUNCTION as NEAREST
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import ProofError
from kinegen.ir.lower import program_of
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import INVERSES, SOLVERS, Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.runtime.compiler import find_compiler
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import default_params, vectors_file
from kinegen.verify.c_library import TYPES, Probe, Spoilable, compile_probe, require_routines
from kinegen.verify.headers import require_headers
from kinegen.verify.package_tables import (
    DRIVEN,
    default_parameters,
    require_limits,
    require_python_limits,
    require_tables,
    require_types,
)
from kinegen.verify.reference_cache import quantity_frames
from kinegen.verify.rounding import COARSE, coarse_spread
from kinegen.verify.samples import FloatArray
from kinegen.verify.selftests import SPOILT_JOINTS, Deltas, require_selftest, worst_number
from kinegen.verify.source_checks import require_straight
from kinegen.verify.tolerances import shaped
from kinegen.verify.vectors import vector_inputs

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

    `folder`: where its files lie, and where more are put. Yields for each number type the probe to come, which raises a
    CompileError where a file does not compile or a header lacks a macro; none of a package without C. What is not
    finished at the end is given up.
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

    Raises `CompileError` if a file does not compile, or a header lacks a macro; `ProofError` if a table, a macro, a
    default, a function or a self-test is wrong.
    """
    programs = tuple(quantity for quantity in quantities if quantity not in SOLVERS)
    require_headers(robot, folder, programs, reals)
    require_tables(robot, package, programs)
    require_python_limits(robot, package)
    require_types(robot, package, folder)
    straight = tuple(quantity for quantity in programs if quantity.kind not in INVERSES)
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in (".c", ".py")}
    require_straight(robot, texts, straight, reals)
    # Without a compiler there is neither a self-test nor a macro to read.
    if package.backend != "c":
        return
    tested = _tested(robot, package, quantities)
    spreads = _spreads(robot, tested.programs)
    for real in reals:
        probe = probes[real].result()
        require_macros(robot, probe, tested.macros)
        require_limits(robot, probe, has_readings=any(quantity.kind in DRIVEN for quantity in programs))
        _require_defaults(robot, probe)
        require_routines(robot, probe)
        joints = _joint_deltas(robot)
        # Each number of a self-test may differ by what rounding of the inputs makes of it.
        deltas = [_deltas(one, spreads.get(each), real, joints) for each, one in zip(tested.programs, tested.kernels)]
        deltas += [(joints,) for _ in tested.choices]
        text = (folder / vectors_file(robot.name, real)).read_text(encoding="utf-8")
        explain = partial(worst_number, robot, package, text, tested.programs, real)
        require_selftest(robot, probe, (*tested.programs, *tested.choices), tested.kernels, deltas, explain)


@dataclass(frozen=True, slots=True)
class _Tested:
    """What the self-tests of a package are about."""

    programs: tuple[Quantity, ...]
    choices: tuple[Quantity, ...]  # Those among them of which one solution is chosen, by a function of its own
    kernels: tuple[Spoilable, ...]  # The kernels, then these functions
    macros: Mapping[str, int]  # The macros of the headers, with their values


def _tested(robot: Robot, package: ModuleType, quantities: Sequence[Quantity]) -> _Tested:
    # The inverse of a machine has a proof of its own, and no part in the self-test.
    programs = tuple(each for each in quantities if each not in SOLVERS and each.kind is not Kind.AXIS_INVERSE)
    choices = tuple(quantity for quantity in programs if quantity.kind is Kind.INVERSE)
    kernels = [_spoilable(getattr(package, quantity.function), quantity) for quantity in programs]
    kernels += [Spoilable(NEAREST, 2 + bool(robot.redundancy), (robot.dof,), is_choice=True) for _ in choices]
    macros = header_macros(robot, programs, len(getattr(package, "BRANCHES", ())))
    return _Tested(programs, choices, tuple(kernels), macros)


def header_macros(robot: Robot, quantities: Sequence[Quantity], branches: int = 0) -> dict[str, int]:
    """Returns the macros of a header after the robot's prefix, with their values."""
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
    """Compare the macros of a header with what they must be. Raises `ProofError` naming the macro."""
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
    """Returns by how much each joint value of a solution is spoilt: an angle, or a part of the reach."""
    strokes = [variable.type is JointType.PRISMATIC for variable in robot.variables]
    return tuple(SPOILT_JOINTS * (reach(robot) if stroke else 1.0) for stroke in strokes)


def _deltas(spoilt: Spoilable, spreads: Spreads | None, real: str, joints: tuple[float, ...]) -> Deltas:
    """By how much each number is spoilt: a few times what rounding may do to it; infinite where that is anything.

    The results of an inverse are the joint vectors of its branches first, then which of them are valid.
    """
    if spreads is None:
        solutions, *others = spoilt.results
        return (joints * (solutions // max(1, len(joints))), *((SPOILT_JOINTS,) * size for size in others))
    unit = 0.5 ** NUMBER_TYPES[ScalarType(real)].precision
    part = unit * 2.0**COARSE.precision
    return tuple(
        tuple(float(each) for each in (OVER * (spread * part + unit * np.maximum(1.0, size))).flat)
        for size, spread in spreads
    )
