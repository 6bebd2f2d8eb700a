"""Headers and READMEs promise the same instructions only of functions that keep it."""

from __future__ import annotations

import pytest

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.firmware.project import emit_project
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.model.outputs import Kind, Quantity, parse_quantity
from tests.emit.emitted import kernels, texts, vectors

STRAIGHT = (Quantity.POSE, parse_quantity("jacobian"))
NO_BRANCH = "no branch on data"


def words(text: str) -> str:
    """A header without its line ends."""
    return " ".join(text.replace("\n *", " ").split())


@pytest.mark.parametrize("kind", [Kind.QUATERNION_WXYZ, Kind.RPY_ZYX, Kind.INVERSE])
def test_no_header_promises_that_a_root_or_an_angle_has_no_branch(kind: Kind) -> None:
    straight = words(texts("puma560", STRAIGHT)["puma560_f32.h"])
    other = words(texts("puma560", (*STRAIGHT, Quantity(kind)))["puma560_f32.h"])

    assert NO_BRANCH in straight
    assert NO_BRANCH not in other
    assert "into branches; no other function has any" in other


@pytest.mark.parametrize(("name", "moves"), [("scara", True), ("puma560", False)])
def test_every_language_says_what_an_infinite_joint_makes_of_a_length(name: str, moves: bool) -> None:
    """Of an infinite angle sines make NaN; what depends on a joint by a length alone becomes infinite as well."""
    files = {**texts(name, STRAIGHT)}
    for language in ("cpp", "javascript", "rust", "matlab"):
        files |= emit_language(kernels(name, STRAIGHT), LANGUAGES[language])
    stating = [text for text in files.values() if "makes every output that depends" in prose(text)]

    assert len(stating) >= 7
    for text in stating:
        assert ("only through a length is infinite or NaN if the joint is infinite" in prose(text)) is moves


def prose(text: str) -> str:
    """The words of a file, whatever marks its comments."""
    return " ".join(word for word in text.split() if word not in ("*", "//!", "//", "%"))


def test_headers_for_float_name_the_rule_of_esp32_for_interrupts() -> None:
    of = texts("puma560", STRAIGHT)

    assert "may use float only at level 1, and only with CONFIG_FREERTOS_FPU_IN_ISR" in words(of["puma560_f32.h"])
    assert "CONFIG_FREERTOS_FPU_IN_ISR" not in of["puma560.h"]


@pytest.mark.parametrize(
    ("outputs", "sentence"),
    [
        ("pose", "every function takes the same instructions for every input"),
        ("pose,fk_jacobian,numeric_inverse", "every function but the search takes the same instructions"),
        ("pose,quaternion_wxyz", "a function without square roots, arc tangents and selections takes the same"),
    ],
)
@pytest.mark.parametrize("ecosystem", list(Ecosystem))
def test_packages_say_which_functions_take_the_same_steps(outputs: str, sentence: str, ecosystem: Ecosystem) -> None:
    wanted = tuple(map(parse_quantity, outputs.split(",")))
    of = emit_project(
        kernels("scara", wanted), vectors("scara", wanted), texts("scara", wanted), ecosystem.reals, ecosystem
    )

    assert f"On a processor with an FPU for its numbers, {sentence}" in of["README.md"]
    assert ("CONFIG_FREERTOS_FPU_IN_ISR" in of["README.md"]) == (ecosystem is Ecosystem.ESP_IDF)
