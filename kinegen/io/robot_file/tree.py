"""Robot file text -> a bounded tree of scalars, sequences and mappings, and typed access to its nodes.

In: the bytes of a file from a stranger. Out: frozen nodes; a scalar stays text, so that no number ever passes through
YAML's floats or its many spellings of true. Size, nesting, aliases and tags are checked on the event stream, before
anything is built. What the entries mean is not decided here.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection, Iterable, Iterator
from itertools import pairwise
from typing import Any, NoReturn

import yaml

from kinegen.errors import quote
from kinegen.io.messages import A_WORKBOOK, WORKBOOKS, expected, fail
from kinegen.model.expression_parser import MINUS
from kinegen.support.dataclass import dataclass

MAX_BYTES = 256 * 1024
MAX_DEPTH = 12
MAX_SIZE = 80_000
"""Characters of all entries after aliases are written out; it bounds the work on a file, however it is written."""

NODE_SIZE = 4
"""What a node adds to its characters, so that empty lists cost something too."""


@dataclass(frozen=True, slots=True)
class Scalar:
    """One value, as text."""

    text: str
    line: int

    @property
    def size(self) -> int:
        """Its share of `MAX_SIZE`; lists and mappings have theirs with all that is in them."""
        return NODE_SIZE + len(self.text)


@dataclass(frozen=True, slots=True)
class Sequence:
    """A list."""

    items: tuple[Node, ...]
    line: int
    size: int


@dataclass(frozen=True, slots=True)
class Mapping:
    """Keys with values, in the order of the file; no key stands twice."""

    entries: tuple[tuple[Scalar, Node], ...]
    line: int
    size: int


Node = Scalar | Sequence | Mapping


def decode(data: bytes) -> str:
    """Turn the bytes of a robot file, UTF-8 with or without a byte order mark, into text."""
    if data.startswith(WORKBOOKS):
        fail(A_WORKBOOK)
    if len(data) > MAX_BYTES:
        fail(f"the file is larger than {MAX_BYTES // 1024} KiB, too large for a robot file")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        fail("this is UTF-16 text; save the file as UTF-8")
    if b"\0" in data:
        fail("this is a binary file; a robot file is UTF-8 text")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        fail(f"byte 0x{data[error.start]:02x} is not UTF-8 text (save the file as UTF-8)", line)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def parse_tree(text: str) -> Mapping:
    """Read YAML text into a tree, and return the mapping at the top.

    Raises:
        RobotFileError: If the text is not YAML, is out of bounds, or is more than plain data.
    """
    _refuse_control_characters(text)
    try:
        root = _Composer(yaml.parse(text, Loader=yaml.SafeLoader)).document()
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        fail(_explain(error, text), line)
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # an escape such as "\Uffffffff" ends in chr()
        fail(f"not valid YAML: {_reason(error)}")
    if root is None:
        fail("the file is empty (a robot file begins with 'kinegen: 1')")
    if not isinstance(root, Mapping):
        fail("a robot file is made of 'key: value' entries and begins with 'kinegen: 1'", root.line)
    return root


def _refuse_control_characters(text: str) -> None:
    for number, line in enumerate(text.split("\n"), start=1):
        bad = next((c for c in line if (c < " " and c != "\t") or "\x7f" <= c <= "\x9f" or c in "\u2028\u2029"), None)
        if bad is not None:
            fail(f"control character {bad!a} is not allowed in a robot file", number)


def _reason(error: Exception) -> str:
    if isinstance(error, yaml.YAMLError):
        return " ".join(str(error).split())
    return r"an escape such as \U0010ffff, or a version number, is out of range"


_HINTS = {
    "expected <block end>": "; is this line indented as those before it?",
    "expected ',' or '}', but got ':'": "; is a comma missing before a key?",
    "could not find expected ':'": "; is the colon missing behind a key?",
}
"""What was probably done, by the beginning of what the parser says."""


def _explain(error: yaml.MarkedYAMLError, text: str) -> str:
    problem = error.problem or "it cannot be read"
    if problem == "mapping values are not allowed here":
        problem += f" ({_why_no_mapping(error.problem_mark, text)})"
    if r"found character '\t'" in problem:
        return "tab characters cannot indent YAML; use spaces"
    context = f" ({error.context}" if error.context else ""
    if context and error.context_mark is not None:
        context += f" that begins on line {error.context_mark.line + 1}"
    hint = next((words for start, words in _HINTS.items() if problem.startswith(start)), "")
    return f"not valid YAML: {problem}{context and context + ')'}{hint}"


def _why_no_mapping(mark: yaml.Mark | None, text: str) -> str:
    """Guess what is wrong at a colon: the key alone before it is indented too far, or the text has no quotes."""
    line = text.splitlines()[mark.line : mark.line + 1] if mark else []
    if line and mark and re.fullmatch(r"\s+[A-Za-z_]\w*\s*", line[0][: mark.column]):
        return "is this line indented too far?"
    return "text that contains ': ' must be quoted"


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark is not None else 0


class _Composer:
    """Builds nodes from YAML events, within the bounds above."""

    def __init__(self, events: Iterator[Any]) -> None:
        self._events = events
        self._anchors: dict[str, Node] = {}
        self._size = 0

    def document(self) -> Node | None:
        """Return the only document of the stream, or None if there is none."""
        root: Node | None = None
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    fail("a second YAML document begins here; a robot file holds one", _line(event))
                root = self._node(next(self._events), 1)
        return None if isinstance(root, Scalar) and not root.text else root

    def _node(self, event: Any, depth: int) -> Node:
        line = _line(event)
        if depth > MAX_DEPTH:
            fail(f"entries are nested more than {MAX_DEPTH} deep", line)
        if isinstance(event, yaml.AliasEvent):
            return self._alias(str(event.anchor), line)
        # A tag could make YAML build any object.
        if event.tag is not None:
            fail(f"YAML tag {quote(event.tag)} is not allowed; a robot file holds plain data", line)
        # Count before children are read, so that nothing large is ever built.
        node: Node
        if isinstance(event, yaml.ScalarEvent):
            node = Scalar(event.value, line)
            self._count(node.size, line)
        elif isinstance(event, yaml.SequenceStartEvent):
            self._count(NODE_SIZE, line)
            items = tuple(self._children(yaml.SequenceEndEvent, depth))
            node = Sequence(items, line, NODE_SIZE + sum(item.size for item in items))
        else:
            self._count(NODE_SIZE, line)
            node = self._mapping(line, depth)
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _alias(self, anchor: str, line: int) -> Node:
        if anchor not in self._anchors:
            fail(f"alias {quote('*' + anchor)} has no anchor '&' above it", line)
        node = self._anchors[anchor]
        self._count(node.size, line)
        return node

    def _count(self, more: int, line: int) -> None:
        self._size += more
        if self._size > MAX_SIZE:
            fail(f"the entries up to here hold more than {MAX_SIZE} characters, counting each alias in full", line)

    def _children(self, end: type, depth: int) -> Iterator[Node]:
        for event in self._events:
            if isinstance(event, end):
                return
            yield self._node(event, depth + 1)

    def _mapping(self, line: int, depth: int) -> Mapping:
        entries: dict[str, tuple[Scalar, Node]] = {}
        children = self._children(yaml.MappingEndEvent, depth)
        for key in children:
            if not isinstance(key, Scalar):
                fail("a key must be a single word", key.line)
            if key.text == "<<":
                fail("merge keys '<<' are not supported; write the entries out", key.line)
            if key.text in entries:
                first = entries[key.text][0].line
                fail(f"key {quote(key.text)} occurs twice in one mapping (first on line {first})", key.line)
            entries[key.text] = (key, next(children))
        size = NODE_SIZE + sum(key.size + value.size for key, value in entries.values())
        return Mapping(tuple(entries.values()), line, size)


def describe(node: Node) -> str:
    """Return what a node is, for a message that wanted something else."""
    match node:
        case Scalar(""):
            return "nothing"
        case Scalar(text):
            return quote(text)
        case Sequence():
            return "a list"
        case Mapping():
            return "a mapping"


def wrong(node: Node, wanted: str) -> NoReturn:
    """Raise the defect of a node of another kind than the format wants."""
    fail(f"expected {wanted}, found {describe(node)}", node.line)


def _refuse_cut(node: Node) -> None:
    """Refuse text that YAML cut in two: a comma ends an entry in braces or a list, also inside `atan2(y, x)`."""
    match node:
        case Mapping(entries):
            cut = [key.line for key, _ in entries if ")" in key.text and "(" not in key.text]
        case Sequence(items):
            cut = [
                item.line for item in items if isinstance(item, Scalar) and item.text.count("(") > item.text.count(")")
            ]
        case _:
            cut = []
    if cut:
        fail("text with a comma, such as atan2(y, x), must be quoted between braces", cut[0])


def _refuse_comma(node: Mapping, keys: Collection[str]) -> None:
    """Refuse a number with a decimal comma, at which YAML ends an entry: `a: 175,5` in braces."""
    for (_, value), (key, after) in pairwise(node.entries):
        is_cut = key.text not in keys and key.text.isdigit() and after == Scalar("", after.line)
        if is_cut and isinstance(value, Scalar) and value.text.lstrip(f"+-{MINUS}").isdigit():
            written = f"{value.text},{key.text}"
            fail(f"{quote(written)}: a decimal point is written '.', as in {value.text}.{key.text}", key.line)


def mapping(node: Node, keys: Collection[str], example: str) -> dict[str, Node]:
    """Return the entries of a mapping, all of them known; `example` is for the message where the node is none."""
    if not isinstance(node, Mapping):
        wrong(node, example)
    _refuse_cut(node)
    _refuse_comma(node, keys)
    for key, _ in node.entries:
        if key.text not in keys:
            name, colon, value = key.text.partition(":")
            if colon and name in keys:
                fail(
                    f"{quote(key.text)}: a space belongs after the colon, as in '{name}: {quote(value)[1:-1]}'",
                    key.line,
                )
            fail(f"unknown key {quote(key.text)} {expected(key.text, keys)}", key.line)
    return {key.text: value for key, value in node.entries}


def named(node: Node, example: str, limit: int) -> tuple[tuple[Scalar, Node], ...]:
    """Return the entries of a mapping whose keys are names that the user chose."""
    if not isinstance(node, Mapping):
        wrong(node, example)
    _refuse_cut(node)
    if len(node.entries) > limit:
        fail(f"{len(node.entries)} entries are too many (at most {limit})", node.line)
    return node.entries


def items(node: Node, wanted: str, count: int | None = None) -> tuple[Node, ...]:
    """Return the items of a list, of a given length if there is one."""
    if not isinstance(node, Sequence):
        wrong(node, wanted)
    _refuse_cut(node)
    if count is not None and len(node.items) != count:
        found = f"{len(node.items)} value{'' if len(node.items) == 1 else 's'}"
        fail(f"expected {wanted}, found {found}", node.line)
    return node.items


def word(node: Node, wanted: str) -> str:
    """Return the text of a scalar that is not empty."""
    if not isinstance(node, Scalar) or not node.text.strip():
        wrong(node, wanted)
    return node.text.strip()


def choice(node: Node, what: str, options: Iterable[str]) -> str:
    """Return a scalar that is one of a few words."""
    known = tuple(options)
    text = word(node, f"one of {', '.join(known)}")
    if text not in known:
        fail(f"unknown {what} {quote(text)} {expected(text, known)}", node.line)
    return text
