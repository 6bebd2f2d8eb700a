"""Values as sums of products, so that no addition or multiplication is tied to the order in which it was written.

What only one sum reads is part of that sum, a product of products is one product, and sums of inputs, as angles are,
are written out; any other sum that several read, or that is a factor, is an atom. Sines and cosines of twice and three
times an angle are made from those of the angle: a product or two for a pair that takes about thirty operations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from fractions import Fraction
from math import gcd, lcm

from kinegen.ir.program import Constant, Operator, Variable
from kinegen.ir.value_numbering import Node, SinOrCos, Value, ValueTable, live_values
from kinegen.support.dataclass import dataclass

Monomial = tuple[int, ...]
"""The atoms of a product, ascending; one that stands n times is its n-th power."""

Polynomial = dict[Monomial, Fraction]
"""The coefficient of each monomial; that of `()` is a constant."""


Product = tuple[tuple[int, int], Monomial]
"""The magnitude of a coefficient, as numerator and denominator, and a monomial."""

Term = tuple[int, Product]
"""A sign and a product."""


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation that is not arithmetic.

    `operands`: what it does it to, each one term or none.
    """

    operator: Operator | SinOrCos
    operands: tuple[Polynomial, ...]


@dataclass(slots=True)
class Polynomials:
    """Polynomials in atoms: inputs, parameters, results of operations that are not arithmetic, and named sums.

    Polynomials are replaced and never changed, so that copies can share them.

    Attributes:
        outputs: The outputs, each one term or none.
        operations: The operations that are not arithmetic, by the atoms that are their results.
        sums: The polynomial of each atom that is a sum; it has two terms or more.
        next_atom: The number of the next new atom; values of the program have smaller ones.
        listed: The terms of polynomials, in order; copies share them too.
    """

    outputs: list[Polynomial] = field(default_factory=list)
    operations: dict[int, Operation] = field(default_factory=dict)
    sums: dict[int, Polynomial] = field(default_factory=dict)
    next_atom: int = 0
    listed: dict[int, tuple[Polynomial, list[Term]]] = field(default_factory=dict)

    def copy(self) -> Polynomials:
        """Return a copy that can be given other outputs, operations and sums."""
        return Polynomials(list(self.outputs), dict(self.operations), dict(self.sums), self.next_atom, self.listed)

    def terms(self, polynomial: Polynomial) -> list[Term]:
        """Return the terms of a polynomial, by their monomials."""
        known = self.listed.get(id(polynomial))
        if known is None:
            # The polynomial is kept, so that no other one gets its place and with it its identity.
            known = self.listed[id(polynomial)] = polynomial, [_term(*each) for each in sorted(polynomial.items())]
        return known[1]

    def atom(self) -> int:
        """Return a new atom."""
        self.next_atom += 1
        return self.next_atom - 1

    def named(self, polynomial: Polynomial) -> Polynomial:
        """Return a polynomial as one term at most: a sum becomes an atom, or minus an atom, that is known or new."""
        if len(polynomial) < 2:
            return polynomial
        sign = 1 if polynomial[min(polynomial)] > 0 else -1
        wanted = times(polynomial, Fraction(sign))
        known = next((atom for atom, each in self.sums.items() if each == wanted), None)
        if known is None:
            known = self.atom()
            self.sums[known] = wanted
        return {(known,): Fraction(sign)}

    def substitute(self, replaced: dict[int, Polynomial]) -> None:
        """Put polynomials, of which each is one term or none, in the place of atoms."""

        def put(polynomial: Polynomial) -> Polynomial:
            if not any(atom in replaced for monomial in polynomial for atom in monomial):
                return polynomial
            result: Polynomial = {}
            for monomial, coefficient in polynomial.items():
                part: Polynomial = {(): coefficient}
                for factor in monomial:
                    part = product(part, replaced.get(factor, {(factor,): Fraction(1)}))
                result = added(result, part, 1)
            return result

        self.outputs = list(map(put, self.outputs))
        self.sums = {atom: put(each) for atom, each in self.sums.items()}
        self.operations = {
            atom: Operation(each.operator, tuple(map(put, each.operands))) for atom, each in self.operations.items()
        }

    def replace_sum(self, atom: int, terms: Polynomial) -> None:
        """Give a named sum other terms; where only one remains, it takes the place of the name."""
        self.sums[atom] = terms
        while short := [atom for atom, each in self.sums.items() if len(each) < 2]:
            self.substitute({short[0]: self.sums.pop(short[0])})

    def live(self) -> list[int]:
        """Return the sums and operations that an output needs, ascending."""
        found: set[int] = set()
        pending = list(self.outputs)
        while pending:
            for monomial in pending.pop():
                for atom in monomial:
                    if atom in found:
                        continue
                    if atom in self.sums:
                        found.add(atom)
                        pending.append(self.sums[atom])
                    elif atom in self.operations:
                        found.add(atom)
                        pending += self.operations[atom].operands
        return sorted(found)


