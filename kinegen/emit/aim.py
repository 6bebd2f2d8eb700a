"""What headers and modules say of the inverse of a five-axis machine."""

from __future__ import annotations

import textwrap

_TEXTS = """\
Rows of solutions:
  0  tilt forward: from where the tool is nearest to the first rotary axis, counted from the workpiece, the other rotary joint is turned by 0 to 180 deg in the direction in which its variable grows
  1  tilt backward: it is turned by 0 to 180 deg the other way
The z axis of the tool gets the direction, which may have any length from 1e-6 to 1e6. valid is 1 where the direction is within reach, all numbers are finite and all joints are within their limits, else 0; then the row is arbitrary, NaN among other values. Targets:
  with the tool along the first rotary axis, that joint keeps its value in q_near, and both rows are the same
  a rotary joint with room for more than one turn is brought as near to its value in q_near as its limits allow; without limits, or with more than 12 turns, into the turn about 0
  q_near is a joint vector, such as the present one; of joints that shift it is not used, but must be finite
"""  # noqa: E501


def aim_lines(width: int) -> tuple[str, ...]:
    """The words as lines of a comment, of at most so many characters."""
    texts = _TEXTS.splitlines()
    return tuple(part for text in texts for part in textwrap.wrap(text, width, subsequent_indent="    "))
