"""XML in: the standard library's parser, with every bound that a stranger's file needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.errors import RobotFileError
from kinegen.io import xml
from kinegen.io.load import load


def test_elements_have_their_lines_and_their_order() -> None:
    root = xml.parse(b'<?xml version="1.0"?>\n<!-- a -->\n<robot\n name="x">\n<a/><b>\n\n<a k="&lt;1"/></b></robot>\n')

    assert [(each.tag, each.line) for each in root.iter()] == [("robot", 3), ("a", 5), ("b", 5), ("a", 7)]
    assert root.children[1].children[0].get("k") == "<1"


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_lines_are_counted_whatever_ends_them(ending: str) -> None:
    text = ending.join(['<?xml version="1.0" encoding="latin-1"?>', "<r>", "<a", 'n="\xe9"/>', "</r>"])
    (child,) = xml.parse(text.encode("latin-1"))

    assert (child.line, child.get("n")) == (3, "\xe9")


def test_a_document_type_is_refused_by_the_parser_too() -> None:
    """What a search of the text would miss, the handlers of the parser refuse."""
    for text in ('<!DOCTYPE r [<!ENTITY x "y">]><r>&x;</r>', '<!DOCTYPE r SYSTEM "file:///etc/passwd"><r/>'):
        with pytest.raises(RobotFileError, match="document type or entity declaration is not allowed"):
            xml._Tree().read(text)


def test_many_elements_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xml, "MAX_ELEMENTS", 100)

    assert len(xml.parse(b"<r>" + b"<a/>" * 99 + b"</r>").children) == 99
    with pytest.raises(RobotFileError, match="more than 100 elements"):
        xml.parse(b"<r>" + b"<a/>" * 100 + b"</r>")


def test_the_last_depth_is_read_and_the_next_is_refused() -> None:
    deepest = xml.MAX_DEPTH
    root = xml.parse(b"<a>" * deepest + b"</a>" * deepest)

    assert sum(1 for _ in root.iter()) == deepest
    with pytest.raises(RobotFileError, match="nested more than 200 deep"):
        xml.parse(b"<a>" * (deepest + 1) + b"</a>" * (deepest + 1))


def test_included_files_share_the_bounds_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each file is within the bounds, and together they are not."""
    model = '<mujoco><worldbody>{}<include file="in.xml"/>{}</worldbody></mujoco>'
    inner = "<mujocoinclude>" + '<body><joint axis="0 1 0"/>' * 150 + "</body>" * 150 + "</mujocoinclude>"
    (tmp_path / "in.xml").write_text(inner)
    path = tmp_path / "arm.xml"
    path.write_text(model.format("<body>" * 150, "</body>" * 150))
    with pytest.raises(RobotFileError, match="nested more than 200 deep"):
        load(path)
    path.write_text(model.format("", ""))
    monkeypatch.setattr(xml, "MAX_BYTES", len(inner) - 1)
    with pytest.raises(RobotFileError, match=r"'in\.xml', the files are too large for a robot"):
        load(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a>\n<b>\n</a>", ":3: not valid XML: mismatched tag; <b> of line 2 is not closed"),
        ("<a>\n<b/>\n", ":3: not valid XML: no element found; <a> of line 1 is not closed"),
        ("<a>R&D</a>", ":1: not valid XML: not well-formed (invalid token)"),
        ("<a>&nbsp;</a>", ":1: not valid XML: undefined entity; the character '&' is written &amp;"),
        ("", ":1: not valid XML: the file is empty"),
        ("<!-- only this -->", ":1: not valid XML: no element found"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    with pytest.raises(RobotFileError) as found:
        load(path)

    assert str(found.value).endswith(message)
