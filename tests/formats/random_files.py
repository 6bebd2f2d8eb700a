"""Random trees of links, as URDF and as MJCF text, for property tests."""

from __future__ import annotations

from hypothesis import strategies as st

from tests.formats.plain_mjcf import Body, Hinge, Model, Orientation

SPECIAL = ("0", "1.5708", "-1.5707963", "3.14", "3.141592653589793", "0.7853981633974483", "-3.1415", "1e-9", "0.5236")


def decimals(largest: float) -> st.SearchStrategy[str]:
    """Decimal text with four places."""
    most = int(largest * 10000)
    return st.integers(-most, most).map(lambda number: f"{number / 10000:.4f}")


LENGTHS = decimals(1)
ANGLES = st.one_of(st.sampled_from(SPECIAL), decimals(3.2))
AXES = st.one_of(
    st.sampled_from(
        [("1", "0", "0"), ("0", "-1", "0"), ("0", "0", "1"), ("0", "0.70711", "0.70711"), ("0", "0", "0.9999999")]
    ),
    st.tuples(LENGTHS, LENGTHS, LENGTHS).filter(lambda axis: sum(float(each) ** 2 for each in axis) > 0.01),
)


@st.composite
def urdf(draw: st.DrawFn) -> str:
    """A tree of links as URDF."""
    count = draw(st.integers(2, 7))
    lines = ['<robot name="random">', *(f'<link name="l{i}"/>' for i in range(count + 1))]
    moving: list[str] = []
    for child in range(1, count + 1):
        kinds = ("revolute", "prismatic", "continuous", "fixed") if moving else ("revolute",)
        kind, parent = draw(st.sampled_from(kinds)), draw(st.integers(max(0, child - 2), child - 1))
        follows = draw(st.sampled_from(moving)) if moving and draw(st.integers(0, 4)) == 0 else ""
        lines += [f'<joint name="j{child}" type="{kind}">', f'<parent link="l{parent}"/><child link="l{child}"/>']
        xyz, rpy = (" ".join(draw(st.tuples(each, each, each))) for each in (LENGTHS, ANGLES))
        lines.append(f'<origin xyz="{xyz}" rpy="{rpy}"/>')
        lines.append(f'<axis xyz="{" ".join(draw(AXES))}"/>')
        if kind in ("revolute", "prismatic"):
            lines.append('<limit lower="-2" upper="2" effort="1" velocity="1"/>')
        if follows and kind != "fixed":
            lines.append(f'<mimic joint="{follows}" multiplier="{draw(LENGTHS)}" offset="{draw(LENGTHS)}"/>')
        elif kind != "fixed":
            moving.append(f"j{child}")
        lines.append("</joint>")
    return "\n".join([*lines, "</robot>"])


@st.composite
def orientations(draw: st.DrawFn) -> Orientation | None:
    """An orientation in one of the forms of MJCF."""
    form = draw(st.sampled_from(["", "quat", "axisangle", "euler", "xyaxes", "zaxis"]))
    axis = draw(AXES)
    if not form:
        return None
    if form == "quat":
        special = ("0.7071", "0", "0", "-0.7071"), ("0.5", "0.5", "-0.5", "0.5"), ("0", "0.707107", "0.707107", "0")
        return Orientation(form, draw(st.one_of(st.sampled_from(special), st.just((draw(LENGTHS), *axis)))))
    if form == "axisangle":
        return Orientation(form, (*axis, draw(ANGLES)))
    if form == "euler":
        return Orientation(form, draw(st.tuples(ANGLES, ANGLES, ANGLES)))
    if form == "zaxis":
        return Orientation(form, axis)
    across = draw(AXES.filter(lambda other: _square_of_cross(axis, other) > 0.01))
    return Orientation(form, (*axis, *across))


def _square_of_cross(a: tuple[str, ...], b: tuple[str, ...]) -> float:
    x, y = ([float(each) for each in axis] for axis in (a, b))
    dot = sum(i * j for i, j in zip(x, y, strict=True))
    return sum(i * i for i in x) * sum(i * i for i in y) - dot * dot


@st.composite
def models(draw: st.DrawFn) -> Model:
    """A model as MJCF."""
    bodies: list[Body] = []
    for place in range(draw(st.integers(1, 5))):
        vector = st.tuples(LENGTHS, LENGTHS, LENGTHS)
        count = draw(st.integers(0 if place else 1, 2))
        joints = tuple(
            Hinge(f"j{place}_{i}", draw(st.booleans()), draw(vector), draw(AXES), draw(LENGTHS)) for i in range(count)
        )
        bodies.append(
            Body(draw(st.integers(-1 if place == 0 else 0, place - 1)), draw(vector), draw(orientations()), joints)
        )
    return Model(tuple(bodies), draw(st.booleans()), draw(st.sampled_from(["xyz", "ZYX", "zxz", "XyZ"])))
