"""Thumb, index finger and middle finger take hold of something small; run with the built package on the path."""

import hand
import numpy as np

points = {"thumb_tip": (49, 42, -58), "index_tip": (60, 30, -42), "middle_tip": (68, 3, -57)}  # mm, in the palm's frame

targets = np.zeros((len(hand.TIPS), 4, 4))
weights = np.zeros((len(hand.TIPS), 2))  # nothing is asked of the ring finger and of the little finger
for tip, point in points.items():
    place = hand.TIPS.index(tip)
    targets[place, :3, 3] = point
    weights[place, 0] = 1  # the position alone

found = hand.numeric_inverse(targets, weights=weights)
print(f"solved: {found.solved}, in {found.iterations} steps")
for tip, pose, error in zip(hand.TIPS, hand.fk(found.q), found.position_error, strict=True):
    wanted = f"{error:.1e} mm from its point" if tip in points else "free"
    print(f"{tip:<12}{np.round(pose[:3, 3], 3)}  {wanted}")
