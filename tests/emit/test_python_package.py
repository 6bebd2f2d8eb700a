"""The generated package: clean under the project's own tools, typed, picklable, and in need of NumPy alone."""

from __future__ import annotations

import ast
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.python.package import emit_package
from kinegen.backends.python.vendored import BANNER
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.io.load import loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import USUAL
from kinegen.runtime.extension import lay_out
from kinegen.support.naming import RUNTIME
from tests.emit.emitted import NAMES, ROOT, everything, kernels, robot, texts

VENDORED = ROOT / "kinegen" / "runtime" / "vendored"

ODD = (
    """
kinegen: 1
name: odd
description: >-
  Ends in a quote "{filler} a backslash \\\\ and a very long description that no line of a hundred and twenty characters
  could ever hold, since it says """
    """twice what everybody knows, and then again, just to be sure of it ...
convention: standard
units: {{length: mm, angle: deg}}
parameters:
  count: {{value: 12.5, runtime: true}}
  index: {{value: 3, runtime: true}}
  lambda: {{value: 7, runtime: true}}
  class_1: {{value: 1, runtime: true}}
joints:
  - {{name: lambda_1, theta: q, d: lambda, a: count, alpha: 90}}
  - {{name: print, theta: q, d: index, a: class_1, alpha: 0, limits: [-10, 10]}}
"""
)

BLOCKED = """
import sys

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {"cffi", "sympy", "kinegen", "mpmath", "jinja2", "yaml", "click", "scipy"}:
            raise ImportError(name + " is not there")

sys.meta_path.insert(0, Block())
sys.path.insert(0, sys.argv[1])
"""


def python(code: str, *arguments: str | Path) -> str:
    """Run Python apart from this checkout, with warnings as errors."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    command = [sys.executable, "-W", "error", "-W", "ignore:NumPy evaluates", "-B", "-c", code, *arguments]
    done = subprocess.run(command, cwd="/", env=environment, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    return done.stdout


def odd(**changes: str) -> dict[str, str]:
    """The Python files of a robot that uses every freedom of the format, built for double alone."""
    text = ODD.format(filler='""""')
    for before, after in changes.items():
        text = text.replace(before, after)
    arm = loads(text, "odd.yaml")
    given = RobotPrograms(arm, tuple(lower(derive(arm, quantity)) for quantity in USUAL), runtime_defaults(arm))
    return emit_formula(given) | emit_package(given, (ScalarType.DOUBLE,), "0123456789abcdef")


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder `generated` with several packages, under the project's configuration."""
    root = tmp_path_factory.mktemp("checkout")
    shutil.copy(ROOT / "pyproject.toml", root)
    packages = {name: texts(name) for name in NAMES} | {"odd": odd()}
    for name, files in packages.items():
        lay_out(root / "generated" / name, files)
    return root / "generated"


