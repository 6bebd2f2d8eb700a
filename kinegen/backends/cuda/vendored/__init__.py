"""The Python that is copied as it is into the folder of kernels."""
