"""Random robots for property tests, as the text of a robot file."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import strategies as st

from kinegen.io.load import loads
from kinegen.model.robot import Robot

CONVENTIONS = ("standard", "modified", "modified_prev_d", "hayati", "ets")

lengths = st.sampled_from(["0", "0", "0.4318", "-0.02", "1/3", "a", "-2*b", "a + b", "0.25"])
right_angles = st.sampled_from(["0", "90", "-90", "180", "270"])
twists = st.one_of(right_angles, right_angles, st.sampled_from(["30", "-45", "89.9999", "pi/3", "17.25"]))
turns = st.sampled_from(["q", "q", "-q", "q + 90", "180 - q", "q - 30", "2*q", "q + pi/2"])
strokes = st.sampled_from(["q", "-q", "q + 0.1", "0.5*q + a"])


@st.composite
def rows(draw: st.DrawFn, index: int, movers: list[str]) -> str:
    """One row: of any convention, revolute, prismatic, screw, following or fixed."""
    kind = draw(st.sampled_from(["revolute"] * 5 + ["prismatic", "screw", "fixed", "follower", "slider"]))
    convention = draw(st.sampled_from(CONVENTIONS))
    theta, d = draw(twists), draw(lengths)
    if kind == "revolute" or (kind in ("prismatic", "screw", "slider") and convention == "hayati"):
        kind, theta = "revolute", draw(turns)
    elif kind == "prismatic":
        d = draw(strokes)
    elif kind == "screw":
        theta, d = "q", "0.01*q/(2*pi)"
    elif kind == "follower" and movers:
        theta = f"{draw(st.sampled_from(['0.5', '-1', '2']))}*{draw(st.sampled_from(movers))} + 10"
    elif kind == "slider" and movers:
        # A length that follows a joint: its angle is then needed as a number too, with either sign.
        d = f"{draw(st.sampled_from(['0.01', '-0.01', '-1', '2', '-2']))}*{draw(st.sampled_from(movers))}"
    if kind in ("revolute", "prismatic", "screw"):
        movers.append(f"j{index}")
    a, alpha = draw(lengths), draw(twists)
    if convention == "ets":
        axis = draw(st.sampled_from("xyz"))
        steps = f"[T{axis}({d}), R{axis}({theta}), Tx({a}), Ry({alpha})]"
        return f"  - {{name: j{index}, ets: {steps}}}"
    if convention == "hayati":
        return (
            f"  - {{name: j{index}, convention: hayati, theta: {theta}, a: {a}, alpha: {alpha}, beta: {draw(twists)}}}"
        )
    return f"  - {{name: j{index}, convention: {convention}, alpha: {alpha}, a: {a}, d: {d}, theta: {theta}}}"


@st.composite
def robots(draw: st.DrawFn, most_rows: int = 6, runtime: bool | None = None) -> Robot:
    """A whole robot: a chain, or a tree where a row hangs on an earlier one."""
    keep = draw(st.booleans()) if runtime is None else runtime
    count = draw(st.integers(1, most_rows))
    movers: list[str] = []
    lines = []
    for index in range(count):
        line = draw(rows(index, movers))
        if index > 1 and draw(st.integers(0, 5)) == 0:
            parent = draw(st.sampled_from(["base", *(f"j{earlier}" for earlier in range(index))]))
            line = line.replace("{name:", f"{{parent: {parent}, name:", 1)
        lines.append(line)
    flag = "true" if keep else "false"
    text = "\n".join(
        [
            "kinegen: 1",
            "name: chain",
            "convention: standard",
            "units: {length: m, angle: deg}",
            "parameters:",
            f"  a: {{value: 0.31, runtime: {flag}}}",
            "  b: 0.17",
            "joints:",
            *lines,
            "base: {xyz: [a, 2*b, 0], rpy: [0, 90, 0]}",
            "frames:",
            "  station: {parent: base, xyz: [a, 0, -b], rpy: [10, 20, 30]}",
        ]
    )
    return loads(text, "chain.yaml")


def exact_defaults(robot: Robot) -> tuple[Fraction, ...]:
    """The values of the runtime parameters of a random robot."""
    return tuple(Fraction(31, 100) for _ in robot.runtime_parameters)
