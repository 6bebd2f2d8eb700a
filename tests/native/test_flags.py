"""Flags: what the compiler is told, and what people are told of it."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from kinegen.errors import CompileError
from kinegen.runtime.compiler import Processor
from kinegen.runtime.dispatch import units
from kinegen.runtime.extension import build_extension, load_package, runnable_variants
from kinegen.runtime.flags import Flags
from kinegen.ui.cli import main
from tests.native.conftest import needs_compiler
from tests.native.sample import Sample

SAMPLE = Sample("chain", reals=("double",))
X86, ARM, RISC = (Processor(machine, "") for machine in ("x86_64", "aarch64", "riscv64"))
WIDE = "-mprefer-vector-width=512"
STRAIGHT = "-fno-tree-slp-vectorize"

# The processor, the flags, what all kernels are compiled with, and what is added for batches.
ARGUMENTS = {
    "default": (X86, Flags(), "-O3 -ffp-contract=fast -fno-math-errno -march=native", WIDE),
    "default, arm": (ARM, Flags(), "-O3 -ffp-contract=fast -fno-math-errno -mcpu=native", ""),
    "default, risc-v": (RISC, Flags(), "-O3 -ffp-contract=fast -fno-math-errno -march=native", ""),
    "a name": (X86, Flags("x86-64-v3"), "-O3 -ffp-contract=fast -fno-math-errno -march=x86-64-v3", WIDE),
    "a name, arm": (ARM, Flags("armv8.2-a+sve"), "-O3 -ffp-contract=fast -fno-math-errno -march=armv8.2-a+sve", ""),
    "the compiler's own": (
        X86,
        Flags(None, optimisation="1", extra=("-g",)),
        "-O1 -ffp-contract=fast -fno-math-errno -g",
        "",
    ),
    "portable": (X86, Flags(portable=True), "-O3 -ffp-contract=fast -fno-math-errno -march=x86-64", ""),
    "portable, arm": (ARM, Flags(portable=True), "-O3 -ffp-contract=fast -fno-math-errno", ""),
}


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Pretend to be another processor."""
    monkeypatch.setattr("kinegen.runtime.flags.processor", lambda: request.param)


@pytest.mark.parametrize(
    ("machine", "flags", "expected", "added"), ARGUMENTS.values(), ids=list(ARGUMENTS), indirect=["machine"]
)
def test_flags_become_arguments(machine: None, flags: Flags, expected: str, added: str) -> None:
    assert " ".join(flags.arguments()) == f"-std=c99 {expected}"
    assert set(flags.arguments(batch=True)) - set(flags.arguments()) == set(added.split())


@pytest.mark.parametrize("machine", [X86, ARM], indirect=True)
def test_without_contraction_straight_code_is_left_alone(machine: None) -> None:
    """Batch kernels need vectors of straight code to write their results."""
    for flags in (Flags(contraction=False), Flags(portable=True, contraction=False)):
        assert {"-ffp-contract=off", STRAIGHT} <= set(flags.arguments())
        assert "-ffp-contract=off" in flags.arguments(batch=True)
        assert STRAIGHT not in flags.arguments(batch=True)


@pytest.mark.parametrize(
    ("machine", "expected"), [(X86, ["baseline", "avx2", "avx512"]), (ARM, ["baseline"])], indirect=["machine"]
)
def test_portable_builds_have_variants(machine: None, expected: list[str]) -> None:
    assert [variant.name for variant in Flags(portable=True).variants] == expected
    assert Flags("x86-64-v4").variants == ()


@pytest.mark.parametrize("machine", [X86], indirect=True)
def test_only_batch_kernels_have_variants(machine: None) -> None:
    names = tuple(name for name in SAMPLE.sources() if name.endswith(".c"))
    found = {unit.name: unit for unit in units(SAMPLE.interface, names, Flags(portable=True))}

    assert sorted(found) == [
        "chain", "chain_batch_avx2", "chain_batch_avx512", "chain_batch_baseline", "kinegen_processor"
    ]  # fmt: skip
    assert {"-mavx512f", WIDE, "-Dchain_fk_batch=chain_fk_batch_avx512"} <= set(found["chain_batch_avx512"].arguments)
    assert {"-mavx2", "-mfma"} <= set(found["chain_batch_avx2"].arguments)
    assert not {"-mavx", "-mfma", WIDE} & {*found["chain_batch_baseline"].arguments, *found["chain"].arguments}


