"""Poses of 100,000 configurations at once; run with the built package on the path."""

import numpy as np
import puma560

low, high = np.transpose([limit or (-np.pi, np.pi) for limit in puma560.LIMITS])
q = np.random.default_rng(1).uniform(low, high, (100_000, puma560.DOF))
poses = puma560.fk(q)

print(q.shape, "->", poses.shape)
print("highest point reached:", poses[:, 2, 3].max().round(4), "m")
