"""Typed access to the nodes of a robot file: known keys, single words, lists of a given length."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import NoReturn

from kinegen.errors import quote
from kinegen.formats.messages import expected, fail
from kinegen.formats.yaml.tree import Mapping, Node, Scalar, Sequence


def describe(node: Node) -> str:
    """What a node is, for a message that wanted something else."""
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


def mapping(node: Node, keys: Collection[str], example: str) -> dict[str, Node]:
    """The entries of a mapping, all of them known.

    Args:
        node: Any node.
        keys: The keys that may stand in it.
        example: What the mapping looks like, for the message.

    Raises:
        RobotFileError: If the node is no mapping or holds another key.
    """
    if not isinstance(node, Mapping):
        wrong(node, example)
    _refuse_cut(node)
    for key, _ in node.entries:
        if key.text not in keys:
            fail(f"unknown key {quote(key.text)} {expected(key.text, keys)}", key.line)
    return {key.text: value for key, value in node.entries}


def named(node: Node, example: str, limit: int) -> tuple[tuple[Scalar, Node], ...]:
    """The entries of a mapping whose keys are names that the user chose."""
    if not isinstance(node, Mapping):
        wrong(node, example)
    _refuse_cut(node)
    if len(node.entries) > limit:
        fail(f"{len(node.entries)} entries are too many (at most {limit})", node.line)
    return node.entries


def items(node: Node, wanted: str, count: int | None = None) -> tuple[Node, ...]:
    """The items of a list, of a given length if there is one."""
    if not isinstance(node, Sequence):
        wrong(node, wanted)
    _refuse_cut(node)
    if count is not None and len(node.items) != count:
        found = f"{len(node.items)} value{'' if len(node.items) == 1 else 's'}"
        fail(f"expected {wanted}, found {found}", node.line)
    return node.items


def word(node: Node, wanted: str) -> str:
    """The text of a scalar that is not empty."""
    if not isinstance(node, Scalar) or not node.text.strip():
        wrong(node, wanted)
    return node.text.strip()


def choice(node: Node, what: str, options: Iterable[str]) -> str:
    """A scalar that is one of a few words."""
    known = tuple(options)
    text = word(node, f"one of {', '.join(known)}")
    if text not in known:
        fail(f"unknown {what} {quote(text)} {expected(text, known)}", node.line)
    return text
