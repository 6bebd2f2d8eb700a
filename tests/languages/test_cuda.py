"""The CUDA form without a GPU: its bits beside C, its Python module on a stand-in of CuPy, and NVRTC."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.cuda import compile_kernels, nvrtc_file
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError, ProofError
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import NUMERIC_INVERSE, Quantity, parse_quantity
from kinegen.verify import reference
from kinegen.verify.invocations import DTYPES
from kinegen.verify.language_build import prepared
from kinegen.verify.languages import prove_language
from tests.emit.emitted import kernels, robot, run
from tests.emit.handwritten import KERNELS
from tests.languages.standin_cupy import Stood, Tensor, stand_in

CUDA = LANGUAGES["cuda"]
POSE = (Quantity.POSE,)

needs_gcc = pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian: apt-get install g++)")
needs_nvrtc = pytest.mark.skipif(
    nvrtc_file() is None, reason="needs NVRTC (pip install --target build/nvrtc nvidia-cuda-nvrtc-cu12)"
)


@cache
def files(name: str) -> dict[str, str]:
    """The files of a robot, without their folder."""
    return {path.rpartition("/")[2]: text for path, text in emit_language(kernels(name, POSE), CUDA).items()}


def module(name: str, folder: Path) -> ModuleType:
    """The Python module of a robot."""
    for file, text in files(name).items():
        (folder / file).write_text(text, encoding="utf-8")
    place = folder / "__init__.py"
    spec = importlib.util.spec_from_file_location(f"{name}_cuda", place, submodule_search_locations=[str(folder)])
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    spec.loader.exec_module(made)
    return made


@pytest.fixture
def cupy(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The stand-in in place of CuPy."""
    made = stand_in()
    monkeypatch.setitem(sys.modules, "cupy", made)
    return made


def on_device(array: Any) -> Any:
    return np.asarray(array).view(Stood)


@needs_gcc
def test_every_layout_goes_through_cupy(cupy: Any, tmp_path: Path) -> None:
    arm, q = module("puma560", tmp_path), np.random.default_rng(1).uniform(-3, 3, (300, 6))
    wanted = reference.pose(robot("puma560"), q)[:, 0]

    whole, upper = arm.fk(on_device(q)), arm.fk(on_device(q), layout="3x4")
    major = arm.fk(on_device(q.T), layout="joint_major")
    assert np.abs(whole - wanted).max() < 1e-14
    assert np.array_equal(upper, whole[:, :3])
    assert np.array_equal(major.T.reshape(-1, 3, 4), upper)
    assert np.array_equal(arm.fk(on_device(q.T).T), whole)
    assert np.array_equal(arm.fk(on_device(q.reshape(2, 150, 6)))[1, 3], whole[153])
    assert np.array_equal(arm.fk(on_device(q[5])), whole[5])
    assert np.array_equal(arm.fk(on_device(q[::-2])), whole[::-2])
    assert arm.fk(on_device(q[:0])).shape == (0, 4, 4)
    options = [entry for entry in cupy.log if isinstance(entry, tuple) and "-fmad=false" in entry]
    assert len(options) == 3
    assert all("-DKINEGEN_PUMA560_WITH_fk" in each for each in options)
    assert ("puma560_fk_rows", (3,), (128,)) in cupy.log


def torch_stand_in(monkeypatch: pytest.MonkeyPatch, stream: int = 4711) -> Any:
    """A module in place of PyTorch, whose tensors are `Tensor`."""
    torch: Any = ModuleType("torch")
    torch.Tensor, torch.from_dlpack = Tensor, Tensor
    torch.cuda = SimpleNamespace(current_stream=lambda _device: SimpleNamespace(cuda_stream=stream))
    monkeypatch.setitem(sys.modules, "torch", torch)
    monkeypatch.setattr(Tensor, "__module__", "torch")
    return torch


