"""The machine controllers that packages are written for."""

from __future__ import annotations

from kinegen.emit.reals import Real
from kinegen.older import StrEnum
from kinegen.outputs import POSE_AND_JACOBIAN, Kind, Quantity


class Controller(StrEnum):
    """A controller, as `--package` names it."""

    LINUXCNC = "linuxcnc"
    ROS2_CONTROL = "ros2_control"
    GRBLHAL = "grblhal"
    KLIPPER = "klipper"

    @property
    def makers_name(self) -> str:
        """Its name as its makers write it."""
        return _NAMES[self]

    @property
    def reals(self) -> tuple[Real, ...]:
        """The number type of its joints."""
        return (Real.FLOAT,) if self is Controller.GRBLHAL else (Real.DOUBLE,)

    @property
    def folder(self) -> str:
        """Where packages for it go unless the user says otherwise."""
        return self.value

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The axes of the world that it moves."""
        return _COORDINATES[self]


_NAMES = {
    Controller.LINUXCNC: "LinuxCNC",
    Controller.ROS2_CONTROL: "ros2_control",
    Controller.GRBLHAL: "grblHAL",
    Controller.KLIPPER: "Klipper",
}

_COORDINATES = {
    Controller.LINUXCNC: ("XYZ", "XYZC", "XYZABC"),
    Controller.ROS2_CONTROL: ("XYZ", "XYZC", "XYZABC"),
    Controller.GRBLHAL: ("XYZ", "XYZC"),
    Controller.KLIPPER: ("XYZ",),
}

NEEDED = (Quantity.POSE, POSE_AND_JACOBIAN, Quantity(Kind.INVERSE))
"""The outputs that every controller calls, in the order of `Kind`."""
