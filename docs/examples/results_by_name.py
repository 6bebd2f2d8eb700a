"""Results of a tree by the names of its tips; run with the package on the path."""

import hand
import numpy as np

q = np.zeros((1000, hand.DOF))
print(hand.TIPS)

# The call of the kernel, and a view of its result for each tip.
tips = hand.fk.by_name(q)
print(tips["index_tip"].shape, np.shares_memory(tips["index_tip"], tips.result))
print({name: point[0].round(3).tolist() for name, point in hand.position.by_name(q).items()})

# Where a kernel has several results, a part is a tuple. The result of frames has the names of FRAMES.
pose, jacobian = hand.fk_jacobian.by_name(q)["thumb_tip"]
print(pose.shape, jacobian.shape, hand.frames.by_name(q)["index_root"].shape)

# For control loops: name the array once; the views show what each call of the bound kernel writes.
now, poses = np.zeros(hand.DOF), np.empty((5, 4, 4))
step, index_tip = hand.fk.bind(now, poses), hand.fk.named(poses)["index_tip"]
step()
print(index_tip[:3, 3])
