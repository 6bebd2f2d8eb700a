"""The files of the C++ form: the header, and what makes its folder a CMake package."""

from __future__ import annotations

from kinegen.emit.cpp.header import header_context
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels


def emit_cpp(kernels: Kernels) -> dict[str, str]:
    """Print the header and the CMake project around it.

    Args:
        kernels: The robot and its programs.

    Returns:
        Text by file name.
    """
    context = header_context(kernels)
    templates = ((context.header, "cpp/header.hpp.jinja"), ("CMakeLists.txt", "cpp/CMakeLists.txt.jinja"))
    return {file: environment().get_template(template).render(k=context) for file, template in templates}
