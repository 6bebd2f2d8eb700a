"""Wheels: proven packages of robots as files that pip installs.

In: robot files and the options of a build. Out: one `.whl`, with a self-test that `python -m NAME` runs. The packages
in it are those of `kinegen build`, file for file; `build` puts metadata around them.
"""
