"""Reads xacro: expands it in a process of its own, where expressions compute with plain data alone."""
