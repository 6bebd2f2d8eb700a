"""The geometric Jacobian as trees, whole or in blocks, and forms with names for what they use more than once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from kinegen.backends.textbook.closed_form import ClosedForm, gathered, printed_chain
from kinegen.backends.textbook.reader import Reader
from kinegen.backends.textbook.trees import Sum, label_order, symbols_in, transform_name
from kinegen.derive.derivative import derivative
from kinegen.derive.expressions import Definition, LetBindings
from kinegen.derive.folding import NULL, FoldedChain, Vector, cross, fold_for_readers, rotate, total
from kinegen.derive.pose import cheapest_plan, evaluate, pose_entries, product
from kinegen.derive.transforms import Elementary, FrameName, Turn, inverse, symbols, transforms_between
from kinegen.model.angle_sums import AngleLabels
from kinegen.model.outputs import Reference
from kinegen.model.robot import Robot, frame_label


def jacobian_form(
    robot: Robot, start: FrameName, end: FrameName, reference: Reference, labels: AngleLabels | None = None
) -> ClosedForm:
    """Write a Jacobian as a textbook would.

    Args:
        robot: The robot; its parameters stay symbols.
        start: The frame that counts as being at rest, by name or row number; usually the base.
        end: The frame that moves.
        reference: The point and the axes of the velocities; see `kinegen.model.outputs.Reference`.
        labels: Names of angles, to be shared by forms that are printed together.

    Returns:
        Six rows, linear velocity and then angular, and one column for each joint variable of the robot.

    Raises:
        KinegenError: If a frame does not exist.
    """
    chain = printed_chain(robot, start, end)
    ways = _ways(robot, chain.steps, reference)
    reader = Reader(robot, labels, chain.places)
    reader.name_angles(sp.Matrix.hstack(*ways))
    entries = tuple(
        tuple(reader.sum(*(way[row, column] for way in ways)) for column in range(robot.dof)) for row in range(6)
    )
    return replace(gathered(jacobian_name(start, end, reference), entries, reader), kind="J")


def jacobian(robot: Robot, start: FrameName, end: FrameName, reference: Reference) -> sp.Matrix:
    """Return the exact Jacobian, 6 x dof, nested as it arises, not expanded; arguments as for `jacobian_form`."""
    steps = transforms_between(robot, start, end, symbols(robot, keep_parameters=True))
    return _ways(robot, steps, reference)[0]


def jacobian_name(start: FrameName, end: FrameName, reference: Reference) -> str:
    """Return `base_J_tool`; the axes stand first, so it is `tool_J_tool` in the axes of the tool."""
    if reference is Reference.LOCAL:
        return f"{end}_J_{end}"
    name = f"{frame_label(start)}_J_{end}"
    return name if reference is Reference.LOCAL_WORLD_ALIGNED else f"{name}_world"


def _ways(robot: Robot, steps: tuple[Elementary, ...], reference: Reference) -> tuple[sp.Matrix, ...]:
    """Return equal Jacobians, of which a printed form takes the shorter entries."""
    variables = [sp.Symbol(variable.name, real=True) for variable in robot.variables]
    if reference is Reference.LOCAL:
        steps = tuple(inverse(step) for step in reversed(steps))
    folded = fold_for_readers(steps)
    ways = tuple(
        sp.Matrix.hstack(sp.zeros(6, 0), *(_carried(way, variable) for variable in variables))
        for way in (folded, _moved_along(folded))
    )
    if reference is not Reference.LOCAL_WORLD_ALIGNED:
        sign = -1 if reference is Reference.LOCAL else 1
        return tuple(sign * way for way in (*ways, _crossed(steps, variables)))
    position = product(steps)[:3, 3]
    linear = sp.Matrix.hstack(sp.zeros(3, 0), *(position.diff(variable) for variable in variables))
    return (sp.Matrix.vstack(linear, ways[0][3:, :]),)


def _moved_along(folded: FoldedChain) -> FoldedChain:
    """Return the same chain with each shift along the axis of a turn behind that turn, where the axes are nearer."""
    shifts = list(folded.shifts)
    for index, turn in enumerate(folded.turns):
        along = tuple(length if axis == turn.axis else sp.S.Zero for axis, length in enumerate(shifts[index]))
        across = tuple(sp.S.Zero if axis == turn.axis else length for axis, length in enumerate(shifts[index]))
        shifts[index] = (across[0], across[1], across[2])
        shifts[index + 1] = total((along[0], along[1], along[2]), shifts[index + 1])
    return FoldedChain(tuple(shifts), folded.turns, folded.attitude)


def _carried(folded: FoldedChain, variable: sp.Symbol) -> sp.Matrix:
    """Return the twist of the end of a chain by one variable, in the axes and at the origin of its start."""
    linear, angular = _rate(folded.shifts[-1], variable), NULL
    for turn, shift in zip(reversed(folded.turns), reversed(folded.shifts[:-1]), strict=True):
        linear, angular = (rotate(turn.axis, turn.angle, vector) for vector in (linear, angular))
        spin = [sp.S.Zero] * 3
        spin[turn.axis] = turn.angle.diff(variable)
        angular = total(angular, (spin[0], spin[1], spin[2]))
        linear = total(linear, total(cross(shift, angular), _rate(shift, variable)))
    return sp.Matrix([*linear, *angular])


def _rate(vector: Vector, variable: sp.Symbol) -> Vector:
    return vector[0].diff(variable), vector[1].diff(variable), vector[2].diff(variable)


def _crossed(steps: tuple[Elementary, ...], variables: list[sp.Symbol]) -> sp.Matrix:
    """The same twists from where each axis stands and how it points: shorter far from the start of some chains."""
    columns = [sp.zeros(6, 1) for _ in variables]
    for index, step in enumerate(steps):
        amount = step.angle if isinstance(step, Turn) else step.length
        if amount.free_symbols.isdisjoint(variables):
            continue
        before = product(steps[:index])
        place, axis = before[:3, 3], before[:3, step.axis]
        twist = sp.Matrix([*place.cross(axis), *axis] if isinstance(step, Turn) else [*axis, 0, 0, 0])
        columns = [column + amount.diff(variable) * twist for column, variable in zip(columns, variables, strict=True)]
    return sp.Matrix.hstack(sp.zeros(6, 0), *columns)


ROWS = ("vx", "vy", "vz", "wx", "wy", "wz")

_PLANES = {(0, 1, 5), (0, 2, 4), (1, 2, 3)}
"""The rows of an arm that moves in the plane of two axes: two of linear velocity, and the turn about the third axis."""


def jacobian_blocks(form: ClosedForm) -> tuple[ClosedForm, ...]:
    """Return the blocks of a Jacobian of six rows.

    Returns its rows of linear velocity as `base_Jv_tool` and of angular velocity as `base_Jw_tool`; or of an arm that
    moves in a plane the three rows that do not vanish, such as x, y and the angle.
    """
    kept = tuple(row for row, entries in enumerate(form.entries) if any(entry.terms for entry in entries))
    if kept in _PLANES:
        return (_part(form, kept, "J", f"rows {', '.join(ROWS[row] for row in kept)}"),)
    return _part(form, (0, 1, 2), "Jv"), _part(form, (3, 4, 5), "Jw")


def _part(form: ClosedForm, rows: tuple[int, ...], letter: str, words: str = "") -> ClosedForm:
    entries = tuple(form.entries[row] for row in rows)
    met = {symbol.name for symbol in symbols_in(entries)}
    # A definition uses those before it alone.
    definitions: list[tuple[str, Sum]] = []
    for name, value in reversed(form.definitions):
        if name in met:
            definitions.insert(0, (name, value))
            met |= {symbol.name for symbol in symbols_in(value)}
    return replace(
        form,
        name=form.name.replace("_J_", f"_{letter}_", 1),
        entries=entries,
        words=words,
        definitions=tuple(definitions),
    )


def named_form(
    robot: Robot, start: FrameName, end: FrameName, jacobian: Reference | None, labels: AngleLabels | None = None
) -> ClosedForm:
    """Write a transform, or a Jacobian, with named sub-expressions.

    `robot`: the robot; its parameters stay symbols. `start`: frame of reference, by name or row number. `end`: frame
    that is reached. `jacobian`: reference of the Jacobian; None for the transform. `labels`: names of angles, to be
    shared by forms that are printed together. Raises KinegenError if a frame does not exist.
    """
    values = symbols(robot, keep_parameters=True)
    steps = transforms_between(robot, start, end, values)
    if jacobian is None:
        folded, bindings = fold_for_readers(steps), LetBindings()
        columns, position = evaluate(folded, cheapest_plan(folded), bindings)
        definitions, entries = tuple(bindings.definitions), pose_entries(columns, position, folded.attitude)
        name, rows, width, kind = transform_name(start, end), 3, 4, "T"
    else:
        found = derivative([steps], [values[variable.name] for variable in robot.variables], jacobian)
        definitions, entries = found.definitions, list(found.entries)
        name, rows, width, kind = jacobian_name(start, end, jacobian), 6, robot.dof, "J"
    named, short = _shared(definitions, entries, {parameter.name for parameter in robot.parameters})
    reader = Reader(robot, labels, printed_chain(robot, start, end).places)
    texts: list[Sum] = [reader.sum(entry) for entry in short]
    return ClosedForm(
        name=name,
        entries=tuple(tuple(texts[row * width : (row + 1) * width]) for row in range(rows)),
        definitions=tuple((symbol.name, reader.sum(value)) for symbol, value in named),
        angles=tuple(sorted(reader.angles.items(), key=lambda item: label_order(item[0]))),
        joints=tuple(sorted(reader.joints.items())),
        kind=kind,
    )


def _shared(
    definitions: Sequence[Definition], entries: Sequence[sp.Expr], taken: set[str]
) -> tuple[list[Definition], list[sp.Expr]]:
    """Return the definitions that are used more than once, with names `x1`, `x2`, ..., and the entries made of them."""
    wanted = dict(definitions)
    pending, needed = list(entries), dict[sp.Symbol, None]()
    while pending:
        for symbol in sorted(pending.pop().free_symbols & wanted.keys() - needed.keys(), key=str):
            needed[symbol] = None
            pending.append(wanted[symbol])
    uses: Counter[sp.Symbol] = Counter()
    for expression in (*entries, *(wanted[symbol] for symbol in needed)):
        uses.update({symbol: expression.count(symbol) for symbol in expression.free_symbols & wanted.keys()})
    known: dict[sp.Symbol, sp.Expr] = {}
    named: list[Definition] = []
    prefix = "x" if not any(name[:1] == "x" and name[1:].isdecimal() for name in taken) else "x_"
    for symbol, value in definitions:
        if symbol in needed:
            written = value.xreplace(known)
            if uses[symbol] > 1:
                named.append((sp.Symbol(f"{prefix}{len(named) + 1}", real=True), written))
                written = named[-1][0]
            known[symbol] = written
    return named, [entry.xreplace(known) for entry in entries]
