"""Kernels as handlers that XLA calls on the processor, without a compiler: its C interface, spoken through ctypes.

XLA hands over the addresses of arguments and results; the kernel reads and writes them where they lie. The structs are
those of version 0 of XLA's foreign function interface (`xla/ffi/api/c_api.h`), which XLA keeps for old callers and
which begin with their own sizes.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAJOR, MINOR = 0, 1
"""The version of the interface that this file follows."""

_TYPES: dict[int, np.dtype[Any]] = {11: np.dtype(np.float32), 12: np.dtype(np.float64)}
_EXECUTE, _METADATA, _INTERNAL = 3, 1, 13
_INT = ctypes.c_int
_POINTER = ctypes.c_void_p


def _struct(name: str, fields: list[tuple[str, Any]]) -> type[ctypes.Structure]:
    head = [("struct_size", ctypes.c_size_t), ("extension_start", _POINTER)]
    return type(name, (ctypes.Structure,), {"_fields_": [*head, *fields]})


class _Extension(ctypes.Structure):
    _fields_ = (("struct_size", ctypes.c_size_t), ("type", _INT), ("next", _POINTER))


_Version = _struct("_Version", [("major", _INT), ("minor", _INT)])
_Buffer = _struct(
    "_Buffer", [("dtype", _INT), ("data", _POINTER), ("rank", ctypes.c_int64), ("dims", ctypes.POINTER(ctypes.c_int64))]
)
_List = _struct("_List", [("size", ctypes.c_int64), ("types", _POINTER), ("items", ctypes.POINTER(_POINTER))])
_Api = _struct("_Api", [("version", _Version), ("internal", _POINTER), ("error_create", _POINTER)])
_Error = _struct("_Error", [("message", ctypes.c_char_p), ("code", _INT)])
_Frame = _struct(
    "_Frame",
    [("api", ctypes.POINTER(_Api)), ("context", _POINTER), ("stage", _INT), ("arguments", _List), ("results", _List)],
)


class _Metadata(ctypes.Structure):
    _fields_ = (("struct_size", ctypes.c_size_t), ("version", _Version), ("traits", ctypes.c_uint32))


class _MetadataExtension(ctypes.Structure):
    _fields_ = (("base", _Extension), ("metadata", ctypes.POINTER(_Metadata)))


_Handler = ctypes.CFUNCTYPE(_POINTER, ctypes.POINTER(_Frame))
_Create = ctypes.CFUNCTYPE(_POINTER, ctypes.POINTER(_Error))


def handler(compute: Callable[[list[NDArray[Any]], list[NDArray[Any]]], None]) -> Any:
    """A C function for XLA; it has to be kept alive as long as XLA may call it.

    Args:
        compute: Called with the arguments, which are read-only, and the results, which it fills.

    Returns:
        A function of ctypes.
    """

    def called(frame_pointer: Any) -> int | None:
        frame = frame_pointer.contents
        if frame.extension_start and _answered(frame):
            return None
        if frame.stage != _EXECUTE:
            return None
        try:
            arguments, results = _arrays(frame.arguments), _arrays(frame.results)
            for array in arguments:
                array.flags.writeable = False
            compute(arguments, results)
        except Exception as error:  # noqa: BLE001 - whatever it is, XLA passes it on
            return _failed(frame, f"{type(error).__name__}: {error}")
        return None

    return _Handler(called)


def _answered(frame: Any) -> bool:
    """Whether XLA only asks which version of the interface this is, and the answer where it does."""
    extension = ctypes.cast(frame.extension_start, ctypes.POINTER(_MetadataExtension)).contents
    if extension.base.type != _METADATA:
        return False
    metadata = extension.metadata.contents
    metadata.version.major, metadata.version.minor, metadata.traits = MAJOR, MINOR, 0
    return True


def _arrays(listed: Any) -> list[NDArray[Any]]:
    """The buffers of a call as arrays, without a copy."""
    found = []
    for index in range(listed.size):
        buffer = ctypes.cast(listed.items[index], ctypes.POINTER(_Buffer)).contents
        shape = tuple(buffer.dims[axis] for axis in range(buffer.rank))
        dtype = _TYPES[buffer.dtype]
        size = math.prod(shape) * dtype.itemsize
        memory = (ctypes.c_char * size).from_address(buffer.data) if size else bytearray()
        found.append(np.ndarray(shape, dtype, memory))
    return found


def _failed(frame: Any, message: str) -> int | None:
    """XLA's own record of an error."""
    create = ctypes.cast(frame.api.contents.error_create, _Create)
    error = _Error(ctypes.sizeof(_Error), None, message.encode(), _INTERNAL)
    found: int | None = create(ctypes.byref(error))
    return found
