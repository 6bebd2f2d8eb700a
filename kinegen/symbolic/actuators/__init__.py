"""Joints from readings, readings from joints, and derivatives by readings, as exact expressions."""
