"""What `kinegen build --json` prints for one build; the keys are stable.

    file          the robot file as it was named
    ok            whether the build succeeded; otherwise `error` is its one line, and nothing else follows
    robot         name, digest of the model, joints (name, type), units (length; angles are in rad), tips
    folder        the package folder
    backend       `c`, or `numpy` where nothing was compiled
    operations    for each quantity and for `plain` (the pose as a plain product): multiplications, additions,
                  negations, divisions, sine_cosines, roots, arc_tangents, selections
    angle_sums    name (`c23`) and angle (`q2 + q3`) of each sum whose sine and cosine are taken once
    files         path and status (`new`, `changed`, `unchanged`, `removed`) of each file
    proof         holds, reach, and for each comparison target, quantity, real, poses, holds, share (of the tolerance
                  that is used), worst (joint vector), frame, position and rotation, each with error and accepted
    stages        name, seconds and detail of each stage
    notes         sentences to be read

The document around it has the keys `kinegen` (version), `format` (1) and `builds` (a list).
"""

from __future__ import annotations

from dataclasses import asdict

from kinegen.results import BuildResult
from kinegen.verify.comparison import Comparison

Record = dict[str, object]


def build_record(result: BuildResult) -> Record:
    """One build as plain data."""
    robot = result.robot
    return {
        "robot": {
            "name": robot.name,
            "digest": robot.digest,
            "joints": [{"name": variable.name, "type": variable.type.value} for variable in robot.variables],
            "units": {"length": robot.units.length, "angle": "rad"},
            "tips": list(robot.tips),
        },
        "folder": str(result.folder),
        "backend": result.backend,
        "operations": {
            **{str(quantity): asdict(count) for quantity, count in result.counts.items()},
            "plain": asdict(result.plain),
        },
        "angle_sums": [{"name": f"c{angle.label}", "angle": angle.text} for angle in result.angles if angle.is_sum],
        "files": [{"path": str(file.path), "status": file.status} for file in result.written],
        "proof": {
            "holds": result.proof.holds,
            "reach": result.proof.reach,
            "comparisons": [_comparison(comparison) for comparison in result.proof.comparisons],
        },
        "stages": [asdict(stage) for stage in result.stages],
        "notes": list(result.notes),
    }


def _comparison(comparison: Comparison) -> Record:
    return {
        "target": comparison.target,
        "quantity": str(comparison.quantity),
        "real": comparison.real,
        "poses": comparison.poses,
        "holds": comparison.holds,
        "share": comparison.share,
        "worst": list(comparison.worst),
        "frame": comparison.frame,
        "position": {"error": comparison.position_error, "accepted": comparison.position_tolerance},
        "rotation": {"error": comparison.rotation_error, "accepted": comparison.rotation_tolerance},
    }
