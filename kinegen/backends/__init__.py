"""From programs to text: one folder for each output language, here and in `templates/`.

Python decides, templates lay out: an emitter turns a `Program` into finished strings in one frozen record, and the
template puts them in place. An emitter returns `{file name: text}` and writes nothing. All languages are in `LANGUAGES`
(`languages.py`); `files.py` calls C and Python, which every build writes.

What a new language takes is said in `language.py`, step by step; `tests/languages/test_checklist.py` takes these steps
with a toy.
"""
