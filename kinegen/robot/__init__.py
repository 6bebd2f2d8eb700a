"""The robot file: YAML text in, the exact and validated model out.

Ask `load.load` for a `model.Robot`; everything else here serves it. Nothing is imported by this package itself, so
that stages which need the model alone do not pay for YAML.
"""
