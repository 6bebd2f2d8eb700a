# What `import kinegen` offers, for type checkers and editors; `__init__.py` finds it when it is asked for.

from kinegen.errors import KinegenError as KinegenError
from kinegen.tools.pictures import plot as plot
from kinegen.ui.api.building import build as build
from kinegen.ui.api.building import compile as compile  # noqa: A004 - a name of kinegen, used as kinegen.compile
from kinegen.ui.api.loading import load as load
from kinegen.ui.api.notebook import load_ipython_extension as load_ipython_extension
from kinegen.ui.api.notebook import view as view
from kinegen.ui.api.robot import Robot as Robot
from kinegen.ui.api.textbook_forms import ClosedForm as ClosedForm
from kinegen.ui.api.textbook_forms import Table as Table
from kinegen.verify import reference as reference

__all__ = [
    "ClosedForm",
    "KinegenError",
    "Robot",
    "Table",
    "build",
    "compile",
    "load",
    "plot",
    "reference",
    "view",
]
__version__: str
