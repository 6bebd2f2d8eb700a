"""What kernels over batches add to the functions of the header: places of arrays, shared memory, names."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.cpp.functions import Function
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import function
from kinegen.outputs import Array

WARP = 32
"""Threads that read and write together."""

_BLOCKS = (128, 64, 32)
_SHARED = 48 * 1024
"""Bytes of shared memory that every block may have without asking."""

_MOST = 24 * 1024
"""Bytes that a block of one warp may have: with more, too few warps fit on a multiprocessor to be worth it."""

_BYTES = 8


@dataclass(frozen=True, slots=True)
class Place:
    """An input or a result of one configuration.

    Attributes:
        name: Its name.
        number: Type of its numbers.
        size: Numbers, the last rows of matrices among them.
        upper: Numbers without these.
        shape: Its shape in Python.
        before: Numbers in shared memory before it; of truth values, which are not there, 0.
    """

    name: str
    number: str
    size: int
    upper: int
    shape: tuple[int, ...]
    before: int

    @property
    def is_shared(self) -> bool:
        """Whether it goes through shared memory, where that is used at all."""
        return self.number == "Real" and self.size > 0

    @property
    def has_rows(self) -> bool:
        """Whether it holds matrices with last rows."""
        return self.upper < self.size

    @property
    def described(self) -> str:
        """The same for the Python module."""
        truth = ", is_truth=True" if self.number == "bool" else ""
        return f'Array("{self.name}", {self.shape}, {self.upper}{truth})'

    def own(self, form: str) -> str:
        """The numbers of an input as a list, from a text with `{index}`; last rows are known."""
        numbers = [form.format(index=index) for index in range(self.upper)]
        return ", ".join([*numbers, *("Real(0.0)", "Real(0.0)", "Real(0.0)", "Real(1.0)")[: self.size - self.upper]])


@dataclass(frozen=True, slots=True)
class Launched:
    """The kernels of one output.

    Attributes:
        function: The function of the header.
        inputs: What it is given.
        results: What it returns.
        block: Threads of a block.
        width: Numbers of shared memory for each thread, odd so that warps read it without conflicts; 0 for none.
        names: Names of the kernels without their ends, by number type.
    """

    function: Function
    inputs: tuple[Place, ...]
    results: tuple[Place, ...]
    block: int
    width: int
    names: dict[str, str]

    @property
    def has_rows(self) -> bool:
        """Whether there are results with last rows that may be left out."""
        return any(each.has_rows for each in self.results)

    def arguments(self, real: str) -> str:
        """What each kernel of a number type is given, as C++ writes it."""
        parts = [f"const {real}* {each.name}, const long long {each.name}_stride" for each in self.inputs]
        numbers = {"Real": real}
        parts += [
            f"{numbers.get(each.number, each.number)}* {each.name}, const long long {each.name}_stride"
            for each in self.results
        ]
        parts += [f"const {real}* given"] * self.function.has_params
        return ", ".join(["const long long n", *parts])

    @property
    def passed(self) -> str:
        """The same as one kernel passes it on."""
        parts = [f"{each.name}, {each.name}_stride" for each in (*self.inputs, *self.results)]
        return ", ".join(["n", *parts, *["given"] * self.function.has_params])


def launched_of(kernels: Kernels, program: Program, printed: Function) -> Launched:
    """The kernels of one output.

    Args:
        kernels: The robot and its programs.
        program: One of these.
        printed: Its function in the header.
    """
    inputs, results = _places(program.signature.inputs), _places(program.signature.results)
    width = max(sum(each.size for each in arrays if each.is_shared) for arrays in (inputs, results)) | 1
    fitting = [
        block
        for block in _BLOCKS
        if block * width * _BYTES <= (_SHARED if block > WARP else _MOST)
    ]  # fmt: skip
    return Launched(
        function=printed,
        inputs=inputs,
        results=results,
        block=fitting[0] if fitting else _BLOCKS[0],
        width=width if fitting else 0,
        names={real.value: function(kernels.robot.name, printed.name, real) for real in Real},
    )


def _places(arrays: tuple[Array, ...]) -> tuple[Place, ...]:
    found: list[Place] = []
    before = 0
    for array in arrays:
        number = "bool" if array.is_truth else "Real"
        place = Place(array.name, number, array.blocks * array.stored, array.size, array.shape, before)
        before += place.size if place.is_shared else 0
        found.append(place)
    return tuple(found)
