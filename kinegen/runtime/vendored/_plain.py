"""The compiled extension through ctypes, where cffi is not installed: the same functions and the same bits.

A call takes about a microsecond longer. The extension itself says which functions it has (`kinegen_signatures`).
"""

from __future__ import annotations

import ctypes
from types import SimpleNamespace
from typing import Any

from numpy.typing import NDArray

_TYPES: dict[str, Any] = {
    "v": None,
    "i": ctypes.c_int,
    "l": ctypes.c_int32,
    "u": ctypes.c_uint32,
    "z": ctypes.c_size_t,
    "p": ctypes.c_void_p,
    "s": ctypes.c_char_p,
}
_NUMBERS: dict[str, Any] = {"double": ctypes.c_double, "float": ctypes.c_float}


class Memory:
    """What the array handling asks of cffi's `ffi`, with its names.

    Args:
        structs: Number type of each struct of runtime parameters.
    """

    def __init__(self, structs: dict[str, str]) -> None:
        self._structs = structs

    def string(self, text: bytes) -> bytes:
        """The bytes of a C string."""
        return text

    def new(self, kind: str, values: list[float]) -> Any:
        """Memory for an array (`double[]`) or a struct of numbers (`arm_params *`), filled in."""
        name = kind.removesuffix("[]").removesuffix(" *")
        return (_NUMBERS[self._structs.get(name, name)] * len(values))(*values)

    def from_buffer(self, _kind: str, array: NDArray[Any], *, require_writable: bool = False) -> Any:
        """The address of a contiguous array, which lives as long as this does."""
        if not array.flags.c_contiguous or (require_writable and not array.flags.writeable):
            raise ValueError("the array is not contiguous, or read-only")
        return array.ctypes.data_as(ctypes.c_void_p)


def open_library(path: str) -> Any:
    """Open the extension as a plain shared library.

    Args:
        path: The file.

    Returns:
        An object with `lib` and `ffi`, to be used as the cffi module is.

    Raises:
        OSError: If it cannot be opened.
        AttributeError: If it lacks a function.
    """
    library = ctypes.CDLL(path)
    library.kinegen_signatures.restype = ctypes.c_char_p
    functions, structs = {}, {}
    for line in library.kinegen_signatures().decode().splitlines():
        name, result, *arguments = line.split()
        if result in _NUMBERS:
            structs[name] = result
            continue
        function = functions[name] = library[name]
        function.restype, function.argtypes = _TYPES[result], [_TYPES[letter] for letter in "".join(arguments)]
    return SimpleNamespace(lib=SimpleNamespace(**functions), ffi=Memory(structs))
