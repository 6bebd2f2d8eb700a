"""Python modules: they need NumPy, and call compiled kernels through cffi, or through ctypes where that is missing."""
