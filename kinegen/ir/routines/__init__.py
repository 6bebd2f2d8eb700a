"""What kernels call besides plain operations, as straight-line code that every language prints.

In: nothing. Out: a `Routine` for each function and number type, with its comments. Every statement is an operation of
a `Program`, so a language that prints programs prints these, and all languages compute the same bits. The functions
that look at the bits of numbers (the square root; in C, selections and signs of the double arc tangent) stay with the
languages that have no better way.
"""
