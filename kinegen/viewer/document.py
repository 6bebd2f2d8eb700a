"""The page: data, style and one script in one HTML text, which loads nothing and lets nothing else run.

The script is a classic one, since browsers refuse modules from the disk: three.js, the kernels and the files of
`SCRIPTS` one after the other, inside one function. The Content-Security-Policy names its digest and that of the style.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from kinegen import __version__
from kinegen.emit.environment import environment, template_folder
from kinegen.emit.kernels import Kernels
from kinegen.robot.model import Robot
from kinegen.viewer.checks import check_data
from kinegen.viewer.cloud import cloud_data
from kinegen.viewer.data import robot_data
from kinegen.viewer.kernels import kernel_script, page_kernels
from kinegen.viewer.options import ViewOptions
from kinegen.viewer.panels import PANEL_SCRIPTS, panel_data

__all__ = ["PARTS", "SCRIPTS", "ViewOptions", "page"]

SCRIPTS = (
    "app.js",
    "numbers.js",
    "theme.js",
    "scene.js",
    "arm.js",
    "labels.js",
    "side.js",
    "joints.js",
    "actuators.js",
    "parameters.js",
    "readout.js",
    "checks.js",
    "link.js",
    *PANEL_SCRIPTS,
    "embed.js",
    "start.js",
)
"""Files of `templates/viewer/` in the order in which they run; `start.js` is the last."""

STYLES = ("style.css", "panels.css")

PARTS: tuple[Callable[[Kernels], Mapping[str, Any]], ...] = (robot_data, check_data, panel_data)
"""What the data of a page is made of; together they are `app.model`."""

_END = re.compile(r"<(/script|script|!--)", re.IGNORECASE)
"""What changes how a browser reads a script."""


def page(robot: Robot, options: ViewOptions) -> str:
    """Make the page of a robot.

    Args:
        robot: The robot.
        options: The choices of a user.

    Returns:
        HTML; the same text for the same robot and options.

    Raises:
        KinegenError: If an output does not exist, or not for this robot.
    """
    kernels = page_kernels(robot, options.outputs)
    model: dict[str, Any] = {"start": None if options.q is None else list(options.q)}
    for part in PARTS:
        model |= part(kernels)
    model |= cloud_data(robot, options.workspace)
    style, script = "\n".join(map(_read, STYLES)), _script(kernels)
    policy = "; ".join(
        (
            "default-src 'none'",
            f"script-src '{content_hash(script)}'",
            f"style-src '{content_hash(style)}'",
            "img-src data:",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )
    return (
        environment()
        .get_template("viewer/page.html.jinja")
        .render(
            title=escaped(f"{robot.name}: kinegen"),
            version=__version__,
            policy=policy,
            style=style,
            model=embedded(model),
            script=script,
        )
    )


def _script(kernels: Kernels) -> str:
    """Everything that runs, inside one function."""
    parts = [f"const kernels = {kernel_script(kernels)};", *map(_read, SCRIPTS)]
    inner = "\n".join((_read("vendor/three.js"), '"use strict";', *parts))
    return closed_script(f'(() => {{\n"use strict";\n{inner}\n}})();\n')


def _read(name: str) -> str:
    return (template_folder(Path(__file__).resolve().parent.parent) / "viewer" / name).read_text(encoding="utf-8")


def closed_script(text: str) -> str:
    """A script in which nothing can be taken for its end or for a comment of HTML; strings keep their value."""
    return _END.sub(r"<\\\1", text)


def embedded(data: Mapping[str, Any]) -> str:
    """JSON that no browser takes for markup, in ASCII; NaN and infinities are refused."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", r"\u003c").replace(">", r"\u003e").replace("&", r"\u0026")


def escaped(text: str) -> str:
    """Text of a file as text of HTML."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")


def content_hash(text: str) -> str:
    """The digest of a script or a style as a Content-Security-Policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
