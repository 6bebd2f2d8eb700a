"""Run-time errors of emitted C: Frama-C's Eva analyses a program that calls a kernel with every input of a range.

In: the kernels of a robot. Out: for each function what Eva found, the ranges that were assumed, and the files, so that
the analysis can be repeated. Frama-C is a program of its own; nothing else needs it.

    ranges.py    what each number of an input may be, the angles that a kernel takes sines of, and their pieces
    driver.py    C programs around the kernels
    claims.py    which functions a robot has, programs around those beside the kernels, what is to be shown of each
    eva.py       runs Frama-C, reads its summary, keeps the records
"""
