"""Makes the page: kernels, data, style and one script in one HTML text, which loads nothing.

The script is a classic one, since browsers refuse modules from the disk: three.js, the kernels and the files of
`SCRIPTS` one after the other, inside one function. The Content-Security-Policy names its digest and that of the style,
and lets nothing else run. Test vectors are computed with 50 digits and rounded once. Of the points that the tip reaches
there is one of each voxel that samples hit (`tools/workspace/`), as 16 bits a coordinate in the box around them, sorted
along a curve through space, so that differences between neighbours are small and compress well.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import __version__
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.test_vectors import Row, accepted_differences
from kinegen.backends.c.vectors import INVERSE_TOLERANCES
from kinegen.backends.javascript.files import emit_javascript
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment, template_folder
from kinegen.driver.pipeline import lower_robot
from kinegen.errors import KinegenError
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.tools.viewer.data import robot_data
from kinegen.tools.viewer.panels import PANEL_SCRIPTS, panel_data
from kinegen.tools.workspace.options import SurveyOptions
from kinegen.tools.workspace.sampling import make_cloud, survey
from kinegen.tools.workspace.tip_samples import find_tip, joint_ranges, position_of
from kinegen.verify.vectors import compute_vectors

NEEDED = (Quantity.POSE, Quantity.FRAMES, Quantity(Kind.JACOBIAN))
"""What every page evaluates."""

_EXPORT = re.compile(r"^export (?=(?:const|function) (\w+))", re.MULTILINE)


def page_kernels(robot: Robot, outputs: tuple[Quantity, ...] = ()) -> RobotPrograms:
    """Return the robot with the programs of a page, each quantity once.

    An inverse and the quantities of actuators are added where there are any.

    Raises:
        KinegenError: If a quantity that was asked for does not exist, or is a search, for which there is no JavaScript.
    """
    wanted = dict.fromkeys((*NEEDED, *outputs))
    wanted |= dict.fromkeys(quantity for quantity in _possible(robot) if quantity not in wanted)
    if any(quantity.kind is Kind.NUMERIC_INVERSE for quantity in wanted):
        raise KinegenError("numeric_inverse is not an output of a page, which has its own search", robot.source)
    for kind in (Kind.INVERSE_TRACKER, Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE):
        if any(quantity.kind is kind for quantity in wanted):
            raise KinegenError(f"{kind} is not an output of a page: it is in C and Python alone", robot.source)
    if robot.redundancy and Quantity(Kind.INVERSE) in wanted:
        reason = f"a page has no input for the redundancy ({robot.redundancy}); it searches for joint values"
        raise KinegenError(f"inverse: {reason}", robot.source)
    return lower_robot(robot, tuple(wanted))


def _possible(robot: Robot) -> list[Quantity]:
    """Return the quantities that only some robots have."""
    from kinegen.derive.inverse.classification import has_closed_inverse

    # That of an arm which is only nearly of a family has too many statements for a page.
    found = [Quantity(Kind.INVERSE)] if not robot.redundancy and has_closed_inverse(robot) else []
    if robot.actuators.readings:
        found.append(Quantity(Kind.ACTUATORS_TO_JOINTS))
        back = Quantity(Kind.JOINTS_TO_ACTUATORS)
        try:
            lower_robot(robot, (back,))
        except KinegenError:
            return found
        found.append(back)
    return found


def kernel_script(kernels: RobotPrograms) -> str:
    """Return the module of a robot as one expression of a classic script: an object with what the module exports."""
    module = emit_javascript(kernels)[f"{kernels.robot.name}.js"]
    exported = _EXPORT.findall(module)
    return f"(() => {{\n{_EXPORT.sub('', module)}\nreturn {{ {', '.join(exported)} }};\n}})()"


Json = Any


def check_data(kernels: RobotPrograms) -> dict[str, Json]:
    """Return the test vectors by kernel.

    Returns:
        `{"checks": {"inputs", "kernels", "targets"}}`: inputs by name; of each kernel its arguments by name, and of
        each of its results the rows of numbers, the largest accepted difference of each entry, whether whole turns do
        not matter, and whether the numbers are matrices without their last rows. Targets are poses with the joint
        vectors that an inverse must find.
    """
    vectors = compute_vectors(kernels)
    programs = [program for program in kernels.programs if program.quantity in vectors.expected]
    checks = []
    for program in programs:
        accepted = iter(accepted_differences(kernels, program, vectors, ScalarType.DOUBLE))
        expected = vectors.expected[program.quantity]
        results = [
            {
                "pose": array.is_pose,
                "turns": result.turns,
                "rows": _table(result.rows),
                "accepted": _numbers(next(accepted)) if array.size else [],
            }
            for array, result in zip(program.signature.results, expected, strict=True)
        ]
        inputs = [array.name for array in program.signature.inputs]
        checks.append({"name": program.quantity.function, "inputs": inputs, "results": results})
    # Inverses are judged by poses: their branches may come in another order.
    tolerance = float(INVERSE_TOLERANCES[ScalarType.DOUBLE])
    extents = [reach(kernels.robot) if each.type == "prismatic" else 1.0 for each in kernels.robot.variables]
    has_inverse = any(program.quantity.kind is Kind.INVERSE for program in kernels.programs)
    targets = [{"pose": _numbers(pose), "q": _numbers(q)} for pose, q in vectors.targets] if has_inverse else []
    return {
        "checks": {
            "inputs": {name: _table(rows) for name, rows in vectors.inputs.items()},
            "kernels": checks,
            "targets": targets,
            "tolerances": [tolerance * extent for extent in extents],
        }
    }


def _table(rows: tuple[Row, ...]) -> list[list[float]]:
    return [_numbers(row) for row in rows]


def _numbers(row: Row) -> list[float]:
    return [float(entry) for entry in row]


MOST_POINTS = 40_000
"""What still turns smoothly on a laptop, and takes a quarter of a megabyte of the page."""

_LEVELS = 65535


def cloud_data(robot: Robot, samples: int) -> dict[str, Any]:
    """Return the points that the tip of a robot, of a tree the first one, reaches for a number of joint vectors.

    Returns:
        `{"cloud": {points, low, high, count, tip}}`: differences of 16-bit numbers, x of all points, then y and z,
        compressed and in base64; the corners of their box in the file's length unit; an empty object without samples.

    Raises:
        KinegenError: If the robot has no joint, or joint values are too large for its kernel.
    """
    if not samples:
        return {}
    if not robot.dof:
        raise KinegenError(f"{robot.name} has no joint, so there is nothing to reach", robot.source)
    kernels = lower_robot(robot, (position_of(robot, robot.tips[0] if robot.is_tree else None),))
    found = survey(robot, find_tip(kernels), joint_ranges(robot), SurveyOptions(samples))
    points, _ = make_cloud(found)
    # Evenly thinned: the points come in the order in which samples hit voxels, which no region is first in.
    points = points[:: max(1, -(-len(points) // MOST_POINTS))]
    return {"cloud": packed(points) | {"tip": found.tip.name}}


def packed(points: NDArray[np.float64]) -> dict[str, Any]:
    """Return points (N, 3) as text, as `cloud_data` says, without the tip."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    # Sixteen bits a coordinate are finer than a pixel.
    levels = np.rint((points - low) / size * _LEVELS).astype(np.uint16)
    # Neighbours along a curve through space differ little, which compresses well.
    levels = levels[np.argsort(_places(levels), kind="stable")]
    steps = np.diff(levels, axis=0, prepend=np.zeros((1, 3), np.uint16))
    data = zlib.compress(steps.T.astype("<u2").tobytes(), 9)
    return {
        "points": base64.b64encode(data).decode(),
        "low": low.tolist(),
        "high": high.tolist(),
        "count": len(points),
    }


