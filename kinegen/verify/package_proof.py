"""Proves the files of a build before they are written, and checks that what is written is what was proven.

Numbers are compared with the reference before. Declarations of types, descriptions of packages, what tests accept,
comments and build files are no numbers: that they are right is a matter of the templates, which the tests and
`generated/` hold; that a build has them as they are is seen here. A text that depends on anything but the programs,
such as the order of a set or what was printed before, is found as well.

The proof of a package takes longer than everything else in a build that changes nothing, and would give the same
numbers. What is remembered is in the user's cache folder, and is accepted on the same terms as a new proof; a damaged
or missing entry, or one of another shape, is proved again.

What these files do is tested where they lie, in `runtime/vendored/`; so a proof of kernels need not try again how they
are called, and one of other bytes would prove nothing.
"""

from __future__ import annotations

import hashlib
import tempfile
import warnings
from collections.abc import Mapping
from contextlib import nullcontext
from functools import partial
from importlib import resources
from pathlib import Path, PurePosixPath

from kinegen.backends.python.vendored import BANNER
from kinegen.errors import CompileError, ProofError, WriteError
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.runtime.cache import Cache
from kinegen.runtime.extension import lay_out, load_package
from kinegen.runtime.toolchain_fingerprint import identity
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import EXTENSION, RUNTIME
from kinegen.support.system import runs_programs
from kinegen.verify.files import compiled_probes, require_files
from kinegen.verify.isolation import guarded, isolated
from kinegen.verify.proof import prove
from kinegen.verify.records import Proof

_LENGTH = 60
"""Characters of a line that a message shows."""


def require_printed(robot: Robot, found: Mapping[str, str | bytes], again: Mapping[str, str | bytes]) -> None:
    """Compare files with what the emitters print.

    Args:
        found: Text of the files by path, as it was proven.
        again: The same files, printed once more.

    Raises:
        ProofError: Naming the first file that differs, with its line.
    """
    for name in sorted(found.keys() | again.keys()):
        if name not in found or name not in again:
            state = "is missing" if name in again else "is not one that kinegen prints"
            raise ProofError(f"{robot.name}: {name} {state}; nothing was written")
        if found[name] != again[name]:
            line, text = _first_difference(str(found[name]), str(again[name]))
            reason = f"line {line} of {name} is not what kinegen prints there: '{text}'"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _first_difference(found: str, again: str) -> tuple[int, str]:
    """Returns where two texts part: the number of the line, and what the first one has there."""
    lines, others = found.split("\n"), again.split("\n")
    place = next((at for at, (one, other) in enumerate(zip(lines, others)) if one != other), len(others))
    text = lines[place].strip() if place < len(lines) else ""
    return place + 1, text if len(text) <= _LENGTH else f"{text[:_LENGTH]}..."


def require_proven(robot: Robot, project: Mapping[str, str], proven: Mapping[str, str]) -> None:
    """Compare the C files of a firmware package with those that were proven.

    Raises:
        ProofError: If one differs, or a kernel is missing.
    """
    found = {PurePosixPath(path).name: text for path, text in project.items() if path.endswith((".c", ".h"))}
    for name, text in proven.items():
        if name.endswith((".c", ".h")) and not name.endswith(("_batch.c", "_batch.h")) and found.get(name) != text:
            state = "differs from the one that was verified" if name in found else "is missing"
            raise ProofError(f"{robot.name}: {name} of the package {state}; nothing was written")


def require_written(folder: Path, contents: Mapping[str, str | bytes]) -> None:
    """Read back what was written.

    Args:
        folder: The output folder.
        contents: What was to be written, by path below it.

    Raises:
        WriteError: If a file holds something else.
    """
    for name, content in contents.items():
        path = folder / name
        if path.read_bytes() != (content.encode() if isinstance(content, str) else content):
            raise WriteError(f"{path} does not hold what was written to it; build again")


def require_shared_files(robot: Robot, folder: Path) -> None:
    """Compare the vendored modules of a package with the installed ones, byte by byte.

    Raises `ProofError` naming a file that differs, or that does not come with kinegen.
    """
    installed = resources.files("kinegen.runtime.vendored")
    for path in sorted((folder / RUNTIME).iterdir()):
        source = installed.joinpath(path.name)
        if not source.is_file() or path.read_bytes() != BANNER.encode() + source.read_bytes():
            reason = f"{RUNTIME}/{path.name} is not the file of this name that comes with kinegen"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def prove_package(
    robot: Robot, contents: Mapping[str, str | bytes], quantities: tuple[Quantity, ...], reals: tuple[str, ...]
) -> tuple[Proof, str]:
    """Import a package from a staging folder and hold it against the reference.

    Returns the proof, which holds, and the backend that was proven. Raises `CompileError` if there is a compiled
    module, and it does not load here, or a C file does not compile; `ProofError` if the proof does not hold, or another
    file says something else.
    """
    with tempfile.TemporaryDirectory(prefix="kinegen-") as staging:
        folder = Path(staging) / robot.name
        lay_out(folder, contents)
        require_shared_files(robot, folder)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            package = load_package(folder)
        if EXTENSION in contents and package.backend != "c":
            reason = "; ".join(str(warning.message) for warning in caught)
            if not runs_programs(folder):
                reason += "; programs in the folder of temporary files are not run: set TMPDIR to another one"
            raise CompileError(f"{robot.name}: the compiled module cannot be verified on this machine: {reason}")
        watch = guarded(robot.name, package) if package.backend == "c" else nullcontext()
        with compiled_probes(robot, package, folder, quantities, reals) as probes, watch:
            proof = prove(robot, package, quantities, reals)
            proof.require(robot)
            require_files(robot, package, folder, quantities, probes, reals)
        return proof, str(package.backend)


def cached_proof(
    robot: Robot, contents: Mapping[str, str | bytes], quantities: tuple[Quantity, ...], reals: tuple[str, ...]
) -> tuple[Proof, str, bool]:
    """Returns the proof of a package, made now or before.

    Returns:
        The proof, which holds, the backend that was proven, and whether it was made before.

    Raises:
        CompileError: If there is a compiled module, and it does not load here.
        ProofError: If the proof does not hold.
    """
    store, checks = Cache(), identity()
    key = "" if checks is None else store.key("proof", checks, robot, quantities, reals, _digests(contents))
    known = store.load_record(key, _Kept)
    if known is not None and _is_accepted(known.proof, robot):
        return known.proof, known.backend, True
    work = partial(prove_package, robot, contents, quantities, reals)
    proof, backend = isolated(robot.name, work) if EXTENSION in contents else work()
    if checks is not None:
        store.save_record(key, _Kept(proof, backend))
    return proof, backend, False


@dataclass(frozen=True, slots=True)
class _Kept:
    """A proof as it is kept, with the backend that was proven."""

    proof: Proof
    backend: str


def _is_accepted(proof: Proof, robot: Robot) -> bool:
    """Returns whether a proof that was kept would be accepted if it was made now; one of nothing would not."""
    try:
        proof.require(robot)
    except ProofError:
        return False
    return bool(proof.comparisons)


def _digests(contents: Mapping[str, str | bytes]) -> list[tuple[str, str]]:
    return [
        (name, hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest())
        for name, content in sorted(contents.items())
    ]
