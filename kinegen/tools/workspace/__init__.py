"""Surveys where the tip of an arm gets to: samples of the joint box, voxels, measures, pictures and clouds of points.

In: a robot, its position program, ranges of its joints. Out: a `Workspace` record, and files. It stands above the
compiled kernels as `verify` does, and judges nothing: what it says is as good as its samples, and it says how good.
"""
