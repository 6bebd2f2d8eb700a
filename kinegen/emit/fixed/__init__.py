"""C99 in integers, for processors without an FPU: the kernels of `ir.fixed`, their test vectors and self-test."""

Q30 = "q30"
"""The name of this number type, on the command line and in the names of files and functions."""
