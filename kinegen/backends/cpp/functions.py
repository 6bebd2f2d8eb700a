"""The functions of the C++ header, as finished text: kernels on arrays, ways to call them, the nearest solution."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial

from kinegen.backends.accuracy import error_lines
from kinegen.backends.bundle import RobotPrograms, operation_line
from kinegen.backends.c.nearest import Choice, choice_of
from kinegen.backends.cpp.syntax import body, number
from kinegen.backends.descriptions import brief, input_text, result_text
from kinegen.backends.inverse import MOST_TURNS, branches_of, free_end_words, notes_of
from kinegen.backends.routines import LINE
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.outputs import Array, Kind
from kinegen.support.dataclass import dataclass

PARAMS = "const Params<Real>& params"


@dataclass(frozen=True, slots=True)
class Argument:
    """Holds an input or a result of one configuration; `before` are the numbers of the arrays before it."""

    name: str
    type: str
    number: str
    size: int
    text: str
    before: int

    @property
    def view(self) -> str:
        """The type of a view of it, of which only the number type is deduced."""
        return f"View<{self.number}, {self.size}>"


@dataclass(frozen=True, slots=True)
class Function:
    """Holds one kernel, printed.

    Attributes:
        heading: What it computes, and notes about its results, as lines of a comment.
        costs: What a call costs, and its proven errors, as lines of a comment.
        read: Names of the inputs that the body reads.
        is_inverse: Whether results count branches.
        is_batched: Whether there are inputs to be batched.
    """

    name: str
    heading: tuple[str, ...]
    costs: tuple[str, ...]
    inputs: tuple[Argument, ...]
    results: tuple[Argument, ...]
    has_params: bool
    reads_params: bool
    read: frozenset[str]
    body: tuple[str, ...]
    returned: str
    is_inverse: bool
    is_batched: bool

    @property
    def given(self) -> int:
        """Numbers of all inputs of one configuration."""
        return sum(each.size for each in self.inputs)

    @property
    def found(self) -> int:
        """Numbers of all results of one configuration."""
        return sum(each.size for each in self.results)

    @property
    def record(self) -> str:
        """The name of the struct of several results; empty for one result."""
        return f"{self.name}_result" if len(self.results) > 1 else ""

    def arguments(self, parts: Sequence[str], *, default: bool = True) -> str:
        """Returns a list of arguments, with the runtime parameters behind them."""
        more = [PARAMS + " = {}" * default] if self.has_params else []
        return ", ".join([*parts, *more])

    @property
    def kernel(self) -> str:
        """The arguments of the function on arrays."""
        unused = "" if self.reads_params or not self.has_params else "[[maybe_unused]] "
        parts = [
            f"{'' if each.name in self.read else '[[maybe_unused]] '}const Real* {_RESTRICT} {each.name}"
            for each in self.inputs
        ]
        parts += [f"{unused}{PARAMS}"] * self.has_params
        # What has no numbers is not written to.
        unwritten = ["" if each.size else "[[maybe_unused]] " for each in self.results]
        parts += [
            f"{mark}{each.number}* {_RESTRICT} {each.name}" for mark, each in zip(unwritten, self.results, strict=True)
        ]
        return ", ".join(parts)

    @property
    def values(self) -> str:
        """The arguments of the function that returns its results."""
        default = " = {}" if not self.is_batched else ""
        return self.arguments([f"const {each.type}& {each.name}{default}" for each in self.inputs])

    @property
    def views(self) -> str:
        """The arguments of the function that reads and writes the memory of the caller."""
        parts = [f"View<In{index}, {each.size}> {each.name}" for index, each in enumerate(self.inputs)]
        return self.arguments([*parts, *(f"{each.view} {each.name}" for each in self.results)])

    @property
    def view_types(self) -> str:
        """The parameters of its template."""
        return ", ".join([*(f"class In{index}" for index in range(len(self.inputs))), "class Real"])

    @property
    def batch(self) -> str:
        """The arguments of the function for any number of configurations."""
        parts = ["std::size_t n", *(f"const Real* {each.name}" for each in self.inputs)]
        return self.arguments([*parts, *(f"{each.number}* {each.name}" for each in self.results)])

    @property
    def eigen(self) -> str:
        """The arguments of the function that takes and returns matrices of Eigen."""
        kinds = [_DERIVED if index == 0 else f"Other{index}" for index in range(len(self.inputs))]
        parts = [f"const Eigen::MatrixBase<{kind}>& {each.name}" for kind, each in zip(kinds, self.inputs, strict=True)]
        return self.arguments(parts).replace("<Real>", f"<typename {_DERIVED}::Scalar>")

    @property
    def eigen_types(self) -> str:
        """The parameters of its template."""
        return ", ".join(f"class {f'Other{index}' if index else _DERIVED}" for index in range(len(self.inputs)))

    @property
    def eigen_call(self) -> str:
        """The arguments of the function on arrays, made of those."""
        parts = [f"detail::from_eigen<{each.type}>({each.name})" for each in self.inputs]
        return ", ".join([*parts, *["params"] * self.has_params])

    def call(self, form: str, result: str) -> str:
        """Returns the arguments of a call of the kernel, with `{name}` and `{size}` of each."""
        parts = [form.format(name=each.name, size=each.size) for each in self.inputs]
        parts += ["params"] * self.has_params
        return ", ".join([*parts, *(result.format(name=each.name, size=each.size) for each in self.results)])


_DERIVED = "Derived"
_RESTRICT = "__restrict"


def function_of(kernels: RobotPrograms, program: Program) -> Function:
    """Prints one kernel."""
    signature, name = program.signature, program.quantity.function
    inputs = arguments_of(signature.inputs, input_text)
    results = arguments_of(signature.results, partial(_result_words, program))
    # One template has notes for both number types.
    notes = notes_of(kernels, program, LINE, tuple(ScalarType))
    return Function(
        name=name,
        heading=(*textwrap.wrap(brief(signature), LINE - 7, break_on_hyphens=False), *notes),
        costs=(*textwrap.wrap(f"Costs {operation_line(program)}.", LINE), *_errors(kernels, program)),
        inputs=inputs,
        results=results,
        has_params=bool(kernels.defaults),
        reads_params=program.reads_parameters,
        read=frozenset(each.name for each in signature.inputs if each.size and program.reads(each)),
        body=body(kernels.robot, program),
        returned=results[0].type if len(results) == 1 else f"{name}_result<Real>",
        is_inverse=program.quantity.kind is Kind.INVERSE,
        is_batched=any(each.size for each in signature.inputs),
    )


def arguments_of(arrays: Sequence[Array], words: Callable[[Array], str]) -> tuple[Argument, ...]:
    """Returns the inputs or the results of a function, of which `words` says what each holds."""
    found: list[Argument] = []
    before = 0
    for array in arrays:
        number, shape = "bool" if array.is_truth else "Real", ", ".join(map(str, array.shape or (1,)))
        kind = f"std::array<{number}, {shape}>" if len(array.shape) < 2 else f"Tensor<{number}, {shape}>"
        found.append(Argument(array.name, kind, number, array.blocks * array.stored, words(array), before))
        before += found[-1].size
    return tuple(found)


def _result_words(program: Program, array: Array) -> str:
    if array.per_branch:
        by_name = ", by Branch" if program.signature.branches is not None else ""
        return f"a joint vector for each branch{by_name}"
    if array.is_truth:
        return "whether each branch is a solution"
    if not array.per_frame:
        return result_text(array)
    return f"{result_text(array)}, for each {'frame' if program.quantity.kind is Kind.FRAMES else 'tip'}"


def _errors(kernels: RobotPrograms, program: Program) -> tuple[str, ...]:
    double, single = (" ".join(error_lines(kernels, program, real)) for real in ScalarType)
    if not double.startswith("Proven"):
        return tuple(textwrap.wrap(double, LINE))
    named = re.sub(r"^Proven error", "Proven error in float", single)
    text = f"{re.sub(r'^Proven error', 'Proven error in double', double)} {named}"
    # A number and its unit stay on one line.
    whole = re.sub(r"(?<=\d) (?=(?:m|cm|mm|in|rad)\b)|(?<=<=) | (?=<=)", "~", text)
    lines = textwrap.wrap(whole, LINE, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


POSE = 16
"""Numbers of a pose."""


@dataclass(frozen=True, slots=True)
class Nearest(Choice):
    """Adds what the choice needs besides: words, and the numbers of a target and of what is given besides it."""

    free_lines: tuple[str, ...]
    branches: int
    far: str
    ahead: int


def nearest_of(kernels: RobotPrograms) -> Nearest | None:
    """Returns what the templates lay out; None where there is no closed-form inverse."""
    choice, branches = choice_of(kernels, tuple(ScalarType), number), branches_of(kernels)
    if choice is None or branches is None:
        return None
    turns = f"{MOST_TURNS[ScalarType.DOUBLE]} whole turns ({MOST_TURNS[ScalarType.FLOAT]} in float)"
    # Beyond these a joint value has no digits left for the choice.
    far = [turns] * any(map(math.isfinite, branches.turns))
    far += [f"1e15 {kernels.robot.units.length}"] * any(map(math.isinf, branches.turns))
    return Nearest(
        **{each.name: getattr(choice, each.name) for each in fields(choice)},
        free_lines=tuple(textwrap.wrap(free_end_words(branches).strip(), LINE, break_on_hyphens=False)),
        branches=len(branches.names),
        far=" or ".join(far),
        ahead=POSE + branches.given,
    )
