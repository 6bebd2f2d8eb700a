"""Run-time errors of emitted C: Frama-C's Eva analyses a program that calls a kernel with every input of a range.

In: the kernels of a robot. Out: for each function what Eva found, the ranges that were assumed, and the files, so that
the analysis can be repeated. Frama-C is a program of its own; nothing else needs it.

    angles.py    the angles whose sines and cosines a kernel takes
    pieces.py    where the sine-cosine pair is cut up for interval analysis
    ranges.py    what each number of an input may be
    driver.py    C programs around the kernels; companions.py around the functions beside them
    claims.py    which functions a robot has, and what is to be shown of each
    eva.py       runs Frama-C, reads its summary
    evidence.py  the records; stage.py makes them; report.py prints them for a folder
"""
