"""Compiled packages where cffi is not installed: the same kernels through ctypes, with the same bits."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from kinegen.model.outputs import parse_quantity
from kinegen.runtime.flags import Flags
from tests.builds.workshop import ARM, make, write_robot
from tests.native.conftest import SAMPLES, needs_compiler

pytestmark = needs_compiler

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

BLOCK = "sys.modules['_cffi_backend'] = sys.modules['cffi'] = None\n"

KERNELS = """
import hashlib, importlib, warnings
import numpy as np
warnings.simplefilter("error")
module = importlib.import_module(sys.argv[2])
assert module.backend == "c", module.backend
digest = hashlib.sha256()
called = 0

def add(*results):
    for result in results:
        for array in result if isinstance(result, tuple) else (result,):
            digest.update(np.ascontiguousarray(array).tobytes())

random = np.random.default_rng(7)
for name in module.__all__:
    kernel = getattr(module, name)
    if not hasattr(kernel, "bind"):
        continue
    called += 1
    for real in kernel._reals:
        for count in (None, 1, 5, 33, 40_000):
            lead = () if count is None else (count,)
            inputs = [random.uniform(-1, 1, lead + array.shape).astype(real) for array in kernel.inputs]
            add(kernel(*inputs), kernel(*inputs, threads=2))
            add(kernel(*(array[..., ::-1][..., ::-1] for array in inputs)))
            if module.__dict__.get("Params"):
                add(kernel(*inputs, params=module.Params(*(2 * value for value in module.Params()))))
                along = np.linspace(1, 2, count or 7)
                add(kernel(*inputs, params=module.Params(*(along * value for value in module.Params())), threads=2))
        single = [np.ascontiguousarray(array[0]) for array in inputs]
        results = [np.full(array.shape, 3, real) for array in kernel.results]
        kernel.bind(*single, *results)()
        add(tuple(results))
assert called, "the package has no kernels"
print(digest.hexdigest())
"""

SEARCH = """
import sys, hashlib, numpy as np
sys.path.insert(0, sys.argv[1])
import arm
q = np.random.default_rng(3).uniform(-1, 1, (50, arm.DOF))
for real in (float, np.float32):
    found = arm.numeric_inverse(arm.fk_jacobian(q.astype(real))[0], restarts=3, threads=2)
    digests = [hashlib.sha256(part.tobytes()).hexdigest() for part in found]
    print(arm.numeric_inverse.backend, found.solved.all(), digests)
"""


def run(code: str, *arguments: str | Path) -> str:
    """What a new interpreter prints."""
    done = subprocess.run([sys.executable, "-B", "-c", code, *arguments], capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", SAMPLES)
def test_every_kernel_gives_the_same_bits_without_cffi(name: str, tmp_path: Path, cache: Path) -> None:
    folder = SAMPLES[name].write(tmp_path, cache)
    # The samples have no list of names.
    module = folder / "__init__.py"
    module.write_text(
        module.read_text() + "\n__all__ = [name for name, o in list(globals().items()) if isinstance(o, Kernel)]\n"
    )
    path = "import sys; sys.path.insert(0, sys.argv[1])\n"

    with_cffi, without = (run(path + before + KERNELS, tmp_path, folder.name) for before in ("", BLOCK))

    assert with_cffi == without
    assert len(without) == 65


def test_the_search_gives_the_same_bits_without_cffi(tmp_path: Path) -> None:
    robot = tmp_path / "arm.yaml"
    robot.write_text((ROBOTS / "ur5.yaml").read_text().replace("name: ur5", "name: arm"))
    make(robot, tmp_path / "built", quantities=(parse_quantity("numeric_inverse"),))

    with_cffi, without = (run("import sys\n" + before + SEARCH, tmp_path / "built") for before in ("", BLOCK))

    assert with_cffi == without
    assert without.startswith("c True [")


def test_variants_are_chosen_without_cffi(tmp_path: Path) -> None:
    make(ROBOTS / "planar_3r.yaml", tmp_path, flags=Flags(portable=True))
    code = f"import sys, os\n{BLOCK}sys.path.insert(0, sys.argv[1])\n"
    code += "os.environ['KINEGEN_VARIANT'] = 'baseline'; import planar_3r; print(planar_3r.fk.variant)"

    assert run(code, tmp_path).startswith("baseline")


RELOAD = """
import importlib, shutil, sys
from pathlib import Path
import numpy as np
sys.path.insert(0, sys.argv[1])
import arm
before = arm.fk
place = Path(arm.__file__).parent
shutil.rmtree(place)
shutil.copytree(sys.argv[2], place)
importlib.reload(arm)
print(arm.backend, arm.fk(np.zeros(2))[2, 3], before(np.zeros(2))[2, 3])
"""


def test_an_address_needs_cffi(tmp_path: Path) -> None:
    make(write_robot(tmp_path), tmp_path / "built")
    code = "import sys\n" + BLOCK + "sys.path.insert(0, sys.argv[1])\nimport arm\n"
    code += "try:\n    arm.fk.address\nexcept AttributeError as error:\n    print(error)\n"

    assert run(code, tmp_path / "built").strip() == "address needs cffi, which is not installed (pip install cffi)"


def test_a_rebuilt_package_is_reloaded_without_cffi(tmp_path: Path) -> None:
    for folder, length in (("old", "0.25"), ("new", "0.75")):
        robot = write_robot(tmp_path, ARM.replace("d: 0.25", f"d: {length}"))
        make(robot, tmp_path / folder)

    printed = run("import sys\n" + BLOCK + RELOAD, tmp_path / "old", tmp_path / "new" / "arm")

    assert printed.split() == ["c", "0.75", "0.25"]
