"""What a package offers; run with the package on the path."""

import numpy as np
import ur5

q = np.zeros((1000, 6))
print(ur5.fk)
print("joints:", ur5.JOINTS, "frames:", ur5.FRAMES)

# One joint vector, a batch, any leading axes; lists are welcome.
print(ur5.fk([0, -1.5, 0, 0, 0, 0]).shape, ur5.fk(q).shape, ur5.fk(q.reshape(10, 100, 6)).shape)

# float32 in, float32 out; everything else is computed in float64.
print(ur5.fk(q.astype(np.float32)).dtype, ur5.fk(np.zeros(6, int)).dtype)

# out= writes into an existing array; threads=0 takes all cores.
poses = np.empty((1000, 4, 4))
print(ur5.fk(q, out=poses, threads=0) is poses)

# layout: without the constant last row, or with one row for each entry, as solvers of many poses like it.
print(ur5.fk(q, layout="3x4").shape, ur5.fk(q.T.copy(), layout="joint_major").shape)

# bind looks everything up once; each call reads q anew and writes the result. For control loops.
now, pose = np.zeros(6), np.empty((4, 4))
step = ur5.fk.bind(now, pose)
now[:] = 0.1
step()
print(np.array_equal(pose, ur5.fk(now)))

# One frame alone (built with pose@elbow), and a kernel with two inputs: joint values and rates.
print(ur5.fk_elbow(q).shape, ur5.twist(q, q).shape)
