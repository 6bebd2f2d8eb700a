"""Calls the JavaScript form through Node.js; see `templates/javascript/driver.mjs.jinja`."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.javascript.functions import function_of
from kinegen.backends.javascript.syntax import SYNTAX, steps
from kinegen.backends.javascript.wasm import compile_command
from kinegen.backends.templates import environment
from kinegen.ir.program import Program
from kinegen.support.dataclass import dataclass
from kinegen.verify.invocations import Arrays
from kinegen.verify.runners.runner import Conversation, exchanged, require_forms, run_tool, tuples

_DRIVER = "driver.mjs"

_WASM = ("clang", "wasm-ld")
"""What compiles WebAssembly; where it is missing, the driver compares nothing with that."""


def run_javascript(tool: str, folder: Path, kernels: RobotPrograms) -> _Module:
    """Returns the kernels of a module; see `kinegen.verify.runners.runner.Runner`."""
    name = f"{kernels.robot.name}.js"
    run_tool((tool, "--check", name), folder, name)
    heads = [rf"function {program.quantity.function}_at\(.*\) {{" for program in kernels.programs]
    text = (folder / name).read_text(encoding="utf-8")
    others = [_others(kernels, program) for program in kernels.programs]
    require_forms(SYNTAX, f"{kernels.robot.name}: {name}", text, heads, "}", others)
    if (folder / f"{kernels.robot.name}_wasm.js").exists() and all(map(shutil.which, _WASM)):
        run_tool(tuple(compile_command(kernels).split()), folder, f"the WebAssembly of {name}")
    driver = environment().get_template(f"javascript/{_DRIVER}.jinja").render()
    (folder / _DRIVER).write_text(driver, encoding="utf-8", newline="\n")
    node = Conversation((tool, _DRIVER, name), folder, tool)
    return _Module(node, name, tuple(parameter.name for parameter in kernels.robot.runtime_parameters))


def _others(kernels: RobotPrograms, program: Program) -> frozenset[str]:
    """Return the lines of a body that are not statements: calls of `sincos`, and titles of sections."""
    lines = function_of(kernels, program).body
    titles = (line for line in lines if not line or line.startswith("// "))
    return frozenset((*(f"sincos({len(step.pairs)});" for step in steps(program)), *titles))


@dataclass(frozen=True, slots=True)
class _Module:
    """A module in one process of Node.js; see `kinegen.verify.runners.runner.Call`."""

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
        shapes = [result.shape for result in results]
        sizes = [array[0].size if count else 0 for array in inputs], [math.prod(shape) for shape in shapes]

        def run(given: str, found: str) -> None:
            self.node.ask(json.dumps((function, count, *sizes, params, given, found)), f"{function} of {self.name}")

        return exchanged(inputs, np.float64, shapes, run)

    def others(self, name: str, inputs: Arrays, *, real: str) -> None:
        """There are no functions beside the kernels."""

    def tables(self) -> dict[str, Any]:
        """Returns what the module says of the robot."""
        text = "".join(self.node.ask(json.dumps(["tables"]), self.name))
        return {name: tuples(value) for name, value in json.loads(text).items()}
