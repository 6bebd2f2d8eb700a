"""The program: straight-line code with one operation a statement, and what can be known about it.

`program` holds the frozen records, `lower` makes them from expressions, `common_subexpressions` saves operations,
`sign_propagation` removes negations, `finalize` gives the temporaries their order and names, `error_analysis` proves
how far results can be off, and `fixed_point` has the same in integers. Everything printed, counted or proven about a
kernel is read off its `Program`.
"""
