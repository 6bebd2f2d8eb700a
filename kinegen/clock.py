"""The clock of a build: times the stages, and says what begins and what has ended."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from kinegen.boards.usual import USUAL_TARGET
from kinegen.errors import KinegenError, WriteError
from kinegen.outputs import Quantity
from kinegen.results import Stage

_WORK = {
    "vectors": "compute test vectors with 50 digits",
    "emit": "emit C and Python, with proven errors",
    "compile": "compile the kernels",
    "prove": "prove every output in every way to call it",
    "measure": f"measure every output on {USUAL_TARGET}",
}
"""What is being done in stages that can take long, in words."""


@dataclass(slots=True)
class Clock:
    """Times the stages, says what begins, and reports each stage as it ends.

    Attributes:
        path: The robot file, as the user named it.
        report: Called after each stage.
        begin: Called with a few words before each stage, and before each output in stages that take them one by one.
        stages: The stages that have ended.
    """

    path: Path
    report: Callable[[Stage], None]
    begin: Callable[[str], object] = str
    stages: list[Stage] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str) -> Iterator[list[str]]:
        """Run a stage.

        Args:
            name: Its name in the report.

        Yields:
            Where details are put that the report shows, such as the number of files.

        Raises:
            KinegenError: What the stage raised, with the robot file as its place if it had none.
            WriteError: If temporary files cannot be used.
        """
        detail: list[str] = []
        self.begin(_WORK.get(name, name))
        begin = time.perf_counter()
        try:
            yield detail
        except KinegenError as error:
            # What is wrong with a robot is told of the file as the user named it.
            if type(error) is KinegenError:
                raise KinegenError(error.message, str(self.path), error.line) from error
            raise
        except OSError as error:
            # Reading and writing speak for themselves; what is left is the folder in which packages are made.
            reason = f"cannot {name} with temporary files: {error}; TMPDIR can name another folder for them"
            raise WriteError(f"{reason}; the earlier output is untouched") from error
        self.stages.append(Stage(name, time.perf_counter() - begin, ", ".join(detail)))
        self.report(self.stages[-1])

    def each(self, verb: str, quantities: Sequence[Quantity]) -> Iterator[Quantity]:
        """The quantities, each said with its number before its turn comes."""
        for place, quantity in enumerate(quantities, start=1):
            self.begin(f"{verb} {quantity} ({place} of {len(quantities)})")
            yield quantity
