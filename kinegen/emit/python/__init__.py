"""Python modules that need NumPy alone."""
