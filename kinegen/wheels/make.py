"""From robots to wheels: build and prove each package for every processor, then put it into an archive."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kinegen import __version__
from kinegen.api.building import built
from kinegen.emit.environment import environment
from kinegen.emit.kernels import provenance
from kinegen.errors import KinegenError, quote
from kinegen.naming import EXTENSION
from kinegen.pipeline import lower_file
from kinegen.results import BuildOptions, BuildResult, Stage
from kinegen.robot.model import Robot
from kinegen.wheels.archive import archive
from kinegen.wheels.platform import PURE, platform_tag
from kinegen.wheels.selftest import selftest_files
from kinegen.write import write_file

_SUFFIXES = (".py", ".pyi", ".typed")
_NUMPY, _CFFI = "numpy>=1.24", "cffi>=1.16"
_NAME = r"[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9])?"
"""Names of projects, as package indexes take them."""


@dataclass(frozen=True, slots=True)
class InWheel:
    """A robot in the metadata of a wheel.

    Attributes:
        name: Its name, also that of the package.
        dof: Number of joint variables.
        functions: Functions of the package.
        provenance: What made it of what.
    """

    name: str
    dof: int
    functions: tuple[str, ...]
    provenance: str


@dataclass(frozen=True, slots=True)
class Metadata:
    """What the template `wheel/METADATA.jinja` is given."""

    distribution: str
    version: str
    summary: str
    requires: tuple[str, ...]
    robots: tuple[InWheel, ...]


@dataclass(frozen=True, slots=True)
class Wheels:
    """What was made.

    Attributes:
        files: The wheels: that of this system, if it was compiled, and the one that runs everywhere.
        results: The build of each robot.
    """

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

    Args:
        files: Robot files; each becomes an importable package of the robot's name.
        output: Folder of the wheels.
        options: What to make of each; the output folder and the processor are not taken from there, since the kernels
            of a wheel are for every processor of the family. Without `compile` there is only the second wheel.
        bundle: Name of the project on a package index; the robot's own if left out.
        report: Called with the file after each stage of its build.

    Returns:
        The wheels and the builds. The same robots give the same bytes.

    Raises:
        KinegenError: If a build fails, a name is wrong, or there is no compiler; nothing was written then.
    """
    if bundle is None and len(files) != 1:
        raise KinegenError(f"{len(files)} robots in one wheel need a name for it: --bundle NAME")
    if bundle is not None and not re.fullmatch(_NAME, bundle):
        raise KinegenError(f"{quote(bundle)} is not a name of a wheel (expected letters, digits, '.', '-' and '_')")
    with tempfile.TemporaryDirectory(prefix="kinegen-wheel-") as work:
        wanted = replace(options, output=Path(work), flags=replace(options.flags, march=None, portable=True))
        results, contents = _built(files, wanted, report)
    if options.compile and any(result.backend != "c" for result in results):
        reason = next(note for result in results for note in (*result.notes, "there is no compiled extension"))
        raise KinegenError(f"{reason.partition(';')[0]}; --no-compile makes the wheel that computes with NumPy")
    kinds = (True, False) if options.compile else (False,)
    made = [_wheel(results, contents, bundle, compiled=compiled) for compiled in kinds]
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
        result = built(file, options, lambda stage, file=file: report(file, stage))  # type: ignore[misc]
        name = result.robot.name
        if name in results:
            raise KinegenError(f"two robots are called {name!r}, and a wheel has one package of a name", str(file))
        results[name] = result
        for path in sorted(result.folder.iterdir()):
            if path.suffix in _SUFFIXES or path.name == EXTENSION:
                contents[f"{name}/{path.name}"] = path.read_bytes()
        tests = selftest_files(lower_file(file, options.quantities, options.wrt), options.reals)
        contents |= {f"{name}/{each}": text.encode() for each, text in tests.items()}
    return tuple(results.values()), contents


def _wheel(
    results: Sequence[BuildResult], contents: Mapping[str, bytes], bundle: str | None, *, compiled: bool
) -> tuple[str, bytes]:
    """The name and the bytes of one wheel."""
    robots = [result.robot for result in results]
    distribution = bundle or robots[0].name
    version = _version(robots)
    stem = f"{re.sub(r'[-_.]+', '_', distribution).lower()}-{version}"
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
    """The version of the robots if they share one, else one made of all digests."""
    versions = {robot.release for robot in robots}
    if len(versions) == 1:
        return versions.pop()
    digest = hashlib.sha256("".join(robot.digest for robot in robots).encode()).hexdigest()
    return f"0.{int(digest[:6], 16)}.0"


def _title(robot: Robot) -> str:
    """The first line of a robot's description, or its name."""
    lines = robot.description.strip().splitlines()
    return lines[0] if lines else robot.name
