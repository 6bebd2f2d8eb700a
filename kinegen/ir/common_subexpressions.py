"""A search for fewer operations: factors taken out of sums, products multiplied out, pairs shared.

In: numbered values and outputs. Out: the same results with fewer operations, or as they came. A change is kept only
where the whole has fewer operations. These are counted when common subexpressions are found: as long as two factors are
in several products together, the pair that most of them have becomes a step of its own; then the same for terms of
sums. See Hosangadi, Fallah and Kastner, Optimizing polynomial expressions by algebraic factorization and common
subexpression elimination (2006). Constants stay exact.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field
from fractions import Fraction
from itertools import combinations

from kinegen.ir.polynomials import (
    Monomial,
    Polynomial,
    Polynomials,
    Product,
    added,
    polynomials_of,
    product,
    share_multiples,
)
from kinegen.ir.program import Constant, Count, Operator, RuntimeParameter, Variable
from kinegen.ir.value_numbering import Leaf, SinOrCos, Value, ValueTable
from kinegen.support.dataclass import dataclass

Signed = tuple[int, int]
"""A sign and an operand: an atom of the polynomials, a constant (below zero), or a step."""

Pair = tuple[int, int, int]
"""Two operands, ascending, and the product of their signs."""

Preference = Callable[[Pair, bool], tuple[int, ...]]
"""Which of the pairs that stand equally often is taken: the one with the greatest value. The second argument says
whether the pair is all that one of the products or sums consists of."""


@dataclass(slots=True)
class Steps:
    """What is computed.

    Attributes:
        constants: The operands that stand for magnitudes of constants.
        products: The factors of each product, which is an operand itself.
        sums: The signed terms of each sum.
        outputs: The operand of each output; None for zero.
        operations: The operator and the operands of each operation that is not arithmetic.
    """

    constants: dict[Fraction, int] = field(default_factory=dict)
    products: dict[int, list[Signed]] = field(default_factory=dict)
    sums: dict[int, list[Signed]] = field(default_factory=dict)
    outputs: list[Signed | None] = field(default_factory=list)
    operations: dict[int, tuple[Operator | SinOrCos, tuple[Signed | None, ...]]] = field(default_factory=dict)

    @property
    def weight(self) -> int:
        """Return what multiplications, additions and sine-cosine pairs cost; the others are the same in any order."""
        angles = {operands for operator, operands in self.operations.values() if isinstance(operator, SinOrCos)}
        multiplications, additions = (
            sum(len(each) - 1 for each in group.values()) for group in (self.products, self.sums)
        )
        return Count(multiplications, additions, negations=0, divisions=0, sine_cosines=len(angles)).weight


def eliminate(polynomials: Polynomials, prefer: Preference) -> Steps:
    """Find common products, then common sums."""
    reader = _Terms(polynomials)
    steps = reader.steps
    steps.outputs = [reader.single(each) for each in polynomials.outputs]
    for atom in polynomials.live():
        if atom in polynomials.sums:
            steps.sums[atom] = reader.terms(polynomials.sums[atom])
        else:
            operation = polynomials.operations[atom]
            steps.operations[atom] = operation.operator, tuple(map(reader.single, operation.operands))
    after = _share(steps.products, reader.next_step, prefer)
    _share(steps.sums, after, prefer)
    return steps


class _Terms:
    """Makes operands of the terms of polynomials; equal products are one."""

    def __init__(self, polynomials: Polynomials) -> None:
        self.steps = Steps()
        self.polynomials = polynomials
        self.next_step = polynomials.next_atom
        self._known: dict[Product, int] = {}

    def terms(self, polynomial: Polynomial) -> list[Signed]:
        known = self._known
        return [
            (sign, known[term] if term in known else self._new(term))
            for sign, term in self.polynomials.terms(polynomial)
        ]

    def single(self, polynomial: Polynomial) -> Signed | None:
        return next(iter(self.terms(polynomial)), None)

    def _new(self, term: Product) -> int:
        size, monomial = term
        factors = monomial if monomial and size == (1, 1) else (self._constant(Fraction(*size)), *monomial)
        if len(factors) == 1:
            operand = factors[0]
        else:
            operand = self.next_step
            self.steps.products[operand] = [(1, factor) for factor in factors]
            self.next_step += 1
        self._known[term] = operand
        return operand

    def _constant(self, size: Fraction) -> int:
        return self.steps.constants.setdefault(size, -1 - len(self.steps.constants))


def _share(groups: dict[int, list[Signed]], next_step: int, prefer: Preference) -> int:
    """Give each pair that several groups have a group of its own, the most frequent first; return the next number.

    `groups`: factors of products or terms of sums; they are changed.
    """
    # Which groups each pair is in; kept up to date, since counting anew would take quadratic time.
    where: dict[Pair, dict[int, None]] = {}
    for number, members in groups.items():
        for pair in _pairs(members):
            where.setdefault(pair, {})[number] = None
    while several := [pair for pair, found in where.items() if len(found) > 1]:
        most = max(len(where[pair]) for pair in several)
        often = [pair for pair in several if len(where[pair]) == most]
        best = max(often, key=lambda pair: prefer(pair, any(len(groups[number]) == 2 for number in where[pair])))
        _replace(groups, where, best, next_step)
        next_step += 1
    return next_step


def _replace(groups: dict[int, list[Signed]], where: dict[Pair, dict[int, None]], pair: Pair, step: int) -> None:
    """Compute a pair once; its first member has a positive sign in it."""
    one, other, sign = pair
    for number in list(where[pair]):
        members = groups[number]
        for old in _pairs(members):
            where[old].pop(number, None)
        first = next(member for member in members if member[1] == one)
        members.remove(first)
        members.remove((first[0] * sign, other))
        members.append((first[0], step))
        for new in _pairs(members):
            where.setdefault(new, {})[number] = None
    groups[step] = [(1, one), (sign, other)]


def _pairs(members: list[Signed]) -> Iterator[Pair]:
    for (one_sign, one), (other_sign, other) in combinations(members, 2):
        yield (one, other, one_sign * other_sign) if one <= other else (other, one, one_sign * other_sign)


def rebuild(leaves: Iterable[Leaf], steps: Steps) -> tuple[ValueTable, list[Value]]:
    """Number the values that steps compute.

    Returns values; sines, cosines and other operations that are not arithmetic first. Signed outputs. `leaves`: the
    leaves at the beginning of the values that the steps were made of, which keep their numbers.
    """
    return _Rebuild(tuple(leaves), steps).run()


class _Rebuild:
    def __init__(self, leaves: tuple[Leaf, ...], steps: Steps) -> None:
        self.steps = steps
        self.values = ValueTable()
        self.known: dict[int, Value] = {
            **{number: (1, self.values.number(leaf)) for number, leaf in enumerate(leaves)},
            **{operand: self.values.constant(size) for size, operand in steps.constants.items()},
        }

    def run(self) -> tuple[ValueTable, list[Value]]:
        for atom in sorted(self.steps.operations):
            self.value((1, atom))
        return self.values, list(map(self.value, self.steps.outputs))

    def value(self, signed: Signed | None) -> Value:
        """Return the value of an operand, after all that it needs."""
        pending = [signed[1]] if signed else []
        while pending:
            missing = [each[1] for each in self._members(pending[-1]) if each and each[1] not in self.known]
            if missing:
                pending += missing
            else:
                operand = pending.pop()
                self.known.setdefault(operand, self._new(operand))
        return self._known(signed)

    def _members(self, operand: int) -> Iterable[Signed | None]:
        if operand in self.known:
            return ()
        if operand in self.steps.operations:
            return self.steps.operations[operand][1]
        return self.steps.products.get(operand) or self.steps.sums[operand]

    def _new(self, operand: int) -> Value:
        if operand in self.known:
            return self.known[operand]
        parts = [self._known(each) for each in self._members(operand)]
        if operand in self.steps.products:
            return self.values.product(parts)
        if operand in self.steps.sums:
            return self.values.total(parts)
        operator = self.steps.operations[operand][0]
        if operator in (SinOrCos.SIN, SinOrCos.COS):
            sign, angle = parts[0]
            return sign if operator is SinOrCos.SIN else 1, self.values.apply(operator, angle)
        return 1, self.values.apply(operator, *map(self.values.signed, parts))

    def _known(self, signed: Signed | None) -> Value:
        if signed is None:
            return self.values.constant(Fraction(0))
        sign, number = self.known[signed[1]]
        return signed[0] * sign, number


_LARGE = 600
"""With more operations than this, nothing is searched: the time grows with the square of their number."""


def _whole_first(pair: Pair, is_whole: bool) -> tuple[int, ...]:
    return (is_whole, -pair[0], -pair[1])


def _constants_first(pair: Pair, is_whole: bool) -> tuple[int, ...]:
    return (pair[0] < 0, is_whole, -pair[0], -pair[1])


def _last_first(pair: Pair, is_whole: bool) -> tuple[int, ...]:
    return (is_whole, pair[1], pair[0])


_PREFERENCES: tuple[Preference, ...] = (_whole_first, _constants_first, _last_first)


@dataclass(frozen=True, slots=True)
class Rewriting:
    """A program as polynomials."""

    leaves: tuple[Leaf, ...]
    polynomials: Polynomials

    @classmethod
    def of(cls, values: ValueTable, outputs: Sequence[Value]) -> Rewriting | None:
        """Read numbered values.

        Returns the polynomials; None if there are too many, or if a constant depends on the number type.
        """
        typed = any(isinstance(node, Constant) and node.single is not None for node in values.nodes)
        if typed or len(values.nodes) > _LARGE:
            return None
        leaves = tuple(node for node in values.nodes if isinstance(node, (Variable, RuntimeParameter)))
        polynomials = polynomials_of(values, outputs)
        share_multiples(polynomials)
        return cls(leaves, polynomials)

    @property
    def weight(self) -> int:
        """Return what the operations cost, but for changes of sign, as they are."""
        return eliminate(self.polynomials, _whole_first).weight

    def searched(self) -> Rewriting:
        """Return the same with fewer operations, as far as single changes lead."""
        found, least = self.polynomials, self.weight
        while better := self._better(found, least):
            found, least = better
        return Rewriting(self.leaves, found)

    @staticmethod
    def _better(found: Polynomials, least: int) -> tuple[Polynomials, int] | None:
        for changed in _changes(found):
            weight = eliminate(changed, _whole_first).weight
            if weight < least:
                return changed, weight
        return None

    def values(self) -> tuple[ValueTable, list[Value]]:
        """Numbered values and signed outputs."""
        steps = [eliminate(self.polynomials, prefer) for prefer in _PREFERENCES]
        return rebuild(self.leaves, min(steps, key=lambda each: each.weight))


def _changes(polynomials: Polynomials) -> Iterator[Polynomials]:
    """Yield one factor taken out of a sum, or one sum multiplied out: first those that are read once."""
    # Factors and constants of several terms of a sum.
    sums = {atom: polynomials.sums[atom] for atom in polynomials.live() if atom in polynomials.sums}
    for atom, terms in sums.items():
        factors = Counter(factor for monomial in terms for factor in dict.fromkeys(monomial))
        sizes = Counter(abs(coefficient) for coefficient in terms.values() if abs(coefficient) != 1)
        for factor, number in factors.items():
            if number > 1:
                inside = {monomial: _less(monomial, factor) for monomial in terms if factor in monomial}
                yield _taken_out(polynomials, atom, inside, {(factor,): Fraction(1)})
        for size, number in sizes.items():
            if number > 1:
                inside = {monomial: monomial for monomial, each in terms.items() if abs(each) == size}
                yield _taken_out(polynomials, atom, inside, {(): size})
    # Sums as factors: those with one reader cost least to multiply out.
    parts = (*polynomials.outputs, *sums.values())
    uses = Counter(factor for part in parts for monomial in part for factor in monomial)
    places = [(atom, monomial, each) for atom, terms in sums.items() for monomial in terms for each in monomial]
    for atom, monomial, inner in sorted(places, key=lambda place: uses[place[2]]):
        if inner in sums:
            yield _multiplied_out(polynomials, atom, monomial, inner)


def _taken_out(
    polynomials: Polynomials, atom: int, inside: dict[Monomial, Monomial], shared: Polynomial
) -> Polynomials:
    """Take a factor, or a constant, out of some terms of a sum; `inside` gives what is left of each of them."""
    terms, (size,) = polynomials.sums[atom], shared.values()
    inner = {left: terms[monomial] / size for monomial, left in inside.items()}
    rest = {monomial: coefficient for monomial, coefficient in terms.items() if monomial not in inside}
    changed = polynomials.copy()
    changed.replace_sum(atom, added(rest, product(shared, changed.named(inner)), 1))
    return changed


def _multiplied_out(polynomials: Polynomials, atom: int, monomial: Monomial, factor: int) -> Polynomials:
    """Return a factor that is a sum, in one term of another sum."""
    terms = dict(polynomials.sums[atom])
    coefficient = terms.pop(monomial)
    parts = product({_less(monomial, factor): coefficient}, polynomials.sums[factor])
    changed = polynomials.copy()
    changed.replace_sum(atom, added(terms, parts, 1))
    return changed


def _less(monomial: Monomial, factor: int) -> Monomial:
    place = monomial.index(factor)
    return monomial[:place] + monomial[place + 1 :]
