"""Where the files of a package stand: the C files, and what is rendered around them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from kinegen.emit.packages.ecosystem import Ecosystem


@dataclass(frozen=True, slots=True)
class Layout:
    """The folders of one ecosystem.

    Attributes:
        headers: Folder of the public headers.
        sources: Folder of the kernels.
        selftest: Folder of the self-test and its vectors.
        rendered: Templates below `packages/`, by the path that they are written to; `{name}` stands for the robot.
    """

    headers: str
    sources: str
    selftest: str
    rendered: Mapping[str, str]


LAYOUTS: Mapping[Ecosystem, Layout] = MappingProxyType(
    {
        # Sources, headers and tests apart, as CMake projects have them.
        Ecosystem.CMAKE: Layout(
            headers="include",
            sources="src",
            selftest="test",
            rendered={
                "CMakeLists.txt": "cmake/CMakeLists.txt.jinja",
                "README.md": "cmake/README.md.jinja",
                "LICENSE": "LICENSE.jinja",
                "examples/pose.c": "cmake/pose.c.jinja",
            },
        ),
        # https://docs.platformio.org/en/latest/librarymanager/creating.html: include/ and src/ are found by themselves.
        Ecosystem.PLATFORMIO: Layout(
            headers="include",
            sources="src",
            selftest="src",
            rendered={
                "library.json": "platformio/library.json.jinja",
                "README.md": "platformio/README.md.jinja",
                "LICENSE": "LICENSE.jinja",
                "examples/pose/pose.cpp": "platformio/pose.cpp.jinja",
            },
        ),
        # Arduino library specification 1.5: src/ is compiled with all folders below it and is alone on the include
        # path; headers that sketches should not see at once stand in a folder below.
        Ecosystem.ARDUINO: Layout(
            headers="src",
            sources="src",
            selftest="src/selftest",
            rendered={
                "library.properties": "arduino/library.properties.jinja",
                "keywords.txt": "arduino/keywords.txt.jinja",
                "README.md": "arduino/README.md.jinja",
                "LICENSE": "LICENSE.jinja",
                "examples/Pose/Pose.ino": "arduino/Pose.ino.jinja",
                "examples/SelfTest/SelfTest.ino": "arduino/SelfTest.ino.jinja",
            },
        ),
        # The build system names a component after its folder.
        Ecosystem.ESP_IDF: Layout(
            headers="include",
            sources="src",
            selftest="selftest",
            rendered={
                "CMakeLists.txt": "esp-idf/CMakeLists.txt.jinja",
                "idf_component.yml": "esp-idf/idf_component.yml.jinja",
                "README.md": "esp-idf/README.md.jinja",
                "LICENSE": "LICENSE.jinja",
                "examples/pose/CMakeLists.txt": "esp-idf/example.CMakeLists.txt.jinja",
                "examples/pose/main/CMakeLists.txt": "esp-idf/main.CMakeLists.txt.jinja",
                "examples/pose/main/main.c": "esp-idf/main.c.jinja",
            },
        ),
    }
)
"""The layouts by ecosystem."""
