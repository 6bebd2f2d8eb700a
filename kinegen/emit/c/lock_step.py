"""The statements of a search in lock step: what a target of a tile does, in the order of the single search.

A sum of products begins with 0, as the single search begins it, so that zeros have the same signs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

_ROWS = range(6)


@dataclass(frozen=True, slots=True)
class Steps:
    """Statements for target i of a tile, by function.

    Attributes:
        products: r00 to r22, the entries of target_R pose_R^T.
        square: The square of the rotation vector's sine.
        errors: `way` and `turn`, the squares of the distance and of the angle; then `whole`, with lengths weighted.
        columns: c0 to c5, one column of the weighted Jacobian, and `slope`.
        sizes: The numbers of one column, each with its place.
        rows: For each row of the damped matrices, what is done before the loop over joints, in it, and after it.
        solving: The solution of the damped equations.
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
    """The statements in C.

    Args:
        real: Number type.
        damping: The part of the squared error that damps a step, a literal.
        least: Damping where there is no error left, a literal.
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
        """A value with a name."""
        return f"const {self.real} {name} = {value};"

    def summed(self, name: str, parts: Sequence[str]) -> Iterator[str]:
        """The sum of some products, one after the other."""
        before = "0"
        for index, part in enumerate(parts, 1):
            yield self.let(f"{name}_part{index}", part)
            total = name if index == len(parts) else f"{name}_{index}"
            yield self.let(total, f"{before} + {name}_part{index}")
            before = total

    def products(self) -> Iterator[str]:
        """The entries of target_R pose_R^T."""
        for row in range(3):
            for column in range(3):
                pairs = ((4 * row + k, 4 * column + k) for k in range(3))
                yield from self.summed(f"r{row}{column}", [f"target[{a}][i] * pose[{b}][i]" for a, b in pairs])

    def errors(self) -> Iterator[str]:
        """The squares of distance and angle, and that of the whole error."""
        yield from self.summed("way", [f"e{row} * e{row}" for row in range(3)])
        yield from self.summed("turn", [f"e{row} * e{row}" for row in range(3, 6)])
        for row in range(3):
            yield self.let(f"w{row}", f"e{row} * length_weight")
        names = [f"w{row}" if row < 3 else f"e{row}" for row in _ROWS]
        yield from self.summed("whole", [f"{name} * {name}" for name in names])
        yield from (f"e[{row}][i] = {name};" for row, name in enumerate(names))

    def columns(self) -> Iterator[str]:
        """One column of the Jacobian with its weights, and its slope."""
        for row in range(3):
            yield self.let(f"weighted{row}", f"jacobian[{row} * DOF + j][i] * length_weight")
        for row in _ROWS:
            entry = f"weighted{row}" if row < 3 else f"jacobian[{row} * DOF + j][i]"
            yield self.let(f"c{row}", f"{entry} * size")
        yield from self.summed("slope", [f"c{row} * e[{row}][i]" for row in _ROWS])

    def matrix_row(
        self, row: int, damping: str, least: str
    ) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
        """One row of the lower half of J W J^T + l I: before the loop over joints, in it, after it."""
        before = tuple(f"{self.real} a{column} = 0;" for column in range(row + 1))
        inside = [self.let("factor", f"jacobian[{row} * DOF + j][i]")]
        for column in range(row + 1):
            inside += [self.let(f"part{column}", f"factor * columns[6 * j + {column}][i]")]
            inside += [f"a{column} = a{column} + part{column};"]
        after = [self.let("damping", f"error[i] * {damping}"), self.let("damped", f"a{row} + damping")]
        after += [f"a[{_place(row, column)}][i] = a{column};" for column in range(row)]
        after += [f"a[{_place(row, row)}][i] = damped + {least};"]
        return before, tuple(inside), tuple(after)

    def solving(self) -> Iterator[str]:
        """The factors of a matrix, and the solution of the equations, as in `solve` of the single search."""
        for column in _ROWS:
            for k in range(column):
                yield self.let(f"scaled{column}{k}", f"f{column}{k} * f{k}{k}")
            for row in range(column, 6):
                yield from self.summed(f"sum{row}{column}", [f"f{row}{k} * scaled{column}{k}" for k in range(column)])
                rest = f"a[{_place(row, column)}][i]" + (f" - sum{row}{column}" if column else "")
                yield self.let(f"f{row}{column}" if row == column else f"rest{row}{column}", rest)
                if row > column:
                    yield self.let(f"f{row}{column}", f"rest{row}{column} / f{column}{column}")
        for row in _ROWS:
            yield from self.summed(f"known{row}", [f"f{row}{k} * y{k}" for k in range(row)])
            yield self.let(f"y{row}", f"b[{row}][i]" + (f" - known{row}" if row else ""))
        for row in reversed(_ROWS):
            yield self.let(f"x{row}_{row}", f"y{row} / f{row}{row}")
            for k in range(row + 1, 6):
                yield self.let(f"back{row}{k}", f"f{k}{row} * x{k}_5")
                yield self.let(f"x{row}_{k}", f"x{row}_{k - 1} - back{row}{k}")
            yield f"x[{row}][i] = x{row}_5;"

    def estimate(self) -> Iterator[str]:
        """The squared distance, weighted, and 2 (1 - cos(angle))."""
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
    """Where an entry of a lower half is, row by row."""
    return row * (row + 1) // 2 + column
