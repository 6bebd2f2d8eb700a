"""Evaluates kernels over data sets that are larger than memory: Parquet, Arrow, CSV and NumPy files in and out.

    sources     words of the user    -> Sources     the files, what they hold, and spans of their rows
    binding     columns, kernels     -> Bindings    which columns are the inputs of which kernel
    results     arrays               -> columns     names, units, nulls
    writing     columns              -> a file      whole or not at all
    plan        Sources              -> Parts       which rows go to which file, and which files are complete
    worker      Part                 -> a file      batches of a bounded number of rows, read and computed
    cluster     Parts                -> files       processes of Dask, here or elsewhere
    run         everything           -> Summary

pyarrow reads and writes. The parts of a data set follow from its input alone, so the bytes are the same for any number
of workers, and for a run that was interrupted.
"""

from kinegen.tools.datasets.run import Summary, evaluate

__all__ = ["Summary", "evaluate"]
