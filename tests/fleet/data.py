"""What the tests of data sets share: a small arm and files of joint vectors for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet

ROOT = Path(__file__).resolve().parent.parent.parent
ROBOT = ROOT / "robots" / "planar_3r.yaml"
JOINTS = ("joint_1", "joint_2", "joint_3")


def vectors_of(rows: int, seed: int = 3) -> Any:
    """Joint vectors, shape (rows, 3)."""
    return np.random.default_rng(seed).uniform(-3, 3, (rows, 3))


def table_of(q: Any, **more: Any) -> Any:
    """Joint vectors in columns with the names of the joints, and other columns."""
    return pa.table({name: q[:, i] for i, name in enumerate(JOINTS)} | more)


def write(path: Path, table: Any, rows: int = 100) -> Path:
    """A Parquet file whose row groups have so many rows."""
    pyarrow.parquet.write_table(table, path, row_group_size=rows)
    return path


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a folder by name, hidden ones too."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}
