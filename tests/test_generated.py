"""`generated/` covers every robot, every output and every language."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path

import pytest

from kinegen.backends.languages import LANGUAGES
from kinegen.model.outputs import Kind

ROOT = Path(__file__).resolve().parent.parent
GENERATED = ROOT / "generated"
LINES = (GENERATED / "digests.txt").read_text(encoding="utf-8").splitlines()

_SPEC = importlib.util.spec_from_file_location("generated_script", ROOT / "scripts" / "generated.py")
assert _SPEC is not None
assert _SPEC.loader is not None
script = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(script)


def test_every_robot_has_a_digest_of_every_language() -> None:
    wanted = {f"{path.stem} {language}" for path in (ROOT / "robots").glob("*.yaml") for language in LANGUAGES}

    assert wanted - {re.match(r"\w+ \w+", line)[0] for line in LINES} == set()  # type: ignore[index]


@pytest.mark.parametrize("name", ["planar_3r", "screw", "palletiser"])
def test_the_digests_of_a_robot_are_current(name: str) -> None:
    assert script.lines(ROOT / "robots" / f"{name}.yaml") == [line for line in LINES if line.startswith(f"{name} ")]


def test_changed_code_changes_the_digest_and_a_comment_does_not() -> None:
    assert script._line("arm c", {"arm.c": "a"}) != script._line("arm c", {"arm.c": "b"})
    assert script._line("arm c", {"arm.c": "a"}) != script._line("arm c", {"arm.h": "a"})
    assert script._line("arm c", {"arm.c": "a"}) == script._line("arm c", {"arm.c": "a  /* told */"})


@pytest.mark.parametrize("is_wrong", [False, True])
def test_digests_of_the_same_sources_are_not_computed_anew(
    is_wrong: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With these, a check is of all robots."""
    text = (GENERATED / script.DIGESTS).read_text(encoding="utf-8")
    monkeypatch.setattr(script, "KEPT", tmp_path / "kept")
    monkeypatch.setattr(script.sources, "digest", lambda *_: "now")
    monkeypatch.setattr(script, "build_packages", lambda *_, **__: None)
    monkeypatch.setattr(script, "differences", lambda *_: [])
    monkeypatch.setattr(script, "digests", lambda _: text.replace("puma560 c", "puma560 d") if is_wrong else text)
    script.every_digest()
    monkeypatch.setattr(script, "digests", None)

    assert script.check(every=False) == is_wrong
    assert "all robots compared" in capsys.readouterr().out


def test_the_packages_are_those_of_the_script() -> None:
    assert {path.name for path in GENERATED.iterdir() if path.is_dir() and path.name != "__pycache__"} == set(
        script.PACKAGES
    )


def test_every_kind_of_output_is_in_a_digest() -> None:
    """Robots have what they can have; together they have all kinds."""
    kinds = {str(kind) for kind in Kind}
    for robot in ("puma560", "motoman_l3", "panda_joint_7", "general_6r", "trunnion_mill"):
        loaded = script.load(ROOT / "robots" / f"{robot}.yaml")
        # Solvers are offered beside a closed form, which is derived for each.
        wanted = (each for each in script.quantities_of(loaded) if str(each.kind) in {*kinds, str(Kind.INVERSE)})
        kernels = script.programs(loaded, wanted)
        kinds -= {str(each.kind) for each in (*(each.quantity for each in kernels.programs), *kernels.solvers)}

    assert kinds == set()
    assert any(line.startswith("puma560 dh c ") for line in LINES)


def test_a_missing_or_changed_file_is_found(tmp_path: Path) -> None:
    for place in ("a", "b"):
        (tmp_path / place / "arm").mkdir(parents=True)
        (tmp_path / place / "arm" / "arm.c").write_text("same", encoding="utf-8")
    assert list(script.differences(tmp_path / "a", tmp_path / "b")) == []

    (tmp_path / "a" / "arm" / "arm.h").write_text(json.dumps(1), encoding="utf-8")
    (tmp_path / "b" / "arm" / "arm.c").write_text("other", encoding="utf-8")

    assert list(script.differences(tmp_path / "a", tmp_path / "b")) == [
        "arm/arm.c differs",
        "arm/arm.h is missing in what the robots give",
    ]
