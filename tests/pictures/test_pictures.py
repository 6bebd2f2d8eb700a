"""Pictures of robots: what is on them, where it is, and that equal pictures are equal bytes."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.robot import JointType, Robot
from kinegen.tools import pictures
from kinegen.tools.pictures import labels
from kinegen.tools.pictures.figure import content
from kinegen.tools.pictures.postures import make_skeleton, moves_of
from kinegen.tools.pictures.projection import SIDES, Area, Side, Stroke, Words, find_side, hull
from kinegen.tools.pictures.sheet import PictureOptions, Sheet, compose
from kinegen.verify import reference

ROOT = Path(__file__).resolve().parent.parent.parent
PUMA = load(ROOT / "robots" / "puma560.yaml")
BENT = (0.35, -0.9, 1.0, 0.3, 0.7, 0.2)


def robot(name: str) -> Robot:
    return load(ROOT / "robots" / f"{name}.yaml")


def sheet(arm: Robot, *postures: tuple[float, ...], side: str = "isometric", **options: object) -> Sheet:
    q = np.array(postures or [pictures.home(arm)], dtype=np.float64)
    return compose(arm, q, PictureOptions(find_side(side, arm), **options))  # type: ignore[arg-type]


def texts(found: Sheet) -> list[str]:
    return [mark.text for mark in found.marks if isinstance(mark, Words)]


def names(found: Sheet, prefix: str) -> list[str]:
    return [mark.name for mark in found.marks if mark.name.startswith(prefix)]


@pytest.mark.parametrize("name", ["puma560", "hand", "palletiser", "planar_3r_standard", "scara", "calibrated_2r"])
def test_frames_are_where_the_reference_has_them(name: str) -> None:
    arm = robot(name)
    q = np.random.default_rng(3).uniform(-1, 1, arm.dof)

    found = make_skeleton(arm, q).frames

    for frame, pose in reference.frames(arm, q).items():
        if frame in found:
            np.testing.assert_allclose(found[frame], pose[0], atol=1e-12 * max(1.0, np.abs(pose).max()))
    assert set(found) >= {arm.root, *(row.name for row in arm.rows), *arm.tips}


@pytest.mark.parametrize("side", [*SIDES, "17,33"])
def test_origins_on_paper_are_projections_of_the_reference(side: str) -> None:
    """The picture is shifted and scaled, and nothing else: two frames fix both, and all others agree."""
    svg = content(pictures.plot(PUMA, BENT, frames=True, side=side), ".svg").decode()
    where = find_side(side, PUMA)
    az, el = np.radians([where.azimuth, where.elevation])
    right = np.array([-np.sin(az), np.cos(az), 0])
    up = np.array([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), np.cos(el)])
    poses = reference.frames(PUMA, BENT)

    rows = ("waist", "elbow", "forearm", "flange")
    drawn = np.array([origin_in(svg, name) for name in rows])
    wanted = np.array([[right @ poses[name][0, :3, 3], -up @ poses[name][0, :3, 3]] for name in rows])

    scale = np.ptp(drawn) and np.linalg.norm(drawn[1] - drawn[3]) / np.linalg.norm(wanted[1] - wanted[3])
    np.testing.assert_allclose(drawn - drawn[0], scale * (wanted - wanted[0]), atol=2e-2)


def origin_in(svg: str, frame: str) -> tuple[float, float]:
    """Where the arrow along x of a frame begins."""
    match = re.search(rf'<g id="axis-{frame}-x">\s*<path d="M (\S+) (\S+)', svg)
    assert match
    return float(match[1]), float(match[2])


@pytest.mark.parametrize(
    ("name", "cylinders", "boxes"), [("puma560", 6, 0), ("stanford", 5, 1), ("scara", 2, 1), ("hand", 21, 0)]
)
def test_every_joint_has_its_symbol(name: str, cylinders: int, boxes: int) -> None:
    found = sheet(robot(name))

    # The outline of a cylinder is round, a face of a box has four corners.
    outlines = [mark for mark in found.marks if isinstance(mark, Area) and mark.name.startswith("joint-")]
    assert len(outlines) == cylinders + boxes
    assert sum(len(mark.points) == 4 for mark in outlines) == boxes


def test_symbols_of_a_spherical_wrist_are_beside_each_other() -> None:
    found = sheet(robot("stanford"), (0.3, 0.8, 0.5, 0.4, 0.6, 0.2))

    middles = {mark.name: mark.points.mean(axis=0) for mark in found.marks if mark.name.startswith("joint-")}  # type: ignore[union-attr]
    for first, second in itertools.combinations([middles[f"joint-joint_{number}"] for number in (4, 5, 6)], 2):
        assert np.linalg.norm(first - second) > 8


def test_dimensions_have_the_symbols_of_the_book_and_the_values_of_the_file() -> None:
    found = texts(sheet(PUMA, tuple(np.radians([20, -50, 60, 0, 40, 10])), dimensions=True))

    assert sorted(found) == sorted(
        [
            *("a₂ = 0.4318 m", "a₃ = 0.0203 m", "d₃ = 0.15005 m", "d₄ = 0.4318 m"),
            *("α₁ = −90°", "α₃ = −90°", "α₄ = 90°", "α₅ = −90°"),
            *("θ₁ = q1 = 20°", "θ₂ = q2 = −50°", "θ₃ = q3 = 60°", "θ₄ = q4 = 0°", "θ₅ = q5 = 40°", "θ₆ = q6 = 10°"),
        ]
    )


def test_dimensions_say_units_offsets_and_parameters() -> None:
    assert "a₃ = lT1 = 45 mm" in texts(sheet(robot("hand"), dimensions=True, rows=("thumb_2",)))
    assert "θ₂ = q1 + 90° = 90°" in texts(sheet(robot("hand"), dimensions=True, rows=("thumb_1",)))
    assert "Rz = −60°" in texts(sheet(robot("hand"), dimensions=True, rows=("thumb_root",)))
    assert "θ₁ = q1 = 0 rad" in texts(sheet(robot("screw"), dimensions=True))


def test_a_length_is_as_long_as_its_dimension_line() -> None:
    """From the front a2 is seen in full; the line has its true length in the scale of the picture."""
    found = sheet(PUMA, dimensions=True, side="front")

    lines = {mark.name: mark.points for mark in found.marks if mark.name.startswith("length-")}  # type: ignore[union-attr]
    a2, d4 = (np.linalg.norm(lines[name][1] - lines[name][0]) for name in ("length-elbow-1", "length-forearm-3"))
    assert a2 == pytest.approx(d4)
    # d3 points away from the viewer.
    assert "length-elbow-3" not in lines


@pytest.mark.parametrize("name", ["puma560", "ur5", "scara", "stanford", "planar_3r", "panda", "iiwa14"])
def test_texts_do_not_overlap(name: str) -> None:
    arm = robot(name)
    q = pictures.home(arm) + np.linspace(0.3, 0.8, arm.dof)

    words = [mark for mark in sheet(arm, tuple(q), frames=True, dimensions=True).marks if isinstance(mark, Words)]

    assert len(words) > arm.dof
    assert [(a.text, b.text) for a, b in itertools.combinations(words, 2) if labels.overlap(a, b)] == []


def test_a_letter_goes_where_there_is_room() -> None:
    """In a small picture all places beside the arrow may be taken."""
    found = sheet(robot("general_6r"), frames=True, dimensions=True, size=3)
    words = [mark for mark in found.marks if isinstance(mark, Words)]

    assert {"z₆", "a₅ = 0.15 m"} <= {each.text for each in words}
    assert [(a.text, b.text) for a, b in itertools.combinations(words, 2) if labels.overlap(a, b)] == []


def test_the_text_boxes_are_those_of_the_letters() -> None:
    """The check above is worth something only if boxes are as large as what is drawn."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4, 4), dpi=720)
    drawn = figure.text(0.5, 0.5, "θ₁ = q1 + 90° = 120°", fontsize=8, family="DejaVu Sans")
    box = drawn.get_window_extent(FigureCanvasAgg(figure).get_renderer())

    assert labels.measure("θ₁ = q1 + 90° = 120°", 8.0)[0] == pytest.approx(box.width / 10, abs=1.0)


