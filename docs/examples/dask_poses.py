"""Kernels over a Dask array, in threads and in processes; run with the package on the path."""

from concurrent.futures import ProcessPoolExecutor

import dask.array as da
import numpy as np
import ur5


def main() -> None:
    """Evaluate the same joint vectors in three ways."""
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (400_000, 6))

    # Dask calls the kernel with one block of rows at a time, on all cores; blocks may come from files.
    blocks = da.from_array(q, chunks=(50_000, 6))
    shape = {"row": 4, "column": 4}
    poses = da.apply_gufunc(ur5.fk, "(joint)->(row,column)", blocks, output_sizes=shape, output_dtypes=float)
    print("highest point:", poses[:, 2, 3].max().compute().round(6), "m")

    # A kernel can be sent to other processes: they import the package and call the kernel of the same name.
    with ProcessPoolExecutor(2) as processes:
        parts = list(processes.map(ur5.fk, np.split(q, 8)))
    print("the same from processes:", np.array_equal(np.concatenate(parts), poses.compute()))

    # On one machine neither is needed: a call with threads=0 uses all cores.
    print("the same from threads:", np.array_equal(ur5.fk(q, threads=0), poses.compute()))


if __name__ == "__main__":
    main()
