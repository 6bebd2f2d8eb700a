"""A wrong kernel cannot pass: what an emitter prints is broken on purpose, and the build refuses it."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import CompileError, ProofError
from kinegen.model.outputs import Quantity
from kinegen.runtime.compile import Extension
from kinegen.verify import package_proof
from tests.builds.workshop import TREE, make, picture, write_robot

Change = Callable[[str], str]

EMITTERS = {
    "emit_kernel": "kinegen.backends.c.kernel",
    "emit_batch": "kinegen.backends.c.batch",
    "emit_numeric_inverse": "kinegen.backends.c.numeric_inverse",
    "emit_formula": "kinegen.backends.python.formula",
    "emit_package": "kinegen.backends.files",
}
"""Where each emitter is looked up when files are printed."""


def first(pattern: str, replacement: str, after: str = "") -> Change:
    """Replace the first place that matches, behind a text."""

    def change(text: str) -> str:
        head, mark, rest = text.partition(after) if after else ("", "", text)
        return head + mark + re.sub(pattern, replacement, rest, count=1, flags=re.DOTALL)

    return change


def break_emitter(monkeypatch: pytest.MonkeyPatch, emitter: str, suffix: str, change: Change, real: Any = None) -> None:
    """Change one file of what an emitter prints, for one number type or for all."""
    module = importlib.import_module(EMITTERS[emitter])
    honest = getattr(module, emitter)

    def dishonest(kernels: Any, *rest: Any) -> dict[str, str]:
        texts: dict[str, str] = honest(kernels, *rest)
        if real is not None and rest[0] is not real:
            return texts
        name = next(name for name in texts if name.endswith(suffix))
        broken = change(texts[name])

        assert broken != texts[name], "nothing was broken"
        return texts | {name: broken}

    monkeypatch.setattr(module, emitter, dishonest)


KERNEL = "void arm_fk("
KERNEL_F32 = "void arm_f32_fk("
TILE = "_tile("

TWICE = r"base_T_tool\[3\] = (\w+);(.*?)base_T_tool\[7\] = (\w+);"
NAN = "(q[0] - q[0]) / (q[0] - q[0])"

# Emitter, file, change, number type, and what the message names.
BREAKS = {
    "a sign, C double": ("emit_kernel", ".c", first(r" \+ ", " - ", KERNEL), ScalarType.DOUBLE, "C double"),
    "a sign, C float": ("emit_kernel", ".c", first(r" \+ ", " - ", KERNEL_F32), ScalarType.FLOAT, "C float"),
    "a sign, batch of doubles": (
        "emit_batch",
        ".c",
        first(r"0\.25", "-0.25", TILE),
        ScalarType.DOUBLE,
        "C double, batch",
    ),
    "a sign, batch of floats": (
        "emit_batch",
        ".c",
        first(r"0\.25F", "-0.25F", TILE),
        ScalarType.FLOAT,
        "C float, batch",
    ),
    "a sign, NumPy": ("emit_formula", "_numpy.py", first(r" \* ", " + ", "def fk("), None, "NumPy double"),
    "two entries exchanged": (
        "emit_kernel",
        ".c",
        first(TWICE, r"base_T_tool[7] = \1;\2base_T_tool[3] = \3;"),
        ScalarType.DOUBLE,
        "C double",
    ),
    "the last row": ("emit_kernel", ".c", first(r"\[15\] = 1", "[15] = 2"), ScalarType.DOUBLE, "C double"),
    "the tenth digit of a length": (
        "emit_kernel",
        ".c",
        first(r"0\.25", "0.2500000001", "#define ARM_D"),
        ScalarType.DOUBLE,
        "C double",
    ),
    "the fourteenth digit of a length": (
        "emit_kernel",
        ".c",
        first(r"0\.25", "0.25000000000005", "#define ARM_D"),
        ScalarType.DOUBLE,
        "C double",
    ),
    "half a micrometre in a float": (
        "emit_kernel",
        ".c",
        first(r"0\.25F", "0.2500005F", "#define ARM_F32_D"),
        ScalarType.FLOAT,
        "C float",
    ),
    "half a micrometre in a float of NumPy": (
        "emit_formula",
        "_numpy.py",
        first(r"0\.25\b", "0.2500006", "def fk("),
        None,
        "NumPy double",
    ),
    "a sine of doubles fifty times worse than promised": (
        "emit_kernel",
        ".c",
        first(r"- 0\.1666666666666\d+", "- 0.16666666666667666"),
        ScalarType.DOUBLE,
        "C double",
    ),
    "a sine of floats fifty times worse than promised": (
        "emit_kernel",
        ".c",
        first(r"- 0\.1666\d+F", "- 0.166672F"),
        ScalarType.FLOAT,
        "C float",
    ),
    "the fifth digit of a float": (
        "emit_kernel",
        ".c",
        first(r"0\.25F", "0.25003F", "#define ARM_F32_D"),
        ScalarType.FLOAT,
        "C float",
    ),
    "a double that was a float": (
        "emit_kernel",
        ".c",
        first(r"0\.8660254037844386", "0.8660254", KERNEL),
        ScalarType.DOUBLE,
        "C double",
    ),
    "a coefficient of the sine": (
        "emit_kernel",
        ".c",
        first(r"- 0\.166666", "- 0.166667"),
        ScalarType.DOUBLE,
        "C double",
    ),
    "one of two equal parameters for the other": (
        "emit_kernel",
        ".c",
        first("params->near", "params->far", KERNEL),
        ScalarType.DOUBLE,
        "C double, other parameters",
    ),
    "a parameter that is not read": (
        "emit_batch",
        ".c",
        first("params->far", "0.5F", "take_params("),
        ScalarType.FLOAT,
        "C float, batch pose gives another result with parameters along a batch of 3",
    ),
    "a default of a parameter": (
        "emit_package",
        "__init__.py",
        first(r"near: Values = 0\.5", "near: Values = 0.6"),
        None,
        "C double",
    ),
    "rows of another layout": (
        "emit_batch",
        ".c",
        first(r"to\[i\] = t\[row\]\[i\];", "to[i] = -t[row][i];", "void store_rows("),
        ScalarType.DOUBLE,
        "C double, batch pose gives another result with transposed arrays of layout joint_major",
    ),
    "the rest of a batch, which fills no tile": (
        "emit_batch",
        ".c",
        first(r"copy\[number\]\[i\] = from\[i \* pose\]", r"\g<0> + 1e-6"),
        ScalarType.DOUBLE,
        "C double, batch",
    ),
    "a result that is not a number": (
        "emit_kernel",
        ".c",
        first(r"base_T_tool\[11\] = ", rf"\g<0>{NAN} * "),
        ScalarType.DOUBLE,
        "C double",
    ),
}


QUICK = ("a sign, C double", "a sign, batch of floats", "a sign, NumPy", "a coefficient of the sine")
"""What every run of the suite tries; each of the others takes a second of its own."""


@pytest.mark.parametrize(
    "case", [case if case in QUICK else pytest.param(case, marks=pytest.mark.sabotage) for case in BREAKS]
)
def test_a_wrong_kernel_is_refused_and_the_earlier_output_stays(
    case: str, earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    emitter, suffix, change, real, target = BREAKS[case]
    before = picture(earlier)
    break_emitter(monkeypatch, emitter, suffix, change, real)

    with pytest.raises(ProofError) as caught:
        make(write_robot(tmp_path), earlier)

    words = target if " pose " in target else f"{target} pose differs from the reference at q = ("
    assert str(caught.value).startswith(f"arm: {words}")
    assert "; nothing was written" in str(caught.value)
    assert picture(earlier) == before


def test_exchanged_tips_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def exchange(text: str) -> str:
        return text.replace("tips[0]", "X").replace("tips[1]", "tips[0]").replace("X", "tips[1]")

    break_emitter(monkeypatch, "emit_kernel", ".c", exchange, ScalarType.DOUBLE)

    with pytest.raises(ProofError, match="C double position differs from the reference"):
        make(write_robot(tmp_path, TREE), tmp_path / "out", quantities=(Quantity.POSITION,))

    assert not (tmp_path / "out").exists()


def test_a_numpy_form_without_a_compiler_is_proven_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    break_emitter(monkeypatch, "emit_formula", "_numpy.py", first(r" \* ", " + ", "def fk("))

    with pytest.raises(ProofError, match="arm: NumPy double pose differs"):
        make(write_robot(tmp_path), tmp_path / "out", compile=False)


def test_an_error_of_a_single_pose_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At one corner of the joint box alone; the message names it."""
    wrong = r"\g<0>\n    if (q[0] > 2.96705 && q[1] < -2.09439) base_T_tool[3] = 0;"
    break_emitter(monkeypatch, "emit_kernel", ".c", first(r"\[15\] = 1\.0;", wrong), ScalarType.DOUBLE)

    with pytest.raises(ProofError, match=r"at q = \(2\.96706, -2\.0944\), frame tool: "):
        make(write_robot(tmp_path), tmp_path / "out")


