"""`kinegen build --package wheel`: robots as files that pip installs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen import __version__
from kinegen.cli.cached import warn_of_cache
from kinegen.cli.interrupt import raise_if_pressed
from kinegen.cli.terminal import say, strong
from kinegen.errors import shown

if TYPE_CHECKING:
    from kinegen.results import BuildOptions, Stage

WHEEL = "wheel"
"""The word for `--package`."""

DIST = "dist"
"""Where wheels go unless -o says otherwise."""


def build_wheels(files: tuple[Path, ...], options: BuildOptions, bundle: str | None, *, as_json: bool) -> int:
    """Build the wheels of some robots and report what was written.

    Args:
        files: Robot files.
        options: What to make; its output is the folder of the wheels.
        bundle: Name of the wheel; the robot's own if left out.
        as_json: Whether one JSON document is printed, and nothing else.

    Returns:
        The exit status, 0.

    Raises:
        KinegenError: If a build fails; nothing was written then.
    """
    from kinegen.cli.record import build_record
    from kinegen.cli.report import stage_line
    from kinegen.wheels.make import make_wheels

    warn_of_cache()
    shown_last: list[Path] = []

    def report(file: Path, stage: Stage) -> None:
        raise_if_pressed()
        if as_json:
            return
        if shown_last != [file]:
            shown_last[:] = [file]
            say(strong(shown(file)))
        say(stage_line(stage))

    made = make_wheels(files, options.output, options, bundle=bundle, report=report)
    if as_json:
        builds = [
            {"file": str(file), "ok": True, **build_record(result)}
            for file, result in zip(files, made.results, strict=True)
        ]
        document = {"kinegen": __version__, "format": 1, "wheels": [str(path) for path in made.files], "builds": builds}
        say(json.dumps(document, indent=2))
        return 0
    for path in made.files:
        say(f"wrote {shown(path)}: {path.stat().st_size / 1000:,.0f} kB")
    names = [result.robot.name for result in made.results]
    say(f"after `pip install {shown(made.files[0])}`, `python -m {names[0]}` runs the self-test")
    return 0
