"""Wheels: proven packages of robots as files that pip installs.

In: robot files and the options of a build. Out: one `.whl`, with a self-test that `python -m NAME` runs. The packages
in it are those of `kinegen build`, file for file; `archive` puts metadata around them, `platform` names the systems on
which the compiled extensions run.
"""
