"""C programs around emitted kernels, which show bits and costs, and the poses at which they are called."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import flat_call, given
from kinegen.backends.c.kernel import KernelContext, emit_kernel, kernel_context
from kinegen.backends.c.nearest import nearest_of
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse, solver_context
from kinegen.backends.fixed_point.files import FixedContext, emit_fixed, fixed_context
from kinegen.backends.fixed_point.kernels import fixed_kernels
from kinegen.backends.inverse import solved_chain
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.errors import KinegenError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import POSE_AND_JACOBIAN, Kind
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, default_params, function
from kinegen.verify import reference
from kinegen.verify.boards.targets import SOURCES, Target, compile_object, link

COUNT = 16
"""Examples of one kernel; small boards hold them in RAM."""

NEAR = 0.1
"""How far a search starts from a solution: radians, or this part of a stroke."""

_INNER = 0.8


def targets_by_kind(robot: Robot) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Targets of an inverse that cost different things, each followed by a joint vector.

    `robot`: the robot; of several tips the first one is changed. Returns `COUNT` rows of a 4x4 matrix for every tip and
    a joint vector for each kind. Joint vectors are near a solution, or, of the targets called far, anywhere in the
    joint box. Raises `KinegenError` if the robot has a redundancy, which these rows have no place for.
    """
    if robot.redundancy:
        raise KinegenError(f"{robot.name}: kinds of targets are not measured with a redundancy", robot.source)
    near = np.array(reachable_poses(robot, starts=True))
    box = np.array(joint_box(robot)).clip(-math.pi, math.pi)
    far, unreachable, bent = near.copy(), near.copy(), near.copy()
    far[:, -robot.dof :] = np.random.default_rng(2).uniform(box[:, 0], box[:, 1], (COUNT, robot.dof))
    unreachable[:, 3] += 3 * reach(robot)
    bent[:, [0, 1, 2, 4, 5, 6, 8, 9, 10]] *= 2
    kinds = {"near a solution": near, "far from one": far, "out of reach": unreachable, "not a rotation": bent}
    return {name: tuple(tuple(map(float, row)) for row in rows) for name, rows in kinds.items()}


def reachable_poses(robot: Robot, *, starts: bool, given: bool = False) -> tuple[tuple[float, ...], ...]:
    """Poses of the tips, each the numbers of a 4x4 matrix for every tip.

    `starts`: whether each is followed by the joint vector from which a search begins; `given`: whether what the inverse
    is given besides stands between them, for a robot with a redundancy. Returns `COUNT` rows. The joint vectors of the
    poses are random ones well within the limits.
    """
    box = np.array(joint_box(robot))
    angles = np.array([variable.type is not JointType.PRISMATIC for variable in robot.variables])
    box[angles] = np.clip(box[angles], -math.pi, math.pi)
    middle, half = box.mean(axis=1), np.ptp(box, axis=1) / 2
    generator = np.random.default_rng(1)
    joints = middle + half * generator.uniform(-_INNER, _INNER, (COUNT, robot.dof))
    poses: NDArray[np.float64] = reference.pose(robot, joints).reshape(COUNT, -1)
    if given and robot.redundancy:
        poses = np.column_stack([poses, reference.redundancy(robot, joints)])
    steps = NEAR * np.where(angles, 1, 2 * half) * generator.choice([-1, 1], joints.shape)
    rows = np.concatenate([poses, np.clip(joints + steps, box[:, 0], box[:, 1])], axis=1) if starts else poses
    return tuple(tuple(map(float, row)) for row in rows)


NOTHING = "board_nothing"
"""The function that costs nothing, with the type of the kernel that is measured."""


@dataclass(frozen=True, slots=True)
class Printed:
    """The C of a robot's kernels in one number type."""

    files: Mapping[str, str]
    header: str  # Which of them declares the kernels
    source: str  # Which of them defines them
    names: tuple[str, ...]  # The kernels, in the order of the programs
    prototypes: tuple[str, ...]  # Their declarations
    beyond: str  # The smallest angle out of range, as a C literal; where every angle is in range, any number


@dataclass(frozen=True, slots=True)
class TableEntry:
    """One kernel in the table of a program."""

    name: str  # C name
    declaration: str  # Where no header declares it
    call: str  # The call, its arguments taken from arrays
    joints: int  # Entries of the joint vector
    numbers: int  # Entries of the result
    beyond: str  # The smallest angle out of range, as a C literal


