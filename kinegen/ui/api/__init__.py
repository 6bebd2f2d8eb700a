"""What `import kinegen` offers in Python and in notebooks.

In: files, texts or mappings that describe robots. Out: objects with rich display, and the modules and records that the
command line makes. Nothing is computed here: each call goes to the stage that has the answer. `kinegen/__init__.py`
finds the public names here, and imports a module when one of its names is used.

    loading        file, text or mapping   -> Robot
    robot          `Robot`: the model with methods
    robot_methods  what `Robot` computes   -> the kernels of `module_cache`, on first use
    textbook_forms `Table` and `ClosedForm`: text, HTML, LaTeX, MathML, Markdown, CSV, Python and sympy
    options        words of a caller       -> BuildOptions; the command line uses it too
    building       file or Robot           -> the files and the record of a build, or the verified module
    module_cache   model or call           -> its module, found whole in the cache or made again
    notebook       the viewer in a cell, as a page in a frame or as a `widget`; `%load_ext kinegen`, `%%robot`

`Robot` is a subclass of the model instead of a record around it. `model/` cannot have these methods, since it would
have to import `backends/textbook/` and `io/`; and with a subclass every function that takes a model takes what `load`
returns, without a conversion at each call.
"""
