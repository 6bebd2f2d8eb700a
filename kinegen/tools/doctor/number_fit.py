"""Single numbers that may be wrong by any amount: each solved from the poses by least squares, the others as they are.

A length moves the tip along a line, so one step is exact. An angle moves it on circles: the squared error is a
trigonometric polynomial of second degree, whose lowest value is found from eight samples. Steps of Gauss and Newton
sharpen both. A kind of entries (all zeros, all lengths) is solved the same way, to say whether a calibration can
find what is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinegen.tools.doctor.edits import Edit, EditKind, blank
from kinegen.tools.doctor.hypotheses import Candidate, Space, judge
from kinegen.tools.doctor.numeric_table import Table
from kinegen.tools.doctor.observed_poses import FloatArray
from kinegen.tools.doctor.residual import Batch, Frames, Targets, predicted_poses, targets
from kinegen.tools.doctor.rewrite import number_text

SPARE = 3
"""Numbers that have to be left over to see whether one that was solved is right."""

MANY_SPARE = 6
"""The same for a kind of entries."""

_SAMPLES = 8
_GRID = 720
_SHARPENED = 4
_STEPS = 20
_POSES = 64
_MOVES = 1e-7
"""The least that an entry must move what was measured, per radian or per reach, as a share of the reach."""

_DIGITS = 10
"""Digits that a solved number has at most."""

_ROUNDER = 1.5
"""How much larger the errors may become for a rounder number."""


def single_numbers(space: Space) -> tuple[Candidate, ...]:
    """Return the file with each of its numbers solved from the poses, as far as the poses know it; the best first."""
    if space.numbers < 1 + SPARE:
        return ()
    fit = _Fit(space)
    places = fit.known(np.arange(len(space.table.slots)))
    found = []
    for place, value in zip(places, fit.single(places), strict=True):
        if abs(value - space.table.constants[place]) > 0:
            edit = number_edit(space.table, int(place), value, space.start.table_angle)
            if edit is not None:
                found.append(judge(space, replace(space.as_it_is, edits=(edit,))))
    return tuple(sorted(found, key=lambda candidate: candidate.score))


def solvable_kinds(space: Space) -> tuple[str, ...]:
    """The first kind of entries that explains the poses if all of them are solved: a word for each, or nothing."""
    fit, table = _Fit(space), space.table
    by_key = {
        key: [row.slots[key] for row in table.rows if key in row.slots and table.slots[row.slots[key]].step < 0]
        for key in ("theta", "d", "a", "alpha")
    }
    # Few unknowns first: the first kind that suffices is the answer.
    for kinds in (("theta",), ("d",), ("a",), ("alpha",), ("d", "a"), ("theta", "d", "a", "alpha")):
        wanted = np.array([place for key in kinds for place in by_key[key]], dtype=np.intp)
        if not len(wanted) or space.numbers < len(wanted) + MANY_SPARE:
            continue
        constants = fit.many(wanted)
        whole = np.array([constants])
        frames = predicted_poses(table, space.start, Batch(whole, np.ones_like(whole)), space.observed.joints)
        if space.errors(frames).worst[0] <= 1:
            return kinds
    return ()


class _Fit:
    """Least squares over constants of the table, with the readings as they are stated."""

    def __init__(self, space: Space) -> None:
        self._space, self._table = space, space.table
        self._few = space.observed.spread(_POSES)
        self._wanted: Targets = targets(self._few, space.start)
        self._limits = space.common
        self._units = np.where(self._table.turns, 1.0, self._table.reach)

    def errors(self, constants: FloatArray) -> FloatArray:
        """Return all deviations of variants (N, slots) in units of what digits leave open, (N, R)."""
        batch = Batch(constants, np.ones_like(constants))
        frames: Frames = predicted_poses(self._table, self._space.start, batch, self._few.joints)
        *axes, origin = frames
        parts = [(origin - self._wanted.positions) / self._limits.position]
        turned = self._wanted.turned / (math.sqrt(2) * self._limits.rotation)
        parts += [(axis - seen) * turned for axis, seen in zip(axes, self._wanted.rotations, strict=True)]
        return np.concatenate([np.moveaxis(part, 1, 0).reshape(len(constants), -1) for part in parts], axis=1)

    def known(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return those that move what was measured."""
        slopes = np.linalg.norm(self._slopes(np.tile(self._table.constants, (len(places), 1)), places), axis=1)
        least = _MOVES * self._table.reach * self._space.start.scale / self._limits.position
        return np.asarray(places[slopes > least])

    def single(self, places: NDArray[np.intp]) -> FloatArray:
        """Return the best value of each, the others as they are, (P,)."""
        constants = np.tile(self._table.constants, (len(places), 1))
        each = np.arange(len(places))
        turning = self._table.turns[places]
        constants[each[turning], places[turning]] = self._angles(places[turning])
        for _ in range(_SHARPENED):
            errors, slopes = self.errors(constants), self._slopes(constants, places)
            steps = -(errors * slopes).sum(axis=1) / np.maximum((slopes**2).sum(axis=1), 1e-300)
            constants[each, places] += steps * self._units[places]
        return np.asarray(constants[each, places])

    def many(self, places: NDArray[np.intp]) -> FloatArray:
        """Return all constants, with those of some places at their best values near those of the file."""
        constants = self._table.constants.copy()
        errors = self.errors(constants[None])[0]
        for _ in range(_STEPS):
            slopes = self._slopes(np.tile(constants, (len(places), 1)), places)
            step = np.linalg.lstsq(slopes.T, -errors, rcond=1e-9)[0] * self._units[places]
            # Steps that are too long for angles are shortened.
            for share in (1.0, 0.25, 0.05):
                changed = constants.copy()
                changed[places] += share * step
                after = self.errors(changed[None])[0]
                if after @ after < errors @ errors:
                    break
            else:
                break
            constants, errors = changed, after
        return constants

    def _slopes(self, constants: FloatArray, places: NDArray[np.intp]) -> FloatArray:
        """Return the derivative of the errors of each variant by its place, per unit, (P, R)."""
        step = 1e-6
        each = np.arange(len(places))
        ends = []
        for sign in (-1, 1):
            moved = constants.copy()
            moved[each, places] += sign * step * self._units[places]
            ends.append(self.errors(moved))
        return (ends[1] - ends[0]) / (2 * step)

    def _angles(self, places: NDArray[np.intp]) -> FloatArray:
        """Return the angle at which the squared error is lowest, for each place."""
        at = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
        constants = np.repeat(np.tile(self._table.constants, (len(places), 1)), _SAMPLES, axis=0)
        constants[np.arange(len(constants)), np.repeat(places, _SAMPLES)] = np.tile(at, len(places))
        squares = (self.errors(constants) ** 2).sum(axis=1).reshape(len(places), _SAMPLES)
        waves = np.fft.rfft(squares, axis=1) / _SAMPLES
        grid = 2 * np.pi * np.arange(_GRID) / _GRID - np.pi
        powers = np.exp(1j * np.outer(np.arange(3), grid)) * np.array([1, 2, 2])[:, None]
        return np.asarray(grid[np.argmin((waves[:, :3] @ powers).real, axis=1)])


