"""Holds the options of a calibration; it imports nothing heavy, so that the command line can check them first."""

from __future__ import annotations

from kinegen.errors import KinegenError
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

TABLE = ("theta", "a", "d", "alpha", "beta")
"""The kinds of entries that `--fit` takes for all rows at once."""

BASE_WORD, TOOL_WORD = "base", "tool"

DEFAULT_FIT = ("theta", "a", "d", "alpha")


class Loss(StrEnum):
    """Weights of residuals: squared, or less than squared beyond three standard deviations."""

    LINEAR = "linear"
    HUBER = "huber"
    SOFT_L1 = "soft_l1"
    CAUCHY = "cauchy"


@dataclass(frozen=True, slots=True)
class Settings:
    """Options of a calibration; units and frames that are not stated are those of the file, and its tool.

    Attributes:
        fit: Words of `--fit`: kinds of entries, `base`, `tool`, names of entries or parameters.
        length: Unit of lengths in the measurements, where a header does not say; None for the unit of the file.
        sigma: Standard deviation of a measured length in metres, where no column says; None if it is not known.
        sigma_angle: The same of an angle, in radians.
        folds: Parts of the cross-validation; 0 for none.
        seed: Decides the folds and the candidates for suggestions.
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
    """Return a positive number with its unit, such as `0.05mm`, in the unit of size 1; `example` is for the message."""
    stripped = text.strip().rstrip("abcdefghijklmnopqrstuvwxyz")
    unit = text.strip()[len(stripped) :]
    try:
        number = float(stripped) * units[unit]
    except (KeyError, ValueError):
        number = 0.0
    if not 1e-15 < number < 1e15:
        raise KinegenError(f"{text!r} is not an uncertainty (expected {example}; units {', '.join(units)})")
    return number
