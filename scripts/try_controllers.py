"""Compiles packages for grblHAL and Klipper against the headers of a checkout, which is not part of kinegen.

    git clone https://github.com/grblHAL/core grbl
    git clone https://github.com/Klipper3d/klipper
    python scripts/try_controllers.py grblhal grbl
    python scripts/try_controllers.py klipper klipper

A SCARA is built for it with `kinegen build --package`; nothing in the checkout is changed. For Klipper the helper is
also called: positions of its steppers must lead back to the position of the tool.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path

from kinegen import build

ROOT = Path(__file__).resolve().parent.parent
SCARA = ROOT / "robots" / "scara.yaml"
WARNINGS = ("-Wall", "-Wextra", "-Wno-unused-parameter")


def try_grblhal(checkout: Path, place: Path) -> None:
    """Compile the plug-in; the headers find each other below a folder called grbl."""
    folder = build(SCARA, place, package="grblhal", compile=False).folder
    (place / "grbl").symlink_to(checkout.resolve())
    (place / "driver.h").touch()  # a board's driver has its own
    include = [f"-I{place}", f"-I{place / 'grbl'}", f"-I{folder}"]
    plugin = folder / "scara_plugin.c"
    _run(["gcc", *WARNINGS, "-DKINEMATICS_API", "-DN_AXIS=3", *include, "-c", plugin, "-o", place / "plugin.o"])


def try_klipper(checkout: Path, place: Path) -> None:
    """Compile the helper and call it."""
    folder = build(SCARA, place, package="klipper", compile=False).folder
    theirs = checkout / "klippy" / "chelper"
    library = place / "helper.so"
    flags = ["-std=gnu11", "-O2", "-fPIC", "-ffp-contract=off", f"-I{theirs}"]
    ours = []
    for source in sorted((folder / "chelper").glob("*.c")):
        ours.append(place / f"{source.stem}.o")
        _run(["gcc", *flags, *WARNINGS, "-c", source, "-o", ours[-1]])
    _run(["gcc", *flags, "-w", "-shared", *ours, *sorted(theirs.glob("*.c")), "-lm", "-o", library])
    helper = ctypes.CDLL(str(library))
    steppers, position, q = (
        (ctypes.c_double * 3)(*values) for values in ((0.4, 0.9, 30.0), (0.0,) * 3, (0.3, 1.0, 0.0))
    )
    helper.scara_position(steppers, position)
    if not helper.scara_solve(*map(ctypes.c_double, position), q):
        raise SystemExit("the helper does not find the joints for a position that they are from")
    if max(abs(q[0] - 0.4), abs(q[1] - 0.9), abs(q[2] - 0.03)) > 1e-9:
        raise SystemExit(f"the helper finds {list(q)} instead of 0.4, 0.9, 0.03")


def _run(command: list[str | Path]) -> None:
    subprocess.run(command, check=True)


def main(arguments: list[str]) -> int:
    """Try one of them; prints what was compiled."""
    kinds = {"grblhal": try_grblhal, "klipper": try_klipper}
    if len(arguments) != 2 or arguments[0] not in kinds or not Path(arguments[1]).is_dir():
        print("usage: python scripts/try_controllers.py grblhal|klipper CHECKOUT", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        kinds[arguments[0]](Path(arguments[1]), Path(folder))
    print(f"the package for {arguments[0]} compiles against {arguments[1]}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
