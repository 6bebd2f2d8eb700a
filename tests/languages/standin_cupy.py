"""A stand-in of the part of CuPy's interface that emitted modules use: kernels are compiled by g++ and run here.

No GPU takes part. Arrays are NumPy's, said to be on device 0; `RawModule` compiles the text beside stand-ins of CUDA's
words, and a launch calls it. What this shows is how modules call CuPy, and that they pass what kernels take.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from kinegen.backends.templates import environment


class Stood(np.ndarray):  # type: ignore[type-arg]
    """An array that says it is on a GPU."""

    def __dlpack_device__(self) -> Any:
        """The first CUDA device."""
        return (2, 0)


class Tensor:
    """An array of another library, which has nothing but DLPack and a stream."""

    def __init__(self, array: Any) -> None:
        self.array = array

    def __dlpack_device__(self) -> Any:
        """The first CUDA device."""
        return (2, 0)


def _names(arguments: str) -> str:
    return ", ".join(each.split()[-1] for each in arguments.split(", "))


def _compiled(place: Path, code: str, options: tuple[str, ...]) -> Any:
    """The kernels that options choose, as a library."""
    (place / "standin.hpp").write_text(environment().get_template("cuda/standin.hpp.jinja").render())
    chosen = [option.partition("_WITH_")[2] for option in options if "_WITH_" in option]
    kernels = re.findall(r'extern "C" __global__ void __launch_bounds__\(\d+, 1\) (\w+)\((.*)\)\n', code)
    calls = [
        f'extern "C" void call_{name}(unsigned blocks, unsigned threads, {arguments})\n'
        f"{{ standin::launch(blocks, threads, [=] {{ {name}({_names(arguments)}); }}); }}\n"
        for name, arguments in kernels
        if any(re.search(rf"_{output}_(rows|joint_major)", name) for output in chosen)
    ]
    text = f'#include "standin.hpp"\n{code}\n{"".join(calls)}'
    (place / "kernels.cpp").write_text(text)
    defined = [option for option in options if option.startswith("-D")]
    command = [
        "g++",
        "-std=c++17",
        "-O0",
        "-ffp-contract=off",
        "-shared",
        "-fPIC",
        *defined,
        "kernels.cpp",
        "-o",
        "k.so",
    ]
    subprocess.run(command, cwd=place, check=True)
    return ctypes.CDLL(str(place / "k.so"))


class Module:
    """`cupy.RawModule`."""

    def __init__(self, log: list[Any], code: str, options: tuple[str, ...]) -> None:
        log.append(options)
        self.log = log
        with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
            self.library = _compiled(Path(name), code, options)

    def get_function(self, name: str) -> Any:
        """A kernel."""
        found = getattr(self.library, f"call_{name}")

        def launch(grid: tuple[int], block: tuple[int], arguments: tuple[Any, ...]) -> None:
            self.log.append((name, grid, block))
            numbers = [
                ctypes.c_void_p(each.ctypes.data) if isinstance(each, np.ndarray) else ctypes.c_longlong(int(each))
                for each in arguments
            ]
            found(ctypes.c_uint(grid[0]), ctypes.c_uint(block[0]), *numbers)

        return launch


def stand_in() -> Any:
    """A module to be put in place of CuPy; its `log` has options, launches and streams, in order."""
    module: Any = ModuleType("cupy")
    module.log = []
    module.ndarray = Stood
    module.empty = lambda shape, dtype: np.full(shape, 7).astype(dtype).view(Stood)
    module.asarray = lambda values, dtype=None: np.asarray(values, dtype).view(Stood)
    module.asnumpy = np.asarray
    module.ascontiguousarray = lambda array, dtype=None: np.ascontiguousarray(array, dtype).view(Stood)
    module.from_dlpack = lambda tensor: tensor.array.view(Stood)
    module.RawModule = lambda code, options: Module(module.log, code, options)

    def on(name: str) -> Any:
        module.log.append(name)
        return nullcontext()

    module.cuda = SimpleNamespace(
        Device=lambda number: on(f"device {number}"),
        ExternalStream=lambda pointer: on(f"pointer {pointer}"),
        Stream=SimpleNamespace(
            null=nullcontext(),
            from_external=lambda stream: on("stream {1}, version {0}".format(*stream.__cuda_stream__())),
        ),
        runtime=SimpleNamespace(getDeviceCount=lambda: 1),
    )
    return module
