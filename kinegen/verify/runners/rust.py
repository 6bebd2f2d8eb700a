"""Calls the Rust form: a crate and a driver compiled by rustc; see `templates/rust/driver.rs.jinja`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.rust.files import CrateContext, crate_context
from kinegen.backends.rust.functions import Function
from kinegen.backends.rust.syntax import BOTH, rust_syntax
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.verify.invocations import DTYPES, Arrays
from kinegen.verify.runners.runner import Driven, exchanged, require_forms, run_tool

MODULES = {ScalarType.DOUBLE: "src/lib.rs", ScalarType.FLOAT: "src/f32.rs"}
"""The file of each number type."""

_FLAGS = ("--edition", "2021", "-C", "opt-level=1", "-C", "debuginfo=0")
_SAFE = ("-D", "warnings", "-F", "unsafe_code")
"""Whatever the crate says itself: a function without unsafe code cannot write beside its results, nor to its inputs."""


def run_rust(tool: str, folder: Path, kernels: RobotPrograms) -> _Crate:
    """Returns the functions of a crate; see `kinegen.verify.runners.runner.Runner`."""
    name = kernels.robot.name
    contexts = tuple(crate_context(kernels, real) for real in MODULES)
    for context, path in zip(contexts, MODULES.values(), strict=True):
        _require_straight(f"{name}: {path}", (folder / path).read_text(encoding="utf-8"), context)
    driver = environment().get_template("rust/driver.rs.jinja").render(contexts=contexts, crate=name)
    (folder / "driver.rs").write_text(driver, encoding="utf-8", newline="\n")
    library = (tool, *_FLAGS, *_SAFE, "--crate-type", "lib", "--crate-name", name, MODULES[ScalarType.DOUBLE])
    run_tool(library, folder, f"the crate {name}")
    linked = ("--extern", f"{name}=lib{name}.rlib")
    run_tool((tool, *_FLAGS, *linked, "driver.rs", "-o", "driver"), folder, "its driver")
    for test in sorted((folder / "tests").glob("*.rs")):
        command = (tool, *_FLAGS[:2], *linked, "--test", f"tests/{test.name}", "-o", test.stem)
        run_tool(command, folder, f"tests/{test.name}")
        run_tool((str(folder / test.stem), "--quiet"), folder, f"the test vectors of tests/{test.name}")
    return _Crate(folder, kernels, "the tables of the crate")


def _require_straight(owner: str, text: str, context: CrateContext) -> None:
    """Refuse bodies that are not straight; heads in several lines are joined before."""
    joined = re.sub(r"\(\n([^()]*)\n\) ->", lambda found: f"({' '.join(found[1].split()).rstrip(',')}) ->", text)
    heads = [rf"pub fn {function.name}\(.*\) -> .* {{" for function in context.functions]
    others = [frozenset((*function.others, *_comments(function))) for function in context.functions]
    require_forms(rust_syntax(ScalarType(context.real)), owner, joined, heads, "}", others, [BOTH])


def _comments(function: Function) -> Sequence[str]:
    return [line for line in function.body if not line or line.startswith("// ")]


class _Crate(Driven):
    """A crate with its driver; see `kinegen.verify.runners.runner.Call`."""

    def _run(
        self,
        name: str,
        real: str,
        inputs: Arrays,
        shapes: Sequence[tuple[int, ...]],
        parameters: Sequence[float] = (),
        *,
        is_batch: bool = False,
    ) -> Arrays:
        function, count, values = f"{name}_batch" if is_batch else name, str(len(inputs[0])), map(repr, parameters)

        def run(given: str, found: str) -> None:
            run_tool(("./driver", real, function, count, given, found, *values), self.folder, f"{function} in Rust")

        return exchanged(inputs, DTYPES[real], shapes, run)
