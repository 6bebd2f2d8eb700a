"""A robot's compiled extension from its emitted files, and its package as a module."""

from __future__ import annotations

import importlib.util
import itertools
import re
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.files import stamp_of
from kinegen.backends.inverse import NEAREST_FUNCTION, inverse_of, nearest_signature
from kinegen.backends.scalar_types import ScalarType
from kinegen.runtime.cffi_interface import Function, Interface, declarations, glue
from kinegen.runtime.cffi_solvers import solver_declarations, solver_glue
from kinegen.runtime.compile import Extension, compile_extension
from kinegen.runtime.dispatch import dispatch, units
from kinegen.runtime.flags import Flags
from kinegen.support.naming import EXTENSION

_numbers = itertools.count()


def interface_of(kernels: RobotPrograms, reals: tuple[ScalarType, ...]) -> Interface:
    """What the extension of a robot offers.

    Args:
        kernels: The robot and its programs.
        reals: Number types.
    """
    robot = kernels.robot
    functions = [
        Function(program.quantity.function, program.signature.inputs, program.signature.results)
        for program in kernels.programs
    ]
    inverse = inverse_of(kernels)
    if inverse is not None:
        functions.append(Function(NEAREST_FUNCTION, *nearest_signature(inverse[0].signature), returns_last=True))
    return Interface(
        symbol=robot.name,
        functions=tuple(functions),
        reals=tuple(real.value for real in reals),
        parameters=tuple(parameter.name for parameter in robot.runtime_parameters),
        numeric_inverse=kernels.numeric_inverse,
        complete_inverse=kernels.complete_inverse,
        tips=len(robot.tips) if robot.is_tree else 0,
        redundancy_range=kernels.redundancy_range,
        inverse_tracker=kernels.inverse_tracker,
        redundancy=inverse[1].redundancy if inverse else "",
    )


def build_extension(
    interface: Interface, sources: Mapping[str, str], flags: Flags | None = None, cache: Path | None = None
) -> Extension:
    """Compile the extension of a robot.

    Args:
        interface: What its kernels offer.
        sources: The same files that the package's stamp was taken of.
        flags: How to compile; by default for this processor.
        cache: Folder in which compiled extensions are kept; by default the user's cache folder.

    Returns:
        The extension, to be written as `_native.abi3.so` beside the package's `__init__.py`.

    Raises:
        CompileError: If there is no compiler, or if it refuses a file.
    """
    flags = flags or Flags()
    kernels = {**sources, **dispatch(interface, flags), **solver_glue(interface)}
    more = solver_declarations(interface)
    return compile_extension(
        {**kernels, **glue(interface, stamp_of(sources), more)},
        units(interface, tuple(kernels), flags),
        declarations(interface) + "".join(f"{line}\n" for line in more),
        f"{interface.symbol}._native",
        place=flags.place,
        cache=cache,
    )


def lay_out(folder: Path, contents: Mapping[str, str | bytes]) -> None:
    """Write the files of a package to a new folder.

    Args:
        folder: The package folder.
        contents: Content by path below the folder.
    """
    for name, content in contents.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def load_package(folder: Path) -> ModuleType:
    """Import a package from where it lies, as a module of its own each time, whatever else bears its name.

    Args:
        folder: The package folder.

    Returns:
        The module; it stays importable by its private name, so its kernels can be pickled in this process.
    """
    name = f"_kinegen_{folder.name}_{next(_numbers)}"
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} is not a package")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with warnings.catch_warnings():
            # Whoever builds without a compiler is told so by the build.
            warnings.filterwarnings("ignore", f"NumPy evaluates .*there is no {re.escape(EXTENSION)}", RuntimeWarning)
            spec.loader.exec_module(module)
    except BaseException:
        for loaded in [other for other in sys.modules if other == name or other.startswith(f"{name}.")]:
            del sys.modules[loaded]
        raise
    return module


def runnable_variants(package: ModuleType) -> tuple[str, ...]:
    """The variants of a portable package's batch kernels that this processor can run.

    Args:
        package: An imported package.

    Returns:
        Their names, plainest first; the last one is in use afterwards. None where there is only one form.
    """
    native = getattr(package, "_native", None)
    names = [variant.name for variant in Flags(portable=True).variants]
    if native is None or native.ffi.string(native.lib.kinegen_variant()).decode().partition(",")[0] not in names:
        return ()
    return tuple(name for name in names if select_variant(package, name))


def select_variant(package: ModuleType, name: str) -> bool:
    """Use a variant from now on, for all who imported this very extension.

    Args:
        package: An imported portable package.
        name: Name of the variant.

    Returns:
        Whether there is such a variant and this processor can run it; otherwise nothing changes.
    """
    native = getattr(package, "_native", None)
    return native is not None and bool(native.lib.kinegen_select(name.encode()))
