"""The Python that is copied as it is into every package."""
