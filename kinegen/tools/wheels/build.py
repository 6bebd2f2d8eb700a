"""Builds and proves the package of each robot for every processor, and puts it into a wheel (PEP 427).

The same files give the same bytes. The C library that an extension needs follows from the names of symbol versions in
it, as PEP 600 describes for the tags `manylinux_X_Y`: such a wheel runs on every Linux whose C library is at least
glibc X.Y.
"""

from __future__ import annotations

import base64
import hashlib
import io
import re
import sys
import sysconfig
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from kinegen import __version__
from kinegen.backends.bundle import provenance
from kinegen.backends.templates import environment
from kinegen.driver.pipeline import lower_file
from kinegen.driver.results import BuildOptions, BuildResult, Stage
from kinegen.errors import KinegenError, quote
from kinegen.model.outputs import SOLVERS
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import check_output, check_place
from kinegen.support.files.write import write_file
from kinegen.support.naming import EXTENSION, RUNTIME
from kinegen.tools.wheels.selftest import selftest_files
from kinegen.ui.api.building import built

PURE = "py3-none-any"
"""The tag of a wheel that runs everywhere."""

_ABI = "cp310-abi3"
"""Extensions use the stable ABI of CPython 3.10."""

_LIBRARIES = re.compile(rb"\0(lib[\w+.-]+\.so(?:\.\d+)*)(?=\0)")
_VERSIONS = re.compile(rb"\0GLIBC_(\d+)\.(\d+)(?:\.\d+)?(?=\0)")
_PART_OF_GLIBC = (b"libc.so.6", b"libm.so.6", b"libpthread.so.0", b"libdl.so.2", b"librt.so.1", b"libgcc_s.so.1")
"""Libraries that PEP 600 lets a wheel expect on every Linux."""

_OLDEST = {"x86_64": (2, 5), "i686": (2, 5)}
_OLDEST_ELSEWHERE = (2, 17)
"""Before these there are no such tags."""


def platform_tag(extensions: Iterable[bytes]) -> str:
    """Return the tag of a wheel with extensions, `linux_x86_64` if one needs a library that not every system has."""
    system = re.sub(r"[-. ]", "_", sysconfig.get_platform())
    if sys.platform != "linux":
        return f"{_ABI}-{system}"
    needed = [_glibc(content) for content in extensions]
    if any(version is None for version in needed):
        return f"{_ABI}-{system}"
    machine = system.removeprefix("linux_")
    oldest = _OLDEST.get(machine, _OLDEST_ELSEWHERE)
    major, minor = max([oldest, *(version for version in needed if version is not None)])
    return f"{_ABI}-manylinux_{major}_{minor}_{machine}"


def _glibc(content: bytes) -> tuple[int, int] | None:
    """Return the oldest glibc that an extension runs with; None if it needs other libraries than those of glibc."""
    if set(_LIBRARIES.findall(content)) - set(_PART_OF_GLIBC):
        return None
    found = [(int(major), int(minor)) for major, minor in _VERSIONS.findall(content)]
    return max(found) if found else None


