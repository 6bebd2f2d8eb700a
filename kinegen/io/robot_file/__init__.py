"""The robot file of kinegen: a bounded tree, raw records as written, then the exact model."""
