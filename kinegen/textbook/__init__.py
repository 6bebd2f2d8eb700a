"""The closed form for people: text, LaTeX, MathML, Python. No kernel is made of it."""
