"""Which real arms get all their solutions, and in which way: `python -m benchmarks.arms`."""
