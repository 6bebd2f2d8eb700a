"""Builds that would change nothing, recognised without making them.

A build is decided by the robot file, the options, this program with its libraries, and the tools and the processor of
the machine. When all these are as they were, and the output folder holds what that build left there, the build is not
made again: it would give the same bytes and the same proof. What it told is kept in the user's cache folder. Whatever
is different, missing, damaged or unknown leads to an ordinary build.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import get_type_hints

from kinegen.emit.languages import LANGUAGES
from kinegen.errors import KinegenError
from kinegen.formats.format import READING, YAML_SUFFIXES
from kinegen.formats.load import load
from kinegen.manifest import digests_of
from kinegen.native.cache import Cache
from kinegen.native.compiler import find_compiler
from kinegen.native.identity import identity
from kinegen.records import from_plain, to_plain
from kinegen.results import BuildOptions, BuildResult, Stage
from kinegen.robot.calibrated import calibrated

_TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
"""What the costs of a build depend on."""

_TOLD_ANEW = ("robot", "stages")
"""Fields of a result that are not kept: the robot is in its file, and the stages are not run again."""


def recall(key: str, path: Path, options: BuildOptions) -> BuildResult | None:
    """What an earlier build told, if this one would tell the same and change nothing.

    Args:
        key: What `key_of` says of the build.
        path: The robot file.
        options: What to make.

    Returns:
        The result with every file untouched; its proof has been looked at like that of a new build. None where the
        build has to be made.
    """
    begin = time.perf_counter()
    kept = Cache().load_record(key, _Kept)
    if kept is None:
        return None
    try:
        robot = calibrated(load(path), options.wrt) if options.wrt else load(path)
        hints = get_type_hints(BuildResult)
        told = {name: from_plain(hints[name], value) for name, value in json.loads(kept.told).items()}
        result = BuildResult(robot=robot, stages=(), **told)
        result.proof.require(robot)
    except (KinegenError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        return None  # of another shape, or not accepted
    if result.folder != options.output / robot.name or kept.digests != digests_of(result.folder):
        return None
    written = tuple(replace(entry, status="unchanged") for entry in result.written if entry.status != "removed")
    stage = Stage("compare", time.perf_counter() - begin, "nothing has changed since the last proven build")
    return replace(result, written=written, stages=(stage,))


def remember(key: str, result: BuildResult) -> None:
    """Keep what a build told.

    Args:
        key: What `key_of` said before the build began: the robot file may have been edited since.
        result: What it told.
    """
    if key:
        names = [each.name for each in fields(result) if each.name not in _TOLD_ANEW]
        told = {name: to_plain(getattr(result, name)) for name in names}
        Cache().save_record(key, _Kept(digests_of(result.folder), json.dumps(told)))


@dataclass(frozen=True, slots=True)
class _Kept:
    """A build as it is kept: the SHA-256 of each file of its folder, and what it told, as JSON."""

    digests: dict[str, str]
    told: str


def key_of(path: Path, options: BuildOptions) -> str:
    """A name for all that decides a build.

    Args:
        path: The robot file.
        options: What to make.

    Returns:
        The name; empty where something cannot be found out.
    """
    try:
        text = path.read_bytes()
        # The text is not all where a file includes others.
        robot = "" if path.suffix.lower() in YAML_SUFFIXES else load(path).digest
        compiler = find_compiler() if options.compile else None
    except (OSError, KinegenError):
        return ""
    machine = identity()
    if machine is None:
        return ""
    named = (*_TOOLS, *(tool for name in options.languages for tool in LANGUAGES[name].tools))
    tools = [(tool, shutil.which(tool)) for tool in named]
    # The path of the output is resolved without a complaint about a loop of links, which the build makes.
    output = os.path.realpath(options.output)
    given = READING.get().redundancy
    return Cache().key("build", machine, compiler, tools, text, robot, given, str(path), options, output)
