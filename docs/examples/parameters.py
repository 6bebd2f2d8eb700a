"""The derivative of the pose by all 24 numbers of the table; run with the built package on the path."""

import numpy as np
import ur5

q = np.array([0.3, -1.2, 0.4, 0.1, 0.8, -0.5])
J = ur5.parameter_jacobian(q, params=ur5.Params(a_elbow=-0.3921))

print(J.shape)
print("columns:", *ur5.PARAMETERS[:5], "...")
