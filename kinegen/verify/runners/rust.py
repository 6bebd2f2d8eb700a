"""Calls the Rust form: a crate and a driver compiled by rustc; see `templates/rust/driver.rs.jinja`."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.rust.crate import CrateContext, crate_context
from kinegen.emit.rust.functions import Function
from kinegen.emit.rust.syntax import BOTH, rust_syntax
from kinegen.ir.program import Program
from kinegen.verify.plain import CLAMP, NEAREST
from kinegen.verify.runners.runner import run_tool
from kinegen.verify.runners.straight import require_forms
from kinegen.verify.ways import DTYPES, Arrays

MODULES = {Real.DOUBLE: "src/lib.rs", Real.FLOAT: "src/f32.rs"}
"""The file of each number type."""

_FLAGS = ("--edition", "2021", "-C", "opt-level=1", "-C", "debuginfo=0")


def run_rust(tool: str, folder: Path, kernels: Kernels) -> _Crate:
    """The functions of a crate; see `kinegen.verify.runners.runner.Runner`."""
    name = kernels.robot.name
    contexts = tuple(crate_context(kernels, real) for real in MODULES)
    for context, path in zip(contexts, MODULES.values(), strict=True):
        _require_straight(f"{name}: {path}", (folder / path).read_text(encoding="utf-8"), context)
    driver = environment().get_template("rust/driver.rs.jinja").render(contexts=contexts, crate=name)
    (folder / "driver.rs").write_text(driver, encoding="utf-8", newline="\n")
    library = (tool, *_FLAGS, "--crate-type", "lib", "--crate-name", name, "-D", "warnings", MODULES[Real.DOUBLE])
    run_tool(library, folder, f"the crate {name}")
    linked = ("--extern", f"{name}=lib{name}.rlib")
    run_tool((tool, *_FLAGS, *linked, "driver.rs", "-o", "driver"), folder, "its driver")
    for test in sorted((folder / "tests").glob("*.rs")):
        command = (tool, *_FLAGS[:2], *linked, "--test", f"tests/{test.name}", "-o", test.stem)
        run_tool(command, folder, f"tests/{test.name}")
        run_tool((str(folder / test.stem), "--quiet"), folder, f"the test vectors of tests/{test.name}")
    return _Crate(folder, kernels.robot.dof)


def _require_straight(owner: str, text: str, context: CrateContext) -> None:
    """Refuse bodies that are not straight; heads in several lines are joined before."""
    joined = re.sub(r"\(\n([^()]*)\n\) ->", lambda found: f"({' '.join(found[1].split()).rstrip(',')}) ->", text)
    heads = [rf"pub fn {function.name}\(.*\) -> .* {{" for function in context.functions]
    others = [frozenset((*function.others, *_comments(function))) for function in context.functions]
    require_forms(rust_syntax(Real(context.real)), owner, joined, heads, "}", others, [BOTH])


def _comments(function: Function) -> Sequence[str]:
    return [line for line in function.body if not line or line.startswith("// ")]


@dataclass(frozen=True, slots=True)
class _Crate:
    """A crate with its driver; see `kinegen.verify.runners.runner.Call`.

    Attributes:
        folder: Where the driver is.
        dof: Length of a joint vector.
    """

    folder: Path
    dof: int

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel in a process of its own."""
        shapes = [result.shape for result in program.signature.results]
        function = program.quantity.function + ("_batch" if is_batch else "")
        return self._run(real, function, inputs, shapes, parameters or ())

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays:
        """Evaluate a function beside the kernels."""
        joints = [(self.dof,)]
        shapes: dict[str, list[tuple[int, ...]]] = {NEAREST: [*joints, ()], CLAMP: [*joints]}
        return self._run(real, name, inputs, shapes.get(name, [()]))

    def _run(
        self,
        real: str,
        function: str,
        inputs: Arrays,
        shapes: Sequence[tuple[int, ...]],
        parameters: Sequence[float] = (),
    ) -> Arrays:
        count, dtype = len(inputs[0]), DTYPES[real]
        with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
            given, found = Path(name) / "inputs", Path(name) / "results"
            flat = [np.ascontiguousarray(array, dtype).ravel() for array in inputs]
            given.write_bytes(np.concatenate(flat).tobytes())
            words = (real, function, str(count), str(given), str(found), *map(repr, parameters))
            run_tool((str(self.folder / "driver"), *words), self.folder, f"{function} in Rust")
            numbers = np.fromfile(found, dtype)
        ends = np.cumsum([count * int(np.prod(shape, dtype=int)) for shape in shapes])
        parts = np.split(numbers, ends[:-1])
        return tuple(part.reshape(count, *shape) for part, shape in zip(parts, shapes, strict=True))

    def tables(self) -> dict[str, Any]:
        """What the crate says of the robot."""
        text = run_tool((str(self.folder / "driver"),), self.folder, "the tables of the crate")
        return {name: _tuples(value) for name, value in json.loads(text).items()}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
