"""From C text to something callable: compiling, and the arrays, shapes and threads of the generated packages.

glue.py      what the extension offers, and the C between the kernels and Python
compile.py   C text -> extension, with compiler.py and cache.py
package.py   the extension of a robot; a package as a module
kernel.py    array handling, copied as it is into every package
"""
