"""All joint vectors for a pose, and the one nearest to the present one; run with the built package on the path."""

import numpy as np
import puma560

q = np.array([0.3, -1.2, 0.4, 0.1, 0.8, -0.5])
solutions, valid = puma560.inverse(puma560.fk(q))
nearest, found = puma560.inverse(puma560.fk(q), nearest=q + 0.1)

print(solutions.shape, "of which within limits:", int(valid.sum()))
print("nearest:", nearest.round(6), bool(found))
