"""Calls the JavaScript form through Node.js; see `templates/javascript/driver.mjs.jinja`."""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.emit.environment import environment
from kinegen.emit.javascript.angles import steps
from kinegen.emit.javascript.syntax import SYNTAX
from kinegen.emit.javascript.wasm import compile_command
from kinegen.emit.kernels import Kernels
from kinegen.ir.program import Program
from kinegen.verify.runners.conversation import Conversation
from kinegen.verify.runners.runner import run_tool
from kinegen.verify.runners.straight import require_forms
from kinegen.verify.ways import Arrays

_DRIVER = "driver.mjs"

_WASM = ("clang", "wasm-ld")
"""What compiles WebAssembly; where it is missing, the driver compares nothing with that."""


def run_javascript(tool: str, folder: Path, kernels: Kernels) -> _Module:
    """The kernels of a module; see `kinegen.verify.runners.runner.Runner`."""
    name = f"{kernels.robot.name}.js"
    run_tool((tool, "--check", name), folder, name)
    heads = [rf"function {program.quantity.function}_at\(.*\) {{" for program in kernels.programs]
    text = (folder / name).read_text(encoding="utf-8")
    calls = [frozenset(f"sincos({len(step.pairs)});" for step in steps(program)) for program in kernels.programs]
    require_forms(SYNTAX, f"{kernels.robot.name}: {name}", text, heads, "}", calls)
    if (folder / f"{kernels.robot.name}_wasm.js").exists() and all(map(shutil.which, _WASM)):
        run_tool(tuple(compile_command(kernels).split()), folder, f"the WebAssembly of {name}")
    driver = environment().get_template(f"javascript/{_DRIVER}.jinja").render()
    (folder / _DRIVER).write_text(driver, encoding="utf-8", newline="\n")
    node = Conversation((tool, _DRIVER, name), folder, tool)
    return _Module(node, name, tuple(parameter.name for parameter in kernels.robot.runtime_parameters))


@dataclass(frozen=True, slots=True)
class _Module:
    """A module in one process of Node.js; see `kinegen.verify.runners.runner.Call`.

    Attributes:
        node: The process.
        name: The file name of the module.
        parameters: Names of its runtime parameters.
    """

    node: Conversation
    name: str
    parameters: tuple[str, ...]

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel; there is one number type."""
        del real
        count, results = len(inputs[0]), program.signature.results
        function = program.quantity.function + ("_batch" if is_batch else "")
        params = None if parameters is None else dict(zip(self.parameters, parameters, strict=True))
        with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
            given, found = Path(name) / "inputs", Path(name) / "results"
            flat = [np.ascontiguousarray(array, np.float64).ravel() for array in inputs]
            given.write_bytes(np.concatenate(flat).tobytes())
            sizes = [array[0].size if count else 0 for array in inputs], [_size(result.shape) for result in results]
            words = (function, count, *sizes, params, str(given), str(found))
            self.node.ask(json.dumps(words), f"{function} of {self.name}")
            numbers = np.fromfile(found)
        ends = np.cumsum([count * _size(result.shape) for result in results])
        parts = np.split(numbers, ends[:-1])
        return tuple(part.reshape(count, *result.shape) for part, result in zip(parts, results, strict=True))

    def others(self, name: str, inputs: Arrays, *, real: str) -> None:
        """There are no functions beside the kernels."""

    def tables(self) -> dict[str, Any]:
        """What the module says of the robot."""
        text = "".join(self.node.ask(json.dumps(["tables"]), self.name))
        return {name: _tuples(value) for name, value in json.loads(text).items()}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _size(shape: tuple[int, ...]) -> int:
    return int(np.prod(shape, dtype=int))
