"""`kinegen schema`: the schema, as JSON."""

from __future__ import annotations

import json

import pytest

from kinegen.io.robot_file.keys import schema
from kinegen.ui.cli import main


def test_the_schema_is_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()
