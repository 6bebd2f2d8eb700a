"""Runs packages for grblHAL, Klipper and LinuxCNC in the controllers themselves, which are not part of kinegen.

    git clone https://github.com/grblHAL/core grbl
    git clone https://github.com/grblHAL/Simulator
    git clone https://github.com/Klipper3d/klipper
    python scripts/try_controllers.py grblhal grbl Simulator
    python scripts/try_controllers.py klipper klipper
    git clone https://github.com/LinuxCNC/linuxcnc
    python scripts/try_controllers.py linuxcnc linuxcnc
    git clone https://github.com/ros-controls/kinematics_interface
    git clone https://github.com/ros-controls/ros2_controllers
    python scripts/try_controllers.py ros2_control kinematics_interface ros2_controllers
    git clone https://github.com/moveit/moveit2
    git clone https://github.com/moveit/moveit_msgs
    python scripts/try_controllers.py moveit2 moveit2 moveit_msgs

Packages are built for it with `kinegen build --package`; nothing in the checkouts is changed. What a contract of
`tests/controllers/contracts` states is looked up in the checkout first. With the simulator, programs run in the planner
of grblHAL, and the steps of the motors are compared with the table of the robot. Klipper's host runs programs in a copy
of the checkout, in the mode that writes its messages to the firmware into a file; the steps are read from that file.
For LinuxCNC modules are compiled with the headers of the checkout, and programs run in the LinuxCNC of this machine,
such as Debian's, where root may install modules. For ros2_control the plug-in is compiled with the header of the
checkout; rclcpp and pluginlib are stand-ins. For MoveIt 2 it is linked with the source of KinematicsBase, and solves
poses; the model of the robot is a stand-in too.
"""

from __future__ import annotations

import importlib.util
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from kinegen import build
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.kernel_calls import needed
from kinegen.backends.controllers.machine import machine_of
from kinegen.driver.pipeline import lower_file
from kinegen.io.load import load
from kinegen.support.files.write import write_files

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT)]

from controllers import grblhal, klipper, moveit2  # noqa: E402

from tests.controllers.cone import axes, cone_cases  # noqa: E402
from tests.controllers.contract import headers, missing  # noqa: E402
from tests.controllers.linuxcnc_cases import tried as linuxcnc_cases  # noqa: E402
from tests.controllers.modules import Numbers  # noqa: E402

ARMS = ("scara4", "palletiser3", "arm3", "coupled3")
KLIPPER_ARMS = ("palletiser3", "arm3", "scara", "coupled3")
LINUXCNC_ARMS = ("scara4", "palletiser3", "arm3", "coupled3")
LINUXCNC_MILLS: dict[str, Callable[[Numbers], Numbers]] = {"trunnion_mill": np.asarray, "coupled_mill": axes}
"""Machines of one geometry, without and with actuators, and what leads from LinuxCNC's joints to the machine's."""

HEADERS = ("src/rtapi", "src/hal", "src/emc/kinematics", "src/emc/nml_intf", "src/emc/motion", "src/libposemath")
COMPILED = ("-std=gnu11", "-O2", "-fsyntax-only", "-Wall", "-Wextra", "-DRTAPI", "-DUSPACE")
MOVEIT_ARMS = ("ur5", "panda_joint_7")
SCARA = ROOT / "robots" / "scara.yaml"
WARNINGS = ("-Wall", "-Wextra", "-Wno-unused-parameter")


def try_grblhal(place: Path, checkout: Path, simulator: Path | None = None) -> bool:
    """Compile the plug-in; with a simulator, run the cases on three arms."""
    if absent := missing("grblhal", checkout):
        raise SystemExit("the checkout lacks what the plug-in calls:\n" + "\n".join(absent))
    if simulator is not None:
        return sum(_run_grblhal(name, place / name, checkout, simulator) for name in ARMS) == len(ARMS)
    folder = build(SCARA, place, package="grblhal", compile=False).folder
    (place / "grbl").symlink_to(checkout.resolve())
    (place / "driver.h").touch()  # a board's driver has its own
    include = [f"-I{place}", f"-I{place / 'grbl'}", f"-I{folder}"]
    plugin = folder / "scara_plugin.c"
    _run(["gcc", *WARNINGS, "-DKINEMATICS_API", "-DN_AXIS=3", *include, "-c", plugin, "-o", place / "plugin.o"])
    return True


