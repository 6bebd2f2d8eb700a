"""From C text to something callable: compiling, and the arrays, shapes and threads of the generated packages.

flags.py     how the kernels are compiled, and for which processors
glue.py      what the extension offers, and the C between the kernels and Python
entries.h    what the C of a robot tells the C that is the same for all robots, which are the next three
arrays.h     how C reads the arrays of a call
memory.h     memory of large results, used again
calls.c      plain calls without Python code around them
dispatch.py  the C that asks the processor what it can run, and the compilations of each variant
compile.py   C text -> extension, with compiler.py and cache.py
package.py   the extension of a robot; a package as a module
vendored/    arrays, threads and solvers, copied as they are into `_runtime/` of a package
"""
