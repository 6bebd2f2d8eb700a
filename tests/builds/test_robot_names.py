"""A robot may have the name of a file that its extension is compiled from."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.builds.workshop import ARM, make, write_robot


@pytest.mark.parametrize("name", ["arrays", "calls", "entries", "memory"])
def test_the_files_between_the_kernels_and_python_have_names_of_their_own(
    machine: None, tmp_path: Path, name: str
) -> None:
    result = make(write_robot(tmp_path, ARM.replace("name: arm", f"name: {name}")), tmp_path / "out")

    assert result.backend == "c"
    assert (tmp_path / "out" / name / f"{name}.h").is_file()