def polynomials_of(values: ValueTable, outputs: Sequence[Value]) -> Polynomials:
    """Read values as polynomials.

    `values`: the values; operands before results. No constant depends on the number type.
    """
    live = live_values(values, [number for _, number in outputs])
    reader = _Reader(values, live, outputs)
    for number in live:
        reader.known[number] = reader.read(number)
    found = reader.found
    found.outputs = [times(found.named(reader.known[number]), Fraction(sign)) for sign, number in outputs]
    return found


class _Reader:
    """Reads values in ascending order."""

    def __init__(self, values: ValueTable, live: Sequence[int], outputs: Sequence[Value]) -> None:
        self.nodes = values.nodes
        self.found = Polynomials(next_atom=len(values.nodes))
        self.known: dict[int, Polynomial] = {}
        self.uses: dict[int, int] = {}
        nodes = [node for number in live if isinstance(node := values.nodes[number], Node)]
        for number in (*(number for _, number in outputs), *(each for node in nodes for each in node.operands)):
            self.uses[number] = self.uses.get(number, 0) + 1

    def read(self, number: int) -> Polynomial:
        node = self.nodes[number]
        if isinstance(node, Constant):
            return {(): node.value} if node.value else {}
        if not isinstance(node, Node):
            return {(number,): Fraction(1)}
        parts = [self.known[operand] for operand in node.operands]
        match node.operator:
            case Operator.NEG:
                return times(parts[0], Fraction(-1))
            case Operator.MUL:
                return product(self.found.named(parts[0]), self.found.named(parts[1]))
            case Operator.ADD | Operator.SUB:
                result = added(parts[0], parts[1], 1 if node.operator is Operator.ADD else -1)
                return result if self.uses[number] == 1 or self._is_linear(result) else self.found.named(result)
        return self._operation(number, Operation(node.operator, tuple(map(self.found.named, parts))))

    def _operation(self, number: int, operation: Operation) -> Polynomial:
        """Return an operation that is not arithmetic; an angle and its negative have one sine and one cosine."""
        sign = Fraction(1)
        if isinstance(operation.operator, SinOrCos) and any(size < 0 for size in operation.operands[0].values()):
            sign = Fraction(-1 if operation.operator is SinOrCos.SIN else 1)
            operation = Operation(operation.operator, (times(operation.operands[0], Fraction(-1)),))
        known = next((atom for atom, each in self.found.operations.items() if each == operation), number)
        self.found.operations[known] = operation
        return {(known,): sign}

    def _is_linear(self, polynomial: Polynomial) -> bool:
        return all(not monomial or (len(monomial) == 1 and self._is_input(monomial[0])) for monomial in polynomial)

    def _is_input(self, atom: int) -> bool:
        return atom < len(self.nodes) and isinstance(self.nodes[atom], Variable)


def _term(monomial: Monomial, coefficient: Fraction) -> Term:
    sign = -1 if coefficient.numerator < 0 else 1
    return sign, ((sign * coefficient.numerator, coefficient.denominator), monomial)


def times(polynomial: Polynomial, factor: Fraction) -> Polynomial:
    """Return a multiple of a polynomial."""
    return {monomial: factor * coefficient for monomial, coefficient in polynomial.items()}


