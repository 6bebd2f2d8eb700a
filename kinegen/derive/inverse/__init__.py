"""The inverse in closed form: joint vectors from poses, all branches, for the families that are recognised.

A robot becomes the axes of its joints at q = 0 (`axes`). These are recognised as a family with its constants
(`classification`, `families`, `family`), or as the nearest arm of one (`nearest_family`). The family is solved as
formulas for the angles of every branch (`solve` and what it imports), Newton steps lead those of a nearly arm on
(`newton_refinement`), and angles become joint variables within their limits (`joint_wrapping`). `derive` does all of
it.
"""
