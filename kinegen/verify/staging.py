"""The proof of files that are not written yet: a package imported from a folder that nobody else sees."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path

from kinegen.errors import CompileError
from kinegen.naming import EXTENSION
from kinegen.native.package import load_package
from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Proof
from kinegen.verify.files import compiled_probes, require_files
from kinegen.verify.proof import prove


def prove_package(
    robot: Robot, contents: Mapping[str, str | bytes], quantities: tuple[Quantity, ...], reals: tuple[str, ...]
) -> tuple[Proof, str]:
    """Import a package from a staging folder and hold it against the reference.

    Args:
        robot: The robot.
        contents: The files of its package, by name.
        quantities: The quantities it was built for.
        reals: Its number types, `double` and `float`.

    Returns:
        The proof, which holds, and the backend that was proven.

    Raises:
        CompileError: If there is a compiled module, and it does not load here, or a C file does not compile.
        ProofError: If the proof does not hold, or another file says something else.
    """
    with tempfile.TemporaryDirectory(prefix="kinegen-") as staging:
        folder = Path(staging) / robot.name
        folder.mkdir()
        for name, content in contents.items():
            (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            package = load_package(folder)
        if EXTENSION in contents and package.backend != "c":
            reason = "; ".join(str(warning.message) for warning in caught)
            raise CompileError(f"{robot.name}: the compiled module cannot be proven on this machine: {reason}")
        with compiled_probes(robot, package, folder, quantities, reals) as probes:
            proof = prove(robot, package, quantities, reals)
            proof.require(robot)
            require_files(robot, package, folder, quantities, probes, reals)
        return proof, str(package.backend)
