"""Are two robot files the same robot?

In: two robots. Out: `Comparison`: for each frame that both have, a proof that its pose is the same for every joint
vector, or the greatest difference over the joint box, and where.

    motions    a frame as a sequence of screws in the base at q = 0, and its pose there, with 150 digits
    box        the joint vectors that both robots can reach
    differ     the greatest difference, by samples and local search
    fit        signs and zero offsets of joints
    compare    all of it
"""

from kinegen.compare.compare import Comparison, Difference, compare

__all__ = ["Comparison", "Difference", "compare"]
