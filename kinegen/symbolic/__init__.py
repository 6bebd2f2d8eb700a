"""From a robot to exact expressions: with `textbook/` and `ir/lower.py` all that uses sympy.

`transforms` turns one row into elementary transforms, `chain` strings them together between two frames, `fold` merges
them, and one module for each kinematic quantity (`pose`, `position`, `velocity`, `hessian` ...) evaluates the folded
chain into `Expressions`. For derivatives `marks` folds a chain and remembers where its transforms stood, `route` brings
vectors along it to its start, and `derivative` chooses the cheapest ways. Nothing here is simplified after the fact.
"""
