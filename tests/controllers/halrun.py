"""LinuxCNC on this machine, without a display and without root: modules that are built and installed, and runs."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.controllers.packages import HERE, need, run

MODULES = Path("/usr/lib/linuxcnc/modules")
NOBODY = 65534
AS_NOBODY = ("nice", "-n", "-10", "setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")
"""What starts LinuxCNC: without rights, and before other programs, since it mostly waits and has to be in time."""

SERIAL = pytest.mark.xdist_group("linuxcnc")
"""Tests that start LinuxCNC: two of them at once would be in each other's way."""

_PROBE_MAKEFILE = "obj-m += kinegen_probe.o\ninclude $(shell halcompile --print-modinc)\n"


@contextmanager
def installed(folder: Path) -> Iterator[str]:
    """Build the module of a package (or the probe) and install it as its README says; it is removed at the end.

    Yields:
        The name of the module.
    """
    need("halrun", "halcompile", "gcc", "make")
    if os.geteuid() != 0:
        pytest.skip("only root installs modules of LinuxCNC")
    run(["make", "modules"], folder)
    run(["make", "install"], folder)
    (module,) = (path.stem for path in folder.glob("*.so"))
    try:
        yield module
    finally:
        (MODULES / f"{module}.so").unlink()


def write_probe(place: Path) -> Path:
    """The folder of the probe."""
    folder = place / "probe"
    folder.mkdir()
    shutil.copy(HERE / "probe.c", folder / "kinegen_probe.c")
    (folder / "Makefile").write_text(_PROBE_MAKEFILE)
    return folder


def ask(place: Path, loaded: Sequence[str], requests: Iterable[str]) -> list[list[str]]:
    """Load modules and the probe in halrun, and return the probe's answers as words.

    Args:
        place: A folder for the files of this run.
        loaded: Lines of HAL before the probe.
        requests: Lines for the probe.
    """
    asked, told, script = place / "asked", place / "told", place / "probe.hal"
    asked.write_text("\n".join(requests) + "\n")
    script.write_text("\n".join([*loaded, "loadrt kinegen_probe"]) + "\n")
    as_nobody(["halrun", str(script)], place, PROBE_IN=str(asked), PROBE_OUT=str(told))
    return [line.split() for line in told.read_text().splitlines()]


def as_nobody(command: Sequence[str], place: Path, seconds: int = 300, **variables: str) -> str:
    """Run a command as a user without rights, which LinuxCNC wants, and return what it prints."""
    for path in (place, *place.rglob("*")):
        path.chmod(0o777 if path.is_dir() else 0o666 | path.stat().st_mode & 0o111)
    for above in place.parents:
        if above.owner() == "root" and above.stat().st_mode & 0o005 != 0o005 and above != Path("/"):
            above.chmod(above.stat().st_mode | 0o005)
    # A file, since a pipe has no end before the last of all processes has ended.
    with tempfile.TemporaryFile("w+") as printed:
        process = subprocess.Popen(
            [*AS_NOBODY, *command],
            cwd=place,
            env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": str(place), "LC_ALL": "C", **variables},
            stdout=printed,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            result = process.wait(seconds)
        except BaseException:
            _end(process)
            raise
        printed.seek(0)
        text = printed.read()
    if result != 0:
        _end(process)
    assert result == 0, f"{' '.join(command)}\n{text}"
    return text


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a run with all that it started: what runs on would be in the way of the next one."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    # The realtime part has left the group.
    subprocess.run([*AS_NOBODY, "halrun", "-U"], capture_output=True, timeout=60, check=False)
    Path("/tmp/linuxcnc.lock").unlink(missing_ok=True)  # noqa: S108 - the name is LinuxCNC's
