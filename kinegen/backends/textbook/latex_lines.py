"""Formulas of LaTeX in lines that fit an A4 page: how wide they are, and where they are broken."""

from __future__ import annotations

import re

from kinegen.support.dataclass import dataclass

_TOKEN = re.compile(r"\\[A-Za-z]+|\\.|\s+|\S")
_SCRIPT = 0.81
"""The width of indices to that of their letters: 7 pt type is a little wider than 7/10."""

_ITALIC_WIDTHS = """
a5.3 b4.3 c4.3 d5.2 e4.7 f4.9 g4.8 h5.8 i3.4 j4.1 k5.2 l3.0 m8.8 n6.0 o4.8 p5.0 q4.5 r4.5 s4.7 t3.6 u5.7 v4.8 w7.2 x5.7
y4.9 z4.7 A7.5 B7.6 C7.1 D8.3 E7.4 F6.4 G7.9 H8.3 I4.4 J5.5 K8.5 L6.8 M9.7 N8.0 O7.6 P6.4 Q7.9 R7.6 S6.1 T5.8 U6.8 V5.8
W9.4 X8.3 Y5.8 Z6.8
"""
_ROMAN_WIDTHS = """
a5.0 b5.6 c4.4 d5.6 e4.4 f3.1 g5.0 h5.6 i2.8 j3.1 k5.3 l2.8 m8.3 n5.6 o5.0 p5.6 q5.3 r3.9 s3.9 t3.9 u5.6 v5.3 w7.2 x5.3
y5.3 z4.4
"""
_ITALIC = {each[0]: float(each[1:]) for each in _ITALIC_WIDTHS.split()}
_ROMAN = {each[0]: float(each[1:]) for each in _ROMAN_WIDTHS.split()}
_SIGN = 7.8
_BINARY = 12.3
_SPACES = {r"\,": 1.7, r"\;": 2.8, r"\quad": 10.0, r"\qquad": 20.0, "=": 13.4, r"\colon": 6.1, ",": 4.5, "&": 0.0}
_MARKS = {"(": 3.9, ")": 3.9, "|": 2.8, ".": 2.8, ":": 2.8, "/": 5.0, r"\_": 3.6}
_GREEK = 6.3
_SPACE = 3.4
_FUNCTION_SPACE = 1.7
_BIG = 6.5
_OPENING, _CLOSING = 7.4, 9.1
"""Brackets that grow around a fraction, 7.36 points each; a thin space follows the closing one."""

_ROOT = 8.5
_FRACTION = 2.4
_AFTER_INDEX = 0.5


@dataclass(slots=True)
class _Measure:
    """Reads the tokens of a formula one after the other."""

    tokens: list[str]
    at: int = 0

    def row(self, scale: float, font: dict[str, float] | None = None) -> float:
        """Return the width up to a closing brace or the end."""
        total = 0.0
        leads = True
        while self.at < len(self.tokens):
            token = self.tokens[self.at]
            self.at += 1
            if token.startswith("}"):
                break
            total += self._signed(scale, leads=leads) if token in ("+", "-") else self._one(token, scale, font)
            leads = token in ("(", "=", "&", ",") or (leads and token.isspace())
        return total

    def _signed(self, scale: float, *, leads: bool) -> float:
        return (_SIGN if leads or scale < 1 else _BINARY) * scale

    def _one(self, token: str, scale: float, font: dict[str, float] | None) -> float:
        match token:
            case "{":
                return self.row(scale, font)
            case "_" | "^":
                return self._argument(scale * _SCRIPT, font) + _AFTER_INDEX
            case r"\frac":
                return max(self._argument(scale, font), self._argument(scale, font)) + _FRACTION
            case r"\sqrt":
                return _ROOT * scale + self._argument(scale, font)
            case r"\mathrm" | r"\text" | r"\operatorname":
                return self._argument(scale, _ROMAN)
            case r"\left" | r"\right":
                self.at += 1
                return self._growing(token) * scale
            case r"\Bigl" | r"\Bigr":
                self.at += 1
                return _BIG
        return self._letter(token, font) * scale

    def _growing(self, token: str) -> float:
        """Return a bracket of a formula, taken as grown where the formula has a fraction."""
        if r"\frac" not in self.tokens:
            return _BIG
        return _CLOSING if token.endswith("right") else _OPENING

    def _argument(self, scale: float, font: dict[str, float] | None) -> float:
        token = self.tokens[self.at]
        self.at += 1
        return self._one(token, scale, font)

    def _letter(self, token: str, font: dict[str, float] | None) -> float:
        if token.isspace():
            return _SPACE if font is _ROMAN else 0.0
        if token in _SPACES or token in _MARKS:
            return _SPACES.get(token, 0.0) + _MARKS.get(token, 0.0)
        if token.isdecimal():
            return 5.0
        if token.startswith("\\"):
            name = token[1:]
            is_function = name.startswith(("sin", "cos", "tan", "arc"))
            return sum(_ROMAN[letter] for letter in name) + _FUNCTION_SPACE if is_function else _GREEK
        return (font or _ITALIC).get(token, _ITALIC.get(token, 5.0))


