"""How long it takes to read robots of other formats: 7 joints, and a humanoid of 40.

    python -m benchmarks.imports

Each figure is the median of some reads of one generated file, from its text to the model; symbolic stages are not
part of it.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

from kinegen.io.load import load

READS = 9
ASKED = {"arm of 7 joints": 0.3, "humanoid of 40 joints": 1.0}


def urdf(limbs: tuple[int, ...]) -> str:
    """A robot with a limb of so many joints for each entry; each joint also carries a fixed link."""
    lines = ['<robot name="measured">', '<link name="torso"/>']
    for limb, joints in enumerate(limbs):
        above = "torso"
        for place in range(joints):
            name = f"l{limb}_{place}"
            axis = ("0 0 1", "0 1 0", "0.70711 0 0.70711")[place % 3]
            lines += [
                f'<link name="{name}"/><link name="{name}_mark"/>',
                f'<joint name="j_{name}" type="revolute"><parent link="{above}"/><child link="{name}"/>',
                f'<origin xyz="0.0{place} 0.089159 0.34000000000000002" rpy="1.5708 0 {place}.141"/>',
                f'<axis xyz="{axis}"/><limit lower="-2.9" upper="2.9" effort="1" velocity="1"/></joint>',
                f'<joint name="f_{name}" type="fixed"><parent link="{name}"/><child link="{name}_mark"/>',
                '<origin xyz="0.1 0 0" rpy="0 3.14159 0"/></joint>',
            ]
            above = name
    return "\n".join([*lines, "</robot>"])


def measure(text: str) -> float:
    """Median seconds of reading a text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "measured.urdf"
        path.write_text(text)
        load(path)
        times = []
        for _ in range(READS):
            begin = time.perf_counter()
            load(path)
            times.append(time.perf_counter() - begin)
    return statistics.median(times)


def main() -> None:
    """Print the figures."""
    for (name, asked), limbs in zip(ASKED.items(), ((7,), (7, 7, 6, 6, 14)), strict=True):
        print(f"{name}: {measure(urdf(limbs)):.3f} s (asked: {asked} s)")


if __name__ == "__main__":
    main()
