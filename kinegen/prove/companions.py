"""C programs for Frama-C around the functions beside the kernels: limits, and the choice among solutions of an inverse.

They have no `Program`; a text calls them with every number of the type, infinities and NaN among them.
"""

from __future__ import annotations

from kinegen.emit.c.kernel import limit_names
from kinegen.emit.c.nearest import Nearest
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.naming import c_file, default_params, function, macro
from kinegen.prove.driver import HEAD, Claim, Driver, any_number_text


def limits_driver(kernels: Kernels, real: Real, name: str, files: dict[str, str]) -> Driver:
    """A program that calls `within_limits` or `clamp` with every joint vector, infinities and NaN among them.

    Args:
        kernels: The robot and its programs.
        real: The number type.
        name: Which of the two.
        files: The emitted files.

    Returns:
        The program. The first gives 0 or 1; the second a vector within the limits, with NaN where there was one.
    """
    robot = kernels.robot
    called, dof = function(robot.name, name, real), macro(robot.name, "DOF")
    low, high = limit_names(robot, real)
    if name == "clamp":
        kept = f"\\is_NaN(clamped[i]) || ({low}[i] <= clamped[i] <= {high}[i])"
        body = (
            f"    {real} clamped[{dof}];\n    {called}(q, clamped);\n    //@ loop unroll {robot.dof};\n"
            f"    for (int i = 0; i < {robot.dof}; i++) {{\n        /*@ assert {kept}; */\n    }}\n"
        )
    else:
        body = f"    const int within = {called}(q);\n    /*@ assert within == 0 || within == 1; */\n"
    values = "".join(f"    q[{index}] = any_number();\n" for index in range(robot.dof))
    main = f"int main(void)\n{{\n    {real} q[{dof}];\n{values}{body}    return 0;\n}}\n"
    text = f'{HEAD}{any_number_text(real)}#include "{c_file(robot.name, "c", real)}"\n\n{main}'
    return Driver(called, {"main.c": text, **files}, 1, Claim.DEFINED)


def nearest_driver(kernels: Kernels, real: Real, nearest: Nearest, files: dict[str, str]) -> Driver:
    """A program that calls the choice among solutions with every target and joint vector.

    Args:
        kernels: The robot and its programs.
        real: The number type.
        nearest: The function.
        files: The emitted files.

    Returns:
        The program. The function gives 0 or 1, and sets every joint value, to a number or NaN.
    """
    robot = kernels.robot
    parameters = [f"&{default_params(robot.name, real)}"] * bool(nearest.params_type)
    given = ["redundancy"] * bool(nearest.given)
    call = f"{nearest.name}({', '.join([nearest.target, *given, 'q0', *parameters, 'q'])})"
    lines = [
        f"{real} {nearest.target}[16];",
        *(f"{real} {name}[{nearest.given}];" for name in given),
        *(f"redundancy[{index}] = any_number();" for index in range(nearest.given)),
        f"{real} q0[{nearest.dof}];",
        *(f"{nearest.target}[{index}] = any_number();" for index in range(16)),
        *(f"q0[{index}] = any_number();" for index in range(robot.dof)),
        f"{real} q[{nearest.dof}];",
        f"const int exists = {call};",
        "/*@ assert exists == 0 || exists == 1; */",
        f"//@ loop unroll {robot.dof};",
        f"for (int i = 0; i < {robot.dof}; i++) {{",
        "    /*@ assert \\initialized(&q[i]); */",
        "}",
        "return 0;",
    ]
    body = "".join(f"    {line}\n" for line in lines)
    text = f'{HEAD}{any_number_text(real)}#include "{c_file(robot.name, "c", real)}"\n\nint main(void)\n{{\n{body}}}\n'
    return Driver(nearest.name, {"main.c": text, **files}, 2, Claim.DEFINED)
