"""Firmware packages: the C kernels of a robot as a folder that a CMake, PlatformIO, Arduino or ESP-IDF project takes.

In: a robot's kernels and the C files that were printed and proved for it. Out: `{path: text}` of the folder, the C
files byte for byte among them. What an ecosystem wants around them stands in `templates/packages/`, one folder each.

A new ecosystem takes these steps:

1. its name in `ecosystem.py`, with the number types and the output folder that its users expect;
2. a folder in `templates/packages/`, and its paths in `ecosystem.py`;
3. a test in `tests/packages/` that builds the package the way such a project does, and holds its manifest against the
   rules of the format.
"""