def test_frames_at_one_origin_share_a_tag() -> None:
    found = texts(sheet(PUMA, BENT, frames=True))

    assert "0 base, 1 waist, 2 shoulder" in found
    assert "3 elbow" in found
    assert "4 forearm, 5 wrist_bend, 6 flange" in found
    assert {"x₃", "z₃", "z₀ z₁"} <= set(found)


def test_rows_choose_what_is_annotated() -> None:
    found = sheet(PUMA, BENT, frames=True, dimensions=True, rows=("elbow",))

    assert {name.split("-")[1] for name in names(found, "length-") + names(found, "angle-")} == {"elbow"}
    assert {name.split("-")[1] for name in names(found, "axis-")} == {"shoulder", "elbow"}


def test_further_postures_are_paler_and_behind() -> None:
    found = sheet(PUMA, BENT, (0.0,) * 6, (1.0,) * 6)

    assert len(names(found, "joint-")) == 18
    first = next(mark for mark in found.marks if mark.name == "joint-elbow")
    third = next(mark for mark in found.marks if mark.name == "joint-elbow-posture-3")
    assert isinstance(first, Area)
    assert isinstance(third, Area)
    assert third.depth < first.depth
    assert min(int(third.colour[place : place + 2], 16) for place in (1, 3, 5)) > 0xE8