@dataclass(frozen=True, slots=True)
class Table:
    """What the template `boards/kernels.c.jinja` is given."""

    headers: tuple[str, ...]
    kernels: tuple[TableEntry, ...]
    joints: int  # Room for any joint vector
    numbers: int  # Room for any result
    examples: tuple[str, ...] = ()  # Inputs of the first kernel where random numbers will not do, as C literals


@dataclass(frozen=True, slots=True)
class Measured:
    """A program around one function that is measured."""

    files: tuple[Path, ...]
    own: int  # How many of these, from the first one on, a call of the function needs
    name: str
    repeats: int  # How often it is called between two readings of the clock


def write_kernels(folder: Path, robots: Sequence[RobotPrograms], real: str) -> tuple[Path, ...]:
    """Write the C of some robots and the table of their kernels. `folder`: an existing folder. Returns the C files."""
    prints = [printed(kernels, real) for kernels in robots]
    entries = [entry for kernels, each in zip(robots, prints, strict=True) for entry in _entries(kernels, each, real)]
    return _write(folder, prints, entries)


def write_measured(folder: Path, kernels: RobotPrograms, real: str) -> Measured:
    """Write the C of a single kernel, and the table with it and the function that does nothing.

    `folder`: an existing folder; `kernels`: a robot with one program. Returns the program.
    """
    kernel = printed(kernels, real)
    (entry,), (prototype,), (program,) = _entries(kernels, kernel, real), kernel.prototypes, kernels.programs
    is_inverse = program.quantity.kind is Kind.INVERSE
    examples = _examples(reachable_poses(solved_chain(kernels), starts=False, given=True), real) if is_inverse else ()
    files = _write(folder, [kernel], _with_nothing(folder, entry, prototype, kernel.header), examples)
    return Measured((*files, folder / "nothing.c"), 1, entry.name, 8)


def write_nearest(
    folder: Path, kernels: RobotPrograms, real: ScalarType, rows: Sequence[Sequence[float]] = ()
) -> Measured:
    """Returns the same for the choice of the solution nearest to a joint vector, which is near one of them.

    `folder`: an existing folder; `kernels`: a robot with one program, its inverse; `rows`: targets and joint vectors;
    reachable ones if there are none.
    """
    kernel, nearest, dof = printed(kernels, real), nearest_of(kernels, real), kernels.robot.dof
    if nearest is None:
        raise KinegenError(f"{kernels.robot.name} has no inverse to choose from")
    parameters = f"&{default_params(kernels.robot.name, real)}, " if nearest.params_type else ""
    given = f"q + 16, q + {16 + nearest.given}" if nearest.given else "q + 16"
    call = f"(void){nearest.name}(q, {given}, {parameters}result)"
    numbers = 16 + nearest.given + dof
    entry = TableEntry(nearest.name, "", call, numbers, dof, kernel.beyond)
    examples = _examples(rows or reachable_poses(solved_chain(kernels), starts=True, given=True), real)
    files = _write(folder, [kernel], _with_nothing(folder, entry, nearest.prototype, kernel.header), examples)
    return Measured((*files, folder / "nothing.c"), 1, nearest.name, 8)


def write_search(
    folder: Path, kernels: RobotPrograms, real: ScalarType, rows: Sequence[Sequence[float]] = ()
) -> Measured:
    """Returns the same for the numeric inverse, which starts close to a solution.

    `folder`: an existing folder; `kernels`: a robot with the numeric inverse; `rows`: targets and starts; reachable
    ones, and starts close to a solution, if there are none.
    """
    solver = solver_context(kernels, real)
    needed = tuple(program for program in kernels.programs if program.quantity == POSE_AND_JACOBIAN)
    kernel = printed(kernels.alone(*needed), real)
    kernel = replace(kernel, files={**kernel.files, **emit_numeric_inverse(kernels, real)}, header=solver.header)
    parameters = f"&{solver.prefix}_default_params, " if solver.parameters else ""
    dof, numbers = kernels.robot.dof, 16 * len(kernels.robot.tips)
    arguments = f"q, q + {numbers}, {parameters}&{solver.prefix}_default_search, result, &found"
    call = f"static {solver.prefix}_found found; (void){solver.function}({arguments})"
    entry = TableEntry(solver.function, "", call, numbers + dof, dof, kernel.beyond)
    examples = _examples(rows or reachable_poses(kernels.robot, starts=True), real)
    files = _write(folder, [kernel], _with_nothing(folder, entry, solver.prototype, solver.header), examples)
    return Measured((files[0], folder / solver.source, *files[1:], folder / "nothing.c"), 2, solver.function, 1)


