"""Emitted C on the processors that it is made for: cross compilers, emulated boards, and what a kernel costs there.

In: the kernels of a robot and a target. Out: flash, stack and instructions of one call, and whatever a program prints
on an emulated board. Nothing here changes what is emitted, and nothing else needs it: a machine without cross compilers
builds and proves kernels all the same.

    targets.py      the processors, with compiler, flags, board and packages; compiling, linking, running
    programs.py     C programs of our own around emitted kernels, and poses for which random numbers say nothing
    cost.py         measures, and says of the usual target what a build tells unasked
    sources/        start-up, layout, output and clock of the boards, and the programs' own C
"""
