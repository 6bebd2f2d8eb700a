"""A language that kernels are printed in: a record, a folder here, and one in `templates/`.

What a new language takes:

1. a folder in `kinegen/backends/` that ends in a `Language`, with a `Syntax` for `kinegen.backends.printing`;
2. a folder in `templates/` with files named after their output plus `.jinja`;
3. a runner in `kinegen/verify/runners/`, which calls what was emitted;
4. its line in `LANGUAGES` (`kinegen/backends/languages.py`) and in `RUNNERS` (`kinegen/verify/runners/__init__.py`);
5. its page in `docs/`.

The build, the command line, the proof and the lists of files know languages by these two tables alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from kinegen.model.outputs import Quantity
from kinegen.support.dataclass import dataclass

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.c.test_vectors import Vectors
    from kinegen.backends.printing import Syntax


def no_tests(_kernels: RobotPrograms, _real: str, _vectors: Vectors) -> Mapping[str, str]:
    """Return no files with test vectors."""
    return {}


@dataclass(frozen=True, slots=True)
class Language:
    """One language.

    Attributes:
        name: As `--languages` names it.
        title: As sentences name it.
        reals: The number types that it has, as `--real` names them.
        syntax: How it writes operations, by number type.
        files: The text of its files by name, for the kernels that it does not refuse and one number type; names may
            have folders, with forward slashes.
        refuses: Why it has no function for a quantity, or an empty text.
        tools: The programs that compile or run it, the first that exists being taken; without one there is no proof.
        install: What provides these, in a few words.
        tests: Files in which its users find the test vectors, by name, for the same kernels and one number type.
        reserved: Names of robots and runtime parameters that it cannot have.
        reserved_robots: Names that a robot alone cannot have, because it is declared beside what libraries declare.
        is_extra: Whether it is written where `--languages` names it, to a folder of its name below that of the robot.
            Of the others C and Python are part of every package, and `--real` asks for integers.
        searches_trees: Whether it has the numeric inverse of robots with several tips, if it has that of arms.
        has_batches: Whether it has functions for many configurations at once.
    """

    name: str
    title: str
    reals: tuple[str, ...]
    syntax: Callable[[str], Syntax[Any]]
    files: Callable[[RobotPrograms, str], Mapping[str, str]]
    refuses: Callable[[Quantity], str]
    tools: tuple[str, ...]
    install: str
    tests: Callable[[RobotPrograms, str, Vectors], Mapping[str, str]] = no_tests
    reserved: frozenset[str] = frozenset()
    reserved_robots: frozenset[str] = frozenset()
    is_extra: bool = True
    searches_trees: bool = True
    has_batches: bool = True


def refuses_nothing(_quantity: Quantity) -> str:
    """Refuse no quantity: each has a function."""
    return ""
