"""Calls the C++ header through a compiled program; see `templates/cpp/driver.cpp.jinja`."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.emit.cpp.header import header_context
from kinegen.emit.cpp.syntax import SYNTAX, TRUTHS
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels
from kinegen.ir.program import Program
from kinegen.verify.plain import CLAMP, NEAREST
from kinegen.verify.runners.runner import run_tool
from kinegen.verify.runners.straight import require_forms
from kinegen.verify.ways import DTYPES, Arrays

FLAGS = ("-std=c++17", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-fno-exceptions", "-fno-rtti")
"""The header is compiled with these, so that a warning in it is an error of the build."""

_OPTIONS = ("-O1", "-ffp-contract=off")
_CHECKED = "-O0"
_TABLES = {
    "JOINT": "JOINTS",
    "FRAME": "FRAMES",
    "TIP": "TIPS",
    "BRANCH": "BRANCHES",
    "PARAMETER": "PARAMETERS",
    "ACTUATOR": "ACTUATORS",
}
_NUMBER = r"-?\d[\d.]*(?:[eE][-+]?\d+)?F?"
_LITERAL = re.compile(rf"Real\(({_NUMBER})\)|detail::either<Real>\(({_NUMBER}), {_NUMBER}\)")


def run_cpp(tool: str, folder: Path, kernels: Kernels) -> _Header:
    """The kernels of a header; see `kinegen.verify.runners.runner.Runner`."""
    name, owner = f"{kernels.robot.name}.hpp", f"{kernels.robot.name}: {kernels.robot.name}.hpp"
    text = (folder / name).read_text(encoding="utf-8")
    heads = [
        rf"constexpr void {program.quantity.function}\(.*Real\* __restrict .*\) noexcept"
        for program in kernels.programs
    ]
    require_forms(SYNTAX, owner, _bare(text), heads, "}", more=tuple(TRUTHS.forms.values()))
    driver = environment().get_template("cpp/driver.cpp.jinja").render(k=header_context(kernels))
    (folder / "driver.cpp").write_text(driver, encoding="utf-8", newline="\n")
    run_tool((tool, *FLAGS, *_OPTIONS, "driver.cpp", "-o", "driver"), folder, name)
    for test in sorted(folder.glob("*_test_*.cpp")):
        run_tool((tool, *FLAGS, _CHECKED, test.name, "-o", test.stem), folder, test.name)
        run_tool((f"./{test.stem}",), folder, f"the test vectors of {test.name}")
    return _Header(folder, kernels)


def _bare(text: str) -> str:
    """The header with numbers and types as they are, and without blank lines and comments of its own."""
    lines = (line for line in text.split("\n") if line.strip() and not re.match(r"\s*//[^\\]*$", line))
    bare = _LITERAL.sub(lambda found: (found[1] or found[2]).rstrip("F"), "\n".join(lines))
    of_numbers = bare.replace("const bool ", "const Real ")
    return re.sub(r"(noexcept)\n\{$", r"\1", of_numbers, flags=re.MULTILINE)


@dataclass(frozen=True, slots=True)
class _Header:
    """A compiled header; see `kinegen.verify.runners.runner.Call`.

    Attributes:
        folder: The folder of the program.
        kernels: What the header was printed from.
    """

    folder: Path
    kernels: Kernels

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel in a process of its own."""
        shapes = [result.shape for result in program.signature.results]
        way = "batch" if is_batch else "one"
        return self._run(program.quantity.function, way, real, inputs, shapes, parameters or ())

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays:
        """Evaluate a function beside the kernels."""
        joints = [(self.kernels.robot.dof,)]
        shapes: dict[str, list[tuple[int, ...]]] = {NEAREST: [*joints, ()], CLAMP: [*joints]}
        return self._run(name, "one", real, inputs, shapes.get(name, [()]))

    def _run(
        self,
        name: str,
        way: str,
        real: str,
        inputs: Arrays,
        shapes: Sequence[tuple[int, ...]],
        parameters: Sequence[float] = (),
    ) -> Arrays:
        count, dtype = len(inputs[0]), DTYPES[real]
        with tempfile.TemporaryDirectory(prefix="kinegen-") as place:
            given, found = Path(place) / "inputs", Path(place) / "results"
            flat = [np.ascontiguousarray(array, dtype).ravel() for array in inputs]
            given.write_bytes(np.concatenate(flat).tobytes())
            values = (value.hex() for value in parameters)
            command = ("./driver", name, way, real, str(count), str(given), str(found), *values)
            run_tool(command, self.folder, f"{name} of {self.kernels.robot.name}.hpp")
            numbers = np.fromfile(found, dtype)
        ends = np.cumsum([count * int(np.prod(shape, dtype=int)) for shape in shapes])
        parts = np.split(numbers, ends[:-1])
        return tuple(part.reshape(count, *shape) for part, shape in zip(parts, shapes, strict=True))

    def tables(self) -> dict[str, Any]:
        """What the header says of the robot."""
        text = run_tool(("./driver",), self.folder, f"{self.kernels.robot.name}.hpp")
        return {_TABLES.get(name, name): _tuples(value) for name, value in json.loads(text).items()}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