def _with_nothing(folder: Path, entry: TableEntry, prototype: str, header: str) -> list[TableEntry]:
    """Returns an entry, and one of the same type that does nothing, whose file is written."""
    declaration = prototype.replace(entry.name, NOTHING, 1)
    result = "    return 0;\n" if declaration.startswith("int ") else ""
    body = f'#include "{header}"\n\n{declaration};\n\n{declaration}\n{{\n{result}}}\n'
    (folder / "nothing.c").write_text(body, "utf-8")
    nothing = replace(entry, name=NOTHING, declaration=declaration, call=entry.call.replace(entry.name, NOTHING, 1))
    return [entry, nothing]


def _examples(rows: Sequence[Sequence[float]], real: str) -> tuple[str, ...]:
    return tuple(", ".join(ScalarType(real).literal(Fraction(number)) for number in row) for row in rows)


def compile_board(target: Target, folder: Path, main: Path, real: str, flags: Sequence[str]) -> tuple[Path, ...]:
    """Compile what a program for a board has besides its kernels.

    `main`: the file with the main function. Returns the objects, which suit every program with these flags.
    """
    files = (main, *(SOURCES / name for name in target.toolchain.sources))
    return compile_files(target, folder, files, real, flags)


def compile_files(
    target: Target, folder: Path, files: Sequence[Path], real: str, flags: Sequence[str]
) -> tuple[Path, ...]:
    """Compile C files that know the number type as REAL.

    `folder`: where headers are found and the objects are written. Returns the objects.
    """
    return tuple(compile_object(target, folder, file, (*flags, *_numbers(real))) for file in files)


def build_program(
    target: Target,
    folder: Path,
    files: Sequence[Path],
    main: Path,
    real: str,
    flags: Sequence[str],
    board: Sequence[Path] | None = None,
) -> Path:
    """Compile and link a program for a board.

    `folder`: where the C files are, and objects and program are written; `main`: the file with the main function;
    `board`: what `compile_board` gave for the same main file and flags; it is compiled here if left out. Returns the
    program.
    """
    objects = compile_files(target, folder, files, real, flags)
    board = compile_board(target, folder, main, real, flags) if board is None else board
    return link(target, folder, [*objects, *board], f"{main.stem}.elf")


def _numbers(real: str) -> tuple[str, ...]:
    return ("-DREAL=int32_t", "-DINTEGERS") if real == Q30 else (f"-DREAL={real}",)


def printed(kernels: RobotPrograms, real: str) -> Printed:
    """Returns the C of a robot's kernels.

    The files, and what is in them. Raises `KinegenError` if integers cannot evaluate a program; the message says why.
    """
    names = tuple(function(kernels.robot.name, each.quantity.function, real) for each in kernels.programs)
    context: KernelContext | FixedContext
    if real == Q30:
        fixed = fixed_kernels(kernels)
        context, files, beyond = fixed_context(fixed), emit_fixed(fixed), "0"
    else:
        number = ScalarType(real)
        context, files = kernel_context(kernels, number), emit_kernel(kernels, number)
        beyond = number.literal(Fraction(beyond_range(number)))
    prototypes = tuple(each.prototype for each in context.functions)
    return Printed(files, context.header, context.source, names, prototypes, beyond)


def _write(
    folder: Path, prints: Sequence[Printed], entries: Sequence[TableEntry], examples: tuple[str, ...] = ()
) -> tuple[Path, ...]:
    texts = {name: text for each in prints for name, text in each.files.items()}
    table = Table(
        headers=tuple(each.header for each in prints),
        kernels=tuple(entries),
        joints=max([1, *(entry.joints for entry in entries)]),
        numbers=max(entry.numbers for entry in entries),
        examples=examples,
    )
    texts["kernels.c"] = environment().get_template("boards/kernels.c.jinja").render(t=table)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    return (*(folder / each.source for each in prints), folder / "kernels.c")


def _entries(kernels: RobotPrograms, each: Printed, real: str) -> list[TableEntry]:
    return [
        TableEntry(
            name=name,
            declaration="",
            call=flat_call(kernels, program, real, name, ("q", "result")),
            joints=sum(array.stored for array in given(program)),
            numbers=sum(array.stored * array.blocks for array in program.signature.results),
            beyond=each.beyond,
        )
        for program, name in zip(kernels.programs, each.names, strict=True)
    ]


def beyond_range(real: ScalarType) -> float:
    """Returns the smallest angle for which the emitted pair promises NaN."""
    limit = SINCOS[real].limit
    if real is ScalarType.DOUBLE:
        return math.nextafter(limit, math.inf)
    (bits,) = struct.unpack("<I", struct.pack("<f", limit))
    (beyond,) = struct.unpack("<f", struct.pack("<I", bits + 1))
    return float(beyond)
