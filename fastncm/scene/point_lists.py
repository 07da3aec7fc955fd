"""Lists of points as values: a thickness profile, a convex polygon.

Like the kinds of kinds.py: `parse` returns nested tuples, or raises ValueError with the sentence
that says what the value must be.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from fastncm.scene.kinds import as_float, is_number

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Profile:
    """Thickness w over the arc length s, piecewise linear: [[s, w], ...] with s ascending from 0
    and w > 0."""

    def parse(self, value: object) -> Points:
        """The stations (s, w), or ValueError."""
        points = _points(value, 2, "[[s, w], ...], pairs of finite numbers in m, at least two")
        if points[0][0] != 0.0:
            raise ValueError(f"a table over s from 0 on; it begins at s = {points[0][0]:g}")
        for (s, w), (after, _) in zip(points, (*points[1:], (math.inf, 0.0)), strict=True):
            if not w > 0.0:
                raise ValueError(f"a table of thicknesses greater than 0; at s = {s:g} it is {w:g}")
            if not after > s:
                raise ValueError(f"a table with s ascending; after s = {s:g} comes {after:g}")
        return points


@dataclass(frozen=True)
class Polygon:
    """The corners of a convex polygon, [[x, y], ...]; counter-clockwise, or turned round to be."""

    def parse(self, value: object) -> Points:
        """The corners in counter-clockwise order, or ValueError naming the corner at fault."""
        points = _points(value, 3, "[[x, y], ...], pairs of finite numbers in m, at least three")
        turns = [_turn(points, corner) for corner in range(len(points))]
        if sum(turns) < 0.0:
            points, turns = points[::-1], [-turn for turn in turns[::-1]]
        for (x, y), turn in zip(points, turns, strict=True):
            if not turn > STRAIGHT:
                raise ValueError(f"a convex polygon; it has no convex corner at [{x:g}, {y:g}]")
        if sum(turns) > 3 * math.pi:
            raise ValueError("a convex polygon; its sides cross each other")
        return points


#: A corner whose sides turn by less than this (rad) is none.
STRAIGHT = 1e-9


def _points(value: object, fewest: int, expected: str) -> Points:
    """Nested tuples of floats from nested sequences of numbers, or ValueError(expected)."""
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) < fewest:
        raise ValueError(expected)
    points = []
    for pair in value:
        if not isinstance(pair, Sequence) or len(pair) != 2 or not all(map(is_number, pair)):
            raise ValueError(expected)
        points.append((as_float(pair[0]), as_float(pair[1])))
    if not all(math.isfinite(number) for pair in points for number in pair):
        raise ValueError(expected)
    return tuple(points)


def _turn(points: Points, corner: int) -> float:
    """Angle in rad, from -pi to pi, by which the outline turns left at a corner."""
    before, here, after = (points[(corner + step) % len(points)] for step in (-1, 0, 1))
    ax, ay = here[0] - before[0], here[1] - before[1]
    bx, by = after[0] - here[0], after[1] - here[1]
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)
