"""The same robot gives the same bytes, in any folder, process, locale and order of hashes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import Quantity
from kinegen.verify.vectors import compute_vectors
from tests.builds.workshop import ARM, ROBOTS, ROOT, TREE, contents, make, picture, write_robot

DIGESTS = """
import hashlib, json, sys
from pathlib import Path
from kinegen.driver.pipeline import lower_file
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import (ScalarType)
from kinegen.model.outputs import USUAL, Quantity
from kinegen.verify.vectors import compute_vectors

found = {}
for path in sys.argv[1:]:
    kernels = lower_file(Path(path), USUAL)
    emitted = emit_files(kernels, tuple(ScalarType), compute_vectors(kernels))
    for name, text in emitted.files.items():
        found[f"{Path(path).stem}/{name}"] = hashlib.sha256(text.encode()).hexdigest()
print(json.dumps(found))
"""

TEXTS = {name: (ROBOTS / f"{name}.yaml").read_text(encoding="utf-8") for name in ("ur5", "calibrated_2r", "al5d")}
TEXTS |= {"arm": TREE}

PLACES = {
    "hash seed 0, C locale": {"PYTHONHASHSEED": "0", "LC_ALL": "C", "PYTHONUTF8": "0", "TZ": "UTC"},
    "hash seed 4711, UTF-8": {"PYTHONHASHSEED": "4711", "LC_ALL": "C.UTF-8", "TZ": "Asia/Tokyo", "COLUMNS": "40"},
    "random hashes, odd locale": {"PYTHONHASHSEED": "random", "LC_ALL": "tr_TR.UTF-8", "LANGUAGE": "tr"},
}


@pytest.fixture(scope="module")
def digests(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    """Digests of every file of some robots, from processes that differ in what must not matter."""
    jobs = {}
    for number, (place, settings) in enumerate(PLACES.items()):
        folder = tmp_path_factory.mktemp("elsewhere")
        for name, text in TEXTS.items():
            write_robot(folder, text, f"{name}.yaml")
        # By an absolute name, by a relative one, and in another order.
        paths = [folder / f"{name}.yaml" if number else Path(f"{name}.yaml") for name in TEXTS]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), **settings}
        command = [sys.executable, "-c", DIGESTS, *map(str, paths[::-1] if number == 2 else paths)]
        jobs[place] = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE)
    return {place: json.loads(job.communicate()[0]) for place, job in jobs.items()}


def test_folder_locale_and_hashes_do_not_matter(digests: dict[str, dict[str, str]]) -> None:
    first, *others = digests.values()

    assert len(first) == 37 * len(TEXTS)
    for other in others:
        assert other == first


def test_a_build_writes_those_bytes(tmp_path: Path) -> None:
    """Line ends and encoding are what the emitters printed."""
    path = write_robot(tmp_path)
    result = make(path, tmp_path / "out", compile=False)
    kernels = lower_file(path, (Quantity.POSE,))
    printed = emit_files(kernels, tuple(ScalarType), compute_vectors(kernels)).files

    found = contents(result.folder)
    assert set(json.loads(found.pop("kinegen-manifest.json"))["files"]) == set(printed)
    assert found == {name: text.encode() for name, text in printed.items()}


def test_compiling_changes_no_text(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    make(path, tmp_path / "compiled")
    make(path, tmp_path / "plain", compile=False)
    compiled, plain = contents(tmp_path / "compiled"), contents(tmp_path / "plain")

    assert compiled.pop("arm/_native.abi3.so")
    assert compiled == plain


def test_a_second_build_touches_nothing(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    first = make(path, tmp_path / "out")
    before = picture(tmp_path / "out")
    second = make(path, tmp_path / "out")

    assert {entry.status for entry in first.written} == {"new"}
    assert {entry.status for entry in second.written} == {"unchanged"}
    assert picture(tmp_path / "out") == before
    assert second.proof == first.proof


def test_only_what_differs_is_touched(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    make(path, tmp_path / "out")
    (tmp_path / "out" / "arm" / "arm.h").unlink()
    result = make(path, tmp_path / "out")

    assert [entry.path.name for entry in result.written if entry.changed] == ["arm.h"]


def test_a_build_of_fewer_things_takes_the_others_away(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    make(path, tmp_path / "out")
    (tmp_path / "out" / "arm" / "notes.txt").write_text("the user's own", encoding="utf-8")
    result = make(path, tmp_path / "out", reals=(ScalarType.DOUBLE,), compile=False)
    removed = {entry.path.name for entry in result.written if entry.status == "removed"}

    assert {name for name in removed if "f32" not in name} == {"_native.abi3.so"}
    assert not [name for name in contents(tmp_path / "out") if "f32" in name]
    assert "arm/notes.txt" in contents(tmp_path / "out")


def test_a_comment_or_a_blank_in_the_robot_file_changes_nothing(tmp_path: Path) -> None:
    plain = make(write_robot(tmp_path / "one"), tmp_path / "one" / "out", compile=False)
    spaced = ARM.replace("joints:\n", "# the arm\n\njoints:   \n").replace("d: 0.25", "d:   0.250")
    commented = make(write_robot(tmp_path / "two", spaced), tmp_path / "two" / "out", compile=False)

    assert contents(plain.folder) == contents(commented.folder)


def test_a_number_in_the_robot_file_changes_the_digest_in_every_banner(tmp_path: Path) -> None:
    one = make(write_robot(tmp_path / "one"), tmp_path / "one" / "out", compile=False)
    changed = write_robot(tmp_path / "two", ARM.replace("0.25", "0.26"))
    two = make(changed, tmp_path / "two" / "out", compile=False)

    named_by_none = ("py.typed", "kinegen-manifest.json")
    assert one.robot.digest != two.robot.digest
    for name, content in contents(two.folder).items():
        assert one.robot.digest.encode() not in content, name
        assert name in named_by_none or name.startswith("_runtime/") or two.robot.digest.encode() in content, name