_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time of every file: the first that a zip archive can hold."""

_MODE = 0o100644 << 16

_ABOUT = ("RECORD", "WHEEL")
"""Files of the `.dist-info` folder that say which files there are, and what made them."""


def archive(files: Mapping[str, bytes], folder: str) -> bytes:
    """Return the bytes of a wheel with these files; its RECORD, in the `.dist-info` folder, comes last."""
    record = f"{folder}/RECORD"
    listed = _listed(files, record)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, content in (*files.items(), (record, listed)):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.external_attr, info.compress_type = _MODE, zipfile.ZIP_DEFLATED
            info.create_system = 3  # Unix, wherever it is written
            opened.writestr(info, content)
    return buffer.getvalue()


def is_own(path: Path) -> bool:
    """Tell whether kinegen wrote a wheel and nobody changed it: its RECORD has the digests of all its files."""
    try:
        with zipfile.ZipFile(path) as opened:
            files = {name: opened.read(name) for name in opened.namelist()}
    except (OSError, ValueError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error):
        return False
    record, about = (next((each for each in files if each.endswith(f".dist-info/{name}")), "") for name in _ABOUT)
    if not (record and about) or b"\nGenerator: kinegen " not in files[about]:
        return False
    return files.pop(record) == _listed(files, record)


def _listed(files: Mapping[str, bytes], record: str) -> bytes:
    """Return the RECORD of files."""
    lines = [f"{name},sha256={_digest(content)},{len(content)}\n" for name, content in files.items()]
    return "".join([*lines, f"{record},,\n"]).encode()


def _digest(content: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


_SUFFIXES = (".py", ".pyi", ".typed")
_NUMPY, _CFFI = "numpy>=1.24", "cffi>=1.16"
_NAME = r"[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9])?"
"""Names of projects, as package indexes take them."""


@dataclass(frozen=True, slots=True)
class InWheel:
    """A robot in the metadata of a wheel; its name is also that of the package."""

    name: str
    dof: int
    functions: tuple[str, ...]
    provenance: str


@dataclass(frozen=True, slots=True)
class Metadata:
    """Arguments of the template `wheel/METADATA.jinja`."""

    distribution: str
    version: str
    summary: str
    requires: tuple[str, ...]
    robots: tuple[InWheel, ...]


@dataclass(frozen=True, slots=True)
class Wheels:
    """The wheels, that of this system if it was compiled and the one that runs everywhere, and all builds."""

    files: tuple[Path, ...]
    results: tuple[BuildResult, ...]


def make_wheels(
    files: Sequence[Path],
    output: Path,
    options: BuildOptions,
    *,
    bundle: str | None = None,
    report: Callable[[Path, Stage], None] = lambda _file, _stage: None,
) -> Wheels:
    """Build and prove robots, and write them as wheels: one of this system, and one that runs everywhere with NumPy.

    The same robots give the same bytes.

    Args:
        files: Robot files; each becomes an importable package of the robot's name.
        output: Folder of the wheels.
        options: What to make of each; the output folder and the processor are not taken from there, since the kernels
            of a wheel are for every processor of the family. Without `compile` there is only the second wheel.
        bundle: Name of the project on a package index; the robot's own if left out.
        report: Called with the file after each stage of its build.

    Raises:
        KinegenError: If a build fails, a name is wrong, or there is no compiler; nothing was written then.
    """
    if bundle is None and len(files) != 1:
        raise KinegenError(f"{len(files)} robots in one wheel need a name for it: --bundle NAME")
    if bundle is not None and not re.fullmatch(_NAME, bundle):
        raise KinegenError(f"{quote(bundle)} is not a name of a wheel (expected letters, digits, '.', '-' and '_')")
    # Minutes of building come only after the cheap checks.
    check_place(output)
    with tempfile.TemporaryDirectory(prefix="kinegen-wheel-") as work:
        wanted = replace(options, output=Path(work), flags=replace(options.flags, march=None, portable=True))
        results, contents = _built(files, wanted, report)
    if options.compile and any(result.backend != "c" for result in results):
        reason = next(note for result in results for note in (*result.notes, "there is no compiled extension"))
        raise KinegenError(f"{reason.partition(';')[0]}; --no-compile makes the wheel that computes with NumPy")
    kinds = (True, False) if options.compile else (False,)
    made = [_wheel(results, contents, bundle, compiled=compiled) for compiled in kinds]
    # All files are checked before the first one is written.
    for name, _ in made:
        check_output(output / name, files, force=options.force, is_own=is_own)
    for name, content in made:
        write_file(output / name, content)
    return Wheels(tuple(output / name for name, _ in made), results)


def _built(
    files: Sequence[Path], options: BuildOptions, report: Callable[[Path, Stage], None]
) -> tuple[tuple[BuildResult, ...], dict[str, bytes]]:
    """Build each robot in a folder of its own, and collect what goes into a wheel, by path."""
    results: dict[str, BuildResult] = {}
    contents: dict[str, bytes] = {}
    for file in files:
        # Names of packages must differ on file systems without capitals too.
        result = built(file, options, lambda stage, file=file: report(file, stage))  # type: ignore[misc]
        name = result.robot.name
        before = next((other for other in results if other.lower() == name.lower()), None)
        if before is not None:
            called = repr(name) if before == name else f"{before!r} and {name!r}, which differ in capitals alone"
            raise KinegenError(f"two robots are called {called}, and a wheel has one package of a name", str(file))
        results[name] = result
        for path in sorted((*result.folder.iterdir(), *(result.folder / RUNTIME).iterdir())):
            if path.suffix in _SUFFIXES or path.name == EXTENSION:
                contents[f"{name}/{path.relative_to(result.folder).as_posix()}"] = path.read_bytes()
        # The self-test asks for what was built, with the inputs of this file.
        built_for = tuple(each for each in options.quantities if each in result.counts or each in SOLVERS)
        tests = selftest_files(lower_file(file, built_for, options.wrt), options.reals)
        contents |= {f"{name}/{each}": text.encode() for each, text in tests.items()}
    return tuple(results.values()), contents


def _wheel(
    results: Sequence[BuildResult], contents: Mapping[str, bytes], bundle: str | None, *, compiled: bool
) -> tuple[str, bytes]:
    """Return the name and the bytes of one wheel."""
    robots = [result.robot for result in results]
    distribution = bundle or robots[0].name
    version = _version(robots)
    stem = f"{re.sub(r'[-_.]+', '_', distribution).lower()}-{version}"
    # The wheel that runs everywhere has no extension.
    files = {name: each for name, each in contents.items() if compiled or not name.endswith(EXTENSION)}
    tag = platform_tag(each for name, each in files.items() if name.endswith(EXTENSION)) if compiled else PURE
    metadata = Metadata(
        distribution=distribution,
        version=version,
        summary=f"Kinematics of {', '.join(_title(robot) for robot in robots)}",
        requires=(_NUMPY, _CFFI) if compiled else (_NUMPY,),
        robots=tuple(
            InWheel(
                robot.name,
                robot.dof,
                tuple(quantity.function for quantity in result.counts),
                provenance(robot),
            )
            for robot, result in zip(robots, results, strict=True)
        ),
    )
    templates = environment()
    info = f"{stem}.dist-info"
    about = {
        "METADATA": templates.get_template("wheel/METADATA.jinja").render(m=metadata),
        "WHEEL": templates.get_template("wheel/WHEEL.jinja").render(version=__version__, pure=not compiled, tag=tag),
        "LICENSE": templates.get_template("packages/LICENSE.jinja").render(),
        "top_level.txt": "".join(f"{robot.name}\n" for robot in robots),
    }
    files |= {f"{info}/{name}": text.encode() for name, text in about.items()}
    return f"{stem}-{tag}.whl", archive(files, info)


def _version(robots: Sequence[Robot]) -> str:
    """Return the version of the robots if they share one, else one made of all digests."""
    versions = {robot.release for robot in robots}
    if len(versions) == 1:
        return versions.pop()
    digest = hashlib.sha256("".join(robot.digest for robot in robots).encode()).hexdigest()
    return f"0.{int(digest[:6], 16)}.0"


def _title(robot: Robot) -> str:
    """Return the first line of a robot's description, or its name."""
    lines = robot.description.strip().splitlines()
    return lines[0] if lines else robot.name
