"""The Arduino library, held against the library specification 1.5 (revision 2.2), and its sketches."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import Q30
from tests.packages.packages import (
    INTEGERS,
    ROBOTS,
    STUBS,
    example_pose,
    is_semantic_version,
    last_rows,
    need,
    project,
    run,
    write_package,
)

# https://docs.arduino.cc/arduino-cli/library-specification
REQUIRED = ("name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures")
OPTIONAL = ("depends", "dot_a_linkage", "includes", "precompiled", "ldflags")
CATEGORIES = (
    "Display",
    "Communication",
    "Signal Input/Output",
    "Sensors",
    "Device Control",
    "Timing",
    "Data Storage",
    "Data Processing",
    "Other",
)
NAME = re.compile(r"(?=.*[A-Za-z])[A-Za-z0-9][A-Za-z0-9 _.-]{0,62}")
FOLDER = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,62}")
ARCHITECTURE = re.compile(r"\*|[a-z0-9_]+")
TOKENS = ("KEYWORD1", "KEYWORD2", "KEYWORD3", "LITERAL1", "LITERAL2")


def properties(text: str) -> dict[str, str]:
    """The fields of a `library.properties`; each stands once, on a line of its own."""
    fields = [line.partition("=") for line in text.splitlines() if line and not line.startswith("#")]
    assert all(sign for _, sign, _ in fields)
    assert len({name for name, _, _ in fields}) == len(fields)
    return {name: value for name, _, value in fields}


def defects(files: Mapping[str, str], folder: str) -> list[str]:
    """What the specification would not accept of a library."""
    fields = properties(files["library.properties"])
    headers = {path for path in files if re.fullmatch(r"src/[^/]+\.h", path)}
    rules = {
        "every required field": all(fields.get(name) for name in REQUIRED),
        "no unknown field": set(fields) <= {*REQUIRED, *OPTIONAL},
        "name": NAME.fullmatch(fields["name"]) and not fields["name"].lower().startswith("arduino"),
        "folder": FOLDER.fullmatch(folder),
        "version": is_semantic_version(fields["version"]),
        "maintainer": not fields["maintainer"].lower().startswith("arduino"),
        "category": fields["category"] in CATEGORIES,
        "url": re.fullmatch(r"https?://[^/\s]+/\S*", fields["url"]),
        "architectures": all(ARCHITECTURE.fullmatch(part) for part in fields["architectures"].split(",")),
        "includes": all(f"src/{name}" in headers for name in fields["includes"].split(",")),
        "dot_a_linkage": fields["dot_a_linkage"] in ("true", "false"),
        "no source beside src": not any(re.fullmatch(r"[^/]+\.(c|cpp|h|ino)|utility/.*", path) for path in files),
        "sketches bear the names of their folders": all(
            path.split("/")[-1] == f"{path.split('/')[-2]}.ino" for path in files if path.startswith("examples/")
        ),
        "a licence": "LICENSE" in files,
    }
    return [rule for rule, kept in rules.items() if not kept]


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), (ScalarType.DOUBLE, ScalarType.FLOAT), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_library_keeps_the_specification(robot: str, reals: tuple[str, ...]) -> None:
    assert defects(project(robot, Ecosystem.ARDUINO, reals), robot) == []


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("name=puma560", "name=_puma560", "name"),
        ("name=puma560", "name=Arduino_arm", "name"),
        ("version=0.", "version=1.1c.", "version"),
        ("category=Data Processing", "category=Robots", "category"),
        ("url=https://example.com/", "url=nowhere", "url"),
        ("includes=puma560_f32.h", "includes=puma560.h", "includes"),
        ("author=kinegen\n", "", "every required field"),
    ],
)
def test_a_library_that_breaks_a_rule_is_noticed(old: str, new: str, rule: str) -> None:
    files = dict(project("puma560", Ecosystem.ARDUINO))
    files["library.properties"] = files["library.properties"].replace(old, new, 1)

    assert defects(files, "puma560") == [rule]


def test_the_double_kernels_are_not_offered_to_boards_that_lack_a_double() -> None:
    both = properties(
        project("puma560", Ecosystem.ARDUINO, (ScalarType.DOUBLE, ScalarType.FLOAT))["library.properties"]
    )
    single = properties(project("puma560", Ecosystem.ARDUINO)["library.properties"])

    assert "avr" not in both["architectures"].split(",")
    assert single["architectures"] == "*"


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ROBOTS)
def test_keywords_are_words_of_the_headers_parted_by_one_tab(robot: str, reals: tuple[str, ...]) -> None:
    files = project(robot, Ecosystem.ARDUINO, reals)
    lines = [line for line in files["keywords.txt"].splitlines() if line and not line.startswith("#")]
    header = "".join(text for path, text in files.items() if re.fullmatch(r"src/[^/]+\.h", path))

    assert lines
    for line in lines:
        word, token = line.split("\t")
        assert token in TOKENS
        assert re.search(rf"\b{word}\b", header)
    assert len(lines) == len(set(lines))


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("sketch", ["Pose", "SelfTest"])
def test_the_sketches_run(robot: str, sketch: str, reals: tuple[str, ...], tmp_path: Path) -> None:
    """As the IDE builds them: all below src as C, only src on the path, the sketch as C++ with Arduino.h before it."""
    need("gcc", "g++")
    library = write_package(tmp_path, robot, Ecosystem.ARDUINO, reals)
    objects = []
    for source in sorted((library / "src").rglob("*.c")):
        objects.append(tmp_path / f"{source.stem}.o")
        run(
            [
                "gcc",
                "-std=gnu11",
                "-Os",
                "-Wall",
                "-Wextra",
                "-Werror",
                f"-I{library / 'src'}",
                "-c",
                source,
                "-o",
                objects[-1],
            ],
            library,
        )
    ino = library / "examples" / sketch / f"{sketch}.ino"
    flags = ["-std=gnu++11", "-Os", "-Wall", "-Werror", f"-I{STUBS}", f"-I{library / 'src'}", "-include", "Arduino.h"]
    run(["g++", *flags, "-x", "c++", ino, "-x", "none", *objects, "-o", tmp_path / "sketch"], library)

    told = run([tmp_path / "sketch"], tmp_path)

    if sketch == "Pose":
        np.testing.assert_allclose(last_rows(told), example_pose(robot, ino.read_text()), atol=2e-4)
    else:
        passes = r": largest difference [\d.]+% of the tolerance, passed\n"
        sincos = f"{robot}_f32_selftest_sincos{passes}" if re.search("_sincos\\(", ino.read_text()) else ""
        assert sincos or robot not in ("puma560", "ur5", "hand") or ScalarType.FLOAT not in reals
        floats = f"{robot}_f32_selftest{passes}{sincos}" if ScalarType.FLOAT in reals else ""
        counted = r": largest difference \d+, tolerance \d+, passed\n"
        integers = f"{robot}_q30_selftest{counted}" if Q30 in reals else ""
        assert re.fullmatch(rf"({floats}{integers}){{2}}", told)


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), *INTEGERS], ids="-".join)
def test_the_library_compiles_for_an_avr(reals: tuple[str, ...], tmp_path: Path) -> None:
    need("avr-gcc")
    library = write_package(tmp_path, "puma560", Ecosystem.ARDUINO, reals)
    for source in (library / "src").rglob("*.c"):
        flags = ["-mmcu=atmega328p", "-std=gnu11", "-Os", "-Wall", "-Wextra", "-Werror", f"-I{library / 'src'}"]
        run(["avr-gcc", *flags, "-c", source, "-o", tmp_path / "object.o"], library)


def test_a_sketch_finds_the_library_by_its_first_include() -> None:
    """Only headers that stand in src itself lead the IDE to a library."""
    for path, text in project("puma560", Ecosystem.ARDUINO).items():
        if path.endswith(".ino"):
            first = re.search(r"#include <(.*)>", text)

            assert first
            assert f"src/{first[1]}" in project("puma560", Ecosystem.ARDUINO)