def test_all_of_it_is_on_the_paper() -> None:
    found = sheet(robot("ur5"), frames=True, dimensions=True)

    low, high = np.array(found.corner), np.array(found.corner) + np.array(found.size)
    for mark in found.marks:
        points = labels.corners(mark) if isinstance(mark, Words) else mark.points
        assert (points >= low).all()
        assert (points <= high).all()


@pytest.mark.parametrize("kind", pictures.FORMATS)
def test_the_same_picture_is_the_same_bytes(kind: str) -> None:
    first, second = (content(pictures.plot(PUMA, BENT, frames=True, dimensions=True), kind) for _ in range(2))

    assert first == second
    assert b"matplotlib v" not in first.lower()
    assert not re.search(rb"CreationDate|<dc:date>|tIME", first)


def test_an_svg_needs_no_font() -> None:
    svg = content(pictures.plot(PUMA, BENT, frames=True), ".svg").decode()

    assert "<text" not in svg
    assert "<!-- 3 elbow -->" in svg
    assert "<title>puma560: " in svg


def test_markup_in_a_robot_file_stays_text() -> None:
    hostile = loads(
        "kinegen: 1\nname: h\ndescription: '</title><script>alert(1)</script> $x_1$'\nconvention: standard\n"
        "units: {length: m, angle: deg}\njoints:\n- {name: j, theta: q, d: 0, a: 1, alpha: 0}\n",
        "h.yaml",
    )

    svg = content(pictures.plot(hostile, frames=True), ".svg").decode()

    assert "<script" not in svg
    assert "&lt;script&gt;" in svg


WRIST = (*np.radians([20.0, 60.0]), 0.6, *np.radians([30.0, 40.0, 20.0]))


def test_arcs_of_a_wrist_do_not_cross() -> None:
    """Three axes meet; each arc is about the symbol of its joint, and those about one point have different radii."""
    found = sheet(robot("stanford"), WRIST, dimensions=True)
    arcs = {mark.name: mark.points for mark in found.marks if mark.name.startswith("angle-")}

    assert len(arcs) == 9
    for (one, first), (other, second) in itertools.combinations(arcs.items(), 2):
        assert not _cross(first, second), (one, other)


