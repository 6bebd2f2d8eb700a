"""Measurements of kinegen; each prints what it finds on this machine."""
