"""The signatures of programs that tests write by hand."""

from __future__ import annotations

from kinegen.model.outputs import Array, Quantity, Signature


def positions(dof: int, frames: tuple[str, ...] = ("tool",)) -> Signature:
    """The signature of a program that computes the positions of these frames."""
    shape = (len(frames), 3) if len(frames) > 1 else (3,)
    result = Array(f"base_p_{'tips' if len(frames) > 1 else frames[0]}", shape, per_frame=len(frames) > 1)
    return Signature(Quantity.POSITION, frames, dof, (Array("q", (dof,)),), (result,))
