"""Writes the calibrated robot file: the text of the user with new numbers, and the old ones in comments.

The result is read again, and must give the poses of the fit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from decimal import Decimal

import numpy as np
import yaml
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.io.robot_file.document import Edits, read_edits
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import TOOL, JointType, Robot, Row
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.arm_model import to_rpy
from kinegen.tools.calibrate.fitted_parameters import BASE_NAMES, TOOL_NAMES, Parallel, Prepared, sequence_with_beta
from kinegen.tools.calibrate.solve import Fit
from kinegen.verify import reference

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")
_TAIL = re.compile(r"(?P<head>.*[\w)])\s+(?P<sign>[+-])\s+(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\Z")


def places_for(resolution: float) -> int:
    """Decimal places that lose less than a hundredth of a resolution."""
    return max(0, 2 + math.ceil(-math.log10(max(resolution, 1e-30))))


def moved(text: str, change: float, places: int) -> str:
    """Return a number or an expression after a change: `0.4321`, `a2 + 0.0003`, `q - 89.98`, or as it was."""
    step = round(Decimal(change), places)
    if not step:
        return text
    if _NUMBER.match(text):
        return plain(round(Decimal(text) + Decimal(change), places))
    tail = _TAIL.match(text)
    if tail:
        number = Decimal(tail["number"]) * (1 if tail["sign"] == "+" else -1)
        text, step = tail["head"], round(number + Decimal(change), places)
    return f"{text} {'-' if step < 0 else '+'} {plain(abs(step))}" if step else text


def summed(text: str, other: str, sign: int) -> str:
    """Return the text of a sum or difference of two texts."""
    if _NUMBER.match(text) and _NUMBER.match(other):
        return plain(Decimal(text) + sign * Decimal(other))
    if _NUMBER.match(other) and not Decimal(other):
        return text
    operator = "+" if sign > 0 else "-"
    return f"{text} {operator} ({other})"


def is_zero(text: str) -> bool:
    """Tell whether a text is the number zero."""
    return bool(_NUMBER.match(text)) and not Decimal(text)


def plain(number: Decimal) -> str:
    """Return a decimal without exponent and without zeros at its end."""
    text = f"{number:f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text


_SLACK = 0.1
"""How far poses of the written file may be from those of the fit, in standard deviations of a measurement."""

_EXACT = 1e-10
_REWRITTEN = frozenset({"theta", "a", "alpha", "d", "beta", "convention", "offset"})
"""Keys of a row that are written again where its convention changes."""


@dataclass(frozen=True, slots=True)
class _Change:
    """A change of one number, in the units of the file."""

    amount: float
    places: int


def rewritten(text: str, source: str, robot: Robot, prepared: Prepared, fit: Fit, heading: str) -> str:
    """Write the calibrated robot file and compare its poses with those of the fit; one in braces is an error."""
    document = read_edits(text, source)
    changes = _changes(robot, fit)
    for parameter in robot.parameters:
        if parameter.name in changes:
            _edit_parameter(document, parameter.name, changes[parameter.name])
    _edit_rows(document, robot, prepared.parallels, changes)
    for names, name, transform in (
        (BASE_NAMES, "base", fit.problem.arm.base),
        (TOOL_NAMES, TOOL, fit.problem.arm.tool),
    ):
        if any(each in fit.problem.arm.names for each in names):
            _edit_mount(document, name, transform(fit.values[: len(fit.problem.arm.names)]), robot, fit, names)
    result = document.result(heading)
    _check(result, source, fit)
    return result


def _resolutions(fit: Fit) -> NDArray[np.float64]:
    """Return how far each unknown alone can change before measurements notice, (U,).

    Standard deviations would be too coarse: numbers that are known badly can have a sum that is known well.
    """
    slopes = np.linalg.norm(fit.problem.jacobian(fit.values), axis=0)
    return np.asarray(np.where(slopes > 0, 1 / np.maximum(slopes, 1e-300), fit.problem.units))


def _changes(robot: Robot, fit: Fit) -> dict[str, _Change]:
    """Return what changed of the table and the parameters, by name."""
    arm, found = fit.problem.arm, dict[str, _Change]()
    dimensions = {parameter.name: parameter.dimension for parameter in arm.robot.parameters}
    amounts, resolutions = fit.values - fit.problem.start, _resolutions(fit)
    for place, name in enumerate(arm.names):
        if name in dimensions and fit.free[place]:
            scale = _angle_scale(robot) if dimensions[name] is Dimension.ANGLE else 1.0
            found[name] = _Change(float(amounts[place]) * scale, places_for(float(resolutions[place]) * scale))
    return found


def _angle_scale(robot: Robot) -> float:
    return math.degrees(1.0) if robot.units.angle == "deg" else 1.0


def _text(node: yaml.Node | None) -> str:
    return str(node.value).strip() if isinstance(node, yaml.ScalarNode) else "0"


def _edit_parameter(document: Edits, name: str, change: _Change) -> None:
    """A parameter is `a2: 0.4` or `a2: {value: 0.4, ...}`."""
    parameters = document.value(document.root, "parameters")
    node = document.value(parameters, name) if isinstance(parameters, yaml.MappingNode) else None
    if isinstance(node, yaml.MappingNode):
        node = document.value(node, "value")
    if node is None:
        return
    new = moved(_text(node), change.amount, change.places)
    if new != _text(node):
        document.comment(node, [f"before calibration: {name} {_text(node)}"])
        document.replace(node, new)


def _edit_rows(document: Edits, robot: Robot, parallels: Iterable[Parallel], changes: dict[str, _Change]) -> None:
    """Every row whose numbers or whose convention changed."""
    by_row = {parallel.row: parallel for parallel in parallels}
    rows = {row.name: row for row in robot.rows}
    nodes = dict(document.rows())
    inherited = dict[str, str]()
    for name, node in nodes.items():
        parallel, row = by_row.get(name), rows[name]
        texts = _texts(document, node, row, inherited.get(name))
        # A Hayati row has no d; the next row takes it over before its own change.
        if parallel and parallel.heir:
            inherited[parallel.heir] = summed(
                _text(document.value(nodes[parallel.heir], "d")), texts["d"], parallel.sign
            )
        new = {key: _moved(text, changes.get(_entry_of(row, key, texts))) for key, text in texts.items()}
        before = {key: _text(document.value(node, key)) for key in texts}
        # A row keeps its form if its convention stays, and is written again otherwise.
        if parallel is None:
            changed = {key: text for key, text in new.items() if text != before[key]}
            for key, text in changed.items():
                _put(document, node, key, text)
            notes = list[str]()
        else:
            changed = dict(before)
            twist = changes.get(f"beta_{name}")
            beta = "0" if twist is None else moved("0", twist.amount, twist.places)
            notes = _restructure(document, node, row, new, beta, hayati=parallel.hayati)
        if changed:
            olds = ", ".join(f"{key} {before[key]}" for key in changed)
            document.comment(node, [*notes, f"before calibration: {olds}"])


def _put(document: Edits, node: yaml.MappingNode, key: str, text: str) -> None:
    """A new value of a key."""
    value = document.value(node, key)
    if value is not None:
        document.replace(value, text)


def _texts(document: Edits, node: yaml.MappingNode, row: Row, inherited: str | None) -> dict[str, str]:
    """Return the texts that may change in a row: an offset, if there is one, stands for the entry that q is in."""
    keys = [key for key in ("theta", "d", "a", "alpha", "beta") if document.value(node, key) is not None]
    texts = {key: _text(document.value(node, key)) for key in keys}
    if document.value(node, "offset") is not None:
        texts["offset"] = _text(document.value(node, "offset"))
    if inherited is not None and row.d is not None:
        texts["d"] = inherited
    return texts


def _entry_of(row: Row, key: str, texts: dict[str, str]) -> str:
    """The name of the entry whose change a text gets: an offset gets that of the entry beside it, which gets none."""
    held = "d" if row.type is JointType.PRISMATIC else "theta"
    if "offset" in texts and key in ("offset", held):
        key = held if key == "offset" else ""
    return f"{key}_{row.name}"


def _moved(text: str, change: _Change | None) -> str:
    return text if change is None else moved(text, change.amount, change.places)


def _restructure(
    document: Edits, node: yaml.MappingNode, row: Row, new: dict[str, str], beta: str, *, hayati: bool
) -> list[str]:
    """Return a row of another convention; returns the comments that were inside of it."""
    # A Hayati row has columns; any other row with a second twist is a sequence.
    if hayati:
        added = [
            ("convention", "hayati"),
            *((key, _quoted(new[key])) for key in ("theta", "a", "alpha")),
            ("beta", beta),
        ]
    else:
        values = new | {"beta": beta}
        steps = [
            f"{kind}({values[key]})" for kind, key in sequence_with_beta(row.convention) if not is_zero(values[key])
        ]
        added = [("ets", f"[{', '.join(map(_quoted, steps))}]")]
    if "offset" in new:
        added.append(("offset", new["offset"]))
    return document.rebuild(node, _REWRITTEN, added)


def _quoted(text: str) -> str:
    return f'"{text}"' if "," in text else text


def _edit_mount(
    document: Edits,
    name: str,
    transform: NDArray[np.float64],
    robot: Robot,
    fit: Fit,
    names: tuple[str, ...],
) -> None:
    """Base or tool, as xyz and rpy."""
    arm, resolutions = fit.problem.arm, _resolutions(fit)
    # A number that does not vary is written with all its digits.
    known = [resolutions[arm.names.index(each)] if each in arm.names else np.inf for each in names]
    lengths = max(12 if np.isinf(each) else places_for(each) for each in known[:3])
    angles = max(12 if np.isinf(each) else places_for(each * _angle_scale(robot)) for each in known[3:])
    xyz = ", ".join(plain(round(Decimal(float(each)), lengths)) for each in transform[:3, 3])
    rpy = ", ".join(plain(round(Decimal(each * _angle_scale(robot)), angles)) for each in to_rpy(transform[:3, :3]))
    new = f"{{xyz: [{xyz}], rpy: [{rpy}]}}"
    node = document.value(document.root, name)
    if node is None:
        document.append(f"# not in the file before calibration\n{name}: {new}")
        return
    before = " ".join(document.source(node).split())
    document.comment(document.key(name), [f"before calibration: {before}"])
    document.replace(node, new)


def _check(text: str, source: str, fit: Fit) -> None:
    """The poses of the written file are those of the fit."""
    robot, arm, measured = loads(text, source), fit.problem.arm, fit.problem.measured
    frame = arm.frame or TOOL
    values = fit.values[: len(arm.names)]
    # Reference and kernels are independent, so this also checks the fit.
    away = np.abs(reference.frames(robot, measured.q)[frame] - arm.poses(values, measured.q))
    length, angle = away[:, :3, 3].max(), away[:, :3, :3].max()
    allowed = _SLACK * float(measured.sigma.min()), _SLACK * float(measured.sigma_angle.min())
    if length > max(allowed[0], _EXACT * arm.reach) or angle > max(allowed[1], _EXACT):
        raise KinegenError(
            f"the calibrated file would give poses that differ from the fit by {length:.3g} and {angle:.3g} rad; "
            "this is a defect of kinegen",
            source,
        )
