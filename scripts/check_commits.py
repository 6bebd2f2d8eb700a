"""Warns about commits whose messages are hard to read later.

    python3 scripts/check_commits.py [BASE] [--strict]

The commits after BASE are looked at, but for merges. Without BASE that is the upstream of the branch, or else main. The
exit status is 0 with warnings too; with --strict it is 1.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

LONGEST_SUBJECT = 72
LONGEST_LINE = 120
MANY_FILES = 12
"""A commit of more files needs a body; generated files do not count."""


@dataclass(frozen=True, slots=True)
class Commit:
    """One commit.

    Attributes:
        name: The short hash.
        message: The whole message.
        files: The paths that it changes.
    """

    name: str
    message: str
    files: tuple[str, ...]


def main(arguments: list[str]) -> int:
    """Prints the warnings; returns the exit status."""
    parser = argparse.ArgumentParser(description="Warns about commits whose messages are hard to read later.")
    parser.add_argument("base", nargs="?", metavar="BASE", help="commit before the first one that is looked at")
    parser.add_argument("--strict", action="store_true", help="exit with 1 if there is a warning")
    options = parser.parse_args(arguments)
    try:
        base = options.base or usual_base()
        found = commits(base)
    except LookupError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    warnings = [f"{commit.name} {line}" for commit in found for line in problems(commit)]
    for line in warnings:
        print(f"warning: {line}")
    print(f"{len(found)} commits after {base}, {len(warnings)} warnings")
    return int(options.strict and bool(warnings))


def usual_base() -> str:
    """The upstream of the branch, or main.

    Raises:
        LookupError: There is neither.
    """
    for name in ("@{upstream}", "main", "origin/main"):
        if git("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}") is not None:
            return name
    raise LookupError("the branch has no upstream, and there is no main; name the base")


def commits(base: str) -> list[Commit]:
    """The commits after a base, oldest first.

    Raises:
        LookupError: The base is not a commit.
    """
    names = git("rev-list", "--no-merges", "--reverse", f"{base}..HEAD", "--")
    if names is None:
        raise LookupError(f"'{base}' is not a commit of this repository")
    found = []
    for name in names.split():
        message = git("show", "--no-patch", "--format=%B", name) or ""
        files = git("show", "--name-only", "--format=", name) or ""
        found.append(Commit(name[:9], message.strip(), tuple(files.splitlines())))
    return found


def problems(commit: Commit) -> Iterator[str]:
    """What makes a message hard to read."""
    subject, *rest = commit.message.splitlines() or [""]
    quoted = f"'{subject[:40]}...'" if len(subject) > LONGEST_SUBJECT else f"'{subject}'"
    if not subject:
        yield "has no message"
    if len(subject) > LONGEST_SUBJECT:
        yield f"{quoted}: the subject has {len(subject)} characters (at most {LONGEST_SUBJECT})"
    if ";" in subject:
        yield f"{quoted}: the subject has a semicolon; one idea a commit"
    if subject.endswith("."):
        yield f"{quoted}: the subject ends with a full stop"
    if re.match(r"(fixup|squash|amend)!|wip\b", subject, re.I):
        yield f"{quoted}: the commit is to be joined with another one"
    if rest and rest[0]:
        yield f"{quoted}: no empty line after the subject"
    if any(len(line) > LONGEST_LINE for line in rest):
        yield f"{quoted}: the body has lines of more than {LONGEST_LINE} characters"
    written = [file for file in commit.files if not file.startswith("generated/")]
    if len(written) > MANY_FILES and not any(line.strip() for line in rest):
        yield f"{quoted}: {len(written)} files without a body; say why"


def git(*arguments: str) -> str | None:
    """What git prints, or None if it fails."""
    done = subprocess.run(("git", *arguments), capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
