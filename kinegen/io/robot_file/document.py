"""The text of a robot file with the places of its nodes, so that one entry changes and every other byte stays.

In: valid YAML text. Out: the same text with some nodes replaced; comments, order and layout of the rest are kept. A
`Document` is one state of the text, and each change gives the next one. `Edits` collects changes at the places of one
state and makes them together, with comments above the lines that change.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml

from kinegen.errors import KinegenError
from kinegen.io.format import FORMATS, READING, format_of
from kinegen.io.load import load, read_bytes
from kinegen.io.robot_file.tree import decode
from kinegen.io.robot_file.write import write


def end_of(node: yaml.Node) -> int:
    """Return where the text of a node ends; a block ends with its last entry, not with the comments below it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return end_of(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


class CannotRewriteError(Exception):
    """A change cannot be made by replacing entries of the text."""


class Document:
    """One state of the text, which the reader has accepted, and the root of its nodes."""

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self.root: Any = yaml.compose(text, Loader=yaml.SafeLoader)
        except yaml.YAMLError:
            raise CannotRewriteError("other entries depend on the one that would change") from None

    def node(self, *path: str | int) -> Any:
        """Return a node by keys and places, or None."""
        node = self.root
        for part in path:
            if isinstance(node, yaml.MappingNode):
                node = self.value(node, part)
            elif isinstance(node, yaml.SequenceNode) and isinstance(part, int):
                node = node.value[part]
            else:
                node = None
            if node is None:
                return None
        return node

    def value(self, mapping: yaml.MappingNode, key: str | int) -> yaml.Node | None:
        """Return the value of a key, if it is there."""
        return next((value for name, value in mapping.value if name.value == key), None)

    def rows(self) -> Iterator[tuple[str, yaml.MappingNode]]:
        """Return the rows of the table with their names, in order."""
        for row in getattr(self.value(self.root, "joints"), "value", ()):
            name = self.value(row, "name")
            yield str(getattr(name, "value", "")), row

    def source(self, node: yaml.Node) -> str:
        """Return the text of a node, as it is in the file."""
        return self.text[node.start_mark.index : end_of(node)]

    def key(self, key: str) -> yaml.Node:
        """Return the node of a key at the top."""
        found: yaml.Node = next(name for name, _ in self.root.value if name.value == key)
        return found

    def words(self, *path: str | int) -> str:
        """Return the text of a scalar."""
        node = self.node(*path)
        if not isinstance(node, yaml.ScalarNode):
            raise CannotRewriteError(f"there is no entry {path[-1]}")
        return str(node.value)

    def with_scalar(self, change: Callable[[str], str], *path: str | int) -> Document:
        """Return the document after the text of one scalar went through a function."""
        old = self.words(*path)
        return self.with_text(change(old), *path)

    def with_text(self, new: str, *path: str | int) -> Document:
        """Return the document with another text in one scalar; its quotation marks are kept."""
        node = self.node(*path)
        self._check_own(path)
        if not isinstance(node, yaml.ScalarNode) or node.style in ("|", ">"):
            raise CannotRewriteError(f"there is no entry {path[-1]} on a line of its own")
        start, end = node.start_mark.index, node.end_mark.index
        return Document(self._aligned(start, end, _in_quotes(node, new)))

    def with_mapping(self, key: str, flow: str) -> Document:
        """Return the document with another value for a key at the top; at the end of the file if it is not there."""
        self._check_block()
        self._check_own((key,))
        node = self.node(key)
        if node is None:
            end = "" if self.text.endswith("\n") or not self.text else "\n"
            return Document(f"{self.text}{end}{key}: {flow}\n")
        start = self.key(key).end_mark.index
        return Document(self._spliced(start, end_of(node), f": {flow}"))

    def without(self, key: str) -> Document:
        """Return the document without a key at the top and the lines of its value."""
        self._check_block()
        self._check_own((key,))
        node, name = self.node(key), self.key(key)
        first = self.text.rfind("\n", 0, name.start_mark.index) + 1
        last = self.text.find("\n", end_of(node))
        return Document(self._spliced(first, len(self.text) if last < 0 else last + 1, ""))

    def without_pair(self, key: str, *path: str | int) -> Document:
        """Return the document without an entry of a mapping between braces."""
        mapping = self.node(*path)
        self._check_own((*path, key))
        pairs = mapping.value if isinstance(mapping, yaml.MappingNode) else []
        at = next((index for index, (name, _) in enumerate(pairs) if name.value == key), None)
        if at is None or not mapping.flow_style or len(pairs) < 2:
            raise CannotRewriteError(f"the entry {key} cannot be taken out")
        if at == 0:
            return Document(self._spliced(pairs[0][0].start_mark.index, pairs[1][0].start_mark.index, ""))
        return Document(self._spliced(end_of(pairs[at - 1][1]), end_of(pairs[at][1]), ""))

    def _check_own(self, path: tuple[str | int, ...]) -> None:
        """Refuse an entry that another one shares: an alias is a node that begins before its parent."""
        parent = self.root
        for length in range(1, len(path) + 1):
            node = self.node(*path[:length])
            if node is not None:
                start = node.start_mark.index
                if start < parent.start_mark.index or self.text[start : start + 1] in ("&", "*"):
                    raise CannotRewriteError(f"the entry {path[length - 1]} is shared by a YAML alias")
                parent = node

    def _aligned(self, start: int, end: int, new: str) -> str:
        """Put other characters in a place; the next entry keeps its column in a table that has columns."""
        grown = len(new) - (end - start)
        match = re.compile(r", *(?=\S)").match(self.text, end)
        if grown and match and self._in_column(match.end()):
            blanks = max(1, len(match[0]) - 1 - grown)
            return self.text[:start] + new + "," + " " * blanks + self.text[match.end() :]
        return self._spliced(start, end, new)

    def _in_column(self, at: int) -> bool:
        """Tell whether a line next to this one has the same word in the same column."""
        first = self.text.rfind("\n", 0, at) + 1
        word, column = re.compile(r"\w*:?").match(self.text, at), at - first
        near = [self.text[:first].splitlines()[-1:], self.text[first:].splitlines()[1:2]]
        return word is not None and any(line.startswith(word[0], column) for lines in near for line in lines)

    def _check_block(self) -> None:
        if self.root.flow_style:
            raise CannotRewriteError("the whole file is between braces")

    def _spliced(self, start: int, end: int, new: str) -> str:
        return self.text[:start] + new + self.text[end:]


class Edits(Document):
    """Changes that are made together at the places of one text."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._edits: list[tuple[int, int, str]] = []

    def replace(self, node: yaml.Node, new: str) -> None:
        """Put a text in the place of a node, in the quotes that a scalar has or needs."""
        text = _in_quotes(node, new) if isinstance(node, yaml.ScalarNode) else new
        self._edits.append((node.start_mark.index, end_of(node), text))

    def comment(self, node: yaml.Node, lines: list[str]) -> None:
        """Put lines of comment above the line on which a node begins."""
        start = self.text.rfind("\n", 0, node.start_mark.index) + 1
        line = self.text[start:].split("\n", 1)[0]
        indent = line[: len(line) - len(line.lstrip())]
        if lines:
            self._edits.append((start, start, "".join(f"{indent}# {each}\n" for each in lines)))

    def rebuild(self, row: yaml.MappingNode, dropped: frozenset[str], added: list[tuple[str, str]]) -> list[str]:
        """Write a row again without some keys and with others behind its name; return the comments inside of it."""
        pairs = [(str(key.value), self.source(value)) for key, value in row.value if key.value not in dropped]
        at = next(place for place, (key, _) in enumerate(pairs) if key == "name") + 1
        pairs[at:at] = added
        texts = [f"{key}: {value}" for key, value in pairs]
        start, end = row.start_mark.index, end_of(row)
        block = not row.flow_style
        new = f"\n{' ' * row.start_mark.column}".join(texts) if block else "{" + ", ".join(texts) + "}"
        self._edits.append((start, end, new))
        return [each for each in self._gaps(row) if each]

    def append(self, line: str) -> None:
        """Put a line at the end."""
        lead = "" if self.text.endswith("\n") else "\n"
        self._edits.append((len(self.text), len(self.text), f"{lead}{line}\n"))

    def result(self, heading: str) -> str:
        """Return the text after all edits, with a comment above all."""
        text = self.text
        # Later places first, so that earlier ones stay where they are; a replacement before what goes above it.
        order = sorted(range(len(self._edits)), key=lambda place: (*self._edits[place][:2], place), reverse=True)
        for start, end, new in (self._edits[place] for place in order):
            text = text[:start] + new + text[end:]
        return f"# {heading}\n{text}"

    def _gaps(self, row: yaml.MappingNode) -> Iterator[str]:
        """Return the comments between the pairs of a mapping."""
        for (_, before), (after, _) in zip(row.value, row.value[1:]):
            for line in self.text[end_of(before) : after.start_mark.index].split("\n"):
                yield line.partition("#")[2].strip()


def read_edits(text: str, path: str) -> Edits:
    """Read the valid text of a robot file, and refuse one whose entries cannot be edited one by one."""
    edits = Edits(text)
    root = edits.root
    if not isinstance(root, yaml.MappingNode) or root.flow_style:
        raise KinegenError("this file is a single list of entries in braces; write one entry a line to edit it", path)
    seen = set[int]()
    for node in _nodes(root):
        if id(node) in seen:
            raise KinegenError(
                "an alias is used here; write the entries out, so that each can change alone",
                path,
                node.start_mark.line + 1,
            )
        seen.add(id(node))
    return edits


def _nodes(node: yaml.Node) -> Iterator[yaml.Node]:
    yield node
    for child in node.value if isinstance(node, yaml.CollectionNode) else ():
        for each in child if isinstance(child, tuple) else (child,):
            yield from _nodes(each)


def _in_quotes(node: yaml.ScalarNode, new: str) -> str:
    """Return a text for the place of a scalar: in the quotes that it has, or in some if it needs them."""
    needed = '"' if re.search(r"[,\[\]{}#:&*!|>'\"%@`]", new) and not _is_plain(new) else ""
    mark = node.style if node.style in ("'", '"') else needed
    return f"{mark}{new}{mark}"


def _is_plain(text: str) -> bool:
    """Tell whether an expression needs no quotation marks, also between braces."""
    return re.fullmatch(r"[\w.+()/-][\w.+()*/ -]*", text) is not None


def as_robot_file(path: str | Path) -> tuple[str, str]:
    """Return a file of any format as the text of a robot file, for commands that edit such text.

    Args:
        path: A file that `load` reads.

    Returns:
        The text as it is, or as `kinegen convert` writes it where it is another format or a part of a tree; and a name
        under which `loads` reads it.

    Raises:
        KinegenError: If it cannot be read, or a robot file cannot hold it.
    """
    data = read_bytes(path)
    if format_of(path, data).name == FORMATS[0].name and not READING.get().tips:
        return decode(data), str(path)
    return write(load(path)), f"{path}.yaml"
