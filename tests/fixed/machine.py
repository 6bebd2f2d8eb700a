"""A C machine for the emitted integer code: it computes with Python's integers, and stops where C does not say what is.

It knows the few forms of which the emitted code consists, int32_t, uint32_t, int64_t and uint64_t, and an int of 32
bits. Overflow of a signed operation, the conversion of a number to a signed type that cannot hold it, a shift of or by
a negative number: each is a `StoppedError`, whatever compilers make of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

Number = tuple[int, str]
"""A value and its type."""

TYPES = {
    "int32_t": (-(2**31), 2**31 - 1),
    "uint32_t": (0, 2**32 - 1),
    "int64_t": (-(2**63), 2**63 - 1),
    "uint64_t": (0, 2**64 - 1),
}
_WORD = re.compile(r"\s*(\d+u?|0x[0-9A-F]+u|[A-Za-z_]\w*(?:->\w+)?(?:\[\d+\])*|>>|<=|[-+*/&~<?:(),])")
_FUNCTION = re.compile(r"^(?:static )?(?:inline )?(\w+) (\w+)\(([^)]*)\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_REFUSAL = re.compile(r"^#if .*\n#error .*\n#endif$", re.MULTILINE)
"""A check of the header, which compilers carry out."""
_WAYS = re.compile(r"^#if .*?$(.*?)^#else$(.*?)^#endif$", re.MULTILINE | re.DOTALL)
"""The two ways to multiply."""
_FORMS = {
    "declaration": r"const (\w+) (\w+) = (.*)",
    "store": r"\*?(\w+(?:\[\d+\])*) = (.*)",
    "pair": r"(\w+)\((.*), &(\w+), &(\w+)\)",
    "return": r"return (.*)",
    "nothing": r"int32_t \w+|\(void\)\w+",
}
_LEVELS = (("<", "<="), ("&",), (">>",), ("+", "-"), ("*", "/"))


class StoppedError(ArithmeticError):
    """The code did what C leaves undefined or to the implementation."""


def convert(value: int, to: str) -> Number:
    """A conversion; to unsigned types any number goes."""
    low, high = TYPES[to]
    if to.startswith("u"):
        return value % (high + 1), to
    if not low <= value <= high:
        raise StoppedError(f"{value} is converted to {to}")
    return value, to


def _common(left: Number, right: Number) -> tuple[int, int, str]:
    """The usual arithmetic conversions."""
    kinds = {left[1], right[1]}
    kind = next(kind for kind in ("uint64_t", "int64_t", "uint32_t", "int32_t") if kind in kinds)
    return convert(left[0], kind)[0], convert(right[0], kind)[0], kind


def _result(value: int, kind: str) -> Number:
    """What an operation gives: unsigned ones wrap, signed ones must not."""
    if not kind.startswith("u") and not TYPES[kind][0] <= value <= TYPES[kind][1]:
        raise StoppedError(f"overflow: {value} in {kind}")
    return convert(value, kind)


def binary(sign: str, left: Number, right: Number) -> Number:
    """An operation on two numbers."""
    if sign == ">>":
        if left[0] < 0 or right[0] < 0:
            raise StoppedError(f"shift of {left[0]} by {right[0]}")
        return left[0] >> right[0], left[1]
    a, b, kind = _common(left, right)
    match sign:
        case "+":
            return _result(a + b, kind)
        case "-":
            return _result(a - b, kind)
        case "*":
            return _result(a * b, kind)
        case "/":
            quotient = abs(a) // abs(b)
            return _result(quotient if (a < 0) == (b < 0) else -quotient, kind)
        case "&":
            if not kind.startswith("u"):
                raise StoppedError("bits of a signed number")
            return a & b, kind
        case "<":
            return int(a < b), "int32_t"
        case "<=":
            return int(a <= b), "int32_t"
    raise ValueError(sign)


Evaluation = Callable[["Machine", dict[str, Number]], Number]


@dataclass(slots=True)
class _Parser:
    """Turns the text of an expression into what evaluates it."""

    words: list[str]

    def next(self, *expected: str) -> str:
        word = self.words.pop(0)
        assert not expected or word in expected, (word, expected)
        return word

    def peek(self) -> str:
        return self.words[0] if self.words else ""

    def conditional(self) -> Evaluation:
        condition = self.level(0)
        if self.peek() != "?":
            return condition
        self.next("?")
        yes = self.level(0)
        self.next(":")
        no = self.level(0)
        # Only one branch is evaluated, so what the other one would do does not count.
        return lambda machine, names: (yes if condition(machine, names)[0] else no)(machine, names)

    def level(self, level: int) -> Evaluation:
        if level == len(_LEVELS):
            return self.unary()
        left = self.level(level + 1)
        while self.peek() in _LEVELS[level]:
            left = self._operation(self.next(), left, self.level(level + 1))
        return left

    @staticmethod
    def _operation(sign: str, left: Evaluation, right: Evaluation) -> Evaluation:
        return lambda machine, names: binary(sign, left(machine, names), right(machine, names))

    def unary(self) -> Evaluation:
        word = self.next()
        if word == "-":
            operand = self.unary()
            return lambda machine, names: binary("-", (0, "int32_t"), operand(machine, names))
        if word == "(" and self.peek() in TYPES:
            kind = self.next()
            self.next(")")
            converted = self.unary()
            return lambda machine, names: convert(converted(machine, names)[0], kind)
        if word == "(":
            inside = self.conditional()
            self.next(")")
            return inside
        if word[0].isdigit():
            value = int(word.removesuffix("u"), 0)
            kinds = ("uint32_t", "uint64_t") if word.endswith("u") else ("int32_t", "int64_t")
            literal = value, next(kind for kind in kinds if value <= TYPES[kind][1])
            return lambda _machine, _names: literal
        return self._call(word) if self.peek() == "(" else lambda _machine, names: names[word]

    def _call(self, name: str) -> Evaluation:
        self.next("(")
        arguments = [self.level(0)]
        while self.next(",", ")") == ",":
            arguments.append(self.level(0))
        return lambda machine, names: machine.call(name, [each(machine, names) for each in arguments])["return"]


@cache
def parse(text: str) -> Evaluation:
    """What evaluates an expression."""
    words = _WORD.findall(text)
    assert "".join(words) == text.replace(" ", ""), text
    parser = _Parser(words)
    evaluation = parser.conditional()
    assert not parser.words, text
    return evaluation


@dataclass(slots=True)
class Machine:
    """The functions of one file.

    Attributes:
        functions: Type, arguments and statements, by name.
    """

    functions: Mapping[str, tuple[str, list[str], list[str]]]

    def call(self, name: str, arguments: list[Number]) -> dict[str, Number]:
        """Run a function on numbers; what it returns or stores at its pointers, by name."""
        kind_returned, wanted, statements = self.functions[name]
        names: dict[str, Number] = {}
        for argument, value in zip(wanted, arguments, strict=False):
            kind, _, called = argument.removeprefix("const ").rpartition(" ")
            names[called] = convert(value[0], kind)
        for statement in statements:
            self._run(statement, names)
        if "return" in names:
            names["return"] = convert(names["return"][0], kind_returned)
        return names

    def kernel(self, name: str, q: list[int], params: Mapping[str, int]) -> dict[str, int]:
        """Run a kernel; every entry of its result, by the text of its place."""
        names: dict[str, Number] = {f"q[{index}]": (entry, "int32_t") for index, entry in enumerate(q)}
        names |= {f"params->{key}": (entry, "int32_t") for key, entry in params.items()}
        for statement in self.functions[name][2]:
            self._run(statement, names)
        return {place: value for place, (value, _) in names.items() if place.startswith("base_")}

    def _run(self, statement: str, names: dict[str, Number]) -> None:
        form, parts = _form(statement)
        match form:
            case "declaration":
                kind, name, text = parts
                value, found = parse(text)(self, names)
                # An implicit conversion must not change anything.
                assert convert(value, kind)[0] == value, (statement, found)
                names[name] = (value, kind)
            case "store":
                names[parts[0]] = convert(parse(parts[1])(self, names)[0], "int32_t")
            case "pair":
                found = self.call(parts[0], [parse(parts[1])(self, names)])
                names[parts[2]], names[parts[3]] = found["s"], found["c"]
            case "return":
                names["return"] = parse(parts[0])(self, names)


@cache
def _form(statement: str) -> tuple[str, tuple[str, ...]]:
    """Which of the few forms a statement has, and its parts."""
    for form, pattern in _FORMS.items():
        if found := re.fullmatch(pattern, statement):
            return form, found.groups()
    raise ValueError(f"the machine does not know {statement!r}")


def load(source: str, *, split: bool) -> Machine:
    """Read an emitted source.

    Args:
        source: The text.
        split: Whether products are made of 16-bit halves.
    """
    text = re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL)
    text = re.sub(r"^#if defined\(_MSC_VER\).*?^#endif$", "", text, flags=re.DOTALL | re.MULTILINE)
    text = _REFUSAL.sub("", text)
    text = _WAYS.sub(r"\1" if split else r"\2", text)
    text = re.sub(r"^#(?:ifndef|define|endif).*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"\bKINEGEN_(\w+)_SINCOS(?=\()", lambda found: f"{found[1].lower()}_sincos", text)
    functions = {}
    for kind, name, arguments, body in _FUNCTION.findall(text):
        statements = [line.strip() for line in body.split(";") if line.strip()]
        functions[name] = (kind, arguments.split(", "), statements)
    return Machine(functions)
