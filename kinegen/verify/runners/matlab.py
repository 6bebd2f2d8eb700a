"""Calls the functions of a MATLAB package through one process of GNU Octave; see `templates/matlab/driver.m.jinja`."""

from __future__ import annotations

import itertools
import math
import re
import shutil
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.matlab.functions import Function, function_of
from kinegen.backends.matlab.gateway import gateway_name
from kinegen.backends.matlab.syntax import CLASS, axes, extents, matlab_syntax
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.errors import CompileError
from kinegen.ir.program import Program
from kinegen.model.outputs import Array
from kinegen.verify.invocations import CLAMPS, DTYPES, NEAREST, Arrays, Floats
from kinegen.verify.runners.runner import Conversation, require_forms, run_tool

_DRIVER = "driver.m"
_GUARDS = "guarded.c"
_MEX = ("mkoctfile",)
"""What compiles MEX files; where it is missing, the driver compares nothing with them."""

_MEX_FLAGS = "-std=c99 -O0 -march=native -ffp-contract=off -fPIC -Wall -Wextra -Werror"
_TYPED = re.compile(r"\b(?:single|double)\(([^()]*)\)")


def run_matlab(tool: str, folder: Path, kernels: RobotPrograms) -> _Package:
    """Returns the functions of a package; see `kinegen.verify.runners.runner.Runner`."""
    robot = kernels.robot.name
    for program in kernels.programs:
        _require_straight(kernels, folder, program)
    if shutil.which(_MEX[0]) and (folder / f"{gateway_name(robot)}.c").exists():
        _compile_mex(folder, kernels)
    driver = environment().get_template(f"matlab/{_DRIVER}.jinja").render()
    (folder / _DRIVER).write_text(driver, encoding="utf-8", newline="\n")
    package = _Package(tool, folder, robot, kernels.robot.dof)
    if (folder / "run_tests.m").exists():
        package.run_tests()
    return package


def _compile_mex(folder: Path, kernels: RobotPrograms) -> None:
    """Compile the MEX file between guards, and quickly; `build_mex` compiles it for speed."""
    name = gateway_name(kernels.robot.name)
    guards = environment().get_template(f"matlab/{_GUARDS}.jinja").render(name=name)
    (folder / _GUARDS).write_text(guards, encoding="utf-8", newline="\n")
    sources = (_GUARDS, *sorted(path.relative_to(folder).as_posix() for path in folder.glob("csrc/*.c")))
    command = ("env", f"CFLAGS={_MEX_FLAGS}", *_MEX, "--mex", "-o", f"{name}.mex", *sources)
    run_tool(command, folder, f"{name}.c")


def _require_straight(kernels: RobotPrograms, folder: Path, program: Program) -> None:
    """Refuse bodies that are not straight, once they are without the types of numbers."""
    robot, function = kernels.robot.name, function_of(kernels, program)
    path = f"+{robot}/{function.name}.m"
    try:
        text = _bare((folder / path).read_text(encoding="utf-8"))
    except OSError as error:
        raise CompileError(f"{robot}: there is no {path}") from error
    for real, body in zip(ScalarType, function.bodies, strict=True):
        head = rf"function .* = in_{body.kind}\(.*\)"
        require_forms(matlab_syntax(real), f"{robot}: {path}", text, [head], "end", [_others(function)])


def _others(function: Function) -> frozenset[str]:
    """Lines of the bodies that are not statements."""
    lines = (line for body in function.bodies for line in (*body.declared, *body.lines))
    comments = (line for line in lines if not line or line.startswith("% "))
    return frozenset((*comments, *(_bare(line) for body in function.bodies for line in body.declared)))


def _bare(text: str) -> str:
    """Statements without the types of numbers, and with a name for a sine or cosine that nothing uses."""
    return _TYPED.sub(r"\1", text).replace("[~, ", "[_, ").replace(", ~] =", ", _] =")


