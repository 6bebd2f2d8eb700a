"""Writes docs/commands.md: what `--help` prints of every command.

python docs/make_commands.py           rewrites the page
python docs/make_commands.py --check   compares, and fails with a diff if the page is not current
"""

from __future__ import annotations

import difflib
import sys
from pathlib import Path

import click
from click.testing import CliRunner

from kinegen.ui import cli

PAGE = Path(__file__).resolve().parent / "commands.md"
WIDTH = 100
HEAD = """\
# Commands

<!-- Written by docs/make_commands.py; change the commands and run `make docs`. -->

What `--help` prints of every command. Exit status 0 is success, 1 an error that a message explains in one line, 2 a
wrong use of the command line. [The tour](tour.md) shows the commands on a robot.

"""


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    after = HEAD + "\n".join(section(name) for name in ("", *cli.COMMANDS))
    if before == after:
        return 0
    if arguments == ["--check"]:
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(PAGE), "now"))
        print("The page is not current: run 'make docs' and commit what it changes")
        return 1
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(PAGE.relative_to(PAGE.parent.parent))
    return 0


def section(name: str) -> str:
    """The help of one command, or of all."""
    words = f"kinegen {name}".strip()
    return f"## {words}\n\n```text\n{help_of(name)}```\n"


def help_of(name: str) -> str:
    """What `--help` prints at a fixed width."""
    group = cli._kinegen  # noqa: SLF001 - the whole program, as the shell starts it
    arguments = [*([name] if name else []), "--help"]
    done = CliRunner().invoke(group, arguments, prog_name="kinegen", terminal_width=WIDTH, max_content_width=WIDTH)
    if done.exit_code != 0:
        raise click.ClickException(done.output)
    return "".join(f"{line.rstrip()}\n" for line in done.output.splitlines())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
