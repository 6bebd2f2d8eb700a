"""From any robot to a table: standard rows, modified rows, or elementary sequences, with every pose kept.

In: a `Robot` in any convention, also a tree. Out: the same robot in another convention, and what was free to choose.
Between two joints a table has a screw about z, a screw about x, and a screw about z. Any fixed transform is such a
product, and screws about z commute with a joint's own motion about z; so each transform between two joints is taken
apart by itself, and nothing adds up along the chain.

    elementary_transforms rows as elementary transforms, folded exactly
    exact_poses           150 digits, the exact expression that a number is, and poses with linear forms of lengths
    motion_tree           the tree of motions about z, and the fixed transforms between them
    fixed_transforms      the ways to take a fixed transform apart, and the ways with most zeros along a path
    row_placement         rows and frames of the new table
    convert               `to_convention`
"""

from kinegen.model.dh_conversion.convert import Converted, to_convention

__all__ = ["Converted", "to_convention"]
