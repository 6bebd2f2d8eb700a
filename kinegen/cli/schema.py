"""`kinegen schema`: the JSON Schema of robot files, for editors."""

from __future__ import annotations

import json

import click

from kinegen.cli.terminal import say


@click.command("schema", short_help="Prints the JSON Schema of robot files.")
def command() -> None:
    """Prints the JSON Schema of robot files, with which an editor completes and checks them.

    \b
        kinegen schema > robot.schema.json
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.formats.yaml.schema import schema

    say(json.dumps(schema(), indent=2))
