"""A language that kernels are printed in beside C and Python: a record, a folder here, and one in `templates/`.

What a new language takes:

1. a folder in `kinegen/emit/` that ends in a `Language`, with a `Syntax` for `kinegen.emit.printing`;
2. a folder in `templates/` with files named after their output plus `.jinja`;
3. a runner in `kinegen/verify/runners/`, which calls what was emitted;
4. its line in `LANGUAGES` (`kinegen/emit/languages.py`) and in `RUNNERS` (`kinegen/verify/runners/__init__.py`);
5. its page in `docs/`.

The build, the command line, the proof and the lists of files know languages by these two tables alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from kinegen.emit.kernels import Kernels
from kinegen.outputs import Quantity


@dataclass(frozen=True, slots=True)
class Language:
    """One language.

    Attributes:
        name: As `--languages` names it; its files go to a folder of this name below that of the robot.
        title: As sentences name it.
        refuses: Why it has no function for a quantity, or an empty text.
        files: The text of its files by name, for the kernels that it does not refuse.
        tools: The programs that compile or run it, the first that exists being taken; without one there is no proof.
        install: What provides these, in a few words.
    """

    name: str
    title: str
    refuses: Callable[[Quantity], str]
    files: Callable[[Kernels], Mapping[str, str]]
    tools: tuple[str, ...]
    install: str
