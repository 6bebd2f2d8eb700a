"""Trees of links and joints, which URDF and MJCF describe: exact numbers, a shared tree, then the model.

A reader fills a `tree.LinkTree`; `assemble.assemble` makes the `Robot` of it.
"""
