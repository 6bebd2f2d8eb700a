"""Which robots have been shown to have the bits of C in a language, by the digests of what was emitted.

A line of `proven.txt` is `ROBOT LANGUAGE DIGEST_OF_C DIGEST`, with the digests of `generated/digests.txt`; one of the
language `all` has the digests of all languages, and stands for a proof of every output in each of them. A robot is
tried again when a digest is another one than in the record; `make current` checks that the digests are true. What
passes is added to the record. `make test-languages PYTEST_OPTIONS=--every-robot` tries all.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from kinegen.emit.languages import LANGUAGES

DIGESTS = Path(__file__).resolve().parents[2] / "generated" / "digests.txt"
PROVEN = Path(__file__).parent / "proven.txt"

ALL = "all"
"""In the place of a language: every language."""

ALWAYS = "scara"
"""The robot that is tried every time: quick, with inverses and both types of joints."""


def due(language: str, *, every: bool = False, digests: Path = DIGESTS, proven: Path = PROVEN) -> tuple[str, ...]:
    """The robots that are to be tried in a language.

    Args:
        language: Its name in `LANGUAGES`.
        every: Whether to try all, whatever the record says.
        digests: The digests of what is emitted now.
        proven: The record.

    Returns:
        The names of robots, sorted.
    """
    before, now = set(_read(proven)), _lines(digests)
    robots = (robot for (robot, spoken), line in now.items() if spoken == language and (every or line not in before))
    return tuple(sorted({*robots, ALWAYS}))


def add(passed: Iterable[tuple[str, str]], *, digests: Path = DIGESTS, proven: Path = PROVEN) -> None:
    """Adds to the record what has passed, and removes from it what nothing emits any more.

    Args:
        passed: Pairs of a robot and a language.
        digests: The digests of what is emitted now.
        proven: The record.
    """
    passed, before = set(passed), set(_read(proven))
    kept = [line for pair, line in _lines(digests).items() if pair in passed or line in before]
    proven.write_text("".join(f"{line}\n" for line in kept), encoding="utf-8")


def _lines(digests: Path) -> dict[tuple[str, str], str]:
    """The line that a record has of every robot and language when both are emitted as now."""
    words = [line.split() for line in _read(digests)]
    emitted: dict[str, dict[str, str]] = {}
    for robot, language, digest in (each for each in words if len(each) == 3):
        if language in LANGUAGES and (language == "c" or LANGUAGES[language].is_extra):
            emitted.setdefault(robot, {})[language] = digest
    found = {}
    for robot, own in emitted.items():
        for language in (each for each in own if each != "c"):
            found[robot, language] = f"{robot} {language} {own['c']} {own[language]}"
        found[robot, ALL] = f"{robot} {ALL} {' '.join(own.values())}"
    return found


def _read(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []
