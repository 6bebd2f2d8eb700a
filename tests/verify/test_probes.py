"""The probes of a package are compiled beside its proof, and never outlive it."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import cast

import pytest

from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.ir.lower import program_of
from kinegen.model.outputs import Quantity
from kinegen.runtime.extension import lay_out
from kinegen.verify.files import compiled_probes
from tests.emit.emitted import texts

ROBOT = load(Path(__file__).parents[2] / "robots" / "puma560.yaml")
SIGNATURE = program_of(ROBOT, Quantity.POSE).signature
FOREVER = 600.0

COMPILER = """#!/bin/sh
case "$*" in *--version*) echo sleeper 1.0; exit;; esac
echo $$ > running.part
mv running.part running
exec sleep {forever:g}
"""


def package(backend: str) -> ModuleType:
    """As much of a package as its probes are about."""
    kernel = SimpleNamespace(inputs=SIGNATURE.inputs, results=SIGNATURE.results)
    return cast(ModuleType, SimpleNamespace(backend=backend, fk=kernel))


def is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
def test_a_proof_that_fails_ends_the_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lay_out(tmp_path, texts("puma560", (Quantity.POSE,)))
    compiler = tmp_path / "compiler"
    compiler.write_text(COMPILER.format(forever=FOREVER), encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    began, running = time.monotonic(), tmp_path / "running"

    with pytest.raises(ProofError, match="does not hold"):
        fail_beside_a_compiler(tmp_path, running)

    assert not is_running(int(running.read_text(encoding="utf-8")))
    assert time.monotonic() - began < FOREVER


def fail_beside_a_compiler(folder: Path, running: Path) -> None:
    with compiled_probes(ROBOT, package("c"), folder, (Quantity.POSE,), ("double", "float")) as probes:
        while not running.exists():
            assert not probes["double"].done()
            time.sleep(0.01)
        assert is_running(int(running.read_text(encoding="utf-8")))
        raise ProofError("does not hold")


def test_a_package_without_c_has_none(tmp_path: Path) -> None:
    with compiled_probes(ROBOT, package("numpy"), tmp_path, (Quantity.POSE,), ("double",)) as probes:
        assert not probes
    assert not list(tmp_path.iterdir())
