"""Holds every emitted kernel against the independent reference, and says where it was worst.

`samples` chooses joint vectors, `proof` compares, `tolerances` says how close is close enough, and why.
"""
