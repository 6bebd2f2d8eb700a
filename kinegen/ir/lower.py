"""From exact expressions to a program: of all ways to compute a quantity the one with the least operations.

In: expressions, in one or several ways. Out: a `Program`. Each way is numbered (`from_expressions.py`) and searched for
products and sums to share (`local_search.py`); where that saves a change of sign alone, values are kept as they came.
Of equally cheap ones that with the fewest values at a time is taken, and of these the first, so that the choice follows
from the robot alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property, lru_cache

from kinegen.derive.dispatch import derive
from kinegen.derive.expressions import Candidate, Expressions, exact_number
from kinegen.derive.transforms import SYMPY
from kinegen.ir.common_subexpressions import Rewriting
from kinegen.ir.finalize import most_alive, name_values
from kinegen.ir.from_expressions import Lowering
from kinegen.ir.program import Count, Program
from kinegen.ir.sign_propagation import propagate_signs
from kinegen.ir.value_numbering import Value, ValueTable, count_of
from kinegen.model.expression_parser import evaluate
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

_SEARCHED = 6
"""How many of the ways of each form are searched: those with the least operations as they come."""

_SIGNS = 2
"""So many changes of sign are paid for values as they came instead of values with shared products and sums."""

_IN_ORDER = (Kind.INVERSE, Kind.AXIS_INVERSE, Kind.ACTUATORS_TO_JOINTS, Kind.JOINTS_TO_ACTUATORS)
"""Kernels whose sums stand in the order that keeps digits near singular sets; they are not rewritten."""


@dataclass(frozen=True, slots=True)
class Choice:
    """What was kept, and of how many.

    `way`: the way that it computes the quantity, in words; empty where there is one alone. `tried`: how many ways there
    were.
    """

    program: Program
    way: str
    tried: int
    _came: _Form

    @property
    def before(self) -> Count:
        """The operations of that way as it came."""
        return count_of(*self._came.signed)


@lru_cache(maxsize=256)
def lower(expressions: Expressions) -> Program:
    """Lower one kinematic quantity to straight-line code.

    Returns:
        The program with the least operations; sines and cosines come first.

    Raises:
        KinegenError: If an expression needs an operation that a kernel does not have.
    """
    return choice_of(expressions).program


@lru_cache(maxsize=256)
def as_derived(robot: Robot, quantity: Quantity) -> Program:
    """Return the program of one quantity without the search for fewer operations.

    In it no number is larger than 1 but lengths, for these numbers are entries of rotations.

    Raises:
        KinegenError: If the robot does not have it, or a kernel cannot evaluate it.
    """
    expressions = derive(robot, quantity)
    lowering = Lowering.of(expressions.variables, expressions.parameters)
    outputs = lowering.outputs(expressions.ways[0])
    return _named(expressions, *propagate_signs(lowering.values, outputs, negate=False))


@lru_cache(maxsize=256)
def choice_of(expressions: Expressions) -> Choice:
    """Return the program of one kinematic quantity, and what it was chosen from; see `lower`."""
    # Different ways may give the same values, and only the lightest of each form are searched.
    tried = [_Tried(expressions, place) for place in range(len(expressions.ways))]
    different: dict[tuple[object, ...], _Tried] = {}
    for each in tried:
        different.setdefault((*each.values.nodes, *each.outputs), each)
    by_form: dict[int, list[_Tried]] = {}
    for each in sorted(different.values(), key=lambda each: each.weight):
        by_form.setdefault(expressions.ways[each.place].form, []).append(each)
    searched = [each for some in by_form.values() for each in some[:_SEARCHED]]
    # Of equal weights, the one with the fewest values alive needs the fewest registers.
    lightest = _lightest([form for each in searched for form in each.forms])
    found = [(_named(expressions, *form.signed), form.tried) for form in lightest]
    program, best = min(found, key=lambda each: most_alive(each[0])) if len(found) > 1 else found[0]
    return Choice(program, _in_words(expressions.ways, expressions.ways[best.place]), len(tried), best.forms[0])


def _in_words(ways: Sequence[Candidate], way: Candidate) -> str:
    """What distinguishes a way from others, the form of inclined mounts included."""
    if not any(each.form for each in ways):
        return way.name
    mounts = "mounts as one turn each, between offsets of joints" if way.form else "mounts as in the table"
    return f"{way.name}; {mounts}" if way.name else mounts


class _Tried:
    """One way to compute a quantity."""

    def __init__(self, expressions: Expressions, place: int) -> None:
        self.place = place
        lowering = Lowering.of(expressions.variables, expressions.parameters)
        self.outputs = lowering.outputs(expressions.ways[place])
        self.values = lowering.values
        self.in_order = expressions.signature.quantity.kind in _IN_ORDER
        self.rewriting = None if self.in_order else Rewriting.of(self.values, self.outputs)

    @cached_property
    def weight(self) -> int:
        return self.rewriting.weight if self.rewriting else self.forms[0].weight

    @cached_property
    def forms(self) -> tuple[_Form, ...]:
        """The values as they came and, where operations are searched, those with shared products and sums."""
        found = [_Form(self, self.values, self.outputs)]
        if self.rewriting:
            found.append(_Form(self, *self.rewriting.searched().values()))
        return tuple(found)


class _Form:
    """Values that compute a quantity, whose signs are chosen when they are asked for."""

    def __init__(self, tried: _Tried, values: ValueTable, outputs: list[Value]) -> None:
        self.tried = tried
        self.values = values
        self.outputs = outputs

    @property
    def as_it_came(self) -> bool:
        """Tell whether no products or sums were shared by a search."""
        return self.values is self.tried.values

    @property
    def bound(self) -> int:
        found = count_of(self.values, [number for _, number in self.outputs])
        return found.weight - found.negations

    @cached_property
    def signed(self) -> tuple[ValueTable, list[int]]:
        """With signs chosen so that few of them change."""
        return propagate_signs(self.values, self.outputs, both=not self.tried.in_order)

    @property
    def weight(self) -> int:
        return count_of(*self.signed).weight


def _lightest(forms: list[_Form]) -> list[_Form]:
    """Return those that cost least, in their order; of those that cost more without any change of sign none is chosen.

    Those as they came may have a few changes of sign more, but no other operations: these are saved whatever the bound.
    """
    if len(forms) == 1:
        return forms
    weights: dict[int, int] = {}
    bounds = [form.bound for form in forms]
    for place in sorted(range(len(forms)), key=bounds.__getitem__):
        if weights and bounds[place] > min(weights.values()):
            break
        weights[place] = forms[place].weight
    least = min(weights.values())
    found = [place for place in sorted(weights) if weights[place] == least]
    if not any(forms[place].as_it_came for place in found):
        # Bounds on errors see rotations in values as they came; for that, changes of sign are paid.
        operations = min(bounds[place] for place in found)
        came = [place for place in weights if forms[place].as_it_came and bounds[place] == operations]
        fewest = min((weights[place] for place in came), default=least)
        if fewest <= least + _SIGNS:
            found = sorted(place for place in came if weights[place] == fewest) or found
    return [forms[place] for place in found]


def _named(expressions: Expressions, values: ValueTable, outputs: list[int]) -> Program:
    parameters = tuple(parameter.name for parameter in expressions.parameters)
    return name_values(values, outputs, signature=expressions.signature, parameters=parameters)


@lru_cache(maxsize=256)
def program_of(robot: Robot, quantity: Quantity) -> Program:
    """Return the program of one quantity of a robot, as a build derives and lowers it.

    Raises:
        KinegenError: If the robot does not have it, or a kernel cannot evaluate it.
    """
    return lower(derive(robot, quantity))


def runtime_defaults(robot: Robot) -> tuple[Fraction, ...]:
    """Return the file's values of the runtime parameters, in their order, in kernel units."""
    return tuple(exact_number(evaluate(parameter.value, {}, SYMPY)) for parameter in robot.runtime_parameters)
