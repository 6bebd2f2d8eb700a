"""What a calibration is asked for; it imports nothing heavy, so that the command line can check it first."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.errors import KinegenError
from kinegen.older import StrEnum

TABLE = ("theta", "a", "d", "alpha", "beta")
"""The kinds of entries that `--fit` takes for all rows at once."""

BASE_WORD, TOOL_WORD = "base", "tool"

DEFAULT_FIT = ("theta", "a", "d", "alpha")

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
RADIANS = {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295}


class Loss(StrEnum):
    """How residuals count: squared, or less than squared beyond three standard deviations."""

    LINEAR = "linear"
    HUBER = "huber"
    SOFT_L1 = "soft_l1"
    CAUCHY = "cauchy"


@dataclass(frozen=True, slots=True)
class Settings:
    """How to calibrate.

    Attributes:
        fit: Words of `--fit`: kinds of entries, `base`, `tool`, names of entries or parameters.
        frame: Frame that was measured; empty for the tool.
        length: Unit of lengths in the measurements, where a header does not say; None for the unit of the file.
        angle: The same for angles.
        sigma: Standard deviation of a measured length in metres, where no column says; None if it is not known.
        sigma_angle: The same of an angle, in radians.
        loss: How residuals count.
        folds: Parts of the cross-validation; 0 for none.
        suggest: Number of poses to suggest.
        seed: Decides the folds and the candidates for suggestions.
        ignore: Columns to leave out.
    """

    fit: tuple[str, ...] = DEFAULT_FIT
    frame: str = ""
    length: str | None = None
    angle: str | None = None
    sigma: float | None = None
    sigma_angle: float | None = None
    loss: Loss = Loss.HUBER
    folds: int = 5
    suggest: int = 0
    seed: int = 0
    ignore: tuple[str, ...] = ()


def quantity(text: str, units: dict[str, float], example: str) -> float:
    """A positive number with its unit, such as `0.05mm`.

    Args:
        text: The text.
        units: Sizes of the units.
        example: What would be right, for the message.

    Returns:
        The number in the unit of size 1.

    Raises:
        KinegenError: If it is not a positive number with a unit.
    """
    stripped = text.strip().rstrip("abcdefghijklmnopqrstuvwxyz")
    unit = text.strip()[len(stripped) :]
    try:
        number = float(stripped) * units[unit]
    except (KeyError, ValueError):
        number = 0.0
    if not 1e-15 < number < 1e15:
        raise KinegenError(f"{text!r} is not an uncertainty (expected {example}; units {', '.join(units)})")
    return number
