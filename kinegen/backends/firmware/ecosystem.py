"""The ecosystems that packages are written for, and where the files of a package stand."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from kinegen.backends.scalar_types import ScalarType
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass


class Ecosystem(StrEnum):
    """A kind of project, as `--package` names it."""

    CMAKE = "cmake"
    PLATFORMIO = "platformio"
    ARDUINO = "arduino"
    ESP_IDF = "esp-idf"

    @property
    def reals(self) -> tuple[ScalarType, ...]:
        """The number types of a package for which none are asked.

        Boards get float alone: most of their floating-point units have no double, and on AVR a double is a float.
        CMake also builds for hosts, and its linker takes only what is called.
        """
        return (ScalarType.DOUBLE, ScalarType.FLOAT) if self is Ecosystem.CMAKE else (ScalarType.FLOAT,)

    @property
    def folder(self) -> str:
        """Where such a project looks for its libraries, below its own folder."""
        return _FOLDERS[self]


_FOLDERS = {
    Ecosystem.CMAKE: "external",
    Ecosystem.PLATFORMIO: "lib",
    Ecosystem.ARDUINO: "libraries",
    Ecosystem.ESP_IDF: "components",
}


@dataclass(frozen=True, slots=True)
class Layout:
    """The folders of one ecosystem.

    `headers`: folder of the public headers. `sources`: folder of the kernels. `selftest`: folder of the self-test and
    its vectors. `rendered`: templates below `packages/`, by the path that they are written to; `{name}` stands for the
    robot.
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
