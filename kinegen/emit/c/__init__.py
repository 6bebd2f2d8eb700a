"""C99 for firmware and for the compiled Python module."""
