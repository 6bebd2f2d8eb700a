"""The files of a language laid out and taken by its tool, ready to be called."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.emit.languages import kept
from kinegen.emit.reals import Real
from kinegen.errors import MissingToolError, ProofError
from kinegen.native.compiler import Compiler, find_compiler
from kinegen.outputs import Kind
from kinegen.verify.plain import PlainKernels, compile_plain
from kinegen.verify.runners import RUNNERS
from kinegen.verify.runners.runner import Call
from kinegen.verify.tables import agree, default_parameters, python_tables

_PYTHON_ALONE = ("ACTUATOR_RANGES", "ACTUATOR_UNITS")
"""Tables of a Python package that other languages do not have."""


@dataclass(frozen=True, slots=True)
class Ready:
    """Files of a language that can be called.

    Attributes:
        language: The language.
        kernels: The robot and its programs, without those that the language refuses.
        call: Evaluates them.
        branches: What the files call the branches of the inverse.
        folder: A folder that is there as long.
        compiler: The C compiler.
    """

    language: Language
    kernels: Kernels
    call: Call
    branches: tuple[str, ...]
    folder: Path
    compiler: Compiler

    def plain(self, real: Real) -> PlainKernels:
        """The kernels of C of a number type."""
        return compile_plain(self.kernels, emit_kernel(self.kernels, real), self.folder, self.compiler, real)


@contextmanager
def prepared(kernels: Kernels, language: Language, files: Mapping[str, str]) -> Iterator[Ready]:
    """Lay out the files of a language, have its tool take them, and compare their tables with the robot.

    Args:
        kernels: The robot and its programs.
        language: The language.
        files: Its files by path.

    Raises:
        MissingToolError: If nothing that runs the language is installed, or no C compiler, whose bits are asked for.
        CompileError: If the tool refuses the files.
        ProofError: If a table is wrong.
    """
    tool = next((found for name in language.tools if (found := shutil.which(name))), None)
    if tool is None:
        raise MissingToolError(f"{language.title} takes {language.install}, which is not installed")
    compiler, kernels = find_compiler(), kept(kernels, language)
    with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
        folder = Path(name) / language.name
        folder.mkdir()
        _lay_out(folder, language, files)
        call = RUNNERS[language.name](tool, folder, kernels)
        tables = call.tables()
        _require_tables(kernels, language, tables)
        yield Ready(language, kernels, call, tables.get("BRANCHES", ()), Path(name), compiler)


def _lay_out(folder: Path, language: Language, files: Mapping[str, str]) -> None:
    """Write the files of a language to a folder of its own."""
    for path, text in files.items():
        place = folder / path.removeprefix(f"{language.name}/")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8", newline="\n")


def _require_tables(kernels: Kernels, language: Language, tables: Mapping[str, Any]) -> None:
    """Compare what the files say of the robot with the robot; names of branches are tried with the inverse."""
    robot = kernels.robot
    kinds = tuple(program.quantity for program in kernels.programs)
    wanted = {name: value for name, value in python_tables(robot, kinds).items() if name not in _PYTHON_ALONE}
    wanted["MODEL"] = robot.digest
    if robot.runtime_parameters:
        wanted["DEFAULT_PARAMS"] = tuple(default_parameters(robot).items())
    found = {name: tuple(value.items()) if isinstance(value, dict) else value for name, value in tables.items()}
    branches = {"BRANCHES"} if any(each.kind is Kind.INVERSE for each in kinds) else set()
    if set(found) != set(wanted) | branches:
        names = ", ".join(sorted(set(found) ^ (set(wanted) | branches)))
        raise ProofError(f"{robot.name}: tables of {language.title} are missing or too many: {names}")
    for name, value in wanted.items():
        if not agree(found[name], value):
            reason = f"{name} in {language.title} is {found[name]}, expected {value}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")
