"""MATLAB and GNU Octave: a package folder of functions, and a MEX file over the C kernels for batches."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from kinegen.emit.language import Language
from kinegen.emit.reals import Real
from kinegen.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.emit.c.expected import Vectors
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
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
    from kinegen.emit.matlab.syntax import matlab_syntax

    return matlab_syntax(Real(real))


def _files(kernels: Kernels, _real: str) -> Mapping[str, str]:
    """Every function takes both number types."""
    return _both(kernels)


@lru_cache(maxsize=1)
def _both(kernels: Kernels) -> Mapping[str, str]:
    """The files, which are asked for once for each number type."""
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.matlab.package import emit_matlab

    return MappingProxyType(emit_matlab(kernels))


def _tests(kernels: Kernels, real: str, vectors: Vectors) -> Mapping[str, str]:
    from kinegen.emit.matlab.vectors import emit_matlab_tests

    return emit_matlab_tests(kernels, vectors) if real == Real.DOUBLE else {}


MATLAB = Language(
    name="matlab",
    title="MATLAB",
    reals=tuple(Real),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("octave-cli",),
    install="GNU Octave",
    tests=_tests,
    reserved=_KEYWORDS,
    reserved_robots=_FUNCTIONS,
)
