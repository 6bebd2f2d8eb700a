"""What the tests of pages share: reading a page apart, and a robot file with markup wherever the format lets it."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent.parent
ROBOTS = ROOT / "robots"
VENDOR = ROOT / "templates" / "viewer" / "vendor"

MARKUP = "</script></style><img src=x onerror=alert(1)><!--<b>&amp; ${1} `\\u003c"

HOSTILE = f"""\
kinegen: 1
name: constructor
description: '{MARKUP}'
convention: standard
units: {{length: m, angle: deg}}
parameters:
  valueOf: {{value: 0.3, runtime: true}}
  alert: {{value: 10, dimension: angle, runtime: true}}
joints:
  - {{name: hasOwnProperty, theta: q + alert, d: 0, a: valueOf, alpha: 0}}
  - {{name: innerHTML, theta: q, d: 0, a: 0.2, alpha: 90}}
frames:
  toString: {{parent: innerHTML, xyz: [0.1, 0, 0]}}
"""


@dataclass
class Page(HTMLParser):
    """A page as a browser reads it: elements with their attributes, and the text in those of interest."""

    elements: list[tuple[str, dict[str, str | None]]] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Begin outside every element."""
        super().__init__()
        self.inside = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.elements.append((tag, dict(attrs)))
        self.inside = {"model": "model"}.get(str(dict(attrs).get("id")), tag)

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 - the name of the base class
        """Leave an element."""
        self.inside = ""

    def handle_data(self, data: str) -> None:
        """Note text."""
        if self.inside:
            self.texts[self.inside] = self.texts.get(self.inside, "") + data

    def error(self, message: str) -> None:
        """What older parsers ask for."""
        raise AssertionError(message)


def read(text: str) -> Page:
    """Reads a page apart."""
    found = Page()
    found.feed(text)
    found.close()
    return found


def model_of(text: str) -> dict[str, Any]:
    """The data of a page."""
    found: dict[str, Any] = json.loads(read(text).texts["model"])
    return found


def with_wrong_kernel(text: str) -> str:
    """The page with one sign of one kernel turned, and without the policy, which forbids such a page to run."""
    changed = re.sub(
        r"(function fk_at\(.*?base_T_tool\[base_T_tool_at \+ 3\] = )", r"\1-", text, count=1, flags=re.DOTALL
    )
    assert changed != text
    return re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", changed)
