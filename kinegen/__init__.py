"""kinegen: a compiler for robot kinematics.

It reads a YAML file with a Denavit-Hartenberg table. It writes the closed form as a textbook prints it, C files for
firmware, and a Python module that evaluates poses in bulk. Data goes one way, from the top of this list to its end:

    robot/      YAML text      -> Robot          what the user wrote: exact, validated, with line numbers
    symbolic/   Robot          -> Expressions    elementary transforms, folded; poses; with sympy
    ir/         Expressions    -> Program        straight-line code, one operation per statement
    emit/       Program        -> {name: text}   one folder of templates per language
    native/     C text         -> callable       compiled extension, threads, arrays
    verify/     callable       -> Proof          the proof, against reference/
    boards/     C text         -> Cost           emulated microcontrollers: the same bits, flash, stack, instructions
    prove/      C text         -> Evidence       run-time errors of the C, by Frama-C where it is installed
    workspace/  callable       -> Workspace      what the tip reaches: extents, volume, pictures, clouds of points
    build.py    the stages in order, timed; what they found as one record
    cli/        one module per subcommand

A module imports only from rows above its own; `tests/test_layers.py` reads the imports. `docs/architecture.md` explains
the stages.

sympy is imported in symbolic/ and in ir/lower.py, nowhere else. This module itself imports nothing, so that `kinegen
--help` answers at once.
"""

__version__ = "0.1.0"
"""The version; the banners of generated files name it, and the build of the wheel reads it here."""
