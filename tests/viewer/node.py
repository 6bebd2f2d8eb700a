"""Runs functions of the viewer's scripts in Node.js, which needs no browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "templates" / "viewer"
NODE = shutil.which("node") or ""

needs_node = pytest.mark.skipif(not NODE, reason="needs Node.js (Debian: apt-get install nodejs)")


def evaluate(scripts: tuple[str, ...], expression: str, given: Any = None, before: str = "") -> Any:
    """The value of an expression of JavaScript.

    Args:
        scripts: Files of the viewer that are read first.
        expression: What is evaluated, and waited for; `given` in it is the next argument.
        given: Anything that is JSON.
        before: JavaScript that runs before the files.
    """
    plain = "(_, each) => (ArrayBuffer.isView(each) ? Array.from(each) : each)"
    parts = [
        '"use strict";',
        "const app = { state: {} };",
        before,
        *((SCRIPTS / name).read_text(encoding="utf-8") for name in scripts),
        'const given = JSON.parse(require("fs").readFileSync(0, "utf8"));',
        f"(async () => process.stdout.write(JSON.stringify(await ({expression}), {plain})))();",
    ]
    text = "\n".join(parts)
    ran = subprocess.run(
        (NODE, "-e", text), input=json.dumps(given), capture_output=True, text=True, check=False, timeout=120
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)