@pytest.mark.parametrize("content", [b"", b"no library", b"\x7fELF" + bytes(100)])
def test_a_compiled_module_that_does_not_load_is_refused(
    content: bytes, earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = picture(earlier)
    monkeypatch.setattr("kinegen.driver.pipeline.build_extension", lambda *_: Extension(content, cached=False))

    with pytest.raises(CompileError, match="arm: the compiled module cannot be verified on this machine"):
        make(write_robot(tmp_path), earlier)

    assert picture(earlier) == before


def test_a_folder_without_programs_is_named_with_the_way_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a container whose /tmp is mounted with `noexec`."""
    monkeypatch.setattr("os.ST_NOEXEC", 8, raising=False)
    monkeypatch.setattr("kinegen.driver.pipeline.build_extension", lambda *_: Extension(b"no library", cached=False))
    monkeypatch.setattr("os.statvfs", lambda _: SimpleNamespace(f_flag=9))

    with pytest.raises(
        CompileError, match="programs in the folder of temporary files are not run: set TMPDIR to another one"
    ):
        make(write_robot(tmp_path), tmp_path / "out", reals=(ScalarType.DOUBLE,))


def test_a_compiled_module_of_other_sources_is_refused(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = (built / "arm" / "_native.abi3.so").read_bytes()
    monkeypatch.setattr("kinegen.driver.pipeline.build_extension", lambda *_: Extension(content, cached=True))

    with pytest.raises(CompileError, match="it was built from other sources"):
        make(write_robot(tmp_path), tmp_path / "out", reals=(ScalarType.DOUBLE,))


def test_a_proof_leaves_nothing_behind(earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither when it holds nor when it does not."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    make(write_robot(tmp_path), earlier, compile=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "nothing proved yet"))
    monkeypatch.setattr(package_proof, "prove", lambda *_: (_ for _ in ()).throw(ProofError("no")))
    with pytest.raises(ProofError):
        make(write_robot(tmp_path), earlier, compile=False)

    assert list(temporary.iterdir()) == []
