"""The ecosystems that packages are written for."""

from __future__ import annotations

from kinegen.emit.reals import Real
from kinegen.older import StrEnum


class Ecosystem(StrEnum):
    """A kind of project, as `--package` names it."""

    CMAKE = "cmake"
    PLATFORMIO = "platformio"
    ARDUINO = "arduino"
    ESP_IDF = "esp-idf"

    @property
    def reals(self) -> tuple[Real, ...]:
        """The number types of a package for which none are asked.

        Boards get float alone: most of their floating-point units have no double, and on AVR a double is a float.
        CMake also builds for hosts, and its linker takes only what is called.
        """
        return (Real.DOUBLE, Real.FLOAT) if self is Ecosystem.CMAKE else (Real.FLOAT,)

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
