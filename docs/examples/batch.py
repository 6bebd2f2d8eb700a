"""Poses of 100,000 configurations at once; run with generated/ on the path."""

import numpy as np
import puma560

low, high = np.radians([[-160, -225, -90, -110, -100, -180], [160, 45, 90, 170, 100, 180]])
q = np.random.default_rng(1).uniform(low, high, (100_000, 6))
poses = puma560.fk(q)

print(q.shape, "->", poses.shape)
print("highest point reached:", poses[:, 2, 3].max().round(4), "m")
