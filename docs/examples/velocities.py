"""Pose and Jacobian of 100,000 configurations in one call, and a twist; run with the built package on the path."""

import numpy as np
import puma560

low, high = np.transpose([limit or (-np.pi, np.pi) for limit in puma560.LIMITS])
q = np.random.default_rng(1).uniform(low, high, (100_000, puma560.DOF))
poses, jacobians = puma560.fk_jacobian(q)
qd = np.full(puma560.DOF, 0.1)

print(poses.shape, jacobians.shape)
print("J qd is the twist:", np.allclose(jacobians @ qd, puma560.twist(q, qd), atol=1e-14))
print("share of poses close to singular:", (puma560.manipulability(jacobians) < 1e-3).mean())