def _cross(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two lines of many pieces cross."""

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return np.sign((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])

    a, b = first[:-1, None], first[1:, None]
    c, d = second[None, :-1], second[None, 1:]
    return bool(((side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)).any())


def test_an_arc_is_about_the_symbol_of_its_joint() -> None:
    arm, joint = robot("stanford"), "joint_4"
    found = sheet(arm, WRIST, dimensions=True)
    (arc,) = [mark.points for mark in found.marks if mark.name.startswith(f"angle-{joint}-0")]
    symbol = np.concatenate(
        [mark.points for mark in found.marks if mark.name == f"joint-{joint}" and not isinstance(mark, Words)]
    )
    middle = (symbol.min(axis=0) + symbol.max(axis=0)) / 2

    # An arc of 30 degrees, seen obliquely, is less than its radius away from the middle; the wrist is farther.
    assert np.linalg.norm(arc - middle, axis=1).max() < 24


@pytest.mark.parametrize(("options", "width"), [({"frames": True}, 4.0), ({"dimensions": True}, 6.5), ({}, 2.0)])
def test_pictures_of_one_width_have_letters_of_one_size(options: dict[str, object], width: float) -> None:
    found = [sheet(robot(name), width=width, **options) for name in ("planar_3r", "scara")]  # type: ignore[arg-type]

    for each in found:
        assert each.size[0] == pytest.approx(72 * width, abs=1e-9)
        words = [mark for mark in each.marks if isinstance(mark, Words)]
        assert {mark.size for mark in words} <= {7.0, 7.5, 8.0}
        points = np.concatenate([mark.points for mark in each.marks if not isinstance(mark, Words)])
        assert (points[:, 0] >= each.corner[0]).all()
        assert (points[:, 0] <= each.corner[0] + each.size[0]).all()
        # The robot fills the paper, apart from words and margins.
        assert np.ptp(points[:, 0]) > 0.4 * each.size[0]


def test_paper_that_is_narrower_than_its_words_is_refused() -> None:
    with pytest.raises(KinegenError, match=r"width is 0\.6 inches, too narrow for the words of planar_3r"):
        sheet(robot("planar_3r"), width=0.6, frames=True)


def test_millimetres_and_metres_give_the_same_picture() -> None:
    text = (ROOT / "robots" / "scara.yaml").read_text(encoding="utf-8")
    large = text.replace("d1: 0.4", "d1: 400").replace("a1: 0.35", "a1: 350").replace("a2: 0.25", "a2: 250")
    metres, thousand = (sheet(loads(each, "s.yaml"), (0.4, 0.5, 0.0)) for each in (text, large))

    np.testing.assert_allclose(metres.size, thousand.size, rtol=1e-9)


@pytest.mark.parametrize("name", ["blocks", "spherical_joint", "screw", "human_body", "wire_arm", "palletiser"])
def test_unusual_robots_can_be_drawn(name: str) -> None:
    """Without joints, without any length, with 21 rows, with actuators."""
    arm = robot(name)
    for side in ("auto", "top", "front"):
        found = sheet(arm, side=side, frames=True)

        assert all(np.isfinite(mark.points).all() for mark in found.marks if not isinstance(mark, Words))
        assert max(found.size) < 72 * 9
        assert len(names(found, "joint-")) == sum(row.type is not JointType.FIXED for row in arm.rows)


def test_a_planar_arm_is_seen_from_the_top() -> None:
    assert find_side("auto", robot("planar_3r")) == Side(*SIDES["top"])
    assert find_side("auto", robot("scara")) == find_side("auto", PUMA) == Side(*SIDES["isometric"])


@pytest.mark.parametrize("name", SIDES)
def test_directions_are_a_right_handed_frame(name: str) -> None:
    directions = Side(*SIDES[name]).directions()

    np.testing.assert_allclose(directions @ directions.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(directions) == pytest.approx(1.0)


def test_moves_of_a_row_without_an_entry_are_zero() -> None:
    assert all(move.value == 0 for move in moves_of(PUMA, np.zeros(6))["waist"])


def test_the_hull_leaves_out_what_is_inside() -> None:
    found = hull(np.array([[0, 0], [2, 0], [1, 1], [2, 2], [0, 2], [1, 0]], dtype=float))

    assert sorted(map(tuple, found.tolist())) == [(0, 0), (0, 2), (2, 0), (2, 2)]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"q": [0, 0]}, r"shape \(2,\) \(expected \(6,\) or \(n, 6\)\)"),
        ({"q": [[0.0] * 6] * 51}, "51 postures"),
        ({"q": np.zeros((0, 6))}, "0 postures"),
        ({"q": [np.nan] * 6}, "not finite"),
        ({"q": [np.inf] * 6}, "not finite"),
        ({"q": "elbow"}, "not a joint vector"),
        ({"side": "behind"}, "'behind' is not a side"),
        ({"side": (0, 91)}, "is not a side"),
        ({"side": (np.nan, 0)}, "is not a side"),
        ({"side": 3}, "is not a side"),
        ({"rows": ["hip"]}, "puma560 has no row 'hip'"),
        ({"size": np.nan}, "size is nan"),
        ({"size": 1e9}, "size is"),
        ({"width": np.nan}, "width is nan"),
        ({"width": 0.0}, "width is 0.0"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(KinegenError, match=message):
        pictures.plot(PUMA, **arguments)  # type: ignore[arg-type]


def test_a_stroke_without_end_is_refused() -> None:
    with pytest.raises(KinegenError, match="too large"):
        pictures.plot(robot("scara"), [0, 0, 1e300])


def test_a_line_counts_where_it_is() -> None:
    line = Stroke(np.array([[0.0, 0.0], [30.0, 0.0]]), "#000000", 1.0)
    here, there = (Words("abc", 15.0, y, 0.0, 8.0, "#000000") for y in (0.0, 20.0))

    points = labels.sampled([line])

    assert labels.inside(points, here) > 3
    assert labels.inside(points, there) == 0
