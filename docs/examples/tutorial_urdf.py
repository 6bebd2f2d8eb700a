"""Poses and Jacobians of an arm that came as a URDF."""

import elbow_arm
import numpy as np

q = np.zeros((1000, elbow_arm.DOF))
q[:, 0] = np.linspace(-1.0, 1.0, 1000)

print(elbow_arm.fk(q).shape, elbow_arm.jacobian(q).shape)
print(elbow_arm.fk(q[0]).round(4))
