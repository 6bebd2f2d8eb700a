"""MATLAB and GNU Octave: a package folder of functions, and a MEX file over the C kernels for batches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from kinegen.backends.language import Language
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.c.test_vectors import Vectors
    from kinegen.backends.printing import Syntax
    from kinegen.ir.program import Operator

LONGEST = 63
"""Characters of a name that MATLAB tells from others (`namelengthmax`)."""

_KEYWORDS = frozenset(
    """arguments break case catch classdef continue do else elseif end end_try_catch end_unwind_protect endclassdef
    endenumeration endevents endfor endfunction endif endmethods endparfor endproperties endswitch endwhile enumeration
    events for function global if import methods otherwise parfor persistent properties return spmd switch try until
    unwind_protect unwind_protect_cleanup while""".split()
)
"""Keywords of MATLAB and of Octave."""

_FUNCTIONS = frozenset(
    """all ans any cell class double eps error eval feval find help i import inf info isa isfloat isreal j logical
    matlab max mex min nan nargin nargout ndims numel ones repmat reshape robot single size sqrt struct sum test true
    varargin varargout zeros""".split()
)
"""Names of functions and variables that a package of the same name would hide, or be hidden by."""


def _refuses(quantity: Quantity) -> str:
    if quantity.kind in (Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE, Kind.INVERSE_TRACKER):
        return "it is in C and Python alone"
    if quantity.kind is Kind.NUMERIC_INVERSE:
        return "it is a search, and functions here have no loop"
    length = len(quantity.function)
    return f"its name has {length} characters, of which {LONGEST} count" if length > LONGEST else ""


def _syntax(real: str) -> Syntax[Operator]:
    from kinegen.backends.matlab.syntax import matlab_syntax

    return matlab_syntax(ScalarType(real))


def _files(kernels: RobotPrograms, _real: str) -> Mapping[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.matlab.files import emit_matlab

    return emit_matlab(kernels)


def _tests(kernels: RobotPrograms, real: str, vectors: Vectors) -> Mapping[str, str]:
    from kinegen.backends.matlab.files import emit_matlab_tests

    return emit_matlab_tests(kernels, vectors) if real == ScalarType.DOUBLE else {}


MATLAB = Language(
    name="matlab",
    title="MATLAB",
    reals=tuple(ScalarType),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("octave-cli",),
    install="GNU Octave",
    tests=_tests,
    reserved=_KEYWORDS,
    reserved_robots=_FUNCTIONS,
)
