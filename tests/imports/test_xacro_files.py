"""Real xacro files: what xacro expands, kinegen expands to the same elements, with packages found around the file."""

from __future__ import annotations

import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from kinegen.errors import KinegenError
from kinegen.io.format import ReadOptions
from kinegen.io.xacro.expand import expanded
from tests.imports.files import DESCRIPTIONS, shown

pytestmark = pytest.mark.imports

PLAIN = """
import contextlib, io, json, pathlib, sys
import xacro
from xacro import substitution_args
file = pathlib.Path(sys.argv[1])
def find(name):
    return str(next(found for above in file.parents for found in (above, above / name) if found.name == name))
substitution_args._eval_find = find
with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
    document = xacro.process_file(str(file))
print(json.dumps(document.toprettyxml(indent="  ")))
"""


@cache
def xacro_files() -> tuple[Path, ...]:
    """Every file that describes a robot with a name; the others are parts."""
    return tuple(path for path in sorted(DESCRIPTIONS.rglob("*.xacro")) if _is_robot(path.read_bytes()))


def _is_robot(text: bytes) -> bool:
    begin = text.find(b"<robot")
    return begin >= 0 and b"name" in text[begin : text.find(b">", begin)].replace(b"xmlns", b"")


def elements(element: ET.Element) -> Any:
    """An element with all below it, without the white space around texts."""
    return element.tag, element.attrib, (element.text or "").strip(), [elements(child) for child in element]


def test_what_xacro_expands_is_expanded_alike() -> None:
    same, refused, different = 0, [], []
    for path in xacro_files():
        done = subprocess.run([sys.executable, "-c", PLAIN, str(path)], capture_output=True, text=True, check=False)
        if done.returncode:
            continue
        try:
            found = expanded(path, ReadOptions())
        except KinegenError as error:
            refused.append(f"{shown(path)}: {error.message}")
            continue
        plain = ET.fromstring(json.loads(done.stdout))  # noqa: S314 - files of known packages
        if elements(plain) == elements(ET.fromstring(found)):  # noqa: S314
            same += 1
        else:
            different.append(shown(path))
    assert refused == []
    assert different == []
    assert same > 20
