"""Measures how fast the batch kernels are, against what the machine can do and against what people use instead.

    python -m benchmarks.speed              everything, some minutes
    python -m benchmarks.speed --help       parts of it

One process, pinned to one core where a row says one thread. What a ratio compares is measured in turns, and the median
of the turns counts, since machines are shared.
"""
