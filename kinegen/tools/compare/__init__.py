"""Compares two robot files: for each frame that both have, a proof or the greatest difference, and where it is.

A proof says that the pose is the same for every joint vector; otherwise the joint box is searched. `frame_differences`
gives both for one frame, `fit` the signs and zero offsets of joints, and `compare` does all of it.
"""

from kinegen.tools.compare.compare import Comparison, Difference, compare

__all__ = ["Comparison", "Difference", "compare"]
