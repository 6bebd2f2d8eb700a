"""Five joints reach what fulfils one condition; run with the built package on the path."""

import al5d
import numpy as np

q = np.array([0.4, 0.9, -1.3, 0.2, 0.5])
target = al5d.fk(q)
c, s = np.cos(np.radians(1)), np.sin(np.radians(1))
beside = target.copy()  # approach vector turned by a degree about the vertical through the tool
beside[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ target[:3, :3]

for name, pose in (("in the plane of the arm", target), ("beside it", beside)):
    found = al5d.numeric_inverse(pose)
    print(f"{name}: {al5d.inverse(pose)[1].sum()} branches", end="; ")
    print(f"search solved {found.solved}, {1000 * found.position_error:.2f} mm", end=" ")
    print(f"and {np.degrees(found.rotation_error):.3f} deg away")
