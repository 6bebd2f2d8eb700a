"""Calls the CUDA kernels on the processor, CUDA's words being defined away; see `templates/cuda/driver.cpp.jinja`."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.cuda.files import FORMS, SYNTAX, header_of, package_of
from kinegen.backends.templates import environment
from kinegen.errors import ProofError
from kinegen.ir.program import Program
from kinegen.support.dataclass import dataclass
from kinegen.verify.invocations import NEAREST, Arrays
from kinegen.verify.runners.cpp import bare
from kinegen.verify.runners.runner import Driven, require_forms, run_tool

FLAGS = ("-std=c++17", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-Wno-unused-parameter")

_OPTIONS = ("-O0", "-ffp-contract=off")


def run_cuda(tool: str, folder: Path, kernels: RobotPrograms) -> _Kernels:
    """Returns the kernels of a robot; see `kinegen.verify.runners.runner.Runner`."""
    context, package = header_of(kernels), package_of(kernels)
    text = (folder / package.header).read_text(encoding="utf-8")
    mark = f"{package.macro}_FUNCTION"
    heads = [rf"{mark} void {program.quantity.function}\(.*Real\* __restrict__ .*\)" for program in kernels.programs]
    lines = re.sub(r"^(.* void .*\))\n\{$", r"\1", bare(text), flags=re.MULTILINE)
    require_forms(SYNTAX, f"{kernels.robot.name}: {package.header}", lines, heads, "}", more=FORMS)
    for template, file in (("driver.cpp", "driver.cpp"), ("standin.hpp", "standin.hpp")):
        driver = environment().get_template(f"cuda/{template}.jinja").render(k=context, p=package)
        (folder / file).write_text(driver, encoding="utf-8", newline="\n")
    run_tool((tool, *FLAGS, *_OPTIONS, "driver.cpp", "-o", "driver"), folder, package.source)
    return _Kernels(Driven(folder, kernels, package.source), _module(folder, kernels))


def _module(folder: Path, kernels: RobotPrograms) -> Any:
    """Returns the Python module beside the kernels, where CuPy and a GPU are to launch them; None elsewhere."""
    try:
        import cupy

        found = cupy.cuda.runtime.getDeviceCount()
    except Exception:  # noqa: BLE001 - no CuPy, or whatever it says of a driver that is missing
        return None
    if not found:
        return None
    name = f"kinegen_{folder.name}_{kernels.robot.name}"
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ProofError(f"{kernels.robot.name}: the Python module beside the kernels cannot be imported")
    for old in [each for each in sys.modules if each.partition(".")[0] == name]:
        del sys.modules[old]
    made = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@dataclass(frozen=True, slots=True)
class _Kernels:
    """Functions of the header and kernels; see `kinegen.verify.runners.runner.Call`."""

    driven: Driven  # What calls them on the processor
    module: Any  # What launches them on a GPU; None where there is none

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel in a process of its own, and on a GPU where there is one, with the same bits."""
        found = self.driven(program, inputs, parameters, real=real, is_batch=is_batch)
        if is_batch and self.module is not None:
            self._require_same(program, inputs, parameters, found)
        return found

    def _require_same(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, wanted: Arrays
    ) -> None:
        """Refuse results of the GPU with other bits than those of the processor."""
        import cupy

        name = program.quantity.function
        given = [cupy.asarray(each) for each in inputs]
        results = getattr(self.module, name)(*given, params=parameters)
        for result, other in zip(results if isinstance(results, tuple) else (results,), wanted, strict=True):
            one = cupy.asnumpy(result).astype(other.dtype)
            if not np.array_equal(one, other, equal_nan=True):
                raise ProofError(f"{self.driven.file}: {name} gives other bits on the GPU; nothing was written")

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays | None:
        """Evaluate a function beside the kernels; none chooses among solutions."""
        return None if name == NEAREST else self.driven.others(name, inputs, real=real)

    def tables(self) -> dict[str, Any]:
        """Returns what the header says of the robot."""
        return self.driven.tables()
