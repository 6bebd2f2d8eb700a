"""XML text from a stranger -> a tree of elements with lines; nothing is loaded, expanded or fetched.

In: bytes. Out: the root element. A document type declaration is refused, so there are no entities. Size and nesting
are bounded.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection, Iterator

from lxml import etree

from kinegen.errors import quote
from kinegen.formats.messages import expected, fail

MAX_BYTES = 16 * 1024 * 1024
MAX_DEPTH = 200

_DECLARATION = re.compile(r"\A<\?xml[^>]*\?>")
_ENCODING = re.compile(rb"\A<\?xml[^>]*encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")
_TEXTS = {
    "utf-8": "utf-8",
    "utf8": "utf-8",
    "us-ascii": "utf-8",
    "ascii": "utf-8",
    "iso-8859-1": "latin-1",
    "latin-1": "latin-1",
}

Element = etree._Element  # noqa: SLF001 - lxml gives its elements no other name


def parse(data: bytes) -> Element:
    """Read XML.

    Args:
        data: The whole file.

    Raises:
        RobotFileError: If it is too large, not XML, or declares a document type.
    """
    if len(data) > MAX_BYTES:
        fail(f"the file is larger than {MAX_BYTES // 1024**2} MiB, too large for a robot file")
    text = _decode(data)
    if (place := text.find("<!DOCTYPE")) >= 0 or (place := text.find("<!ENTITY")) >= 0:
        fail("a document type or entity declaration is not allowed in a robot file", text.count("\n", 0, place) + 1)
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        dtd_validation=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(text.encode(), parser)
    except etree.XMLSyntaxError as error:
        fail(f"not valid XML: {_reason(error)}", error.lineno or None)
    if root is None:
        fail("not valid XML: there is no element")
    _check_depth(root)
    return root


def _decode(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        fail("this is UTF-16 text; save the file as UTF-8")
    data = data.removeprefix(codecs.BOM_UTF8)
    match = _ENCODING.match(data)
    named = match[1].decode("ascii").lower() if match else "utf-8"
    if named not in _TEXTS:
        fail(f"the encoding {quote(named)} is not supported; save the file as UTF-8", 1)
    if b"\0" in data:
        fail("the file holds a zero byte; expected XML text")
    try:
        text = data.decode(_TEXTS[named])
    except UnicodeDecodeError as error:
        fail("the file is not UTF-8 text", data.count(b"\n", 0, error.start) + 1)
    # The parser gets UTF-8, whatever the declaration said; lines stay.
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return _DECLARATION.sub(lambda found: "\n" * found[0].count("\n"), text)


def _reason(error: etree.XMLSyntaxError) -> str:
    return re.sub(r", line \d+, column \d+.*\Z", "", " ".join(str(error.msg).split()))


def _check_depth(root: Element) -> None:
    waiting = [(root, 1)]
    while waiting:
        element, depth = waiting.pop()
        if depth > MAX_DEPTH:
            fail(f"elements are nested more than {MAX_DEPTH} deep", line(element))
        waiting.extend((child, depth + 1) for child in element)


def line(element: Element) -> int:
    """The line of an element."""
    return int(element.sourceline or 0)


def children(element: Element, *tags: str) -> Iterator[Element]:
    """The elements right below one, of these tags; those in a namespace are not meant."""
    return (child for child in element if isinstance(child.tag, str) and child.tag in tags)


def name_of(element: Element) -> str:
    """The tag of an element without its namespace, cut if it is long."""
    return str(element.tag).rpartition("}")[2][:40]


def only(element: Element, tag: str) -> Element | None:
    """The one element of a tag right below another, if there is one."""
    found = list(children(element, tag))
    if len(found) > 1:
        fail(f"<{tag}> occurs twice in one <{name_of(element)}>", line(found[1]))
    return found[0] if found else None


def needed(element: Element, attribute: str) -> str:
    """An attribute that has to be there and not empty."""
    value = str(element.get(attribute, "")).strip()
    if not value:
        fail(f"<{name_of(element)}> has no attribute '{attribute}'", line(element))
    return value


def word(element: Element, attribute: str, words: Collection[str]) -> str:
    """An attribute that is one of some words."""
    value = needed(element, attribute)
    if value not in words:
        fail(f"unknown {attribute} {quote(value)} {expected(value, words)}", line(element))
    return value
