"""From robot files to every emitted text in a Python that has neither NumPy nor cffi nor lxml.

    python plain_python.py FILE...    prints digests of texts as JSON, by file and name
    python plain_python.py            runs the command line for each line of the input

It is run as a program of its own; the test calls `texts` in a process that has everything, for comparison.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

LACKS = ("numpy", "cffi", "_cffi_backend", "pycparser", "lxml", "xacro", "scipy")

OUTPUTS = ("pose", "frames", "fk_jacobian", "rpy_zyx", "inverse", "actuators_to_joints")


def take_away() -> None:
    """An import of these packages fails from now on."""
    for name in LACKS:
        sys.modules[name] = None  # type: ignore[assignment]


def texts(path: Path) -> Iterator[tuple[str, str]]:
    """Every text that kinegen makes of a robot file, but for test vectors and packages for controllers, by name."""
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.languages import LANGUAGES, emit_language
    from kinegen.errors import KinegenError
    from kinegen.io.load import load
    from kinegen.ir.lower import program_of, runtime_defaults
    from kinegen.model.outputs import parse_quantity

    robot = load(path)
    programs = []
    for name in OUTPUTS:
        try:
            quantity = parse_quantity(name)
            programs.append(program_of(robot, quantity))
        except KinegenError as error:
            yield name, error.message
    kernels = RobotPrograms(robot, tuple(programs), runtime_defaults(robot))
    for language in LANGUAGES.values():
        try:
            yield from emit_language(kernels, language).items()
        except KinegenError as error:
            yield language.name, error.message


def digests(path: Path) -> dict[str, str]:
    """The digest of each text."""
    return {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts(path)}


def main() -> int:
    """Take away, then work."""
    take_away()
    if sys.argv[1:]:
        print(json.dumps({name: digests(Path(name)) for name in sys.argv[1:]}))
        return 0
    from kinegen.ui.cli import main as kinegen

    found = []
    for line in sys.stdin:
        with contextlib.suppress(SystemExit):
            found.append(kinegen(shlex.split(line)))
    return max(found)


if __name__ == "__main__":
    sys.exit(main())
