"""What a page is made of."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.outputs import Quantity


@dataclass(frozen=True, slots=True)
class ViewOptions:
    """The choices of a user.

    Attributes:
        q: The joint vector at first, in rad and the file's length unit; None for the home position.
        outputs: Quantities whose kernels the page gets besides those that it needs.
        workspace: Number of joint vectors to try for the points that the tip reaches; 0 for no points.
    """

    q: tuple[float, ...] | None = None
    outputs: tuple[Quantity, ...] = ()
    workspace: int = 0
