"""What reading changed is told in one line, with how far the tip moves where it does."""

from __future__ import annotations

from dataclasses import replace

import pytest

from kinegen.io.format import Finding, Report


@pytest.mark.parametrize(
    ("effects", "shown"),
    [
        ((5.7e-17, 0.0), ""),
        ((9e-7, 0.0), ""),
        ((0.0003, 0.00008), "0.38 mm"),
        ((2e-6, 0.0), "0.002 mm"),
        ((0.25, 0.05), "0.3 m"),
    ],
)
def test_changes_are_noted_from_a_micrometre_on(effects: tuple[float, ...], shown: str) -> None:
    findings = tuple(
        Finding(3, "joint 'a', rpy[2]", text, exact, 0.1, effect, changed=True)
        for (text, exact), effect in zip((("1.57080", "pi/2"), ("0.34999", "0.35")), effects, strict=True)
    )
    report = Report(findings)

    assert report.is_noted == bool(shown)
    assert replace(report, findings=(replace(findings[0], text="1.57"),)).is_noted, "an angle without a length"
    if shown:
        begin = "2 rounded numbers replaced by exact ones (1.57080 -> pi/2); moves the end effector by up to "
        assert report.summary == begin + shown
