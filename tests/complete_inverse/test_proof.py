"""A build proves its complete inverse; a wrong one cannot pass."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.c import complete_inverse as emitter
from kinegen.errors import ProofError
from kinegen.model.outputs import COMPLETE_INVERSE
from kinegen.verify import complete_inverse as proof
from tests.builds.workshop import ROBOTS, make, set_machine

ROBOT = ROBOTS / "general_6r.yaml"

BREAKS = {
    "a root that is left out": ("if (!(im[i] >= 0) ||", "if ((i == 3) || !(im[i] >= 0) ||", "misses the joint vectors"),
    "no Newton steps": ("if (polish(target, q) == 0) {", "if (0) {", "misses the joint vectors"),
    "what is taken twice": ("same = (absolute(apart) <", "same = (absolute(apart) < -", "misses the joint vectors"),
    "what is no pose": (
        "if (is_pose(base_T_tool) == 0) {",
        "if (base_T_tool[3] != base_T_tool[3]) {",
        "has solutions for",
    ),
    "a wrong angle": ("angles[1] = general_6r_atan2(", "angles[1] = 1 + general_6r_atan2(", "misses the joint vectors"),
}


@pytest.fixture(autouse=True)
def quickly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proof, "TARGETS", 300)
    monkeypatch.setattr(proof, "FEWER", 10)
    monkeypatch.setattr(proof, "SPECIAL", 200)
    monkeypatch.setattr(proof, "FEWER_SPECIAL", 12)
    set_machine(monkeypatch, tmp_path / "cache")


def test_both_ways_are_proven_and_the_count_is_told(tmp_path: Path) -> None:
    built, again = (make(ROBOT, tmp_path, quantities=(COMPLETE_INVERSE,)).proof for _ in range(2))
    found = [comparison for comparison in built.comparisons if comparison.quantity == COMPLETE_INVERSE]

    assert [each.target for each in found] == ["C double, all solutions", "NumPy double, all solutions"]
    assert [each.poses for each in found] == [300, 10]
    assert built.counts[0].startswith("complete inverse: the joint vectors of all 300 random poses are among")
    assert built.counts[0].endswith("; so are those of all 201 regular poses at multiples of 30, 45 and 90 degrees")
    assert again == built


@pytest.mark.parametrize("case", BREAKS)
def test_a_wrong_one_is_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, new, message = BREAKS[case]
    emit = emitter.emit_complete_inverse

    def broken(kernels: object) -> dict[str, str]:
        files = emit(kernels)  # type: ignore[arg-type]
        assert sum(text.count(old) for text in files.values()) == 1
        return {name: text.replace(old, new) for name, text in files.items()}

    monkeypatch.setattr(emitter, "emit_complete_inverse", broken)
    with pytest.raises(ProofError, match=f"general_6r.*complete_inverse {message}"):
        make(ROBOT, tmp_path, quantities=(COMPLETE_INVERSE,))


def test_solutions_that_are_lost_where_they_share_an_angle_are_missed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Random poses do not show it: only at multiples of 90, 45 and 30 degrees do solutions share an angle."""
    monkeypatch.setattr(proof, "SPECIAL", 600)
    emit = emitter.emit_complete_inverse

    def broken(kernels: object) -> dict[str, str]:
        files = emit(kernels)  # type: ignore[arg-type]
        old, new = "} else {\n            sure = 0;", "} else if (place == MOST) {\n            sure = 0;"
        assert sum(text.count(old) for text in files.values()) == 1
        return {name: text.replace(old, new) for name, text in files.items()}

    monkeypatch.setattr(emitter, "emit_complete_inverse", broken)
    with pytest.raises(ProofError, match=r"xarm6.*complete_inverse (misses|finds fewer)"):
        make(ROBOTS / "xarm6.yaml", tmp_path, quantities=(COMPLETE_INVERSE,))
