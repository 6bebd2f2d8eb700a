"""From programs to text: one folder for each output language, here and in `templates/`.

Python decides, templates lay out: an emitter turns a `Program` into finished strings in one frozen record, and the
template puts them in place. An emitter returns `{file name: text}` and writes nothing.

A new language takes these steps:

1. a folder here with functions from `Kernels` to `{file name: text}`, as `emit_kernel` in `c/kernel.py`, and the
   printing of each operator of `ir.program.Operator`, an unknown one being an error;
2. a folder in `templates/` with files named after their output plus `.jinja`;
3. the names of its files and functions, and its reserved words, in `naming.py`;
4. its line in `files.py`, and in `verify/` a way to call what was emitted;
5. `tests/emit/`: every operator through hand-written programs, and the bytes of two builds compared.
"""
