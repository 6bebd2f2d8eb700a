"""The real descriptions that `scripts/get_descriptions.py` gets, each content once."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from kinegen.errors import KinegenError
from kinegen.io.format import Imported, ReadOptions
from kinegen.io.load import load_with_report

ROOT = Path(__file__).resolve().parent.parent.parent
DESCRIPTIONS = ROOT / "build" / "descriptions"
_MOVING = re.compile(rb"<joint[^>]*type\s*=\s*[\"'](revolute|continuous|prismatic)[\"']")


@cache
def urdf_files() -> tuple[Path, ...]:
    """Every URDF file with three joints that move, also those that are not XML."""
    return _distinct(
        path for path in sorted(DESCRIPTIONS.rglob("*.urdf")) if len(_MOVING.findall(path.read_bytes())) > 2
    )


@cache
def mjcf_files() -> tuple[Path, ...]:
    """Every MJCF file with three joints."""
    found = (path for path in sorted(DESCRIPTIONS.rglob("*.xml")) if b"<mujoco" in path.read_bytes()[:4000])
    return _distinct(path for path in found if path.read_bytes().count(b"<joint") > 2 and b"<body" in path.read_bytes())


def _distinct(paths) -> tuple[Path, ...]:  # noqa: ANN001 - any paths
    seen: dict[bytes, Path] = {}
    for path in paths:
        seen.setdefault(path.read_bytes(), path)
    return tuple(seen.values())


def shown(path: Path) -> str:
    """A file for people: its package and its name."""
    return str(path.relative_to(DESCRIPTIONS))


def imported(path: Path) -> tuple[Imported | None, str]:
    """A robot with every digit, or the line that refuses it; below free joints, as that line advises."""
    folders = (("around", str(path.parent.parent)),)
    base, message = "", ""
    for _ in range(8):
        try:
            return load_with_report(path, ReadOptions(snap=0.0, base=base, packages=folders)), base
        except KinegenError as error:
            message = str(error)
        advice = re.search(r"start below it with --base '?([^',]+)'?", message)
        if advice is None:
            break
        base = advice[1]
    return None, message


def written_names(found: Imported) -> dict[str, tuple[str, ...]]:
    """What each joint may be called in its file: variables get another name where theirs is not an identifier."""
    back: dict[str, tuple[str, ...]] = {}
    for old, new in found.report.renamed:
        back[new] = (*back.get(new, ()), old)
    return {variable.name: (*back.get(variable.name, ()), variable.name) for variable in found.robot.variables}