def _places(levels: NDArray[np.uint16]) -> NDArray[np.uint64]:
    """Return the place of each point on Morton's curve: the bits of x, y and z by turns."""
    found = np.zeros(len(levels), np.uint64)
    for bit in range(16):
        for axis in range(3):
            part = (levels[:, axis].astype(np.uint64) >> np.uint64(bit)) & np.uint64(1)
            found |= part << np.uint64(3 * bit + axis)
    return found


@dataclass(frozen=True, slots=True)
class ViewOptions:
    """The choices of a user: a first joint vector in rad and the file's length unit, or None for the home position.

    Outputs are quantities whose kernels the page gets besides those that it needs; `workspace` is the number of joint
    vectors to try for the points that the tip reaches, 0 for no points.
    """

    q: tuple[float, ...] | None = None
    outputs: tuple[Quantity, ...] = ()
    workspace: int = 0


__all__ = ["PARTS", "SCRIPTS", "ViewOptions", "page"]

SCRIPTS = (
    "app.js",
    "numbers.js",
    "theme.js",
    "scene.js",
    "housings.js",
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

PARTS: tuple[Callable[[RobotPrograms], Mapping[str, Any]], ...] = (robot_data, check_data, panel_data)
"""What the data of a page is made of; together they are `app.model`."""

_END = re.compile(r"<(/script|script|!--)", re.IGNORECASE)
"""What changes how a browser reads a script."""


def page(robot: Robot, options: ViewOptions) -> str:
    """Return the page of a robot as HTML, the same text for the same robot and options.

    Raises:
        KinegenError: If an output does not exist, or not for this robot.
    """
    kernels = page_kernels(robot, options.outputs)
    model: dict[str, Any] = {"start": None if options.q is None else list(options.q)}
    for part in PARTS:
        model |= part(kernels)
    model |= cloud_data(robot, options.workspace)
    # The policy names what may run, by digest: nothing of a robot file can.
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


def _script(kernels: RobotPrograms) -> str:
    """Everything that runs, inside one function."""
    parts = [f"const kernels = {kernel_script(kernels)};", *map(_read, SCRIPTS)]
    inner = "\n".join((_read("vendor/three.js"), '"use strict";', *parts))
    return closed_script(f'(() => {{\n"use strict";\n{inner}\n}})();\n')


def _read(name: str) -> str:
    return (template_folder(Path(__file__).resolve().parents[2]) / "viewer" / name).read_text(encoding="utf-8")


def closed_script(text: str) -> str:
    """Return a script in which nothing can be taken for its end or for a comment of HTML; strings keep their value."""
    return _END.sub(r"<\\\1", text)


def embedded(data: Mapping[str, Any]) -> str:
    """JSON that no browser takes for markup, in ASCII; NaN and infinities are refused."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", r"\u003c").replace(">", r"\u003e").replace("&", r"\u0026")


def escaped(text: str) -> str:
    """Return text of a file as text of HTML."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")


def content_hash(text: str) -> str:
    """Return the digest of a script or a style as a Content-Security-Policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
