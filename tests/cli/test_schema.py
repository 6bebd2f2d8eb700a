"""`kinegen schema`: the schema, as JSON."""

from __future__ import annotations

import json

import pytest

from kinegen.cli import main
from kinegen.formats.yaml.schema import schema


def test_the_schema_is_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()
