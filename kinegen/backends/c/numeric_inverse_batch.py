"""The numeric inverse of many targets: `puma560_numeric_inverse_batch.h` and `.c`, a tile of targets in lock step.

A lane does the operations of the single search in the same order, so without contraction it has the same bits. A sum of
products begins with 0, as the single search begins it, so that zeros have the same signs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import wrapped_prototype
from kinegen.backends.c.batch import TILE_BYTES
from kinegen.backends.c.numeric_inverse import solver_context
from kinegen.backends.routines import ROUTINES
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import TUNING, tips_of
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.outputs import NUMERIC_INVERSE
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, function, guard, params_type, prefix, search_file

_ROWS = range(6)


@dataclass(frozen=True, slots=True)
class Steps:
    """Holds the statements for target i of a tile, by function.

    Attributes:
        products: r00 to r22, the entries of target_R pose_R^T.
        square: The square of the rotation vector's sine.
        errors: `way` and `turn`, the squares of the distance and of the angle; then `whole`, with lengths weighted.
        columns: c0 to c5, one column of the weighted Jacobian, and `slope`.
        places: The numbers of one column, each with its place.
        rows: For each row of the damped matrices, what is done before the loop over joints, in it, and after it.
        moving: `sum`, how far a joint goes before it slows down.
        estimate: How far a pose is from a target.
    """

    products: tuple[str, ...]
    square: tuple[str, ...]
    errors: tuple[str, ...]
    columns: tuple[str, ...]
    places: tuple[str, ...]
    rows: tuple[tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]], ...]
    solving: tuple[str, ...]
    moving: tuple[str, ...]
    estimate: tuple[str, ...]


def steps_of(real: str, damping: str, least: str) -> Steps:
    """Writes the statements in C.

    The literal `damping` is the part of the squared error that damps a step, `least` the damping where no error is
    left.
    """
    c = _Writer(real)
    return Steps(
        products=tuple(c.products()),
        square=tuple(c.summed("square", ["v0 * v0", "v1 * v1", "v2 * v2"])),
        errors=tuple(c.errors()),
        columns=tuple(c.columns()),
        places=tuple(
            [f"columns[6 * j + {row}][i] = c{row};" for row in _ROWS]
            + [f"jacobian[{row} * DOF + j][i] = c{row} * freedom;" for row in _ROWS]
        ),
        rows=tuple(c.matrix_row(row, damping, least) for row in _ROWS),
        solving=tuple(c.solving()),
        moving=tuple(c.summed("sum", [f"columns[6 * j + {row}][i] * y[{row}][i]" for row in _ROWS])),
        estimate=tuple(c.estimate()),
    )


@dataclass(frozen=True, slots=True)
class _Writer:
    """Writes statements of one number type."""

    real: str

    def let(self, name: str, value: str) -> str:
        """Returns a value with a name."""
        return f"const {self.real} {name} = {value};"

    def summed(self, name: str, parts: Sequence[str]) -> Iterator[str]:
        """Yields the sum of some products, one after the other."""
        before = "0"
        for index, part in enumerate(parts, 1):
            yield self.let(f"{name}_part{index}", part)
            total = name if index == len(parts) else f"{name}_{index}"
            yield self.let(total, f"{before} + {name}_part{index}")
            before = total

    def products(self) -> Iterator[str]:
        """Yields the entries of target_R pose_R^T."""
        for row in range(3):
            for column in range(3):
                pairs = ((4 * row + k, 4 * column + k) for k in range(3))
                yield from self.summed(f"r{row}{column}", [f"target[{a}][i] * pose[{b}][i]" for a, b in pairs])

    def errors(self) -> Iterator[str]:
        """Yields the squares of distance and angle, and that of the whole error."""
        yield from self.summed("way", [f"e{row} * e{row}" for row in range(3)])
        yield from self.summed("turn", [f"e{row} * e{row}" for row in range(3, 6)])
        # Lengths are weighted, so that one number measures both.
        for row in range(3):
            yield self.let(f"w{row}", f"e{row} * length_weight")
        names = [f"w{row}" if row < 3 else f"e{row}" for row in _ROWS]
        yield from self.summed("whole", [f"{name} * {name}" for name in names])
        yield from (f"e[{row}][i] = {name};" for row, name in enumerate(names))

    def columns(self) -> Iterator[str]:
        """Yields one column of the Jacobian with its weights, and its slope."""
        for row in range(3):
            yield self.let(f"weighted{row}", f"jacobian[{row} * DOF + j][i] * length_weight")
        for row in _ROWS:
            entry = f"weighted{row}" if row < 3 else f"jacobian[{row} * DOF + j][i]"
            yield self.let(f"c{row}", f"{entry} * size")
        yield from self.summed("slope", [f"c{row} * e[{row}][i]" for row in _ROWS])

    def matrix_row(
        self, row: int, damping: str, least: str
    ) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
        """Returns one row of the lower half of J W J^T + l I: before the loop over joints, in it, after it."""
        before = tuple(f"{self.real} a{column} = 0;" for column in range(row + 1))
        inside = [self.let("factor", f"jacobian[{row} * DOF + j][i]")]
        for column in range(row + 1):
            inside += [self.let(f"part{column}", f"factor * columns[6 * j + {column}][i]")]
            inside += [f"a{column} = a{column} + part{column};"]
        # Damping falls with the error, and never to zero.
        after = [self.let("damping", f"error[i] * {damping}"), self.let("damped", f"a{row} + damping")]
        after += [f"a[{_place(row, column)}][i] = a{column};" for column in range(row)]
        after += [f"a[{_place(row, row)}][i] = damped + {least};"]
        return before, tuple(inside), tuple(after)

    def solving(self) -> Iterator[str]:
        """Yields the factors of a matrix, and the solution of the equations, as in `solve` of the single search."""
        # The factors L and D of L D L^T: no root is taken.
        for column in _ROWS:
            for k in range(column):
                yield self.let(f"scaled{column}{k}", f"f{column}{k} * f{k}{k}")
            for row in range(column, 6):
                yield from self.summed(f"sum{row}{column}", [f"f{row}{k} * scaled{column}{k}" for k in range(column)])
                rest = f"a[{_place(row, column)}][i]" + (f" - sum{row}{column}" if column else "")
                yield self.let(f"f{row}{column}" if row == column else f"rest{row}{column}", rest)
                if row > column:
                    yield self.let(f"f{row}{column}", f"rest{row}{column} / f{column}{column}")
        # Forward substitution.
        for row in _ROWS:
            yield from self.summed(f"known{row}", [f"f{row}{k} * y{k}" for k in range(row)])
            yield self.let(f"y{row}", f"b[{row}][i]" + (f" - known{row}" if row else ""))
        # Back substitution, divided by D first.
        for row in reversed(_ROWS):
            yield self.let(f"x{row}_{row}", f"y{row} / f{row}{row}")
            for k in range(row + 1, 6):
                yield self.let(f"back{row}{k}", f"f{k}{row} * x{k}_5")
                yield self.let(f"x{row}_{k}", f"x{row}_{k - 1} - back{row}{k}")
            yield f"x[{row}][i] = x{row}_5;"

    def estimate(self) -> Iterator[str]:
        """Yields the squared distance, weighted, and 2 (1 - cos(angle))."""
        yield self.let("sum0", "3")
        for row in range(3):
            places = [4 * row + k for k in range(4)]
            yield self.let(f"way{row}", f"target[{places[3]}] - pose[{places[3]}][i]")
            yield self.let(f"weighted{row}", f"way{row} * length_weight")
            yield self.let(f"square{row}", f"weighted{row} * weighted{row}")
            yield self.let(f"with{row}", f"sum{row} + square{row}")
            yield from self.summed(f"alike{row}", [f"target[{place}] * pose[{place}][i]" for place in places[:3]])
            yield self.let(f"sum{row + 1}", f"with{row} - alike{row}")


def _place(row: int, column: int) -> int:
    """Returns where an entry of a lower half is, row by row."""
    return row * (row + 1) // 2 + column


@dataclass(frozen=True, slots=True)
class SearchBatch:
    """Holds what `c/numeric_inverse_batch.*.jinja` are given beside the single search.

    A tile counts targets in lock step.
    """

    header: str
    source: str
    guard: str
    title: str
    kernel_header: str
    declaration: tuple[str, ...]
    routines: tuple[str, ...]
    tile: int
    stack: str
    steps: Steps


def emit_numeric_inverse_batch(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Prints the header and the source of the search for many targets.

    The kernel of pose and Jacobian is among the programs.
    """
    context, batch = solver_context(kernels, real), _batch(kernels, real)
    source = "c/numeric_inverse_tips_batch.c" if context.tips else "c/numeric_inverse_batch.c"
    templates = {batch.header: "c/numeric_inverse_batch.h", batch.source: source}
    return rendered(templates, k=context, b=batch, prefix=context.prefix, qualifier=f"{context.prefix.upper()}_INLINE")


