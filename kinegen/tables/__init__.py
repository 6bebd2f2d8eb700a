"""From any robot to a table: standard rows, modified rows, or elementary sequences, with every pose kept.

In: a `Robot` in any convention, also a tree. Out: the same robot in another convention, and what was free to choose.
Between two joints a table has a screw about z, a screw about x, and a screw about z. Any fixed transform is such a
product, and screws about z commute with a joint's own motion about z; so each transform between two joints is taken
apart by itself, and nothing adds up along the chain.

    numbers    150 digits, and the exact expression that a number is
    steps      rows as elementary transforms, folded exactly
    poses      the same as a rotation and a linear form of lengths
    cells      the tree of motions about z, and the fixed transforms between them
    links      the ways to take a fixed transform apart
    choose     the ways with most zeros along a path
    far        lengths that nearly parallel axes make
    place      rows and frames of the new table
    convert    `to_convention`
"""

from kinegen.tables.convert import Converted, to_convention

__all__ = ["Converted", "to_convention"]
