"""Cosines and sines of angles that are sums of arc tangents, without going through the angles."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from kinegen.symbolic.inverse.exact import tidy
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.steps import ONE, ZERO, Steps


@dataclass(slots=True)
class Units:
    """Angles of a tape as complex numbers of length 1.

    Attributes:
        steps: The tape.
    """

    steps: Steps
    _defined: dict[sp.Expr, sp.Expr] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._defined = dict(self.steps.tape.definitions)

    def of(self, angle: sp.Expr) -> Planar:
        """The complex number of length 1 whose argument is a sum of constants and named arc tangents."""
        constants = [term for term in sp.Add.make_args(angle) if term.is_number]
        others = [term for term in sp.Add.make_args(angle) if not term.is_number]
        turned: Planar = (ONE, ZERO)
        for term in others:
            turned = self.steps.times(turned, self._of_term(term))
        if not constants:
            return turned
        constant = sp.Add(*constants)
        return self.steps.times(turned, (tidy(sp.cos(constant)), tidy(sp.sin(constant))))

    def _of_term(self, term: sp.Expr) -> Planar:
        factor, core = term.as_coeff_Mul()
        arc = self._defined.get(core)
        if abs(factor) != 1 or not isinstance(arc, sp.atan2):
            return self.steps.name(sp.cos(term)), self.steps.name(sp.sin(term))
        y, x = arc.args
        scale = self.steps.name(1 / self.steps.root(self.steps.square((x, y))))
        return self.steps.name(x * scale), factor * self.steps.name(y * scale)
