"""The machine controllers that packages are written for, and the names that they have taken."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError
from kinegen.model.outputs import POSE_AND_JACOBIAN, Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.support.compat import StrEnum


class Controller(StrEnum):
    """A controller, as `--package` names it."""

    LINUXCNC = "linuxcnc"
    ROS2_CONTROL = "ros2_control"
    MOVEIT2 = "moveit2"
    GRBLHAL = "grblhal"
    KLIPPER = "klipper"

    @property
    def makers_name(self) -> str:
        """Its name as its makers write it."""
        return _NAMES[self]

    @property
    def reals(self) -> tuple[ScalarType, ...]:
        """The number type of its joints."""
        return (ScalarType.FLOAT,) if self is Controller.GRBLHAL else (ScalarType.DOUBLE,)

    @property
    def folder(self) -> str:
        """Where packages for it go unless the user says otherwise."""
        return self.value

    @property
    def has_mills(self) -> bool:
        """Return whether it also moves machine tools."""
        return self is Controller.LINUXCNC

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The axes of the world that it moves; nothing where every arm with a closed form will do."""
        return _COORDINATES[self]


_NAMES = {
    Controller.LINUXCNC: "LinuxCNC",
    Controller.ROS2_CONTROL: "ros2_control",
    Controller.MOVEIT2: "MoveIt 2",
    Controller.GRBLHAL: "grblHAL",
    Controller.KLIPPER: "Klipper",
}

_COORDINATES = {
    Controller.LINUXCNC: ("XYZ", "XYZC", "XYZABC"),
    Controller.ROS2_CONTROL: ("XYZ", "XYZC", "XYZABC"),
    Controller.MOVEIT2: (),
    Controller.GRBLHAL: ("XYZ", "XYZC"),
    Controller.KLIPPER: ("XYZ",),
}

NEEDED = (Quantity.POSE, POSE_AND_JACOBIAN, Quantity(Kind.INVERSE))
"""The outputs that every controller calls, in the order of `Kind`."""

ACTUATORS = (Quantity(Kind.ACTUATORS_TO_JOINTS), Quantity(Kind.JOINTS_TO_ACTUATORS))
"""The outputs that are called too if the arm has actuators."""


_TAKEN = {
    Controller.LINUXCNC: frozenset("emcpos hal kinematics rtapi rtapi_app rtapi_math".split()),
    Controller.KLIPPER: frozenset(
        """
        cartesian compiler corexy corexz delta deltesian extruder generic generic_cartesian hybrid_corexy hybrid_corexz
        idex idex_modes itersolve kinematic_stepper list msgblock none polar pollreactor pyhelper rotary_delta
        serialqueue shaper stepcompress steppersync trapq trdispatch winch
        """.split()
    ),
}
"""Names of headers that a module of LinuxCNC includes, and of kinematics, helpers and C files of Klipper."""


def require_name(robot: Robot, controller: Controller) -> None:
    """Refuse a name that the controller has for a file of its own.

    Raises KinegenError if there is such a file.
    """
    if robot.name in _TAKEN.get(controller, ()):
        maker = controller.makers_name
        raise KinegenError(
            f"no {maker} package for {robot.name}: {maker} has a file of that name, which one of the package would "
            "hide or replace; give the robot another name",
            robot.source,
        )


_GRBLHAL = frozenset(
    """ABORTED ACCELERATION_TICKS_PER_SECOND ADAPTIVE_MULTI_AXIS_STEP_SMOOTHING ARC_ANGULAR_TRAVEL_EPSILON
    AXES_BITMASK AXIS_REMAP_ABC2UVW AXIS_SETTINGS_INCREMENT BAUD_RATE BEZIER_MAX_STEP BEZIER_MIN_STEP
    BEZIER_SIGMA BLOCK_TX_BUFFER_SIZE BUILD_INFO CHECK_MODE_DELAY COMPATIBILITY_LEVEL COREXY COS120
    CUTTER_COMP_ENABLE DCRAM DEBOUNCE_DELAY DEBUG_PRINT DEGRAD DELTA_ROBOT DISABLE_BUILD_INFO_WRITE_COMMAND
    DWELL_TIME_STEP ENCODER_N_SETTINGS_MAX ENCODER_SETTINGS_INCREMENT FEED_OVERRIDE_COARSE_INCREMENT
    FEED_OVERRIDE_FINE_INCREMENT FLASHMEM HAL_VERSION HARD_LIMIT_FORCE_STATE_CHECK HOMING_AXIS_LOCATE_SCALAR
    HOMING_AXIS_SEARCH_SCALAR INCH_PER_MM IOPORT_UNASSIGNED ISR_CODE JOG_LINE_NUMBER KINEMATICS_API
    LATHE_UVW_OPTION MAX_AMASS_LEVEL MAX_INT_DIGITS MAX_OFFSET_ENTRIES MAX_STORED_LINE_LENGTH MAX_TOOL_NUMBER
    MINIMUM_FEED_RATE MINIMUM_JUNCTION_SPEED MM_PER_INCH MODBUS_TCP_SETTINGS_INCREMENT NVSDATA_BUFFER_ENABLE Off
    On PASSWORD_MASK PLANNER_ADD_MOTION_MODE POLAR_ROBOT PROGMEM PWM_SPINDLE_NO_DELAYS RADDEG RAPID_OVERRIDE_LOW
    RAPID_OVERRIDE_MEDIUM RTCP_AC RX_BUFFER_SIZE SEGMENT_BUFFER_SIZE SERIAL_NO_DATA
    SET_CHECK_MODE_PROBE_TO_START SIN120 SIN30 SLEEP_DURATION SOME_LARGE_VALUE SQRT3 STRLEN_COORDVALUE TAN30
    TAN30_2 TAN60 TOLERANCE_EQUAL TOOLSETTER_RADIUS TOOL_LENGTH_OFFSET_AXIS TX_BUFFER_SIZE VFS_MOUNT_PATH_LEN
    WALL_PLOTTER""".split()
)
"""Macros of grblHAL f80fc34 (2026-08-18) without arguments, as far as they reach its plug-ins."""

_GRBLHAL_FAMILIES = re.compile(
    r"(ASCII|CLOCK|CMD|DEFAULT|DISPLAY|ENABLE|EXEC|GRBL|N|NGC|NVS|PINMODE|REPORT|SETTINGS|SIGNALS|SPINDLE|STATE)"
    r"_[A-Z0-9_]+|AXIS\d_(LETTER|BIT|IDX)|[A-Z]_AXIS(_BIT)?|(MAX|MIN)_[A-Z_]+_OVERRIDE|RA\d"
)
"""More of them, by what they begin and end with."""

_OTHERS: Mapping[Controller, frozenset[str]] = MappingProxyType({Controller.KLIPPER: frozenset({"PACKED", "noinline"})})
"""Those of other controllers."""


def macro_clash(robot: Robot, controller: Controller) -> str:
    """Return why a runtime parameter cannot be a member of a struct beside the macros; empty if all can."""
    own = f"{robot.name.upper()}_"
    for name in (parameter.name for parameter in robot.runtime_parameters):
        if name.startswith(own) and name == name.upper():
            return f"runtime parameter {name!r} may be a macro of the package, whose macros begin with {own}; rename it"
        is_grblhal = name in _GRBLHAL or _GRBLHAL_FAMILIES.fullmatch(name)
        if name in _OTHERS.get(controller, ()) or (controller is Controller.GRBLHAL and is_grblhal):
            return f"runtime parameter {name!r} may be a macro of its headers; rename it"
    return ""
