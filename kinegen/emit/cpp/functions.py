"""The functions of the C++ header, as finished text: kernels on arrays, and the ways to call them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from kinegen.emit.accuracy import error_lines
from kinegen.emit.cpp.syntax import body
from kinegen.emit.functions import LINE
from kinegen.emit.inverse import notes_of
from kinegen.emit.kernels import Kernels, operation_line
from kinegen.emit.reals import Real
from kinegen.emit.words import brief, input_text, result_text
from kinegen.ir.program import Program
from kinegen.outputs import Array, Kind

PARAMS = "const Params<Real>& params"


@dataclass(frozen=True, slots=True)
class Argument:
    """An input or a result.

    Attributes:
        name: Its name.
        type: Its type for one configuration.
        number: Type of its numbers.
        size: Numbers of one configuration, last rows of matrices among them.
        text: What it holds.
        before: Numbers of one configuration of the arrays before it.
    """

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
    """One kernel, printed.

    Attributes:
        name: Its name.
        heading: What it computes, and notes about its results, as lines of a comment.
        costs: What a call costs, and its proven errors, as lines of a comment.
        inputs: What it is given.
        results: What it returns.
        has_params: Whether the robot has runtime parameters.
        reads_params: Whether the body reads any of them.
        read: Names of the inputs that the body reads.
        body: Its statements.
        returned: The type that is returned.
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
        """A list of arguments, with the runtime parameters behind them."""
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
        """The arguments of a call of the kernel, with `{name}` and `{size}` of each."""
        parts = [form.format(name=each.name, size=each.size) for each in self.inputs]
        parts += ["params"] * self.has_params
        return ", ".join([*parts, *(result.format(name=each.name, size=each.size) for each in self.results)])


_DERIVED = "Derived"
_RESTRICT = "__restrict"


def function_of(kernels: Kernels, program: Program) -> Function:
    """Print one kernel.

    Args:
        kernels: The robot and its programs.
        program: One of these.
    """
    signature, name = program.signature, program.quantity.function
    inputs = _arguments(signature.inputs, input_text)
    results = _arguments(signature.results, partial(_result_words, program))
    notes = notes_of(kernels, program, LINE, tuple(Real))
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


def _arguments(arrays: Sequence[Array], words: Callable[[Array], str]) -> tuple[Argument, ...]:
    """The inputs or the results."""
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


def _errors(kernels: Kernels, program: Program) -> tuple[str, ...]:
    """The proven errors in both number types."""
    double, single = (" ".join(error_lines(kernels, program, real)) for real in Real)
    if not double.startswith("Proven"):
        return tuple(textwrap.wrap(double, LINE))
    named = re.sub(r"^Proven error", "Proven error in float", single)
    text = f"{re.sub(r'^Proven error', 'Proven error in double', double)} {named}"
    whole = re.sub(r"(?<=\d) (?=(?:m|cm|mm|in|rad)\b)|(?<=<=) | (?=<=)", "~", text)
    lines = textwrap.wrap(whole, LINE, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)
