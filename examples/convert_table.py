"""Prints a robot in another convention, as a robot file, and what the conversion was free to choose.

    python examples/convert_table.py robots/panda.yaml standard

docs/tables.md explains what it prints.
"""

from __future__ import annotations

import sys

from kinegen.io.load import load
from kinegen.io.robot_file.write import write
from kinegen.model.dh_conversion import to_convention
from kinegen.model.robot import Convention


def main(file: str, convention: str) -> None:
    """Converts one file."""
    found = to_convention(load(file), Convention(convention))
    print(write(found.robot), end="")
    for line in found.free:
        print(f"free: {line}")
    for line in found.rounded:
        print(f"rounded: {line}")


if __name__ == "__main__":
    main(*sys.argv[1:])
