"""The calibrated robot file: the text of the user with new numbers, and the old ones in comments.

The result is read again, and must give the poses of the fit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
import yaml
from numpy.typing import NDArray

from kinegen import reference
from kinegen.calibrate.choice import BASE_NAMES, TOOL_NAMES
from kinegen.calibrate.numbers import is_zero, moved, places_for, plain, summed
from kinegen.calibrate.parallel import SEQUENCES, Parallel, Prepared
from kinegen.calibrate.rotations import to_rpy
from kinegen.calibrate.solve import Fit
from kinegen.errors import KinegenError
from kinegen.formats.load import loads
from kinegen.formats.yaml.document import Edits, read_edits
from kinegen.robot.dimension import Dimension
from kinegen.robot.model import TOOL, JointType, Robot, Row

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
    """Write the calibrated robot file.

    Args:
        text: The file.
        source: What messages call it.
        robot: The robot of the file.
        prepared: What was fitted.
        fit: The fit.
        heading: One line about the calibration, for the first line.

    Returns:
        The text, whose poses were compared with those of the fit.

    Raises:
        KinegenError: If the file is written so that it cannot be edited.
    """
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
    """How far each unknown alone can change before measurements notice, (U,).

    Standard deviations would be too coarse: numbers that are known badly can have a sum that is known well.
    """
    slopes = np.linalg.norm(fit.problem.jacobian(fit.values), axis=0)
    return np.asarray(np.where(slopes > 0, 1 / np.maximum(slopes, 1e-300), fit.problem.units))


def _changes(robot: Robot, fit: Fit) -> dict[str, _Change]:
    """What changed of the table and the parameters, by name."""
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
        if parallel and parallel.heir:
            inherited[parallel.heir] = summed(
                _text(document.value(nodes[parallel.heir], "d")), texts["d"], parallel.sign
            )
        new = {key: _moved(text, changes.get(_entry_of(row, key, texts))) for key, text in texts.items()}
        before = {key: _text(document.value(node, key)) for key in texts}
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
    """The texts that may change in a row: an offset, if there is one, stands for the entry that q is in."""
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
    """A row of another convention; returns the comments that were inside of it."""
    if hayati:
        added = [
            ("convention", "hayati"),
            *((key, _quoted(new[key])) for key in ("theta", "a", "alpha")),
            ("beta", beta),
        ]
    else:
        values = new | {"beta": beta}
        steps = [f"{step}({values[key]})" for step, key in SEQUENCES[row.convention] if not is_zero(values[key])]
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
    away = np.abs(reference.frames(robot, measured.q)[frame] - arm.poses(values, measured.q))
    length, angle = away[:, :3, 3].max(), away[:, :3, :3].max()
    allowed = _SLACK * float(measured.sigma.min()), _SLACK * float(measured.sigma_angle.min())
    if length > max(allowed[0], _EXACT * arm.reach) or angle > max(allowed[1], _EXACT):
        raise KinegenError(
            f"the calibrated file would give poses that differ from the fit by {length:.3g} and {angle:.3g} rad; "
            "this is a defect of kinegen",
            source,
        )
