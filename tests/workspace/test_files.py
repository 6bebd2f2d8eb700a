"""Pictures and clouds: what they hold, and that they are the same each time."""

from __future__ import annotations

import io
import json
import re
from html import unescape
from math import pi

import numpy as np
import pytest
from matplotlib.image import imread
from numpy.typing import NDArray
from pyarrow import parquet

from kinegen.errors import KinegenError
from kinegen.tools.workspace.options import Plane
from kinegen.tools.workspace.sampling import Workspace, pack
from kinegen.tools.workspace.slices import draw, fill_layer, make_slices
from kinegen.tools.workspace.tip_samples import joint_ranges
from kinegen.tools.workspace.voxels import Voxels
from kinegen.verify import reference
from tests.workspace import arms

BLUE = np.array([0x1B, 0x6C, 0xA8]) / 255


def texts(svg: bytes) -> set[str]:
    """The words of a picture."""
    return {unescape(text).strip() for text in re.findall("<text[^>]*>([^<]*)</text>", svg.decode())}


def test_slices_of_a_shell_are_annuli() -> None:
    workspace = arms.surveyed(arms.SHELL, 1_000_000)
    slices = make_slices(workspace)

    assert [(each.across, each.up) for each in slices] == [(0, 1), (0, 2), (1, 2)]
    for each in slices:
        annulus, disc = (Voxels(each.size, each.corner, cells).measure for cells in (each.reached, each.shadow))
        assert annulus == pytest.approx(pi * (1 - 0.5**2), rel=0.05)
        assert disc == pytest.approx(pi, rel=0.03)
        assert each.at == pytest.approx(0, abs=each.size) or each.across + each.up == 1


