"""What a package says of outputs that it was built without."""

from __future__ import annotations

import pytest

from kinegen.errors import KinegenError
from kinegen.model.outputs import every_quantity, parse_quantity
from kinegen.runtime.vendored import _absent
from kinegen.runtime.vendored._absent import absent, output_named

FRAMES = ("elbow", "local", "elbow_2")


def told(name: str, module: str = "arm", **changes: object) -> str:
    """The message for a name that a package of an arm does not have."""
    given: dict[str, object] = {"robot": "arm", "source": "arm.yaml", "outputs": ("pose",), "frames": FRAMES} | changes
    return str(absent(name, module, **{"options": {}, **given}))  # type: ignore[arg-type]


def test_it_knows_every_output() -> None:
    assert {*_absent.OF_A_FRAME, *_absent.OF_THE_ROBOT} == {str(quantity) for quantity in every_quantity()}
    assert {output_named(each.function, ()) for each in every_quantity()} == {str(each) for each in every_quantity()}
    assert {*_absent.COME_WITH.values()} <= {str(quantity) for quantity in every_quantity()}


@pytest.mark.parametrize("quantity", every_quantity(), ids=str)
def test_outputs_for_one_frame_are_those_that_there_are(quantity: object) -> None:
    word, function = str(quantity), quantity.function  # type: ignore[attr-defined]
    found = output_named(f"{function}_elbow", FRAMES)
    try:
        expected = str(parse_quantity(f"{word}@elbow"))
    except KinegenError:
        expected = ""

    assert found == expected
    assert output_named(f"{function}_nowhere", FRAMES) == ""


@pytest.mark.parametrize(
    ("name", "output"),
    [
        ("fk", "pose"),
        ("pose", ""),
        ("FRAMES", "frames"),
        ("BRANCHES", "inverse"),
        ("PARAMETERS", "parameter_jacobian"),
        ("manipulability", "jacobian"),
        ("condition_number", "jacobian"),
        ("fk_elbow_2", "pose@elbow_2"),
        ("jacobian_local", "jacobian_local"),
        ("jacobian_local_local", "jacobian_local@local"),
        ("fkine", ""),
        ("__path__", ""),
        ("_jacobian", ""),
    ],
)
def test_a_name_leads_to_its_output(name: str, output: str) -> None:
    assert output_named(name, FRAMES) == output


def test_the_message_has_the_command() -> None:
    assert told("jacobian") == "arm was built without jacobian: kinegen build arm.yaml --outputs pose,jacobian"
    assert told("fk", outputs=("frames", "jacobian")) == (
        "arm was built without pose: kinegen build arm.yaml --outputs frames,jacobian,pose"
    )
    assert told("frames", options={"wrt": "a2,d3", "strict-limits": ""}, source="'my arm.yaml'") == (
        "arm was built without frames: kinegen build 'my arm.yaml' --outputs pose,frames --wrt a2,d3 --strict-limits"
    )


def test_the_message_has_the_call_for_what_a_call_made() -> None:
    made = "kinegen.runtime.compiled.arm_0123456789abcdef"
    assert told("inverse", made) == 'arm was compiled without inverse: kinegen.compile(robot, "pose,inverse")'
    assert told("inverse", made, options={"wrt": "a2", "strict-limits": ""}) == (
        'arm was compiled without inverse: kinegen.compile(robot, "pose,inverse", wrt="a2")'
    )
    assert told("inverse", source="<mapping>") == (
        'arm was built without inverse: kinegen.build(robot, outputs="pose,inverse")'
    )


def test_any_other_name_is_missing_as_in_every_module() -> None:
    error = absent("nothing", "math", robot="arm", source="a", outputs=(), frames=FRAMES, options={})

    assert str(error) == "module 'math' has no attribute 'nothing'"
    assert error.name == "nothing"
    assert error.obj is __import__("math")
    assert told("jacobian", outputs=("jacobian",)) == "module 'arm' has no attribute 'jacobian'"
