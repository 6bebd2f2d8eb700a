"""Standard and modified tables as text that people paste: Markdown, CSV, LaTeX."""
