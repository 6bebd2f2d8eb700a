"""What a survey is asked for; it imports nothing heavy, so that the command line can check it first."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.errors import KinegenError

MOST_SAMPLES = 10**11
"""Places in the sequence keep enough digits up to here."""


@dataclass(frozen=True, slots=True)
class SurveyOptions:
    """How to survey.

    Attributes:
        samples: Number of joint vectors, 1 to `MOST_SAMPLES`.
        voxel: Edge of a voxel in the file's length unit; None for one that suits the number of samples.
        seed: Decides where the sequence of samples begins.
        threads: Threads to compute with; 0 for one on each processor.
    """

    samples: int
    voxel: float | None = None
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.samples <= MOST_SAMPLES:
            raise KinegenError(f"{self.samples} samples (expected 1 to {MOST_SAMPLES:.0e})".replace("e+", "e"))


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane to cut a region with.

    Attributes:
        axis: The axis of the base frame that is square to it, 0 to 2.
        at: Where it cuts that axis, in the file's length unit.
    """

    axis: int
    at: float