def test_an_older_python_is_refused_with_a_sentence(generated: Path) -> None:
    code = "import sys; sys.version_info = (3, 9, 18); sys.path.insert(0, sys.argv[1]); import hand"
    command = [sys.executable, "-B", "-c", code, str(generated)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode == 1
    assert done.stderr.endswith("ImportError: hand needs Python 3.10 or newer; this is Python 3.9\n")


# D301: quotes and backslashes of an odd description are escaped, which reads no worse than a raw string.
@pytest.mark.parametrize("command", [["check", "--extend-ignore=D301"], ["format", "--diff"]])
def test_generated_modules_are_clean_under_ruff(command: list[str], generated: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "ruff", *command, "--no-cache", "generated"],
        cwd=generated.parent,
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stdout + done.stderr


def test_generated_modules_are_strictly_typed(generated: Path, tmp_path: Path) -> None:
    """And so is code that uses them; what they offer is not Any."""
    user = generated.parent / "user.py"
    user.write_text(
        """
from collections.abc import Callable
from typing import Any, assert_type

import numpy as np
from numpy.typing import NDArray

import hand
import calibrated_2r

q = np.zeros((5, calibrated_2r.DOF))
assert_type(calibrated_2r.fk(q, params=calibrated_2r.Params(L1=0.5), threads=2), NDArray[np.floating[Any]])
assert_type(calibrated_2r.LIMITS, tuple[tuple[float, float] | None, ...])
assert_type(hand.TIPS, tuple[str, ...])
assert_type(hand.DOF, int)
assert_type(calibrated_2r.fk.bind(q, q), Callable[[], object])
assert_type(hand.fk.by_name(q)["thumb_tip"], NDArray[np.floating[Any]])
calibrated_2r.fk(q=q, layout="3x4")
names: tuple[str, ...] = hand.JOINTS + hand.FRAMES
""",
        encoding="utf-8",
    )
    options = ["--strict", "--cache-dir", str(ROOT / ".mypy_cache" / "generated"), "--config-file", os.devnull]
    options += ["--disable-error-code", "import-not-found"]  # in torch.py and jax.py of _runtime/, without them
    packages = [generated / name for name in ("hand", "calibrated_2r", "blocks")]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, user, *packages],
        cwd=generated.parent,
        env=os.environ | {"MYPYPATH": str(generated)},
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", ["puma560", "scara"])
def test_the_numpy_form_of_every_quantity_has_right_types(name: str, tmp_path: Path) -> None:
    """Roots, arc tangents and selections of the closed-form inverses and orientations too."""
    (tmp_path / "_numpy.py").write_text(emit_formula(everything(name))["_numpy.py"], encoding="utf-8")
    options = ["--strict", "--cache-dir", str(ROOT / ".mypy_cache" / "generated"), "--config-file", os.devnull]
    command = [sys.executable, "-m", "mypy", *options, "_numpy.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("call", "error"),
    [
        ("hand.fk(q, q)", "Too many positional arguments"),
        ("hand.fk()", 'Missing positional argument "q"'),
        ("hand.fk(q, treads=2)", 'Unexpected keyword argument "treads"'),
        ("hand.fk(q, params=None)", 'Unexpected keyword argument "params"'),
        ("hand.position(q, layout='3x4')", 'Argument "layout"'),
        ("calibrated_2r.fk(q, params=0.5)", 'Argument "params"'),
    ],
)
def test_a_wrong_argument_is_a_type_error(call: str, error: str, generated: Path, tmp_path: Path) -> None:
    user = tmp_path / "wrong.py"
    user.write_text(f"import numpy as np\nimport hand, calibrated_2r\nq = np.zeros(17)\n{call}\n", encoding="utf-8")
    options = ["--strict", "--cache-dir", str(ROOT / ".mypy_cache" / "generated"), "--config-file", os.devnull]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, user],
        cwd=tmp_path,
        env=os.environ | {"MYPYPATH": str(generated)},
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 1
    assert f"wrong.py:4: error: {error}" in done.stdout


@pytest.mark.parametrize("arm", [*NAMES, "odd"])
def test_a_package_needs_numpy_alone(arm: str, generated: Path) -> None:
    """Imported from anywhere, in a process where nothing else can be."""
    code = f"{BLOCKED}\nimport {arm} as arm, numpy\nprint(arm.fk(numpy.zeros((3, arm.DOF))).shape, arm.backend)"
    tips = f"{len(robot(arm).tips)}, " if arm != "odd" and robot(arm).is_tree else ""

    assert python(code, generated) == f"(3, {tips}4, 4) numpy\n"


def test_importing_a_package_imports_little(generated: Path) -> None:
    """Nothing of the standard library that takes long to import, beyond what NumPy takes."""
    code = "import sys, numpy\nbefore = set(sys.modules)\nsys.path.insert(0, sys.argv[1])\nimport puma560\n"
    code += "print(*sorted({name.split('.')[0] for name in set(sys.modules) - before}))"
    heavy = {"asyncio", "multiprocessing", "email", "http", "xml", "unittest", "importlib_metadata", "cffi", "inspect"}

    assert set(python(code, generated).split()) & heavy == set()


