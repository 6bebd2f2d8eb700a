"""The program: straight-line code with one operation a statement, and what can be known about it.

`program` holds the frozen records, `lower` makes them from expressions and is the last module that uses sympy, `names`
gives the temporaries their names, `signs` removes negations, and `bounds` proves how far results can be off.
Everything printed, counted or proven about a kernel is read off its `Program`.
"""
