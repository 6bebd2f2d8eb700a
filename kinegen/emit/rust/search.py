"""The numeric inverse of the crate: the C of the search, and a module that calls it behind a feature."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.c.numeric_inverse import emit_numeric_inverse, tolerances
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.rust.functions import signature_lines
from kinegen.emit.rust.syntax import NUMBER, literal
from kinegen.emit.search import TUNING
from kinegen.naming import c_file, function, search_file
from kinegen.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN

FOLDER = "csrc"
"""Where the C files are in the crate."""


@dataclass(frozen=True, slots=True)
class Search:
    """What the templates of the search are given.

    Attributes:
        crate: Name of the crate.
        function: Its name in C.
        number: The number type.
        length: The length unit.
        position_tolerance: Accepted by default, in that unit.
        rotation_tolerance: Accepted by default, in radians.
        restarts: Descents after the first by default.
        sources: The C files that are compiled, of both number types.
        has_parameters: Whether there are runtime parameters.
        signature: The first lines of the function.
    """

    crate: str
    function: str
    number: str
    length: str
    position_tolerance: str
    rotation_tolerance: str
    restarts: int
    sources: tuple[str, ...]
    has_parameters: bool
    signature: tuple[str, ...]


def search_of(kernels: Kernels, real: Real) -> Search:
    """What the templates lay out."""
    robot = kernels.robot
    position, rotation = tolerances(robot, real)
    number = NUMBER[real]
    arguments = [f"base_T_tool: &[[{number}; 4]; 4]", f"start: &[{number}; DOF]"]
    arguments += [*["params: &Params"] * bool(robot.runtime_parameters), "search: &Search"]
    return Search(
        crate=robot.name,
        function=function(robot.name, str(NUMERIC_INVERSE), real),
        number=number,
        length=robot.units.length,
        position_tolerance=literal(real, position),
        rotation_tolerance=literal(real, rotation),
        restarts=TUNING.restarts,
        sources=tuple(
            f"{FOLDER}/{name}"
            for each in Real
            for name in (c_file(robot.name, "c", each), search_file(robot.name, "c", each))
        ),
        has_parameters=bool(robot.runtime_parameters),
        signature=signature_lines(str(NUMERIC_INVERSE), arguments, "Found"),
    )


def emit_search(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the files of the search of one number type, by path in the crate; C has the kernel that it takes alone."""
    alone = tuple(program for program in kernels.programs if program.quantity == POSE_AND_JACOBIAN)
    searched = Kernels(kernels.robot, alone, kernels.defaults, numeric_inverse=True)
    sources = emit_kernel(searched, real) | emit_numeric_inverse(searched, real)
    files = {f"{FOLDER}/{name}": text for name, text in sources.items()}
    search = search_of(kernels, real)
    templates = {"src/numeric_inverse.rs": "numeric_inverse.rs", "build.rs": "build.rs"}
    if real is Real.FLOAT:
        templates = {"src/f32/numeric_inverse.rs": "numeric_inverse.rs"}
    for path, name in templates.items():
        files[path] = environment().get_template(f"rust/{name}.jinja").render(s=search)
    return files
