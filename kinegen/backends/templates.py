"""Finds the templates and makes the one Jinja environment that reads them.

The templates stand at the top level of the checkout, beside the package. A wheel carries them inside the package
instead; an editable install does not, so both places are looked at.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import jinja2

from kinegen.backends.c.syntax import c_routine
from kinegen.errors import KinegenError
from kinegen.support.naming import docstring_text


def template_folder(package: Path) -> Path:
    """Find the folder of templates that belongs to a package folder.

    `package`: folder that holds `kinegen/__init__.py`. Returns `templates/` inside the package, as a wheel installs it,
    or else beside it, as it stands in a checkout. Raises KinegenError if neither folder exists: the installation is
    broken.
    """
    candidates = (package / "templates", package.parent / "templates")
    for folder in candidates:
        if folder.is_dir():
            return folder
    places = " nor ".join(str(folder) for folder in candidates)
    raise KinegenError(f"the templates are missing, neither {places} exists; install kinegen again")


@cache
def environment() -> jinja2.Environment:
    """Make the environment; every template is rendered through this one.

    A name that a template uses and Python does not supply is an error. White space is what the template shows: a
    line that holds only a tag leaves nothing behind. Nothing is escaped, since no output is HTML.
    """
    package = Path(__file__).resolve().parent.parent
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template_folder(package), encoding="utf-8"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        newline_sequence="\n",
        autoescape=False,  # noqa: S701 - the outputs are C, Python and LaTeX
    )
    made.globals["c_routine"] = c_routine
    made.filters |= {
        "sentence": _sentence,
        "markdown": markdown,
        "xml": _xml,
        "quoted": _quoted,
        "one_based": _one_based,
    }
    made.filters["docstring"] = docstring_text
    return made


def rendered(templates: Mapping[str, str], **given: Any) -> dict[str, str]:
    """Renders files, each by the name of its template without `.jinja`; all templates are given the same names."""
    return {file: environment().get_template(f"{template}.jinja").render(given) for file, template in templates.items()}


def _sentence(text: str) -> str:
    """Return text that begins with a capital letter."""
    return text[:1].upper() + text[1:]


def markdown(text: str) -> str:
    """Return text that Markdown shows as it is."""
    return re.sub(r"([\\`*_{}\[\]<>#|])", r"\\\1", text)


def _xml(text: str) -> str:
    """Return text for XML, its comments too, in which two hyphens cannot stand together."""
    return escape(text).replace("--", "- -")


def _one_based(index: int) -> int:
    """Return an index for a language that counts from 1."""
    return index + 1


def _quoted(text: str) -> str:
    """Return a name in double quotes."""
    return f'"{text}"'
