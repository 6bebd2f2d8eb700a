"""What `kinegen calibrate` prints: a report for people, or one JSON document.

Keys of the document: kinegen, file, measurements (file, rows, kinds, stated, sigma, sigma_angle), units, backend,
before and after (rms, worst, line, rms_angle, worst_angle), chi_square, degrees_of_freedom, parameters (name, before,
after, sigma, fixed, angle, dimension), fixtures (kind, name, numbers), nearly_parallel, tied (name, partners, exact,
words), regions, cross_validation, outliers, patterns (joint, shape, size, explained), suggestions, inverse (before,
after), written. Lengths are in the unit of the robot file, angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinegen.model.expression_values import Dimension
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import JointType
from kinegen.support.text_layout import columns
from kinegen.ui.cli.terminal import bad, faint

if TYPE_CHECKING:
    from kinegen.tools.calibrate.run import Study
    from kinegen.tools.calibrate.solve import Tied

MOST_OUTLIERS = 10

_ROUNDING = 1e-11
"""Smaller errors, in rad or as parts of the reach, are those of arithmetic."""

_MILLIMETRES = {"m": 1e3, "cm": 10.0, "mm": 1.0}

_WORDS = {
    "pose": "poses",
    "position": "positions",
    "distance": "distances between positions",
    "anchor": "distances from anchors",
    "plane": "points on planes",
    "sphere": "points on spheres",
}


def report(study: Study) -> Iterator[str]:
    """Yield the lines for people."""
    yield from _measured(study)
    yield ""
    yield from _errors(study)
    yield from _parallels(study)
    yield from _tied(study)
    yield ""
    yield from _parameters(study)
    yield ""
    yield from _regions(study)
    yield from _outliers(study)
    yield from _patterns(study)
    yield from _suggestions(study)
    yield ""
    yield _inverse(study)


def _small(study: Study, length: float) -> str:
    """Return an error or an uncertainty: in mm, or in inches where the file has them."""
    unit = study.robot.units.length
    return f"{length:.3g} in" if unit == "in" else f"{length * _MILLIMETRES[unit]:.3g} mm"


def _measured(study: Study) -> Iterator[str]:
    measured = study.fit.problem.measured
    counts = ", ".join(f"{measured.kinds.count(kind)} {_WORDS[kind]}" for kind in dict.fromkeys(measured.kinds))
    yield f"measured: {counts}"
    if measured.angles:
        yield f"joint values in {measured.angles}, as their titles state"
    angle = float(measured.sigma_angle.mean())
    turned = f" and {1e3 * angle:.3g} mrad" if "pose" in measured.kinds else ""
    how = "stated" if measured.stated else "estimated from the residuals; state it with --sigma and --sigma-angle"
    yield f"uncertainty (1 sigma): {_small(study, float(measured.sigma.mean()))}{turned}, {how}"
    sizes = [float(measured.sigma.mean()) / reach(study.robot), *([angle] if turned else [])]
    if not measured.stated and min(sizes) < _ROUNDING:
        yield "  this is rounding, not accuracy: so many numbers fit some measurements exactly, whatever their errors;"
        yield "  measure more poses, or choose fewer numbers with --fit"


def _errors(study: Study) -> Iterator[str]:
    crossed = study.crossed
    rows: list[tuple[str, ...]] = [("", "before", "after", "not fitted to")]
    left_out = _small(study, crossed.rms) if crossed else "-"
    rows.append(("RMS error", _small(study, study.before.rms), _small(study, study.after.rms), left_out))
    worst = (f"{_small(study, each.worst)}, line {each.line}" for each in (study.before, study.after))
    rows.append(("worst error", *worst, ""))
    if study.before.rms_angle is not None and study.after.rms_angle is not None:
        pairs = (("RMS angle", study.before.rms_angle, study.after.rms_angle), (
            "worst angle", study.before.worst_angle or 0.0, study.after.worst_angle or 0.0))  # fmt: skip
        for place, (name, *sizes) in enumerate(pairs):
            held = f"{1e3 * crossed.rms_angle:.3g} mrad" if crossed and crossed.rms_angle and not place else ""
            rows.append((name, *(f"{1e3 * size:.3g} mrad" for size in sizes), held))
    yield from columns(rows, left=frozenset({0}))
    if crossed:
        yield faint(f"not fitted to: {crossed.folds}-fold cross-validation, each part against a fit to the others")
    else:
        yield faint("no cross-validation: there are too few rows, or --folds is less than 2")
    # Chi-square says something only against an uncertainty that was stated.
    chi, freedom = study.fit.chi_square, study.fit.freedom
    if not study.fit.problem.measured.stated:
        return
    spread = 3 * math.sqrt(2 / freedom)
    verdict = "the stated uncertainty fits"
    if chi > 1 + spread:
        verdict = bad("the errors are larger than the stated uncertainty: the model or the uncertainty is wrong")
    elif chi < 1 - spread:
        verdict = "the errors are smaller than the stated uncertainty"
    yield f"chi-square: {chi:.3f} for each of {freedom} degrees of freedom; {verdict}"


def _parallels(study: Study) -> Iterator[str]:
    for each in study.prepared.parallels:
        angle = f"{math.degrees(each.angle):.3g} degrees apart in the file"
        how = "a Hayati row" if each.hayati else "an elementary sequence with a second twist (Hayati)"
        moved = f"; its d is in row {each.heir} now" if each.heir else ""
        yield from _wrapped(
            f"nearly parallel: {each.neighbours[0]} and {each.neighbours[1]}, {angle}: row {each.row} becomes "
            f"{how}, beta_{each.row} is varied{moved}"
        )


def _tied(study: Study) -> Iterator[str]:
    for each in study.fit.tied:
        yield from _wrapped(f"cannot be distinguished: {tied_words(each)}")


def tied_words(tied: Tied) -> str:
    """Return what cannot be distinguished, and what was fixed."""
    value = f"{tied.name} keeps its value"
    if not tied.partners and tied.exact:
        return f"{tied.name} moves nothing that was measured; {value}"
    others = ", ".join(name for name, _ in tied.partners)
    # A combination that is never measured, or hardly with these poses.
    if tied.exact:
        same = ""
        if len(tied.partners) == 1 and abs(abs(tied.partners[0][1]) - 1) < 1e-3:
            sign = "+" if tied.partners[0][1] > 0 else "-"
            same = f" (only {tied.name} {sign} {others} is measured)"
        return f"{tied.name} and {others}{same}; {value}"
    what = f"{tied.name} and {others}" if others else tied.name
    return f"{what}, with these poses; more different poses may help; {value}"


def _wrapped(text: str) -> list[str]:
    """Return a sentence in lines as wide as the terminal."""
    words, lines = text.split(), [""]
    for word in words:
        candidate = f"{lines[-1]} {word}".strip() if len(lines) == 1 else f"{lines[-1]} {word}"
        if len(candidate) > 96 and lines[-1]:
            lines.append(f"  {word}")
        else:
            lines[-1] = candidate
    return lines


def parameter_rows(study: Study) -> list[dict[str, Any]]:
    """Return what was varied, in the order of the file: entries of a row stand together."""
    arm, found = study.fit.problem.arm, study.fit
    order = {f"{key}_{row.name}": place for place, (row, key) in enumerate(
        (row, key) for row in study.robot.rows for key in ("theta", "d", "a", "alpha", "beta"))}  # fmt: skip
    places = sorted(range(len(arm.names)), key=lambda place: (order.get(arm.names[place], len(order)), place))
    return [
        {
            "name": arm.names[place],
            "before": float(arm.start[place]),
            "after": float(found.values[place]),
            "sigma": float(found.sigma[place]),
            "fixed": not bool(found.free[place]),
            "angle": arm.dimension(arm.names[place]) is Dimension.ANGLE,
            "dimension": str(arm.dimension(arm.names[place])),
        }
        for place in places
    ]


def _parameters(study: Study) -> Iterator[str]:
    degrees = study.robot.units.angle == "deg"
    units = {"angle": study.robot.units.angle, "length": study.robot.units.length, "number": ""}
    rows = [("parameter", "before", "after", "change", "1 sigma", "")]
    for each in parameter_rows(study):
        unit = units[each["dimension"]]
        scale = math.degrees(1.0) if each["angle"] and degrees else 1.0
        before, after, sigma = (scale * each[key] for key in ("before", "after", "sigma"))
        if each["fixed"]:
            rows.append((each["name"], f"{before:.6g}", "fixed", "", "", unit))
            continue
        # As many digits as the uncertainty leaves, and one more.
        digits = min(12, max(0, 1 - math.floor(math.log10(sigma)))) if sigma > 0 else 6
        texts = (f"{value:.{digits}f}" for value in (before, after))
        rows.append((each["name"], *texts, f"{after - before:+.{digits}f}", f"{sigma:.{digits}f}", unit))
    yield from columns(rows, left=frozenset({0, 5}))
    for fixture, numbers in study.fixtures():
        unit = study.robot.units.length
        if fixture.kind == "plane":
            text = (
                f"normal ({numbers[0]:.5f}, {numbers[1]:.5f}, {numbers[2]:.5f}), {numbers[3]:.5g} {unit} from the base"
            )
        else:
            radius = f", radius {numbers[3]:.5g} {unit}" if numbers[3] else ""
            text = f"at ({numbers[0]:.5g}, {numbers[1]:.5g}, {numbers[2]:.5g}) {unit}{radius}"
        yield f"found with them: {fixture.kind} {fixture.name} {text}"


def _regions(study: Study) -> Iterator[str]:
    unit = study.robot.units.length
    scaled, small = (1.0, "in") if unit == "in" else (_MILLIMETRES[unit], "mm")
    rows = [(f"RMS error [{small}]", "range", "lowest third", "middle", "highest third")]
    turning = {variable.name for variable in study.robot.variables if str(variable.type) != "prismatic"}
    degrees = study.robot.units.angle == "deg"
    for joint, group in groupby(study.regions, key=lambda region: region.joint):
        parts = list(group)
        scale = math.degrees(1.0) if joint in turning and degrees else 1.0
        what = study.robot.units.angle if joint in turning else unit
        span = f"{scale * parts[0].low:.4g} to {scale * parts[-1].high:.4g} {what}"
        cells = (f"{scaled * part.before:.2g} -> {scaled * part.after:.2g}" if part.rows else "-" for part in parts)
        rows.append((joint, span, *cells))
    yield from columns(rows, left=frozenset({0, 1}))


def _outliers(study: Study) -> Iterator[str]:
    found = study.outliers
    if not found:
        yield "no outliers"
        return
    many = len(found) > 1
    if study.patterns:
        yield bad(f"{len(found)} row{'s' * many} worse than the others; look at the joint below first:")
    else:
        yield bad(f"{len(found)} outlier{'s' * many}; measure again, or leave out:")
    for each in found[:MOST_OUTLIERS]:
        angle = "" if each.angle is None else f" and {1e3 * each.angle:.3g} mrad"
        yield f"  line {each.line}: {_small(study, each.error)}{angle}, {each.size:.3g} sigma"
    if len(found) > MOST_OUTLIERS:
        yield f"  and {len(found) - MOST_OUTLIERS} more (--json lists all)"


def _patterns(study: Study) -> Iterator[str]:
    """Yield errors that follow a joint, and what to do."""
    turning = {variable.name for variable in study.robot.variables if variable.type is not JointType.PRISMATIC}
    for place, each in enumerate(study.patterns):
        joint, share = each.joint, f"{100 * min(each.explained, 0.999):.3g} % of the squared errors"
        if each.shape == "gear":
            name = f"gear_{joint}"
            said = (
                f"a {'gear' if joint in turning else 'scale'} factor of {1 + each.size:.6g} would explain {share}; add "
                f"{name}: 1 to the parameters, write {name}*q in its row, and add {name} to --fit"
            )
        else:
            error = f"an error of {math.degrees(each.size):.3g} degrees once per turn (an eccentric gear or encoder)"
            said = f"{error} would explain {share}"
        yield from _wrapped(f"the errors {'also ' * bool(place)}follow joint {joint}: {said}")


def _suggestions(study: Study) -> Iterator[str]:
    if not study.suggestions:
        return
    robot = study.robot
    yield "measure next, as the gain in percent by which all standard deviations become smaller together:"
    degrees = robot.units.angle == "deg"
    rows = [(*_with_unit(study), "gain")]
    for each in study.suggestions:
        pairs = zip(each.q, robot.variables, strict=True)
        angles = [math.degrees(q) if degrees and str(v.type) != "prismatic" else q for q, v in pairs]
        rows.append((*(f"{angle:.5g}" for angle in angles), f"{100 * each.gain:.1f} %"))
    yield from (f"  {line}" for line in columns(rows))


def _with_unit(study: Study) -> Iterable[str]:
    units = study.robot.units
    for variable in study.robot.variables:
        yield f"{variable.name} [{units.length if str(variable.type) == 'prismatic' else units.angle}]"


def _inverse(study: Study) -> str:
    if study.family_after and study.family_after != study.family_before:
        return f"closed-form inverse: {study.family_after}, each branch refined to the actual arm"
    if study.family_after:
        return f"closed-form inverse: {study.family_after}, also after calibration"
    if study.family_before:
        return "closed-form inverse: none after calibration; build the calibrated file with --outputs numeric_inverse"
    return "closed-form inverse: none; build with --outputs numeric_inverse"


def document(study: Study, file: Path, written: list[Path]) -> dict[str, Any]:
    """Return the same as plain data."""
    found, measured = study.fit, study.fit.problem.measured
    kinds = {str(kind): measured.kinds.count(kind) for kind in dict.fromkeys(measured.kinds)}
    return {
        "file": str(file),
        "robot": study.robot.name,
        "units": {"length": study.robot.units.length, "angle": "rad"},
        "backend": found.problem.arm.backend,
        "measurements": {
            "file": measured.path,
            "rows": len(measured.kinds),
            "kinds": kinds,
            "stated": measured.stated,
            "sigma": float(measured.sigma.mean()),
            "sigma_angle": float(measured.sigma_angle.mean()),
        },
        "before": asdict(study.before),
        "after": asdict(study.after),
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.freedom,
        "parameters": parameter_rows(study),
        "fixtures": [
            {"kind": str(fixture.kind), "name": fixture.name, "numbers": [float(number) for number in numbers]}
            for fixture, numbers in study.fixtures()
        ],
        "nearly_parallel": [asdict(each) for each in study.prepared.parallels],
        "tied": [
            {"name": each.name, "partners": dict(each.partners), "exact": each.exact, "words": tied_words(each)}
            for each in found.tied
        ],
        "regions": [asdict(each) for each in study.regions],
        "cross_validation": None if study.crossed is None else asdict(study.crossed),
        "patterns": [asdict(each) for each in study.patterns],
        "outliers": [asdict(each) for each in study.outliers],
        "suggestions": [asdict(each) for each in study.suggestions],
        "inverse": {"before": study.family_before or None, "after": study.family_after or None},
        "written": [str(path) for path in written],
    }