def width(formula: str) -> float:
    """Return the width of a formula in print, in points; of a fraction that of its longer part."""
    return _Measure(_TOKEN.findall(formula)).row(1.0)


LINE = 338.0
"""Points of a line that a formula can fill: 345 in the standard classes at 10 pt, and some for what it is off."""

_INDENT = 10.0
_DEEPEST = 4
_PIECES = re.compile(r" (?=[+-] )")
_BRACKET = re.compile(r"\\(?:left|right)[()|]|[(){}]")
_GROWING = re.compile(r"\\(left|right)([()|])")


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part of a formula between two places at which it can be broken.

    `text`: the part, with the sign that it begins with. `depth`: number of brackets that are open before it.
    """

    text: str
    depth: int


def lines(formula: str, first: float = 0.0) -> tuple[str, ...]:
    """Return a formula as lines of an `align*`.

    Args:
        formula: LaTeX, as `notation` prints it.
        first: Points of the line that are taken by what stands before it, also on the lines that follow.

    Returns:
        The lines; those after the first begin with an indentation. Brackets that end on another line do not grow.
    """
    room = LINE - first
    filled = _filled(_pieces(formula), room, 0, 1)
    texts = [rf"{_space(depth)} {{}} {text}" for text, depth in filled[1:]]
    return _bracketed((filled[0][0], *texts))


def _space(depth: int) -> str:
    return r"\quad" * min(depth, _DEEPEST)


def _pieces(formula: str) -> list[_Piece]:
    """Return a formula, cut before the signs that stand in no fraction, root or index."""
    texts = [""]
    for part in _PIECES.split(formula):
        is_inside = texts[-1].count("{") > texts[-1].count("}")
        texts = [*texts[:-1], f"{texts[-1]} {part}"] if is_inside else [*texts, part]
    pieces = []
    depth = 0
    for text in texts[1:]:
        pieces.append(_Piece(text, depth))
        depth += sum(1 if mark.endswith("(") or "left" in mark else -1 for mark in _outer_brackets(text))
    return pieces


def _outer_brackets(text: str) -> list[str]:
    """Return the brackets that stand in no fraction, root or index."""
    marks = []
    braces = 0
    for found in _BRACKET.finditer(text):
        braces += {"{": 1, "}": -1}.get(found[0], 0)
        if braces == 0 and found[0] not in "{}":
            marks.append(found[0])
    return marks


def _filled(pieces: list[_Piece], room: float, depth: int, hang: int) -> list[tuple[str, int]]:
    """Lines with their indentation, that of the first and that of others: broken where the fewest brackets are open."""
    text = _joined(pieces)
    if len(pieces) == 1 or width(text) <= room - _INDENT * min(depth, _DEEPEST):
        return [(text, depth)]
    outermost = min(piece.depth for piece in pieces[1:])
    chunks: list[list[_Piece]] = []
    for piece in pieces:
        if chunks and (piece.depth > outermost or piece is pieces[0]):
            chunks[-1].append(piece)
        else:
            chunks.append([piece])
    found: list[tuple[str, int]] = []
    is_open = False
    for chunk in chunks:
        fits = room - _INDENT * min(found[-1][1], _DEEPEST) if is_open else 0.0
        if is_open and width(f"{found[-1][0]} {_joined(chunk)}") <= fits:
            found[-1] = (f"{found[-1][0]} {_joined(chunk)}", found[-1][1])
            continue
        broken = _filled(chunk, room, hang if found else depth, hang + 1)
        is_open = len(broken) == 1
        found += broken
    return found


def _joined(pieces: list[_Piece]) -> str:
    return " ".join(piece.text for piece in pieces)


def _bracketed(texts: tuple[str, ...]) -> tuple[str, ...]:
    r"""Return the lines, with `\Bigl(` for `\left(` where the other bracket is on another line."""
    opened: list[tuple[int, int]] = []
    parted: set[tuple[int, int]] = set()
    for line, text in enumerate(texts):
        for mark in _GROWING.finditer(text):
            if mark[1] == "left":
                opened.append((line, mark.start()))
            elif opened[-1][0] == line:
                opened.pop()
            else:
                parted |= {opened.pop(), (line, mark.start())}
    return tuple(_parted(text, {start for at, start in parted if at == line}) for line, text in enumerate(texts))


def _parted(text: str, starts: set[int]) -> str:
    def mark(found: re.Match[str]) -> str:
        side = {"left": "Bigl", "right": "Bigr"}[found[1]]
        return rf"\{side}{found[2]}" if found.start() in starts else found[0]

    return _GROWING.sub(mark, text)