def _run_grblhal(name: str, place: Path, core: Path, simulator: Path) -> bool:
    """Run the cases on one arm, and print what was measured."""
    path = ROOT / "tests" / "controllers" / "robots" / f"{name}.yaml"
    place.mkdir()
    folder = build(path, place, package="grblhal", compile=False).folder
    kernels = _lowered(path, Controller.GRBLHAL)
    made = machine_of(kernels, Controller.GRBLHAL)
    program = grblhal.compiled(core, simulator, folder, max(3, made.dof), place)
    return _printed(name, grblhal.tried(kernels.robot, made, program))


def try_klipper(place: Path, checkout: Path) -> bool:
    """Run the cases on three arms in Klipper's host."""
    if absent := missing("klipper", checkout):
        raise SystemExit("the checkout lacks what the package calls:\n" + "\n".join(absent))
    if lacks := [name for name in klipper.NEEDED if importlib.util.find_spec(name) is None]:
        raise SystemExit(f"Klipper's host needs {', '.join(lacks)}: pip install cffi greenlet jinja2 pyserial")
    copy = klipper.installed(checkout, place)
    return sum([_run_klipper(name, place / name, copy) for name in KLIPPER_ARMS]) == len(KLIPPER_ARMS)


def _run_klipper(name: str, place: Path, copy: Path) -> bool:
    path = ROOT / "tests" / "controllers" / "robots" / f"{name}.yaml"
    path = path if path.exists() else ROOT / "robots" / f"{name}.yaml"
    folder = build(path, place, package="klipper", compile=False).folder
    _run(["sh", folder / "install.sh", copy])
    kernels = _lowered(path, Controller.KLIPPER)
    made = machine_of(kernels, Controller.KLIPPER)
    return _printed(name, klipper.tried(kernels.robot, made, copy, folder, place / "run"))


def try_linuxcnc(place: Path, checkout: Path) -> bool:
    """Compile modules with the headers of a checkout, and run programs in the LinuxCNC of this machine."""
    if absent := missing("linuxcnc", checkout):
        raise SystemExit("the checkout lacks what the package calls:\n" + "\n".join(absent))
    passes = True
    for name in (*LINUXCNC_ARMS, *LINUXCNC_MILLS):
        path = ROOT / "tests" / "controllers" / "robots" / f"{name}.yaml"
        path = path if path.exists() else ROOT / "robots" / f"{name}.yaml"
        folder = build(path, place / name, package="linuxcnc", compile=False).folder
        include = [f"-I{checkout / each}" for each in HEADERS]
        _run(["gcc", *COMPILED, *include, f"-I{folder}", folder / f"{folder.name}_glue.c"])
        if name in LINUXCNC_MILLS:
            passes &= _printed(name, cone_cases(folder, LINUXCNC_MILLS[name]))
        else:
            kernels = _lowered(path, Controller.LINUXCNC)
            passes &= _printed(name, linuxcnc_cases(folder, kernels.robot, machine_of(kernels, Controller.LINUXCNC)))
    version = subprocess.run(["linuxcnc_var", "LINUXCNCVERSION"], capture_output=True, text=True, check=True).stdout
    print(f"compiled with the headers of the checkout; run in LinuxCNC {version.strip()} of this machine")
    return passes


def _lowered(path: Path, controller: Controller) -> RobotPrograms:
    """An arm with the programs that a package has."""
    return lower_file(path, needed(load(path), controller))


