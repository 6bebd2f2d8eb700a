"""Writes docs/commands.md, one line a command; the site has what `--help` prints of each below it.

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

```sh
kinegen build --help
```

`--help` after a command describes its options. Exit status 0 is success, 1 an error that a message explains in one
line, 2 a wrong use of the command line. In bash, `eval "$(_KINEGEN_COMPLETE=bash_source kinegen)"` turns on completion
of commands and options (`zsh_source` and `fish_source` for zsh and fish).

| command | purpose | page |
| --- | --- | --- |
"""
PAGES = {
    "build": "[package](python.md), [C](generated-c.md), [firmware](firmware.md), [controllers](controllers.md)",
    "show": "[tour](tour.md#the-closed-form), [singularities](velocities.md#singularities)",
    "view": "[viewer](viewer.md), [figures](pictures.md)",
    "check": "[robot file](robot-file.md)",
    "convert": "[other formats](import.md), [tables](tables.md)",
    "compare": "[comparing](compare.md)",
    "inspect": "[inverse kinematics](inverse.md)",
    "fk": "[tour](tour.md#the-closed-form)",
    "eval": "[files of joint vectors](eval.md)",
    "doctor": "[doctor](doctor.md)",
    "calibrate": "[calibration](calibration.md)",
    "size": "[cost of a call](firmware.md#cost-of-a-call)",
    "prove": "[proofs by Frama-C](proof.md)",
    "workspace": "[tour](tour.md#other-outputs)",
    "schema": "[tour](tour.md#completion-in-an-editor)",
}
"""Where each command is explained."""


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    after = page()
    if before == after:
        return 0
    if arguments == ["--check"]:
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(PAGE), "now"))
        print("The page is not current: run 'make docs' and commit what it changes")
        return 1
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(PAGE.relative_to(PAGE.parent.parent))
    return 0


def page() -> str:
    """The page: a table of the commands."""
    return HEAD + "".join(f"| `kinegen {name}` | {summary(name)} | {PAGES[name]} |\n" for name in cli.COMMANDS)


def whole_page() -> str:
    """The page of the site: also the help of every command."""
    return f"{page()}\n" + "\n".join(section(name) for name in ("", *cli.COMMANDS))


def summary(name: str) -> str:
    """What the list of commands says of one."""
    command = cli._kinegen.get_command(click.Context(cli._kinegen), name)  # noqa: SLF001 - as the shell finds it
    return command.get_short_help_str(limit=WIDTH) if command else ""


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
