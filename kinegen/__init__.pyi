# What `import kinegen` offers, for type checkers and editors; `__init__.py` finds it when it is asked for.

from kinegen import reference as reference
from kinegen.api.building import build as build
from kinegen.api.closed_form import ClosedForm as ClosedForm
from kinegen.api.compiling import compile as compile  # noqa: A004 - a name of kinegen, used as kinegen.compile
from kinegen.api.loading import load as load
from kinegen.api.magic import load_ipython_extension as load_ipython_extension
from kinegen.api.robot import Robot as Robot
from kinegen.api.table import Table as Table
from kinegen.api.viewing import view as view
from kinegen.errors import KinegenError as KinegenError
from kinegen.pictures import plot as plot

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
