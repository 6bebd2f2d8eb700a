"""What a runner is, and how kernels of another process are called."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from kinegen.emit.kernels import Kernels
from kinegen.errors import CompileError
from kinegen.ir.program import Program
from kinegen.native.compiler import first_errors
from kinegen.verify.ways import Arrays

PATIENCE = 600.0
"""Seconds that one call of a tool may take."""


class Call(Protocol):
    """Evaluates a kernel."""

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel.

        Args:
            program: The program that the kernel was printed from.
            inputs: Its inputs, N configurations each, in the number type.
            parameters: Values of the runtime parameters; those of the robot file if None.
            real: The number type, one of the language.
            is_batch: Whether to call the function for batches.

        Returns:
            Its results, N configurations each, in the shapes that the program's signature gives.

        Raises:
            CompileError: If the tool refuses the files.
        """

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays | None:
        """Evaluate a function beside the kernels, with the runtime parameters of the robot file.

        Args:
            name: `inverse_nearest` (poses of the tool and joint vectors; joint vectors and flags), `within_limits`
                (joint vectors; flags) or `clamp` (joint vectors; joint vectors).
            inputs: Its inputs, N configurations each, in the number type.
            real: The number type, one of the language.

        Returns:
            Its results, N configurations each, flags as numbers; None where the language has no such function.
        """

    def tables(self) -> Mapping[str, Any]:
        """What the files say of the robot, by the names that Python packages use.

        `DOF`, `JOINTS`, `LIMITS`, `MODEL` and, where there is such a thing, `FRAMES`, `TIPS`, `BRANCHES`, `PARAMETERS`,
        `ACTUATORS` and `DEFAULT_PARAMS`; lists are tuples.

        Raises:
            CompileError: If the tool refuses the files.
        """


class Runner(Protocol):
    """Prepares the files of a language to be called."""

    def __call__(self, tool: str, folder: Path, kernels: Kernels) -> Call:
        """Prepare what was emitted.

        Args:
            tool: The program that compiles or runs it.
            folder: The folder with the emitted files, in which more may be written.
            kernels: What they were printed from.

        Raises:
            CompileError: If the tool refuses the files.
        """


def run_tool(command: tuple[str, ...], folder: Path, subject: str) -> str:
    """Run a tool in a folder.

    Args:
        command: The tool and its arguments.
        folder: Working folder.
        subject: What it is run for, for the message.

    Returns:
        What it prints.

    Raises:
        CompileError: With the first error that it reports, if it fails or takes longer than `PATIENCE`.
    """
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise CompileError(f"{command[0]} did not finish {subject} within {PATIENCE:.0f} s") from error
    except OSError as error:
        raise CompileError(f"{command[0]} cannot be run: {error.strerror}") from error
    if done.returncode:
        raise CompileError(f"{command[0]} refuses {subject}: {first_errors(done)}")
    return done.stdout