def test_planes_are_chosen() -> None:
    """A shell cut 0.3 m off its middle: an annulus between the roots of 0.5² - 0.3² and 1 - 0.3²."""
    first, second = make_slices(arms.surveyed(arms.SHELL, 1_000_000), (Plane(1, 0.3), Plane(2, 0.0)))

    assert [(each.across, each.up, each.at) for each in (first, second)] == [(0, 2, 0.3), (0, 1, 0.0)]
    assert Voxels(first.size, first.corner, first.reached).measure == pytest.approx(pi * (1 - 0.5**2), rel=0.05)
    assert not first.reached[tuple(((np.zeros(2) - first.corner) // first.size).astype(int))]
    assert "y = 0.3 m" in texts(draw(arms.surveyed(arms.SHELL, 1_000_000), ".svg", (Plane(1, 0.3),)))


def test_upright_planes_go_through_the_first_axis() -> None:
    assert [each.at for each in make_slices(arms.surveyed("iiwa14"))[1:]] == [0.0, 0.0]


def test_a_plane_beside_the_region_is_refused() -> None:
    with pytest.raises(KinegenError, match="the plane z = 2 m misses the region, which goes from z = -1 to 1 m"):
        make_slices(arms.surveyed(arms.SHELL), (Plane(2, 2.0),))


def test_a_layer_has_no_holes_where_samples_left_some() -> None:
    """Seven joints: samples leave free voxels inside the outline, and the search of the layer fills them."""
    workspace = arms.surveyed("iiwa14", 1_000_000, 0.025)
    assert workspace.tally
    place = int(-workspace.tally.halves.corner[1] // workspace.tally.halves.size)
    sampled, filled = np.take(workspace.tally.halves.hit, place, 1), fill_layer(workspace, 1, place)

    assert (filled | ~sampled).all()
    assert holes(sampled) > 20
    assert holes(filled) == 0


def holes(cells: NDArray[np.bool_]) -> int:
    """How many free cells have four neighbours that are reached."""
    wide = np.pad(cells, 1)
    beside = wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:]
    return int((~cells & beside).sum())


def test_a_planar_arm_has_one_picture_and_no_shadow() -> None:
    (only,) = make_slices(arms.surveyed(arms.TWO_LINKS))

    assert only.at is None
    assert (only.reached == only.shadow).all()


def test_a_png_shows_the_annulus_round() -> None:
    """Blue within the drawn circle, as wide as high, and of the area that it should have."""
    picture = imread(io.BytesIO(draw(arms.surveyed(arms.TWO_LINKS), ".png")), format="png")[..., :3]
    # The legend below holds a blue patch too.
    blue = (np.abs(picture - BLUE).max(axis=2) < 0.02)[: int(0.85 * len(picture))]
    rows, columns = np.flatnonzero(blue.any(axis=1)), np.flatnonzero(blue.any(axis=0))
    high, wide = np.ptp(rows), np.ptp(columns)

    assert high == pytest.approx(wide, rel=0.02)
    # Grid lines are drawn over it, and voxels reach beyond it.
    assert 0.9 < blue.sum() / (wide * high) / (pi / 4 * (1 - 0.25**2)) < 1.05


def test_an_svg_says_what_it_shows() -> None:
    words = texts(draw(arms.surveyed(arms.SHELL), ".svg"))

    assert {"x [m]", "y [m]", "z [m]", "base", "Workspace of arm, tool"} <= words
    assert any(word.startswith("volume 3.") for word in words)
    assert any(word.startswith("z = ") for word in words)
    assert any(re.fullmatch(r"reached in a layer of [\d.]+ m at this plane", word) for word in words)


def test_a_slanting_plane_says_where_its_axes_lie() -> None:
    words = texts(draw(arms.surveyed(arms.TILTED), ".svg"))

    assert {"u [m]", "v [m]"} <= words
    assert any(word.startswith("u along (") for word in words)


@pytest.mark.parametrize("kind", [".png", ".svg"])
def test_the_same_survey_gives_the_same_picture(kind: str) -> None:
    workspace = arms.surveyed(arms.TWO_LINKS, 20_000)

    assert draw(workspace, kind) == draw(workspace, kind)


@pytest.mark.parametrize("joints", [arms.LINE, arms.POINT])
def test_what_has_no_slices_says_so(joints: str) -> None:
    with pytest.raises(KinegenError, match="has no slices"):
        draw(arms.surveyed(joints, 1000), ".svg")


def cloud(workspace: Workspace, joints: str, kind: str) -> bytes:
    """The content of a cloud file."""
    return pack(workspace, joint_ranges(arms.robot(joints)), kind)


@pytest.mark.parametrize("joints", [arms.SHELL, arms.TILTED, "puma560", arms.POINT])
def test_every_point_of_a_cloud_is_the_pose_of_its_joints(joints: str) -> None:
    workspace = arms.surveyed(joints, 20_000)
    found = np.load(io.BytesIO(cloud(workspace, joints, ".npz")))
    points = reference.pose(arms.robot(joints), found["q"])[:, 0, :3, 3]

    assert np.abs(points - found["points"]).max() < 1e-12
    assert len(points) == (workspace.tally.voxels.count if workspace.tally else 1)
    assert list(found["joints"]) == [variable.name for variable in arms.robot(joints).variables]
    assert str(found["unit"]) == "m"


def test_a_parquet_cloud_holds_the_same() -> None:
    workspace = arms.surveyed(arms.SHELL, 20_000)
    found = np.load(io.BytesIO(cloud(workspace, arms.SHELL, ".npz")))
    table = parquet.read_table(io.BytesIO(cloud(workspace, arms.SHELL, ".parquet")))

    assert table.column_names == ["x", "y", "z", "q_turn", "q_lift", "q_out"]
    assert (np.stack([table[name].to_numpy() for name in "xyz"], axis=1) == found["points"]).all()
    assert (table["q_out"].to_numpy() == found["q"][:, 2]).all()
    assert json.loads(table.schema.metadata[b"kinegen"])["voxel"] == found["voxel"]