def added(left: Polynomial, right: Polynomial, factor: int | Fraction) -> Polynomial:
    """Return the sum of a polynomial and a multiple of another."""
    result = dict(left)
    for monomial, coefficient in right.items():
        total = result.pop(monomial, Fraction(0)) + factor * coefficient
        if total:
            result[monomial] = total
    return result


def product(left: Polynomial, right: Polynomial) -> Polynomial:
    """Return a product, multiplied out."""
    result: Polynomial = {}
    for one, first in left.items():
        for other, second in right.items():
            result = added(result, {tuple(sorted((*one, *other))): first * second}, 1)
    return result


_MOST = 3
"""The largest multiple; the error grows with it, to about three units of rounding."""


def share_multiples(polynomials: Polynomials) -> None:
    """Compute sines and cosines of angles that are multiples of one angle from those of that angle.

    It is the greatest angle of which all are whole multiples, whether or not it is among them.

    Args:
        polynomials: They are changed.
    """
    for angles in _proportional(polynomials):
        unit = Fraction(gcd(*(size.numerator for size in angles)), lcm(*(size.denominator for size in angles)))
        if len(angles) > 1 and max(angles) <= _MOST * unit:
            _share(polynomials, angles, unit)


def _proportional(polynomials: Polynomials) -> list[dict[Fraction, Polynomial]]:
    """Angles that are multiples of each other, each by its size."""
    groups: dict[tuple[tuple[tuple[int, ...], Fraction], ...], dict[Fraction, Polynomial]] = {}
    for operation in polynomials.operations.values():
        if isinstance(operation.operator, SinOrCos):
            angle = _written_out(polynomials, operation.operands[0])
            if angle and () not in angle:
                size = abs(angle[min(angle)])
                direction = tuple(sorted(times(angle, 1 / size).items()))
                groups.setdefault(direction, {})[size] = operation.operands[0]
    return list(groups.values())


def _written_out(polynomials: Polynomials, angle: Polynomial) -> Polynomial:
    if len(angle) != 1:
        return angle
    ((monomial, size),) = angle.items()
    return times(polynomials.sums[monomial[0]], size) if monomial in [(atom,) for atom in polynomials.sums] else angle


def _share(polynomials: Polynomials, angles: dict[Fraction, Polynomial], unit: Fraction) -> None:
    size, angle = next(iter(angles.items()))
    base = angles.get(unit) or polynomials.named(times(_written_out(polynomials, angle), unit / size))
    sine, cosine = (_half(polynomials, operator, base) for operator in (SinOrCos.SIN, SinOrCos.COS))
    replaced: dict[int, Polynomial] = {}
    for atom, operation in polynomials.operations.items():
        for size, angle in angles.items():
            if size != unit and operation.operands == (angle,) and isinstance(operation.operator, SinOrCos):
                is_sine = operation.operator is SinOrCos.SIN
                replaced[atom] = _multiple(polynomials, int(size / unit), is_sine, sine, cosine)
    polynomials.substitute(replaced)
    for atom in replaced:
        del polynomials.operations[atom]


def _half(polynomials: Polynomials, operator: SinOrCos, angle: Polynomial) -> int:
    """Return the atom of a sine or cosine, known or new."""
    operation = Operation(operator, (angle,))
    for atom, known in polynomials.operations.items():
        if known == operation:
            return atom
    atom = polynomials.atom()
    polynomials.operations[atom] = operation
    return atom


def _multiple(polynomials: Polynomials, number: int, is_sine: bool, sine: int, cosine: int) -> Polynomial:
    """sin 2a = 2 s c, cos 2a = 1 - 2 s^2, sin 3a = s (3 - 4 s^2) and cos 3a = c (1 - 4 s^2), as one term."""
    square = (sine, sine)
    if number == 2 and is_sine:
        return {tuple(sorted((sine, cosine))): Fraction(2)}
    rest: Polynomial = {(): Fraction(3 if number == 3 and is_sine else 1), square: Fraction(-2 if number == 2 else -4)}
    ((named, sign),) = polynomials.named(rest).items()
    if number == 2:
        return {named: sign}
    return {tuple(sorted((*named, sine if is_sine else cosine))): sign}
