"""Holds every emitted kernel against the independent reference, and says where it was worst.

records         what was found: invocations by their fields, comparisons, proofs, costs
samples         inputs as tables: joint vectors, rates, poses, values beyond the limits, runtime parameters
expected_results  what each kind of result must be, and which of its entries are lengths
expectations    what a kernel must return at some inputs, and how far it is from that
tolerances      how close is close enough, and why (rounding)
invocations     how kernels can be called, each way compared with the reference
compare         one comparison, at usual inputs and beyond the limits (nan_propagation, dependence)
bit_consistency  every other way of calling, which has to give the same bits (parameter_batches)
proof           all comparisons of a build; the inverses and solvers have trials of their own
languages       the same for other languages, each with a runner in runners/
files           what lies beside the kernels: tables, headers, C text, self-tests and vectors
package_proof   a package proven before it is written, and what is written against what was proven
isolation       calls in a process of their own, between guard words
"""