@needs_gcc
def test_tensors_go_back_to_their_library_on_their_stream(
    cupy: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By CUDA's protocol for streams; by the pointer where CuPy is older than 14."""
    torch_stand_in(monkeypatch)
    q, arm = Tensor(np.zeros((2, robot("scara").dof), np.float32)), module("scara", tmp_path)

    found = arm.fk(q)
    assert isinstance(found, Tensor)
    assert found.array.dtype == np.float32
    assert cupy.log[:2] == ["device 0", "stream 4711, version 0"]
    assert cupy.log[-1] == ("scara_f32_fk_rows", (1,), (128,))
    del cupy.cuda.Stream.from_external, cupy.log[:]
    arm.fk(q)
    assert cupy.log[:2] == ["device 0", "pointer 4711"]


@needs_gcc
def test_classes_of_ones_own_go_back_to_the_library_they_are_made_from(
    cupy: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where their own module takes everything from NumPy, and where it is in no module."""
    torch_stand_in(monkeypatch)
    mine: Any = ModuleType("mine")
    mine.from_dlpack = np.from_dlpack
    monkeypatch.setitem(sys.modules, "mine", mine)
    arm, q = module("scara", tmp_path), np.zeros((2, robot("scara").dof))

    for place in ("mine.tensors", "nowhere"):
        kind = type("Mine", (Tensor,), {"__module__": place})
        assert type(arm.fk(kind(q))) is Tensor
    assert cupy.log


def test_libraries_that_take_nothing_back_are_refused_before_the_launch(
    cupy: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "tensorflow", ModuleType("tensorflow"))
    kind = type("EagerTensor", (Tensor,), {"__module__": "tensorflow.python.framework.ops"})
    monkeypatch.setattr(Tensor, "__module__", "tensorflow")
    with pytest.raises(TypeError, match=r"fk: q is tensorflow.EagerTensor, of a library without from_dlpack"):
        module("scara", tmp_path).fk(kind(np.zeros((2, robot("scara").dof))))
    assert cupy.log == []


@needs_gcc
def test_parameters_on_the_device_are_read_where_they_are(
    cupy: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm, q = module("calibrated_2r", tmp_path), on_device(np.full((3, 2), 0.3))
    values = [7.0 + 0.5 * place for place in range(len(robot("calibrated_2r").runtime_parameters))]
    wanted = arm.fk(q, params=values)

    monkeypatch.setattr(cupy, "asarray", None)  # nothing is copied from the host
    assert np.array_equal(arm.fk(q, params=on_device(values)), wanted)
    assert np.array_equal(arm.fk(q, params=on_device(np.array(values, np.float32))), wanted), (
        "other types are converted"
    )
    assert np.array_equal(arm.fk(q, params=Tensor(np.array(values))), wanted)
    with pytest.raises(ValueError, match=r"fk: params are .*; params has shape \(1, \d\)"):
        arm.fk(q, params=on_device([values]))


@needs_gcc
def test_parameters_are_given_in_order_or_by_name(cupy: Any, tmp_path: Path) -> None:
    del cupy
    arm = module("calibrated_2r", tmp_path)
    names = [each.name for each in robot("calibrated_2r").runtime_parameters]
    values = dict.fromkeys(names, 0.0) | {"L1": 7.0}
    q = on_device(np.zeros((1, 2)))

    assert np.array_equal(arm.fk(q, params=values), arm.fk(q, params=list(values.values())))
    assert not np.array_equal(arm.fk(q, params=values), arm.fk(q))
    with pytest.raises(ValueError, match="fk: params are"):
        arm.fk(q, params={"L1": 7.0})


@needs_gcc
@pytest.mark.languages
def test_the_proof_launches_kernels_where_it_can(cupy: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """On the stand-in, which gives the bits of the processor, and on one that does not."""
    given = kernels("planar_3r", POSE)
    prove_language(given, CUDA, emit_language(given, CUDA))
    assert {entry[0] for entry in cupy.log if len(entry) == 3} >= {"planar_3r_fk_rows", "planar_3r_f32_fk_rows"}

    monkeypatch.setattr(cupy, "asnumpy", lambda array: np.nextafter(np.asarray(array), 7))
    with pytest.raises(ProofError, match="fk gives other bits on the GPU"):
        prove_language(given, CUDA, emit_language(given, CUDA))


def test_what_cannot_be_launched_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arm, q = module("puma560", tmp_path), np.zeros((2, 6))
    monkeypatch.setitem(sys.modules, "cupy", None)
    with pytest.raises(ImportError, match=r"puma560_cuda needs CuPy \(pip install cupy-cuda13x, or cupy-cuda12x where"):
        arm.fk(q)
    made = stand_in()
    monkeypatch.setitem(sys.modules, "cupy", made)
    cases: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
        "q is numpy.ndarray, not on a GPU": ((q,), {}),
        "takes 1 arrays": ((), {}),
        r"q has shape \(2, 5\), expected \(..., 6\)": ((on_device(q[:, :5]),), {}),
        r"q has shape \(\), expected": ((on_device(0.0),), {}),
        r"q has shape \(2, 6\), expected \(6, N\)": ((on_device(q),), {"layout": "joint_major"}),
        "q is int64": ((on_device(q.astype(int)),), {}),
        "layout is 'rows'": ((on_device(q),), {"layout": "rows"}),
        "no runtime parameters": ((on_device(q),), {"params": [1.0]}),
    }
    for message, (inputs, options) in cases.items():
        with pytest.raises((TypeError, ValueError), match=message):
            arm.fk(*inputs, **options)
    made.cuda.runtime.getDeviceCount = lambda: 0
    with pytest.raises(RuntimeError, match="needs an NVIDIA GPU"):
        arm.fk(q)


def test_every_operator_is_printed() -> None:
    text = emit_language(KERNELS, CUDA)["cuda/made_up.cuh"]

    for line in ("const Real t2 = params.far / params.lambda;", "const Real t6 = square_root(t2);"):
        assert f"    {line}\n" in text


@pytest.mark.parametrize("name", ["threadIdx", "double4", "cub", "rsqrt", "index"])
def test_words_of_cuda_are_refused(name: str) -> None:
    given = kernels("scara")
    renamed = replace(given, robot=replace(given.robot, name=name))
    with pytest.raises(KinegenError, match=rf"robot name '{name}' is a word of CUDA"):
        emit_language(renamed, CUDA)


def test_parameters_with_names_of_built_in_variables_are_refused(tmp_path: Path) -> None:
    given = kernels("calibrated_2r")
    first, *others = given.robot.parameters
    renamed = replace(given.robot, parameters=(replace(first, name="blockIdx"), *others))
    with pytest.raises(KinegenError, match="parameter name 'blockIdx' is a word of CUDA"):
        emit_language(replace(given, robot=renamed), CUDA)


def test_the_search_is_refused_with_a_reason() -> None:
    assert "it is a search" in CUDA.refuses(NUMERIC_INVERSE)


@needs_gcc
def test_the_example_of_the_page_compiles_and_runs(tmp_path: Path) -> None:
    module("puma560", tmp_path)
    example = Path(__file__).resolve().parents[2] / "docs" / "examples" / "reach.cu"
    command = ["g++", "-std=c++17", "-x", "c++", "-ffp-contract=off", f"-I{tmp_path}", str(example)]
    run([*command, "-o", str(tmp_path / "reach")])

    assert run([str(tmp_path / "reach")]).startswith("within 0.50 m: ")


@needs_gcc
@pytest.mark.languages
def test_an_arm_with_a_redundancy_is_proven() -> None:
    """Against the reference, and with the bits of C: seven joints with an arm angle."""
    given = kernels("iiwa14_arm_angle", tuple(map(parse_quantity, ("pose", "quaternion_wxyz", "twist", "inverse"))))
    comparisons = prove_language(given, CUDA, emit_language(given, CUDA))

    assert {comparison.quantity for comparison in comparisons} == {program.quantity for program in given.programs}
    assert {comparison.real for comparison in comparisons} == {"double", "float"}


@needs_gcc
@pytest.mark.languages
@pytest.mark.proves("cuda")
def test_every_robot_has_the_bits_of_c(language: str, name: str) -> None:
    """Poses and inverses in every layout and both number types, with numbers out of range among the inputs."""
    given = _pose_and_inverse(name)
    with prepared(given, LANGUAGES[language], emit_language(given, LANGUAGES[language])) as ready:
        for real in ScalarType:
            plain = ready.plain(real)
            for program in ready.kernels.programs:
                inputs = _inputs(ready.kernels, program.quantity, real)
                wanted = plain.call(program, inputs)
                for is_batch in (False, True)[: 1 + any(array.size for array in program.signature.inputs)]:
                    found = ready.call(program, inputs, None, real=real, is_batch=is_batch)
                    for one, other in zip(found, wanted, strict=True):
                        assert np.array_equal(one, other, equal_nan=True)


def _pose_and_inverse(name: str) -> RobotPrograms:
    programs = [lower(derive(robot(name), Quantity.POSE))]
    with suppress(KinegenError):  # those that have none
        programs.append(lower(derive(robot(name), parse_quantity("inverse"))))
    return RobotPrograms(robot(name), tuple(programs), runtime_defaults(robot(name)))


def _inputs(given: RobotPrograms, quantity: Quantity, real: str) -> tuple[Any, ...]:
    """Joint values, some of which are none, or the poses of those."""
    q = np.random.default_rng(7).uniform(-3, 3, (77, given.robot.dof))
    q[::9] *= np.array([np.nan, 1e30, np.inf, -1e5, 1e-30, 0.0, 1e9, -np.inf, 1.0])[:, None][: len(q[::9])]
    if quantity == Quantity.POSE:
        return (q.astype(DTYPES[real]),)
    poses = [reference.pose(given.robot, np.nan_to_num(q, posinf=0.0, neginf=0.0))[:, 0]]
    if given.robot.redundancy:
        poses.append(reference.redundancy(given.robot, np.nan_to_num(q)))
    with np.errstate(over="ignore"):  # what is too large for a float becomes infinite
        return tuple(each.astype(DTYPES[real]) for each in poses)


@needs_nvrtc
@pytest.mark.languages
@pytest.mark.parametrize("name", ["puma560", "ur5", "panda", "iiwa14"])
def test_nvrtc_compiles_without_spills_and_contractions(name: str) -> None:
    given = _pose_and_inverse(name)
    for architecture in ("sm_70", "sm_90"):
        found, ptx = compile_kernels(given, architecture)
        assert len(found) == 10 if len(given.programs) > 1 else 6
        assert [each for each in found if each.spilled] == []
        assert re.findall(r"\bfma\.", ptx) == []
        assert f".target {architecture}" in ptx
    contracted = compile_kernels(given, "sm_90", ("fk",), ("--std=c++17",))[1]
    assert re.search(r"\bfma\.", contracted), "without -fmad=false there are some"


@needs_nvrtc
@pytest.mark.languages
def test_fast_math_is_refused() -> None:
    with pytest.raises(RuntimeError, match="-use_fast_math, -ftz=true and -prec-div=false break"):
        compile_kernels(kernels("scara"), "sm_90", (), ("--std=c++17", "-use_fast_math"))


@pytest.mark.languages
@pytest.mark.skipif(shutil.which("nvcc") is None, reason="needs nvcc")
def test_nvcc_compiles_the_example_of_the_page(tmp_path: Path) -> None:
    module("puma560", tmp_path)
    example = Path(__file__).resolve().parents[2] / "docs" / "examples" / "reach.cu"
    command = ["nvcc", "-arch=sm_80", "-fmad=false", "-Werror", "all-warnings", f"-I{tmp_path}", "-cubin", str(example)]
    done = subprocess.run([*command, "-o", str(tmp_path / "reach.cubin")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
