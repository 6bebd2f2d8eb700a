"""XML text from a stranger -> a tree of elements with lines; nothing is loaded, expanded or fetched.

In: bytes. Out: the root element. A document type declaration is refused, so there are no entities. Size, number of
elements and nesting are bounded. The parser is the expat of the standard library, without namespaces: a tag is what the
file has before the first space, prefix included, as the readers of ROS and MuJoCo see it.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection, Iterator
from dataclasses import field
from xml.parsers import expat

from kinegen.errors import quote
from kinegen.io.messages import expected, fail
from kinegen.support.dataclass import dataclass

MAX_BYTES = 16 * 1024 * 1024
MAX_DEPTH = 200
MAX_ELEMENTS = 500_000
"""More than a hundred times what the largest robots have; each takes memory."""

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


@dataclass(slots=True, eq=False)
class Element:
    """An element; `line` is 0 where it comes from another file, names have their prefixes."""

    tag: str
    attrib: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def get(self, attribute: str, otherwise: str = "") -> str:
        """Return an attribute, or what stands for one that is missing."""
        return self.attrib.get(attribute, otherwise)

    def __iter__(self) -> Iterator[Element]:
        return iter(self.children)

    def iter(self) -> Iterator[Element]:
        """This element and all below it, in the order of the file."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))


def parse(data: bytes) -> Element:
    """Read XML. Raises `RobotFileError` if it is too large, not XML, or declares a document type."""
    if len(data) > MAX_BYTES:
        fail(f"the file is larger than {MAX_BYTES // 1024**2} MiB, too large for a robot file")
    text = _decode(data)
    if (place := text.find("<!DOCTYPE")) >= 0 or (place := text.find("<!ENTITY")) >= 0:
        fail(_DOCTYPE, text.count("\n", 0, place) + 1)
    if not text.strip():
        fail("not valid XML: the file is empty", 1)
    return _Tree().read(text)


_DOCTYPE = "a document type or entity declaration is not allowed in a robot file"
_CODES = expat.errors.codes
_UNCLOSED = (_CODES[expat.errors.XML_ERROR_TAG_MISMATCH], _CODES[expat.errors.XML_ERROR_NO_ELEMENTS])
_SYNTAX = _CODES[expat.errors.XML_ERROR_SYNTAX]
_ENTITY = _CODES[expat.errors.XML_ERROR_UNDEFINED_ENTITY]


class _Tree:
    """Collects what expat reports; the elements that are open are on a stack."""

    def __init__(self) -> None:
        self._parser = expat.ParserCreate("utf-8")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        # None gets here, since the text was searched for them: this holds whatever the parser takes for one.
        self._parser.StartDoctypeDeclHandler = self._refuse
        self._parser.EntityDeclHandler = self._refuse
        self._parser.ExternalEntityRefHandler = self._refuse
        self._open: list[Element] = []
        self._root: Element | None = None
        self._count = 0

    def read(self, text: str) -> Element:
        """Return the root of the tree."""
        try:
            self._parser.Parse(text.encode(), True)
        except expat.ExpatError as error:
            fail(f"not valid XML: {self._reason(error)}", error.lineno or None)
        assert self._root is not None  # noqa: S101 - expat reports a text without an element
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, self._parser.CurrentLineNumber)
        self._count += 1
        accept_depth(element, len(self._open) + 1)
        if self._count > MAX_ELEMENTS:
            fail(f"there are more than {MAX_ELEMENTS:,} elements, too many for a robot file", element.line)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _refuse(self, *_: object) -> int:
        fail(_DOCTYPE, self._parser.CurrentLineNumber)

    def _reason(self, error: expat.ExpatError) -> str:
        """Return what is wrong, and what would be right."""
        reason = expat.ErrorString(error.code)
        if self._open and error.code in _UNCLOSED:
            last = self._open[-1]
            return f"{reason}; <{name_of(last)}> of line {last.line} is not closed"
        if self._root is None and error.code == _SYNTAX:
            return f"{reason}; expected '<' at the start of the text"
        return f"{reason}; the character '&' is written &amp;" if error.code == _ENTITY else reason


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


def accept_depth(element: Element, depth: int) -> None:
    """Refuse an element that is too deep in others; the root has depth 1."""
    if depth > MAX_DEPTH:
        fail(f"elements are nested more than {MAX_DEPTH} deep", element.line)


def children(element: Element, *tags: str) -> Iterator[Element]:
    """Return the elements right below one, of these tags; those with a prefix are not meant."""
    return (child for child in element if child.tag in tags)


def name_of(element: Element) -> str:
    """Return the tag of an element with its prefix, cut if it is long."""
    return element.tag[:40]


def only(element: Element, tag: str) -> Element | None:
    """Return the one element of a tag right below another, if there is one."""
    found = list(children(element, tag))
    if len(found) > 1:
        fail(f"<{tag}> occurs twice in one <{name_of(element)}>", found[1].line)
    return found[0] if found else None


def needed(element: Element, attribute: str) -> str:
    """Return an attribute that has to be there and not empty."""
    value = str(element.get(attribute, "")).strip()
    if not value:
        fail(f"<{name_of(element)}> has no attribute '{attribute}'", element.line)
    return value


def word(element: Element, attribute: str, words: Collection[str]) -> str:
    """Return an attribute that is one of some words."""
    value = needed(element, attribute)
    if value not in words:
        fail(f"unknown {attribute} {quote(value)} {expected(value, words)}", element.line)
    return value
