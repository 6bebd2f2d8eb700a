"""The robot file: YAML text in, the exact and validated model out."""