def search_batch_arguments(symbol: str, real: str, *, parameters: bool, tips: bool) -> tuple[str, ...]:
    """Writes the arguments of the search for many targets, each a declaration that ends in the name.

    A tree has `tips`, each with a target.
    """
    stem, target = prefix(symbol, real), "base_T_tips" if tips else "base_T_tool"
    return (
        "size_t n",
        *(f"const {real} *{target}", f"ptrdiff_t {target}_pose"),
        *(("ptrdiff_t base_T_tips_tip",) if tips else ()),
        f"ptrdiff_t {target}_joint",
        *(f"const {real} *start", "ptrdiff_t start_pose", "ptrdiff_t start_joint"),
        *((f"const {params_type(symbol, real)} *params", "ptrdiff_t params_stride") if parameters else ()),
        *(f"const {stem}_search *search", "size_t first", f"{real} *q", "ptrdiff_t q_stride"),
        *(f"{stem}_found *found", "unsigned char *solved", "int layout"),
    )


def _batch(kernels: RobotPrograms, real: ScalarType) -> SearchBatch:
    robot, bits = kernels.robot, "f64" if real is ScalarType.DOUBLE else "f32"
    header, source = (search_file(robot.name, suffix, real, batch=True) for suffix in "hc")
    arguments = search_batch_arguments(robot.name, real, parameters=bool(robot.runtime_parameters), tips=robot.is_tree)
    name = function(robot.name, NUMERIC_INVERSE.function, real, batch=True)
    tile = TILE_BYTES // real.size
    called = (ROUTINES[real][operator].template for operator in (Operator.SQRT, Operator.ATAN2))
    return SearchBatch(
        header=header,
        source=source,
        guard=guard(header),
        title=f"Batches: numeric inverse kinematics of {robot.name}, {real.precision} precision",
        kernel_header=c_file(robot.name, "h", real, batch=True),
        declaration=wrapped_prototype(f"void {name}({', '.join(arguments)})"),
        routines=(*called, f"c/_select_{bits}.c.jinja"),
        tile=tile,
        stack=f"{_stack(robot)} KiB",
        steps=steps_of(real.value, real.literal(TUNING.damping), real.literal(TUNING.least_damping[real])),
    )


def _stack(robot: Robot) -> int:
    """Counts the KiB of the tile, of a step, and of the kernel that both call, which has as many rows as a step."""
    dof, tips = robot.dof, len(robot.tips)
    # The lower half of a matrix of six rows, and six numbers on the right.
    equations = 27
    if robot.is_tree:
        size = dof if tips_of(robot).by_joints else 6 * tips
        equations = size * (size + 1) // 2 + 2 * size
    own = (12 + 12 + 6 * dof + 6) * tips + 2 * dof + 6 * len(robot.tips)
    rows = own + (6 * dof * tips + 2 * dof + equations) + (dof + (12 + 6 * dof) * tips)
    return -(-rows * TILE_BYTES // 1024)
