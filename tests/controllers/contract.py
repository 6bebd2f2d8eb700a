"""Contracts with controllers: what a package calls and is called by, restated with the place where it stands.

A contract is a file of `contracts/`. Stand-ins for headers are printed from it, so that no test declares an interface
of its own, and every entry is looked up in a checkout of the controller.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

CONTRACTS = Path(__file__).resolve().parent / "contracts"

_BEGIN = "#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n"


def contract(name: str) -> Mapping[str, Any]:
    """A contract by the name of its controller."""
    found: Mapping[str, Any] = yaml.safe_load((CONTRACTS / f"{name}.yaml").read_text(encoding="utf-8"))
    return found


def judged_by(name: str) -> str:
    """What the tests judge a package by, in one line: LinuxCNC is on the machine, the others are stand-ins."""
    known = contract(name)
    sources = known.get("repositories", {known["controller"]: known})
    dated = ", ".join(f"{each} {source['commit'][:7]} ({source['date']})" for each, source in sources.items())
    stand_in = f"stand-ins printed from declarations of {dated}"
    if name != "linuxcnc":
        return f"{known['controller']}: {stand_in}"
    if shutil.which("linuxcnc_var") is None:
        return f"{known['controller']}: {stand_in}; it is not installed, so nothing ran inside it"
    words = ["linuxcnc_var", "LINUXCNCVERSION"]
    version = subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    return f"{known['controller']}: version {version} of this machine; {stand_in}"


def headers(name: str) -> dict[str, str]:
    """The stand-ins for the headers of a controller, by path."""
    known = contract(name)
    return {path: _header(known, path, groups) for path, groups in known["headers"].items()}


def _header(known: Mapping[str, Any], path: str, groups: list[str]) -> str:
    guard = "STANDIN_" + re.sub(r"\W", "_", path).upper()
    text = "\n".join(_group(known, group) for group in groups)
    begin = (
        f"/* Printed from the contract with {known['controller']}, for tests. */\n#ifndef {guard}\n#define {guard}\n"
    )
    return f"{begin}{known.get('begin', _BEGIN)}{text}\n#endif\n"


def _group(known: Mapping[str, Any], group: str) -> str:
    """A group, which several headers may have."""
    guard = f"STANDIN_GROUP_{group.upper()}"
    lines = "\n".join(line for entry in known["groups"][group] for line in _declared(entry))
    return f"#ifndef {guard}\n#define {guard}\n{lines}\n#endif"


def _declared(entry: Mapping[str, Any]) -> Iterator[str]:
    for kind in ("struct", "union"):
        if kind in entry:
            members = [*entry.get("fields", ()), *(f"unsigned {bit} : 1" for bit in entry.get("bits", ()))]
            yield f"typedef {kind} {{ {'; '.join(members)}; }} {entry[kind]};"
    if "text" in entry:
        yield entry.get("stand_in", entry["text"])


def missing(name: str, checkout: Path, chosen: Collection[str] = ()) -> list[str]:
    """The entries of a contract that are not in a checkout, each with the file where it should be.

    Args:
        name: The controller.
        checkout: The folder.
        chosen: The groups that are looked up; all of them by default.
    """
    known = contract(name)
    entries = [entry for group in chosen or known["groups"] for entry in known["groups"][group] if "file" in entry]
    absent = [
        f"{entry['file']}: {words}" for entry in entries for words in _sought(entry) if not _has(checkout, entry, words)
    ]
    about = known.get("parameters")
    if about and (not chosen or about["group"] in chosen):
        absent += _other_parameters(known, checkout / about["file"], about)
    return absent


def _other_parameters(known: Mapping[str, Any], path: Path, about: Mapping[str, str]) -> list[str]:
    """Parameters without a default value that the contract or the checkout has alone, or with another type or size."""
    ours = {(each["parameter"], each["type"], each.get("size")) for each in known["groups"][about["group"]]}
    text = path.read_text(encoding="utf-8") if path.is_file() else "{}"
    theirs = set(_required(yaml.safe_load(text).get(about["group"], {})))
    return [f"{about['file']}: {' '.join(map(str, each))}" for each in sorted(ours ^ theirs, key=str)]


def _required(tree: Mapping[str, Any], stem: str = "") -> Iterator[tuple[str, str, int | None]]:
    """Name, type and size of the parameters without a default value, of a file of generate_parameter_library."""
    for name, entry in tree.items():
        if isinstance(entry, dict) and "type" not in entry:
            yield from _required(entry, f"{stem}{name}.")
        elif isinstance(entry, dict) and "default_value" not in entry:
            yield stem + name, entry["type"], entry.get("validation", {}).get("fixed_size<>")


def _sought(entry: Mapping[str, Any]) -> Iterator[str]:
    """The words of an entry, which stand in its file but for spaces."""
    yield from entry.get("fields", ())
    yield from (f"{bit} :1" for bit in entry.get("bits", ()))
    yield from entry.get("names", ())
    yield from (f"}} {entry[kind]};" for kind in ("struct", "union") if kind in entry)
    if "text" in entry:
        yield entry["text"]


def _has(checkout: Path, entry: Mapping[str, Any], words: str) -> bool:
    path = checkout / entry["file"]
    return path.is_file() and _squeezed(words) in _squeezed(path.read_text(encoding="utf-8", errors="replace"))


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", "", re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL))