def _printed(name: str, cases: Iterable[tuple[str, float, float]]) -> bool:
    """Print what was measured, and whether all of it is within what is allowed."""
    passes = True
    for what, measured, allowed in cases:
        passes &= measured <= allowed
        print(
            f"{name:20} {what:52} {measured:10.3g} {'pass' if measured <= allowed else 'FAIL'} ({allowed:g})",
            flush=True,
        )
    return passes


def try_ros2_control(place: Path, interface: Path, controllers: Path | None = None) -> bool:
    """Compile the plug-in with the header of a checkout; with another, compare the parameters of its controller."""
    absent = missing("ros2_control", interface, ("kinematics_interface", "kdl"))
    if controllers is not None:
        absent += missing("ros2_control", controllers, ("admittance_controller",))
    if absent:
        raise SystemExit("the checkout and the contract differ:\n" + "\n".join(absent))
    folder = build(ROOT / "robots" / "puma560.yaml", place, package="ros2_control", compile=False).folder
    own = interface / "kinematics_interface" / "include"
    name = "kinematics_interface/kinematics_interface.hpp"
    write_files(place / "standins", {path: text for path, text in headers("ros2_control").items() if path != name})
    include = [f"-I{own}", f"-I{place / 'standins'}", "-isystem", "/usr/include/eigen3"]
    include += [f"-I{folder / 'include'}", f"-I{folder / 'src'}"]
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Wno-unused-parameter"]
    _run(["g++", *flags, *include, "-c", folder / "src" / "plugin.cpp", "-o", place / "plugin.o"])
    print(f"compiled with {name} of the checkout; rclcpp and pluginlib are stand-ins")
    return True


def try_moveit2(place: Path, checkout: Path, messages: Path | None = None) -> bool:
    """Link the plug-in with the source of its base class, and solve poses; with another checkout, compare the codes."""
    absent = missing("moveit2", checkout, moveit2.GROUPS)
    if messages is not None:
        absent += missing("moveit2", messages, ("error_codes",))
    if absent:
        raise SystemExit("the checkout and the contract differ:\n" + "\n".join(absent))
    passes = True
    for name in MOVEIT_ARMS:
        (place / name).mkdir()
        passes &= _printed(name, moveit2.tried(name, place / name, checkout))
    print(f"linked with {moveit2.SOURCE} of the checkout; the model, rclcpp and pluginlib are stand-ins")
    return passes


def _run(command: list[str | Path]) -> None:
    subprocess.run(command, check=True)


def main(arguments: list[str]) -> int:
    """Try one of them; prints what was tried."""
    kinds: dict[str, tuple[Callable[..., bool], tuple[int, ...]]] = {
        "grblhal": (try_grblhal, (1, 2)),
        "klipper": (try_klipper, (1,)),
        "linuxcnc": (try_linuxcnc, (1,)),
        "ros2_control": (try_ros2_control, (1, 2)),
        "moveit2": (try_moveit2, (1, 2)),
    }
    name, *checkouts = arguments or [""]
    if name not in kinds or len(checkouts) not in kinds[name][1] or not all(Path(each).is_dir() for each in checkouts):
        print(
            "usage: python scripts/try_controllers.py grblhal CORE [SIMULATOR] | klipper CHECKOUT | "
            "linuxcnc CHECKOUT | ros2_control KINEMATICS_INTERFACE [ROS2_CONTROLLERS] | moveit2 MOVEIT2 [MOVEIT_MSGS]",
            file=sys.stderr,
        )
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that what was started is ended
    with tempfile.TemporaryDirectory() as folder:
        passes = kinds[name][0](Path(folder), *map(Path, checkouts))
    how = (
        "is linked with"
        if name == "moveit2"
        else "compiles against"
        if name == "ros2_control" or (name, len(checkouts)) == ("grblhal", 1)
        else "runs in"
    )
    print(f"the package for {name} {how} {' and '.join(checkouts)}{'' if passes else ', and fails there'}")
    return 0 if passes else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
