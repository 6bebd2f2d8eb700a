"""Builds with altered text: the build of the product, in which the emitted files are exchanged."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import pytest

from kinegen.backends.files import Emitted, stamp_of
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver import artifacts
from kinegen.driver import pipeline as builds
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions, Stage
from kinegen.runtime.flags import Flags
from kinegen.ui.cli import main
from kinegen.verify import compare, fixed_point, package_proof, tolerances
from tests.sabotage.case import Sabotage, Setting
from tests.sabotage.expected import expect, spread

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (ROOT / "robots", Path(__file__).parent / "robots", ROOT / "tests" / "inverse" / "robots")

PRINTED = "is not what kinegen prints"
"""In the message about text that is not what its emitter prints."""

FOREIGN = "is not the file of this name"
"""In the message about array handling that is not the installed one."""

QUICK = Flags(march=None, contraction=False, optimisation="1")
"""How kernels are compiled where it does not matter."""


def attempt(setting: Setting, output: Path, case: Sabotage | None = None) -> None:
    """Build a robot, with an alteration or without one.

    Args:
        setting: What is built.
        output: Where to.
        case: The alteration.

    Raises:
        KinegenError: If the build refuses.
        AssertionError: If no file was altered.
    """
    made, stages = _made(setting), list[Stage]()
    touched: list[str] = []

    def alter(files: Mapping[str, str]) -> dict[str, str]:
        found = dict(files) if case is None else case.applied(files)
        touched.extend(name for name, text in found.items() if text is not files[name])
        return found

    try:
        with _emitting(made, alter, case):
            build(made.path, replace(made.options, output=output), stages.append)
    finally:
        assert case is None or touched, f"{case.name}: no emitted file is called {case.file}"


@contextmanager
def _emitting(
    made: _Made, alter: Callable[[Mapping[str, str]], dict[str, str]], case: Sabotage | None
) -> Iterator[None]:
    """Let the build find its text made before, and altered.

    Untouched kernels are called in this process, so that altered ones, each in a process of its own, find what the
    reference says of them. Array handling that is not the installed one is refused by its bytes alone, and so is text
    that is printed otherwise a second time; cases that do not expect these messages are tried without them, so that the
    proof has to find what they do wrong.
    """
    project, language, done = artifacts.emit_project, artifacts.emit_languages, set[str]()

    def once(kind: str, files: Mapping[str, str]) -> dict[str, str]:
        """What is printed first is altered, and what it is compared with is not."""
        is_first, _ = kind not in done, done.add(kind)
        return alter(files) if is_first else dict(files)

    def files(*_: object) -> Emitted:
        return restamped(made.emitted, once("files", made.emitted.files))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(builds, "_programs", lambda *_: made.programs)
        patch.setattr(builds, "bundle_of", lambda *_, **__: made.bundle)
        patch.setattr(artifacts, "emit_files", files)
        patch.setattr(artifacts, "emit_integers", lambda *_: once("integers", made.integers))
        patch.setattr(artifacts, "emit_project", lambda *given: once("project", project(*given)))
        patch.setattr(artifacts, "emit_languages", lambda *given: once("languages", language(*given)))
        patch.setattr(builds, "can_measure", lambda: False)
        patch.setattr(compare, "expect", expect)
        patch.setattr(tolerances, "_spread", spread)
        if case is None or FOREIGN not in case.message:
            patch.setattr(package_proof, "require_shared_files", lambda *_: None)
        if case is not None and PRINTED not in case.message:
            patch.setattr(builds, "require_printed", lambda *_: None)
        if case is None:
            patch.setattr(package_proof, "isolated", lambda _owner, work: work())
            patch.setattr(fixed_point, "isolated", lambda _owner, work: work())
        yield


def restamped(emitted: Emitted, files: Mapping[str, str]) -> Emitted:
    """The files as an emitter would have made them: with the digest of their sources."""
    sources = {name: files[name] for name in emitted.sources}
    stamp = stamp_of(sources)
    return Emitted(sources, {name: text.replace(emitted.stamp, stamp) for name, text in files.items()}, stamp)


@dataclass(frozen=True)
class _Made:
    """What all attempts at one setting share, each part made when it is first asked for."""

    path: Path
    options: BuildOptions

    @cached_property
    def programs(self) -> Any:
        clock = builds.Clock(self.path, lambda _: None)
        robot = builds._load(self.path, self.options.wrt)
        return builds._programs(robot, self.options.quantities, clock, builds.plain_count)

    @cached_property
    def bundle(self) -> artifacts.ProgramBundle:
        return artifacts.bundle_of(self.programs[0], integers=self.options.integers)

    @cached_property
    def emitted(self) -> Emitted:
        return artifacts.emit_files(self.programs[0], self.options.reals, self.bundle.vectors)

    @cached_property
    def integers(self) -> Mapping[str, str]:
        assert self.bundle.integers
        return artifacts.emit_integers(self.programs[0], self.bundle.integers)

    def make_all(self) -> None:
        """Make every part now, before anything is exchanged."""
        assert self.emitted
        assert not self.options.integers or self.integers


@cache
def _made(setting: Setting) -> _Made:
    made = _Made(_robot_file(setting.robot), options_of(setting))
    made.make_all()
    return made


def _robot_file(stem: str) -> Path:
    return next(path for folder in FOLDERS if (path := folder / f"{stem}.yaml").exists())


def options_of(setting: Setting) -> BuildOptions:
    """The options of a build, as `kinegen build` reads them."""
    found: list[BuildOptions] = []

    def take(_files: object, options: BuildOptions, **_: object) -> int:
        found.append(options)
        return 0

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kinegen.ui.cli.build._build_all", take)
        words = ("--outputs", setting.outputs, "--real", setting.real, *setting.options)
        assert main(["build", str(_robot_file(setting.robot)), *words]) == 0
    (options,) = found
    assert set(options.reals) <= set(ScalarType)
    return replace(options, flags=QUICK) if options.flags == Flags() else options
