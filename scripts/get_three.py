"""Makes templates/viewer/vendor/three.js anew: what the viewer uses of three.js, bundled and minified.

    python scripts/get_three.py [VERSION]

Takes npm, which fetches three.js and esbuild into a temporary folder. `templates/viewer/vendor/entry.js` lists what is
bundled. `three.json` beside it gets versions, licence and the digest of the file, which a test compares.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

VENDOR = Path(__file__).resolve().parent.parent / "templates" / "viewer" / "vendor"
RECORD = VENDOR / "three.json"


def main(arguments: list[str]) -> int:
    """Fetches, bundles and records; returns the exit status."""
    if shutil.which("npm") is None:
        print("error: npm is missing; on Debian, as root: apt-get install npm", file=sys.stderr)
        return 1
    known = json.loads(RECORD.read_text(encoding="utf-8"))
    version = arguments[0] if arguments else known["version"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _run(folder, "npm", "init", "-y")
        _run(folder, "npm", "install", "--no-fund", "--no-audit", f"three@{version}", f"esbuild@{known['esbuild']}")
        bundle = _bundle(folder)
        package = json.loads((folder / "node_modules/three/package.json").read_text(encoding="utf-8"))
        licence = (folder / "node_modules/three/LICENSE").read_bytes()
    (VENDOR / "three.js").write_bytes(bundle)
    (VENDOR / "three.LICENSE").write_bytes(licence)
    record = {
        "name": "three",
        "version": package["version"],
        "licence": package["license"],
        "source": package["homepage"],
        "esbuild": known["esbuild"],
        "sha256": hashlib.sha256(bundle).hexdigest(),
    }
    RECORD.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    print(f"three.js {record['version']}: {len(bundle)} bytes")
    return 0


def _bundle(folder: Path) -> bytes:
    """One classic script that defines THREE; it has nothing that is not used."""
    shutil.copy(VENDOR / "entry.js", folder / "entry.js")
    options = ("--bundle", "--minify", "--format=iife", "--global-name=THREE", "--target=es2020", "--charset=ascii")
    _run(folder, "node_modules/.bin/esbuild", "entry.js", *options, "--legal-comments=inline", "--outfile=three.js")
    return (folder / "three.js").read_bytes()


def _run(folder: Path, *command: str) -> None:
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
