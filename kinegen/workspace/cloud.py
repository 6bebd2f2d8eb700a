"""A workspace as a cloud of points: one sample for each voxel, with the joint vector that leads there.

Thinned to one point a voxel, a cloud is even in space, of the size of the region rather than of the number of samples,
and every point is exact: the tip's position at its joint vector.
"""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from kinegen.errors import KinegenError
from kinegen.workspace.optional import library
from kinegen.workspace.ranges import Range
from kinegen.workspace.sample import FloatArray
from kinegen.workspace.survey import Workspace

FORMATS = (".npz", ".parquet")

_PURPOSE = "a Parquet cloud"


def check_cloud(path: Path) -> None:
    """Refuse a cloud before anything is computed for it.

    Args:
        path: Where it should go.

    Raises:
        KinegenError: If its name ends in none of `FORMATS`, or it takes pyarrow and that is not installed.
    """
    if path.suffix.lower() not in FORMATS:
        raise KinegenError(f"{path}: clouds are written as {' or '.join(FORMATS)}, expected a name with such an ending")
    if path.suffix.lower() == ".parquet":
        library("pyarrow.parquet", _PURPOSE)


def make_cloud(workspace: Workspace) -> tuple[FloatArray, FloatArray]:
    """The points of a cloud.

    Args:
        workspace: A survey.

    Returns:
        Points (N, 3) in the base frame, and the joint vectors (N, dof) that lead there, in the order of the samples;
        one point where the tip stands still.
    """
    q = workspace.samples.at(np.zeros(1, np.int64)) if workspace.tally is None else workspace.tally.q
    return np.ascontiguousarray(workspace.tip.position(q).T), np.ascontiguousarray(q.T)


def pack(workspace: Workspace, ranges: tuple[Range, ...], kind: str) -> bytes:
    """The content of a cloud file.

    Args:
        workspace: A survey.
        ranges: The ranges of the joints, for their names.
        kind: Ending of the file name, one of `FORMATS`. An NPZ file holds the arrays `points` (N, 3) and `q` (N, dof),
            and `joints`, `robot`, `tip`, `unit`, `voxel`; a Parquet file the columns `x`, `y`, `z` and one named
            `q_JOINT` for each joint, and the rest as the metadata `kinegen`.

    Returns:
        The bytes.

    Raises:
        KinegenError: If a library is missing.
    """
    points, q = make_cloud(workspace)
    names = [each.name for each in ranges]
    about = {"robot": workspace.robot, "tip": workspace.tip.name, "unit": workspace.unit, "voxel": _voxel(workspace)}
    buffer = io.BytesIO()
    if kind.lower() == ".npz":
        np.savez_compressed(buffer, points=points, q=q, joints=np.array(names, "U"), **about)  # type: ignore[arg-type]
        return buffer.getvalue()
    pyarrow, parquet = library("pyarrow", _PURPOSE), library("pyarrow.parquet", _PURPOSE)
    columns = dict(zip("xyz", points.T, strict=True)) | {
        f"q_{name}": column for name, column in zip(names, q.T, strict=True)
    }
    table = pyarrow.table({name: np.ascontiguousarray(column) for name, column in columns.items()})
    parquet.write_table(table.replace_schema_metadata({"kinegen": json.dumps(about)}), buffer, compression="zstd")
    return buffer.getvalue()


def _voxel(workspace: Workspace) -> float:
    return 0.0 if workspace.tally is None else workspace.tally.voxels.size
