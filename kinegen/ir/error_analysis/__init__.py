"""Proven bounds on what a kernel's results are off, read off its `Program`: a running error analysis, done forwards.

In: a program, the ranges of its inputs, the facts of a number type. Out: an `ErrorBound` with one number for each entry
of the result. For every group of one to three values two bounds are kept: of the 2-norm of the exact values, and of the
2-norm of their errors, an error being the computed value minus the exact one. `directed_rounding` holds the arithmetic
of the bounds, `value_graph` the values, their signs and the rotations among them, `rules` holds the rules and `bound`
applies them.

What is proven. Inputs are the numbers that the kernel is given, taken as exact, anywhere in their ranges; runtime
parameters have the values of the file, and rounding them is charged like that of any constant. The exact result is
what real numbers give with the exact decimals of the file (a `Program` holds irrational constants to well over a
hundred digits; the rest is left out of account). Arithmetic is IEEE 754 with subnormal numbers, rounding to nearest,
and the sine and cosine are the emitted ones. An angle that leaves their range makes results NaN, about which nothing
is said: where the ranges allow that, the bound holds for those inputs for which every angle stays inside.

Contraction is covered too. It leaves out the rounding of a product that a sum takes up at once; every rule charges
that rounding by its largest size and lets it be anything down to zero, and no magnitude that a rule uses relies on it.
Products of products and whatever is multiplied are rounded once in either case.

Sound by construction. Every number of the analysis is an upper bound and none is negative, so that rounding all of
its operations upwards can only enlarge the result; decimal arithmetic with forty digits does that, and gives the same
digits on every machine. The rules are theorems about any group of values, so no grouping can be wrong, only useless;
that a step is a rotation is checked on the operations themselves, sign by sign.
"""

from kinegen.ir.error_analysis.bound import ErrorBound, FrameBound, bound, has_rules
from kinegen.ir.error_analysis.directed_rounding import NumberType
from kinegen.ir.error_analysis.value_graph import Ranges, largest_angle

__all__ = ["ErrorBound", "FrameBound", "NumberType", "Ranges", "bound", "has_rules", "largest_angle"]
