"""The model of a robot: frozen records, exact values, kernel units.

`model.Robot` is what every stage takes; everything else here answers questions about one, or changes one into another.
It knows no format: `kinegen.io` reads robots.
"""