class _Package:
    """A package that one process of Octave calls; see `kinegen.verify.runners.runner.Call`."""

    def __init__(self, tool: str, folder: Path, robot: str, dof: int) -> None:
        self._robot, self._dof, self._numbers = robot, dof, itertools.count()
        command = (tool, "--norc", "--quiet", "--no-history", _DRIVER, robot)
        self._place = tempfile.TemporaryDirectory(prefix="kinegen-")
        weakref.finalize(self, self._place.cleanup)
        self._octave = Conversation(command, folder, "Octave")

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel: all configurations in one call, or some one after the other and the rest in pieces."""
        signature, way = program.signature, "all" if is_batch else "parts"
        given = tuple(zip(signature.inputs, inputs, strict=True))
        return self._run(program.quantity.function, way, real, given, signature.results, parameters)

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays:
        """Evaluate a function beside the kernels."""
        joints, flag = Array("q", (self._dof,)), Array("flag", ())
        clamped = (Array("clamped", inputs[0].shape[1:]),)
        results = {NEAREST: (joints, flag), **dict.fromkeys(CLAMPS, clamped)}
        given = tuple((Array("", array.shape[1:]), array) for array in inputs)
        return self._run(name, "all", real, given, results.get(name, (flag,)), None)

    def _run(
        self,
        function: str,
        way: str,
        real: str,
        inputs: Sequence[tuple[Array, Floats]],
        results: Sequence[Array],
        parameters: Sequence[float] | None,
    ) -> Arrays:
        count, dtype = len(inputs[0][1]), DTYPES[real]
        given, found, values = (Path(self._place.name) / f"{word}{next(self._numbers)}" for word in "abc")
        given.write_bytes(b"".join(_to_columns(array, numbers.astype(dtype)) for array, numbers in inputs))
        if parameters is not None:
            values.write_bytes(np.array(parameters, float).tobytes())
        shapes = ",".join("x".join(map(str, extents(array))) for array, _ in inputs)
        words = (CLASS[ScalarType(real)], way, str(count), shapes, str(len(results)), str(given), str(found))
        self._asked(" ".join((function, *words, "-" if parameters is None else str(values))), function)
        numbers = np.fromfile(found, dtype)
        sizes = [count * math.prod(extents(array)) for array in results]
        if numbers.size != sum(sizes):
            reason = f"{function} gives {numbers.size} numbers, expected {sum(sizes)}"
            raise CompileError(f"{self._robot}: {reason} of {count} configurations")
        parts = np.split(numbers, np.cumsum(sizes)[:-1])
        for file in (given, found, values):
            file.unlink(missing_ok=True)
        return tuple(_from_columns(array, part, count) for array, part in zip(results, parts, strict=True))

    def run_tests(self) -> None:
        """Try the test vectors."""
        self._asked("run_tests", "the test vectors")

    def tables(self) -> dict[str, Any]:
        """Returns what the package says of the robot."""
        found: dict[str, Any] = {}
        for line in self._asked("tables", "the tables of the package"):
            name, kind, *words = line.split("\t")
            found[name] = words[0] if kind == "text" else tuple(words if kind == "words" else map(float, words))
        if "LIMITS" in found:
            pairs = zip(found["LIMITS"][::2], found["LIMITS"][1::2], strict=True)
            found["LIMITS"] = tuple(
                None if math.isinf(low) and math.isinf(high) else (low, high) for low, high in pairs
            )
        if "ACTUATOR_RANGES" in found:
            ranges = found["ACTUATOR_RANGES"]
            found["ACTUATOR_RANGES"] = tuple(zip(ranges[::2], ranges[1::2], strict=True))
        if "DOF" in found:
            found["DOF"] = int(found["DOF"][0])
        names, values = found.pop("PARAMETER_NAMES", ()), found.pop("PARAMETER_VALUES", ())
        return found | ({"DEFAULT_PARAMS": dict(zip(names, values, strict=True))} if names else {})

    def _asked(self, line: str, subject: str) -> list[str]:
        """Returns the lines before the answer; see `Conversation.ask`."""
        return self._octave.ask(line, f"{subject} of {self._robot}")


def _to_columns(array: Array, numbers: Floats) -> bytes:
    """Numbers (N, ...) in the order of MATLAB."""
    order = [axis + 1 for axis in reversed(axes(array))]
    return np.ascontiguousarray(numbers.transpose(0, *order)).tobytes()


def _from_columns(array: Array, numbers: Floats, count: int) -> Floats:
    """Returns the reverse of `_to_columns`."""
    if not array.shape:
        return numbers
    order = axes(array)
    back = [1 + place for place in np.argsort(order[::-1])]
    return numbers.reshape(count, *reversed(extents(array))).transpose(0, *back)
