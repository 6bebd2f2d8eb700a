"""An extension that is missing, damaged or foreign: NumPy takes over, and a damaged one is named."""

from __future__ import annotations

import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.backends.python.vendored import FURTHER, SHARED
from kinegen.runtime.extension import load_package
from kinegen.support.naming import EXTENSION
from tests.native.conftest import SAMPLES, needs_compiler

SEAL = b"\nkinegen sha256 "  # behind it is the digest of the library, which loading does not need
Damage = Callable[[Path], object]
pytestmark = needs_compiler


@pytest.fixture
def folder(tmp_path: Path, cache: Path) -> Path:
    """A package of its own, with its extension."""
    return SAMPLES["chain"].write(tmp_path, cache)


def cut(path: Path, size: int) -> None:
    path.write_bytes(path.read_bytes()[:size])


def for_another_machine(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[18] = 0xB7 if data[18] != 0xB7 else 0x3E  # aarch64, or else x86-64
    path.write_bytes(data)


DAMAGES: dict[str, tuple[Damage, str]] = {
    "empty": (lambda path: cut(path, 0), "file too short"),
    "a few bytes": (lambda path: cut(path, 40), "the file is cut short"),
    "half": (lambda path: cut(path, path.stat().st_size // 2), "the file is cut short"),
    "all but one byte": (
        lambda path: cut(path, len(path.read_bytes().rpartition(SEAL)[0]) - 1),
        "the file is cut short",
    ),
    "text": (lambda path: path.write_text("no library " * 100), "invalid ELF header"),
    "another machine": (for_another_machine, "wrong ELF class|cannot open shared object|Exec format|wrong"),
    "a folder": (lambda path: (path.unlink(), path.mkdir()), "Is a directory"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_extension_is_named_and_numpy_takes_over(folder: Path, damage: str) -> None:
    harm, words = DAMAGES[damage]
    harm(folder / EXTENSION)

    with pytest.warns(
        RuntimeWarning, match=rf"NumPy evaluates chain, .*: {EXTENSION} is not used: .*({words})"
    ) as caught:
        module = load_package(folder)

    assert len(caught) == 1
    assert "\n" not in str(caught[0].message)
    assert module.backend == module.fk.backend == "numpy"
    assert module.fk(np.ones(3))[0].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_a_stale_extension_is_named(folder: Path, tmp_path: Path, cache: Path) -> None:
    other = SAMPLES["tree"].write(tmp_path / "other", cache)
    shutil.copy(other / EXTENSION, folder / EXTENSION)

    with pytest.warns(RuntimeWarning, match="it was built from other sources"):
        module = load_package(folder)

    assert module.backend == "numpy"


def test_an_extension_for_a_better_processor_is_named(folder: Path) -> None:
    engines = folder / "_runtime" / "_engines.py"
    engines.write_text(engines.read_text().replace("not native.lib.kinegen_select", "native.lib.kinegen_select"))

    with pytest.warns(RuntimeWarning, match="it was built for a processor with more instructions"):
        module = load_package(folder)

    assert module.backend == "numpy"


def test_a_future_numpy_is_not_trusted(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np, "__version__", "3.0.0")

    with pytest.warns(RuntimeWarning, match="it needs CPython and NumPy 1 or 2"):
        module = load_package(folder)

    assert module.backend == "numpy"


def started(folder: Path, code: str, *options: str) -> subprocess.CompletedProcess[str]:
    """What a new interpreter says that has the package on its path."""
    code = f"import sys; sys.path.insert(0, sys.argv[1])\n{code}"
    return subprocess.run(
        [sys.executable, "-B", *options, "-c", code, folder.parent], capture_output=True, text=True, check=True
    )


def test_a_package_without_an_extension_says_so_once_and_what_to_do(folder: Path) -> None:
    """As in a fresh clone, whose compiled files are not committed."""
    (folder / EXTENSION).unlink()

    done = started(folder, "import chain; import numpy; chain.fk(numpy.ones(3)); chain.fk(numpy.ones(3))")

    (warning,) = [line for line in done.stderr.splitlines() if "Warning" in line]
    assert warning.endswith(
        "RuntimeWarning: NumPy evaluates chain, about 50 times slower than C: "
        f"there is no {EXTENSION} here; `kinegen build` with a C compiler makes it"
    )
    assert "_engines.py" not in warning


def test_what_kinegen_builds_without_a_compiler_is_loaded_without_a_word(folder: Path) -> None:
    (folder / EXTENSION).unlink()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        module = load_package(folder)

    assert module.backend == "numpy"


def test_without_cffi_and_ctypes_numpy_takes_over_and_the_remedy_is_named(folder: Path) -> None:
    done = started(
        folder, "sys.modules['_cffi_backend'] = sys.modules['ctypes'] = None; import chain; print(chain.backend)"
    )

    assert done.stdout == "numpy\n"
    assert "_cffi_backend" in done.stderr
    assert "(pip install cffi)" in done.stderr
    assert "about 50 times slower" in done.stderr


def test_a_foreign_extension_is_named_without_cffi_too(folder: Path, tmp_path: Path, cache: Path) -> None:
    other = SAMPLES["tree"].write(tmp_path / "other", cache)
    shutil.copy(other / EXTENSION, folder / EXTENSION)

    done = started(folder, "sys.modules['_cffi_backend'] = None; import chain; print(chain.backend)")

    assert done.stdout == "numpy\n"
    assert "it was built from other sources" in done.stderr


def test_a_package_can_be_moved_and_renamed(folder: Path, tmp_path: Path) -> None:
    """Also into another package, as people do who vendor it."""
    target = tmp_path / "mine" / "vendored"
    shutil.copytree(folder, target)
    (tmp_path / "mine" / "__init__.py").write_text("")
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from mine.vendored import fk, backend; import pickle\n"
        "assert pickle.loads(pickle.dumps(fk)) is fk; print(backend, fk)"
    )

    done = subprocess.run([sys.executable, "-B", "-c", code, tmp_path], capture_output=True, text=True, check=True)

    assert done.stdout == "c <mine.vendored.fk: q (3,) to (4, 4), backend c (native, reproducible)>\n"
    assert done.stderr == ""


def test_two_versions_of_a_package_live_side_by_side(folder: Path, tmp_path: Path, cache: Path) -> None:
    other = SAMPLES["chain"].write(tmp_path / "other", cache)
    modules: list[ModuleType] = [load_package(folder), load_package(other)]

    assert [module.backend for module in modules] == ["c", "c"]
    assert modules[0].fk is not modules[1].fk
    assert np.array_equal(modules[0].fk(np.ones(3)), modules[1].fk(np.ones(3)))


def test_a_package_that_does_not_load_leaves_no_trace(tmp_path: Path) -> None:
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "__init__.py").write_text("from . import missing\n")
    before = set(sys.modules)

    with pytest.raises(ImportError):
        load_package(tmp_path / "broken")

    assert not [name for name in set(sys.modules) - before if "broken" in name]


def test_the_array_handling_is_copied_without_a_trace_of_us() -> None:
    for name in (*SHARED, *(each for names in FURTHER.values() for each in names)):
        text = resources.files("kinegen.runtime.vendored").joinpath(name).read_text()

        assert "import kinegen" not in text
        assert "from kinegen" not in text


def test_a_package_imports_quickly(folder: Path) -> None:
    """No heavy module comes along besides NumPy."""
    code = (
        "import sys, numpy; before = set(sys.modules); sys.path.insert(0, sys.argv[1]); import chain\n"
        "print(*{name.partition('.')[0] for name in set(sys.modules) - before})"
    )

    done = subprocess.run([sys.executable, "-B", "-c", code, folder.parent], capture_output=True, text=True, check=True)

    assert not {"cffi", "pycparser", "ctypes", "multiprocessing", "sympy", "kinegen"} & set(done.stdout.split())
