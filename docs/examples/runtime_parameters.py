"""Lengths that stay arguments; run with the package on the path."""

import calibrated_2r
import numpy as np

q = np.array([0.3, -0.5])
print(calibrated_2r.Params())

# A measured length instead of the one in the file; the others keep their defaults. Angles are in radians.
measured = calibrated_2r.Params(L1=0.4011)
moved = calibrated_2r.position(q, params=measured) - calibrated_2r.position(q)
print("the tip moves by", (1000 * moved).round(3), "mm")
