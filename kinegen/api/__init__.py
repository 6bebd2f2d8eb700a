"""What `import kinegen` offers in Python and in notebooks.

In: files, texts or mappings that describe robots. Out: objects with rich display, and the modules and records that the
command line makes. Nothing is computed here: each call goes to the stage that has the answer. `kinegen/__init__.py`
finds the public names here, and imports a module when one of its names is used.

    loading      file, text or mapping       -> Robot
    robot        `Robot`: the model with methods
    table        `Table`: its rows as text, HTML, LaTeX, Markdown and CSV
    closed_form  `ClosedForm`: text, LaTeX, MathML, Python and sympy
    words        what callers write: lists of words, texts and paths
    options      words of a caller           -> BuildOptions; the command line uses it too
    building     file or Robot               -> the files and the record of a build
    compiling    file or Robot               -> the proven module, kept in the cache
    asked        a call as it was written    -> the module that it led to before
    kept         the cache of compiled modules: found whole, or made again
    viewing      file or Robot               -> the viewer in a cell: `widget`, or a `page` in a frame
    magic        `%load_ext kinegen`, `%%robot`

`Robot` is a subclass of the model instead of a record around it. `robot/` cannot have these methods, since it would
have to import `textbook/` and `formats/`; and with a subclass every function that takes a model takes what `load`
returns, without a conversion at each call.
"""
