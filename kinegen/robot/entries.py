"""The entries of a table's row, by convention."""

from __future__ import annotations

from kinegen.robot.model import Convention

ROW_ENTRIES: dict[Convention, tuple[str, ...]] = {
    Convention.STANDARD: ("a", "alpha", "d", "theta"),
    Convention.MODIFIED: ("a", "alpha", "d", "theta"),
    Convention.MODIFIED_PREV_D: ("a", "alpha", "d", "theta"),
    Convention.HAYATI: ("a", "alpha", "theta", "beta"),
    Convention.ETS: (),
}
"""The entries that a row of each convention must have."""

ANGLE_ENTRIES = frozenset({"alpha", "theta", "beta"})
MOVING_ENTRIES = frozenset({"theta", "d"})
"""The entries in which a joint variable may stand; both turn about or move along z."""
