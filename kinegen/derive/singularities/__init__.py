"""Determinants of the Jacobian in closed form, factored, and what is singular where a factor vanishes.

In: a robot and two frames. Out: `Loci`, the determinant or the minors as products of short factors. The order is that
of the modules: `trigonometric_polynomials`, `screws` (the Jacobian in the axes of any frame, determinants by blocks),
`factors`, `loci`, and `singular_points` (in words).
"""
