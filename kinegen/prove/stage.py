"""The stage: every function of a robot through Frama-C, several at a time."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.outputs import Kind
from kinegen.prove.claims import Subject, subjects
from kinegen.prove.eva import analyse, require_program, version
from kinegen.prove.evidence import Evidence, Finding

_COMPLETE = "it iterates for eigenvalues; intervals say nothing of where that ends"
_RANGE = "its search has loops; intervals say nothing of where they end"
_TRACKER = "it chooses among solutions and iterates; intervals say nothing of the choice"
_SEARCH = "a search with a loop; intervals say nothing of where it ends"


def prove(
    kernels: Kernels, reals: tuple[Real, ...], *, integers: bool, report: Callable[[Finding], object]
) -> Evidence:
    """Analyse the scalar C functions of a robot.

    Args:
        kernels: The robot and its programs.
        reals: Number types.
        integers: Whether to analyse the kernels in integers, too.
        report: Called with each finding as soon as it is there, in the order of the functions.

    Returns:
        The findings, whether everything was shown or not.

    Raises:
        MissingToolError: If Frama-C is not installed.
        KinegenError: If Frama-C did not come to an end, or integers cannot evaluate an output.
    """
    require_program()
    found = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for finding in pool.map(examine, subjects(kernels, reals, integers=integers)):
            found.append(finding)
            report(finding)
    left_out = ((str(Kind.NUMERIC_INVERSE), _SEARCH),) * kernels.numeric_inverse
    left_out += ((str(Kind.COMPLETE_INVERSE), _COMPLETE),) * kernels.complete_inverse
    left_out += ((str(Kind.REDUNDANCY_RANGE), _RANGE),) * kernels.redundancy_range
    left_out += ((str(Kind.INVERSE_TRACKER), _TRACKER),) * kernels.inverse_tracker
    robot = kernels.robot
    names = (parameter.name for parameter in robot.runtime_parameters)
    parameters = tuple(zip(names, map(float, kernels.defaults), strict=True))
    return Evidence(robot.name, robot.digest, robot.units.length, parameters, version(), tuple(found), left_out)


def examine(subject: Subject) -> Finding:
    """Analyse one function."""
    begin = time.perf_counter()
    outcome = analyse(subject.driver)
    return Finding(subject, outcome, time.perf_counter() - begin)