@pytest.mark.parametrize(
    ("flags", "label"),
    [
        (Flags(), "native"),
        (Flags(None), "plain"),
        (Flags("x86-64-v3", contraction=False), "x86-64-v3, reproducible"),
        (Flags(portable=True), ""),
        (Flags(portable=True, contraction=False), "reproducible"),
    ],
)
def test_flags_are_told_in_a_word(flags: Flags, label: str) -> None:
    assert flags.label == label


def test_only_native_depends_on_this_very_processor() -> None:
    assert Flags().place != Flags("x86-64-v3").place == Flags(portable=True).place


def test_all_flags_decide_the_result(tmp_path: Path) -> None:
    """No two of them share an entry of the cache."""
    plain = Flags()
    changed: list[dict[str, object]] = [
        {"march": None}, {"portable": True}, {"contraction": False}, {"optimisation": "1"}, {"extra": ("-g",)}
    ]  # fmt: skip
    names = tuple(SAMPLE.sources())
    seen = {units(SAMPLE.interface, names, dataclasses.replace(plain, **change)) for change in changed}  # type: ignore[arg-type]

    assert len(seen | {units(SAMPLE.interface, names, plain)}) == 6


@pytest.mark.parametrize("name", ["", " native", "-O0", "a b", 'a"b', "a\nb", "ä", "a=b"])
def test_what_cannot_be_a_processor_is_refused(name: str) -> None:
    with pytest.raises(CompileError, match=r"is not a processor \(expected native or a name that the compiler knows\)"):
        Flags(name)


@needs_compiler
def test_an_unknown_processor_is_refused_in_the_words_of_the_compiler(tmp_path: Path) -> None:
    with pytest.raises(CompileError, match=r"refuses .*\.c: .*error: .*pentium99") as caught:
        build_extension(SAMPLE.interface, SAMPLE.sources(), Flags("pentium99"), tmp_path)

    assert "\n" not in str(caught.value)


# Command line ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def planar(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small robot, and a cache for this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "stick.yaml"
    path.write_text("kinegen: 1\nname: stick\nconvention: standard\nunits: {length: m, angle: rad}\n"
                    "joints:\n  - {name: swing, a: 1, alpha: 0, d: 0, theta: q}\n")  # fmt: skip
    return path


PROVEN = re.compile(r"^ +(C double(?:, batch)?)  +([\d,]+) .* pose +pass$", re.MULTILINE)
"""A row of the report on the proof: what was called, and how many poses were compared."""

LAYOUTS = 3


@needs_compiler
@pytest.mark.parametrize(
    ("options", "variant"),
    [
        ([], "native"),
        (["--reproducible"], "native, reproducible"),
        (["--portable"], "avx512|avx2|baseline"),
    ],
)
def test_the_command_line_chooses(
    planar: Path, tmp_path: Path, options: list[str], variant: str, capfd: pytest.CaptureFixture[str]
) -> None:
    output = ["-v", "-o", str(tmp_path / "out"), "--outputs", "pose", "--real", "double"]

    assert main(["build", str(planar), *output, *options]) == 0, capfd.readouterr().err
    package = load_package(tmp_path / "out" / "stick")
    assert package.fk.variant in variant.split("|")
    variants = runnable_variants(package)
    poses = {row: int(count.replace(",", "")) for row, count in PROVEN.findall(capfd.readouterr().out)}
    assert bool(variants) == ("--portable" in options)
    assert poses["C double, batch"] == LAYOUTS * max(len(variants), 1) * poses["C double"], "each one is proven"


@needs_compiler
def test_an_unknown_processor_is_one_line(planar: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status = main(["build", str(planar), "-o", str(tmp_path / "out"), "--march", "pentium99"])

    errors = [line for line in capfd.readouterr().err.splitlines() if line.startswith("error: ")]
    assert status == 1
    assert len(errors) == 1
    assert "pentium99" in errors[0]
    assert not (tmp_path / "out").exists()


def test_a_processor_and_all_of_them_exclude_each_other(planar: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["build", str(planar), "--march", "native", "--portable"]) == 2
    assert "--march and --portable exclude each other" in capfd.readouterr().err
