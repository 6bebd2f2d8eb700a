"""Downloads packages with real robots and takes the text files of their descriptions out of them.

    python scripts/get_descriptions.py build/descriptions

The folder gets one folder for each package. Each package has its own licence; nothing of them is committed. A package
that is there already is not downloaded again.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

PACKAGES = (
    "example-robot-data==6.0.0",
    "rtb-data==2.0.0",
    "robosuite==1.5.2",
    "pybullet==3.2.7",
    "frax==0.1.0",
    "scikit-robot==0.4.7",
    "dm-control==1.0.50",
    "gymnasium-robotics==1.4.2",
)
SUFFIXES = (".urdf", ".xacro", ".xml", ".mjcf", ".yaml")
LARGEST = 4_000_000


def main(folder: Path) -> None:
    """Get every package that is missing."""
    for package in PACKAGES:
        place = folder / package.replace("==", "-")
        if (place / "complete").exists():
            continue
        with tempfile.TemporaryDirectory() as downloads:
            command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
            subprocess.run([*command, "--only-binary", ":all:", "-d", downloads, package], check=True)
            files = sum(extract(wheel, place) for wheel in Path(downloads).glob("*.whl"))
        (place / "complete").touch()
        print(f"{package}: {files} files")


def extract(wheel: Path, place: Path) -> int:
    """Take the descriptions out of a wheel; returns how many there are."""
    count = 0
    with zipfile.ZipFile(wheel) as archive:
        for entry in archive.infolist():
            target = (place / entry.filename).resolve()
            if entry.file_size > LARGEST or not entry.filename.endswith(SUFFIXES):
                continue
            if not target.is_relative_to(place.resolve()):
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(archive.read(entry))
            count += 1
    return count


if __name__ == "__main__":
    main(Path(sys.argv[1]))
