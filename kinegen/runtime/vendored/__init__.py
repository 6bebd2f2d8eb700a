"""Arrays, threads and solvers of this package; the folder is the same for every robot and needs NumPy alone."""