def test_kernels_pickle_by_name_and_copy(generated: Path) -> None:
    code = """
import copy, pickle, sys
sys.path.insert(0, sys.argv[1])
import calibrated_2r as arm
for thing in (arm.fk, arm.frames, arm.position, arm.Params(1.0, 2.0)):
    again = pickle.loads(pickle.dumps(thing))
    assert again == thing and type(again) is type(thing)
assert pickle.loads(pickle.dumps(arm.fk)) is arm.fk is copy.deepcopy(arm.fk)
print(pickle.dumps(arm.fk).count(b"calibrated_2r"))
"""

    assert int(python(code, generated)) == 1


@pytest.mark.parametrize("arm", ["puma560", "blocks"])
def test_the_example_of_the_docstring_runs(arm: str, generated: Path) -> None:
    code = """
import doctest, importlib, sys
sys.path.insert(0, sys.argv[1])
module = importlib.import_module(sys.argv[2])
result = doctest.testmod(module)
print(result.attempted, result.failed)
"""

    assert python(code, generated, arm) == "3 0\n"


@pytest.mark.parametrize("arm", NAMES)
def test_all_names_what_is_public(arm: str) -> None:
    """Every name in `__all__` exists; every other one begins with an underscore or is the `annotations` import."""
    tree = ast.parse(texts(arm)["__init__.py"])
    defined: set[str] = set()
    exported: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            defined.add(node.target.id)
        elif isinstance(node, ast.ClassDef):
            defined.add(node.name)
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            if node.targets[0].id == "__all__":
                exported = ast.literal_eval(node.value)
            defined.add(node.targets[0].id)
    expected = {name for name in defined if not name.startswith("_")}

    assert set(exported) == expected
    assert len(exported) == len(set(exported))
    assert ("Params" in exported) == bool(robot(arm).runtime_parameters)
    assert ("TIPS" in exported) == robot(arm).is_tree


def test_the_docstring_of_a_package_says_what_a_user_asks() -> None:
    text = ast.get_docstring(ast.parse(texts("calibrated_2r")["__init__.py"]))

    assert text
    assert text.splitlines()[0] == "Forward kinematics of calibrated_2r."
    assert "Planar arm with two joints, calibrated" in text
    assert "angles in rad and lengths in m" in text
    assert "q[0]  joint_1  revolute   rad  -2.96706 to 2.96706" in text


@pytest.mark.parametrize("arm", ["puma560", "hand", "calibrated_2r"])
def test_the_frames_and_tips_of_a_package_are_the_robots(arm: str, generated: Path) -> None:
    names = python(
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        f"import {arm} as arm; print(arm.FRAMES, arm.JOINTS, getattr(arm, 'TIPS', None), sep='|')",
        generated,
    )
    found = [ast.literal_eval(part) for part in names.split("|")]
    given = robot(arm)

    assert found[0] == given.frame_names
    assert found[1] == tuple(variable.name for variable in given.variables)
    assert found[2] == (given.tips if given.is_tree else None)


def test_a_package_names_the_build_of_what_it_was_built_without(generated: Path) -> None:
    """`hasattr`, `dir` and star imports see what is there, and kernels are pickled by their names."""
    code = """
import pickle, sys
sys.path.insert(0, sys.argv[1])
import hand, odd
names = "jacobian", "frames_thumb", "fk_thumb_tip", "no"
for module, name in [*((hand, name) for name in names), (odd, "inverse")]:
    assert not hasattr(module, name) and name not in dir(module) and getattr(module, name, 1) == 1
    try:
        getattr(module, name)
    except AttributeError as error:
        print(error)
scope = {}
exec("from hand import *", scope)
assert set(hand.__all__) == scope.keys() - {"__builtins__"}
assert pickle.loads(pickle.dumps(hand.fk)) is hand.fk
"""

    assert python(code, generated).splitlines() == [
        "hand was built without jacobian: kinegen build hand.yaml --outputs pose,frames,position,jacobian",
        "module 'hand' has no attribute 'frames_thumb'",
        "hand was built without pose@thumb_tip: kinegen build hand.yaml --outputs pose,frames,position,pose@thumb_tip",
        "module 'hand' has no attribute 'no'",
        "odd was built without inverse: kinegen build odd.yaml --outputs pose,frames,position,inverse",
    ]