def number_edit(table: Table, place: int, value: float, unit: str) -> Edit | None:
    """Return the edit that gives a slot another constant; None where it is the old one."""
    old = float(table.constants[place])
    if table.slots[place].kind.is_rotation:
        value = math.remainder(value, 2 * math.pi)
        if abs(math.remainder(value - old, 2 * math.pi)) < 1e-12:
            return None
    # Words name the entry as the file has it, in its unit.
    owner, key, rows = _owner(table, place)
    moving = bool(table.coefficients[place].any())
    turns = table.slots[place].kind.is_rotation
    new, before = (number_text(number, unit if turns else "") for number in (value, old))
    words = f"{owner}: {'the constant in ' * moving}{key} is {new} instead of {before}"
    edit = blank(table, words, EditKind.NUMBER, frozenset({f"{place} number"}), rows, (key,))
    # The old constant counts nothing, whatever other edits do to it.
    edit.times[place] = 0.0
    edit.plus[place] = value
    return replace(edit, place=place, text=new)


def _owner(table: Table, place: int) -> tuple[str, str, tuple[int, ...]]:
    """Return what a slot belongs to, its entry, and the number of its row."""
    for row in table.rows:
        for key, slot in row.slots.items():
            if slot == place:
                return row.label, key, (row.number,)
    name, steps = ("base", table.base) if place in table.base else ("tool", table.tail)
    own = table.slots[place]
    alone = sum(table.slots[each].kind is own.kind for each in steps) == 1
    return f"the transform '{name}'", str(own.kind) if alone else own.entry, ()


def rounder(space: Space, candidate: Candidate) -> Candidate:
    """Return the candidate with its solved number rounded as far as the poses agree with it."""
    (edit,) = (edit for edit in candidate.edits if edit.kind is EditKind.NUMBER)
    rest = tuple(each for each in candidate.edits if each is not edit)
    for value in _rounded(float(edit.plus[edit.place]), space.table.slots[edit.place].kind.is_rotation, space):
        other = number_edit(space.table, edit.place, value, candidate.setting.table_angle)
        if other is None:
            continue
        found = judge(space, replace(candidate, edits=(*rest, other)))
        if found.fits == candidate.fits and found.score < _ROUNDER * max(candidate.score, 1.0 if found.fits else 0.0):
            return found
    return candidate


def _rounded(value: float, turns: bool, space: Space) -> Iterator[float]:
    """Finer and finer values, the roundest first."""
    unit = math.pi / 180 if turns and space.start.table_angle == "deg" else 1.0
    if turns:
        yield round(value / (math.pi / 12)) * (math.pi / 12)
    largest = math.pi / unit if turns else space.table.reach
    first = -math.floor(math.log10(largest))
    for decimals in range(first, first + _DIGITS):
        yield round(value / unit, decimals) * unit
