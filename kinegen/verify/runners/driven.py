"""Calls kernels through a compiled program that reads numbers from a file and writes results to another."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.emit.kernels import Kernels
from kinegen.ir.program import Program
from kinegen.verify.plain import CLAMP, NEAREST
from kinegen.verify.runners.runner import run_tool
from kinegen.verify.ways import DTYPES, Arrays

_TABLES = {
    "JOINT": "JOINTS",
    "FRAME": "FRAMES",
    "TIP": "TIPS",
    "BRANCH": "BRANCHES",
    "PARAMETER": "PARAMETERS",
    "ACTUATOR": "ACTUATORS",
}


@dataclass(frozen=True, slots=True)
class Driven:
    """A compiled driver; see `kinegen.verify.runners.runner.Call`.

    Attributes:
        folder: The folder of the program.
        kernels: What the file was printed from.
        file: The file that it calls.
    """

    folder: Path
    kernels: Kernels
    file: str

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
            run_tool(command, self.folder, f"{name} of {self.file}")
            numbers = np.fromfile(found, dtype)
        ends = np.cumsum([count * int(np.prod(shape, dtype=int)) for shape in shapes])
        parts = np.split(numbers, ends[:-1])
        return tuple(part.reshape(count, *shape) for part, shape in zip(parts, shapes, strict=True))

    def tables(self) -> dict[str, Any]:
        """What the file says of the robot."""
        text = run_tool(("./driver",), self.folder, self.file)
        return {_TABLES.get(name, name): _tuples(value) for name, value in json.loads(text).items()}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
