"""A function in straight-line code: statements of a program in passages, each with a comment."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.ir.program import Operand, Operator, Statement, Temporary


@dataclass(frozen=True, slots=True)
class Passage:
    """Some statements and what they do.

    Attributes:
        title: The comment; its lines are kept in every language.
        statements: The statements.
    """

    title: str
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Routine:
    """A function of numbers.

    Attributes:
        name: Its name.
        inputs: The names of its arguments, in the order of the variables.
        passages: The code.
        outputs: What it returns.

    Raises:
        ValueError: If a name is defined twice, used before its definition or never.
    """

    name: str
    inputs: tuple[str, ...]
    passages: tuple[Passage, ...]
    outputs: tuple[Operand, ...]

    def __post_init__(self) -> None:
        defined: set[str] = set(self.inputs)
        used = {operand.name for operand in self.outputs if isinstance(operand, Temporary)}
        for statement in self.statements:
            names = {operand.name for operand in statement.operands if isinstance(operand, Temporary)}
            if not names <= defined:
                raise ValueError(f"{self.name}: {sorted(names - defined)} are used before they are defined")
            if statement.name in defined:
                raise ValueError(f"{self.name}: {statement.name} is defined twice")
            defined.add(statement.name)
            used |= names
        unused = {statement.name for statement in self.statements} - used
        if unused:
            raise ValueError(f"{self.name}: {sorted(unused)} are never used")

    @property
    def statements(self) -> tuple[Statement, ...]:
        """All statements in their order."""
        return tuple(statement for passage in self.passages for statement in passage.statements)

    def uses(self, *operators: Operator) -> bool:
        """Whether it has one of these operations."""
        return any(statement.operator in operators for statement in self.statements)