@pytest.mark.parametrize("source", ["my arm.yaml", 'a"b\\c.yaml', "ä'.yaml", "{0}.yaml", "<text>", "a\nb.yaml"])
def test_any_name_of_a_file_is_printed_as_it_is(source: str) -> None:
    arm = replace(robot("screw"), source=source)
    kernels = RobotPrograms(arm, (lower(derive(arm, USUAL[0])),), ())
    text = emit_package(kernels, (ScalarType.DOUBLE,), "0123456789abcdef")["__init__.py"]
    (call,) = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call) and named(node) == "absent"]
    given = {each.arg: each.value for each in call.keywords}
    found = ast.literal_eval(given["source"])

    assert found == source if source.startswith("<") else shlex.split(found) == [" ".join(source.split())]
    assert ast.literal_eval(given["outputs"]) == ("pose",)


def named(call: ast.Call) -> str:
    """What a call calls."""
    return ast.unparse(call.func)


def test_vendored_modules_have_the_same_bytes_for_every_robot() -> None:
    """After the banner, word for word what kinegen/runtime/vendored/ holds."""
    packages = [*map(texts, NAMES), odd()]
    found = {(file, text) for files in packages for file, text in files.items() if file.startswith(f"{RUNTIME}/")}

    assert len(found) == len({file for file, _ in found}) > 15
    for file, text in found:
        assert text == BANNER + (VENDORED / file.removeprefix(f"{RUNTIME}/")).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_a_package_has_few_python_files_of_its_own(name: str) -> None:
    own = {file for file in texts(name) if file.endswith((".py", ".pyi")) and "/" not in file}

    assert own == {"__init__.py", "__init__.pyi", "_numpy.py", "jax.py", "torch.py", "xp.py"}


def test_the_numpy_form_of_a_bad_angle_is_nan_as_in_c(generated: Path) -> None:
    code = """
import sys, numpy as np
sys.path.insert(0, sys.argv[1])
import puma560 as arm
q = np.zeros((4, 6))
q[1, 0], q[2, 0], q[3, 0] = np.nan, np.inf, 1.01e5
found = arm.position(q)
assert np.isfinite(found[0]).all() and np.isnan(found[1:, :2]).all() and np.isfinite(found[:, 2]).all()
single = arm.position(np.array([[12000.0] + [0] * 5, [12100.0] + [0] * 5], np.float32))
assert single.dtype == np.float32 and np.isfinite(single[0]).all() and np.isnan(single[1, :2]).all()
"""

    python(code, generated)


def test_dividing_by_a_runtime_parameter_that_is_zero_is_as_in_c(tmp_path: Path) -> None:
    """An infinity or a NaN in the poses, not an exception."""
    lay_out(tmp_path / "odd", odd(**{"a: class_1": "a: class_1/lambda"}))
    code = """
import sys, numpy as np
sys.path.insert(0, sys.argv[1])
import odd as arm
for real in (np.float64, np.float32):
    found = arm.position(np.zeros((2, 2), real), params=arm.Params(lambda_=0.0))
    assert found.dtype == real and np.isinf(found[:, 0]).all(), found
"""

    python(code, tmp_path)


def test_counts_in_the_docstrings_are_those_of_the_program() -> None:
    given = kernels("puma560")
    text = texts("puma560")["__init__.py"]

    for program in given.programs:
        multiplications = sum(statement.operator.value == "mul" for statement in program.statements)

        assert f"    {multiplications} multiplications, " in text
