"""Runs the notebooks of examples/, and keeps their outputs out of the files.

python scripts/notebooks.py            clears what a run left in the files
python scripts/notebooks.py --check    fails if there is any
python scripts/notebooks.py --run      runs them from top to bottom and prints what fails; the files stay as they are
"""

from __future__ import annotations

import os
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent.parent / "examples"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
SECONDS = 600
"""The longest that a cell may take; a build on a busy machine takes a minute."""


def main(arguments: list[str]) -> int:
    """Clears, checks or runs; returns the exit status."""
    if arguments == ["--run"]:
        return sum(not run(path) for path in NOTEBOOKS) and 1
    changed = [path for path in NOTEBOOKS if path.read_text(encoding="utf-8") != cleared(path)]
    for path in changed:
        if arguments != ["--check"]:
            path.write_text(cleared(path), encoding="utf-8", newline="\n")
        print(f"{path.name}: {'has outputs; run scripts/notebooks.py' if arguments else 'outputs are cleared'}")
    return int(bool(changed and arguments))


def cleared(path: Path) -> str:
    """A notebook without outputs, counts and settings of the editor."""
    nbformat: Any = import_module("nbformat")
    notebook = nbformat.read(path, as_version=4)
    for place, cell in enumerate(notebook.cells, start=1):
        cell["id"], cell["metadata"] = f"cell-{place:02d}", {}
        if cell["cell_type"] == "code":
            cell["outputs"], cell["execution_count"] = [], None
    python = {"display_name": "Python 3", "language": "python", "name": "python3"}
    notebook["metadata"] = {"kernelspec": python, "language_info": {"name": "python"}}
    return str(nbformat.writes(notebook, indent=1)).rstrip("\n") + "\n"


def executed(path: Path) -> object:
    """Run a notebook in its folder with this interpreter.

    Returns:
        The notebook with its outputs; nothing is written.

    Raises:
        CellExecutionError: At the first cell that fails.
    """
    nbformat: Any = import_module("nbformat")
    client: Any = import_module("nbclient").NotebookClient
    notebook = nbformat.read(path, as_version=4)
    # Cells call the command as a shell finds it.
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    options = {"timeout": SECONDS, "kernel_name": "python3", "resources": {"metadata": {"path": str(path.parent)}}}
    client(notebook, **options).execute()
    return notebook


def run(path: Path) -> bool:
    """Run a notebook and say how that went."""
    from nbclient.exceptions import CellExecutionError

    begin = time.perf_counter()
    try:
        executed(path)
    except CellExecutionError as error:
        print(f"{path.name}: {error}")
        return False
    print(f"{path.name}: ran in {time.perf_counter() - begin:.0f} s")
    return True


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
