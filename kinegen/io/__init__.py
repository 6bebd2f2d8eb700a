"""Text in the formats that describe robots -> the exact and validated model.

Ask `load.load` for a `Robot`; everything else here serves it. Nothing is imported by this package itself.
"""
