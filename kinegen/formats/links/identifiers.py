"""Names of links and joints -> identifiers that every output can use.

A name that can be used stays. In any other one, each run of other characters than letters, digits and underscores
becomes an underscore; what is then a reserved word, or taken, gets `_joint` or `_link`, and then a number. Every change
is reported.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from kinegen.errors import KinegenError
from kinegen.naming import MAX_NAME, check_name

_RESERVED = frozenset({"BASE", "TOOL", "WRIST"})


@dataclass
class Identifiers:
    """Gives out identifiers, each once, blind to upper and lower case because macros lose it.

    Attributes:
        renamed: Names that could not be used as they are, with the names used instead.
    """

    renamed: list[tuple[str, str]] = field(default_factory=list)
    _taken: set[str] = field(default_factory=set)

    def give(self, kind: str, name: str, ending: str) -> str:
        """An identifier for a name.

        Args:
            kind: `robot`, `joint` or `frame`.
            name: As the file has it.
            ending: What is appended to a name that is taken or reserved.
        """
        plain = identifier(name) or ending
        tries = [plain, f"{plain[: MAX_NAME - len(ending) - 1].rstrip('_')}_{ending}"]
        tries_end, place = tries[1][: MAX_NAME - 5].rstrip("_"), 1
        while True:
            chosen = tries.pop(0) if tries else f"{tries_end}_{place}"
            if self._is_free(kind, chosen):
                break
            place += not tries
        self._taken.add(chosen.upper())
        if chosen != name:
            self.renamed.append((name, chosen))
        return chosen

    def _is_free(self, kind: str, name: str) -> bool:
        if name.upper() in self._taken or (kind != "robot" and name.upper() in _RESERVED):
            return False
        try:
            check_name(kind, name)
        except KinegenError:
            return False
        return True


def identifier(name: str) -> str:
    """A name with everything taken out that no identifier may have; empty if nothing is left."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    if plain[:1].isdigit():
        plain = f"n{plain}"
    return plain[:MAX_NAME].rstrip("_")
