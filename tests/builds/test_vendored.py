"""The folder `_runtime/` of a package: what replaces an earlier layout, and what other builds leave of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.model.outputs import POSE_AND_JACOBIAN, Quantity
from kinegen.support.files.manifest import MANIFEST, manifest_text, read_manifest
from kinegen.support.naming import RUNTIME
from tests.builds.workshop import contents, make, write_robot


def flatten(folder: Path) -> set[str]:
    """Give a package the layout of earlier versions, which had the vendored modules beside `__init__.py`."""
    listed = read_manifest(folder) or {}
    moved = [path for path in sorted((folder / RUNTIME).glob("_*.py")) if path.name != "__init__.py"]
    for path in sorted((folder / RUNTIME).glob("*.py")):
        digest = listed.pop(f"{RUNTIME}/{path.name}")
        if path in moved:
            path.rename(folder / path.name)
            listed[path.name] = digest
        else:
            path.unlink()
    (folder / RUNTIME).rmdir()
    (folder / MANIFEST).write_bytes(manifest_text(listed))
    return {path.name for path in moved}


def imported(folder: Path) -> str:
    """What a new interpreter prints of a package."""
    code = "import sys; sys.path.insert(0, sys.argv[1]); import arm; print(arm.fk([0, 0]).shape)"
    command = [sys.executable, "-W", "ignore", "-B", "-c", code, str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_a_build_replaces_the_layout_of_earlier_versions(tmp_path: Path) -> None:
    """Twice: the second build finds nothing to do."""
    robot = write_robot(tmp_path / "files")
    folder = make(robot, tmp_path, compile=False).folder
    before = contents(folder)
    moved = flatten(folder)

    result = make(robot, tmp_path, compile=False)

    assert len(moved) > 12
    assert {entry.path.name for entry in result.written if entry.status == "removed"} == moved
    assert contents(folder) == before
    assert not any(entry.changed for entry in make(robot, tmp_path, compile=False).written)
    assert imported(tmp_path) == "(4, 4)\n"


def test_a_module_of_an_earlier_version_that_was_edited_stays(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "files")
    folder = make(robot, tmp_path, compile=False).folder
    flatten(folder)
    (folder / "_quick.py").write_text("mine = 1\n", encoding="utf-8")

    make(robot, tmp_path, compile=False)

    assert (folder / "_quick.py").read_text(encoding="utf-8") == "mine = 1\n"
    assert (folder / RUNTIME / "_quick.py").is_file()
    assert imported(tmp_path) == "(4, 4)\n"


def test_vendored_modules_go_with_the_outputs_that_need_them(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "files")
    quantities = (Quantity.POSE, POSE_AND_JACOBIAN)
    folder = make(robot, tmp_path, compile=False, quantities=quantities).folder
    assert (folder / RUNTIME / "_measures.py").is_file()

    make(robot, tmp_path, compile=False)

    assert not (folder / RUNTIME / "_measures.py").exists()
    assert f"{RUNTIME}/_measures.py" not in (read_manifest(folder) or {})
    assert f"{RUNTIME}/_kernel.py" in (read_manifest(folder) or {})


def test_a_firmware_package_in_the_same_folder_leaves_the_python_package_whole(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "files")
    folder = make(robot, tmp_path, compile=False).folder
    before = contents(folder)
    before.pop(MANIFEST)

    make(robot, tmp_path, compile=False, package=Ecosystem.CMAKE)

    assert (folder / "src" / "arm.c").is_file()
    assert contents(folder).items() >= before.items()
    assert imported(tmp_path) == "(4, 4)\n"
