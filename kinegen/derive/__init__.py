"""From a robot to exact expressions: with `backends/textbook/` and `ir/lower.py` all that uses sympy.

`transforms` makes elementary transforms between two frames, `folding` merges them, `chain_forms` finds other forms, and
one module for each kinematic quantity (`pose`, `jacobian`, `velocity`, `orientation` ...) evaluates the folded chain
into `Expressions`. For derivatives `annotated_chain` folds a chain and remembers where its transforms were,
`lever_arms` brings vectors along it to its start, `jacobian_columns` makes velocities of them, and `derivative` chooses
the cheapest ways. `dispatch` imports the module of a quantity when it is asked for. Nothing is simplified after the
fact.
"""
