"""Default classes of MJCF: the attributes of joints that do not have them themselves."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.errors import quote
from kinegen.formats import xml
from kinegen.formats.messages import expected, fail

_MAIN = "main"


@dataclass(frozen=True, slots=True)
class Defaults:
    """The attributes of a joint in each class, those of the classes around it included."""

    classes: dict[str, dict[str, str]]

    def joint(self, element: xml.Element, kind: str) -> dict[str, str]:
        """All attributes of a joint.

        Args:
            element: The joint.
            kind: Class of the body around it; empty for the main one.
        """
        name = str(element.get("class", kind)) or _MAIN
        if name not in self.classes and name != _MAIN:
            fail(f"there is no default class {quote(name)} {expected(name, self.classes)}", xml.line(element))
        own = {str(key): str(value) for key, value in element.attrib.items()}
        return {**self.classes.get(name, {}), **own}


def read_defaults(root: xml.Element) -> Defaults:
    """Read all default classes of a model."""
    classes: dict[str, dict[str, str]] = {_MAIN: {}}
    waiting = [(element, _MAIN) for element in xml.children(root, "default")]
    tops = {id(element) for element, _ in waiting}
    while waiting:
        element, parent = waiting.pop(0)
        is_top = id(element) in tops
        name = str(element.get("class", _MAIN if is_top else ""))
        if not name:
            fail("a <default> inside another one needs a class", xml.line(element))
        found = dict(classes.get(parent, {}))
        for joint in xml.children(element, "joint"):
            found |= {str(key): str(value) for key, value in joint.attrib.items()}
        classes[name] = {**classes.get(name, {}), **found}
        if is_top:
            classes[_MAIN] = classes[name]
        waiting += [(child, name) for child in xml.children(element, "default")]
    return Defaults(classes)
