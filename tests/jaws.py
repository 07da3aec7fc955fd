"""Jaws and targets in front of a tip, by plain geometry: what the gap functions are tested with."""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c

TARGET_Y = 0.05


class Pose(NamedTuple):
    """Tip position and section angle, and the target's position along its path."""

    x: float
    y: float
    psi: float
    t: float

    def to_space(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 2) of the jaw's frame in space."""
        cos, sin = np.cos(self.psi), np.sin(self.psi)
        return np.array([self.x, self.y]) + points @ np.array([[cos, sin], [-sin, cos]])


def jaw_row(
    a: tuple[float, float],
    b: tuple[float, float],
    rho: float = 0.0,
    unit: float = 1.0,
    face: tuple[float, float] | None = None,
) -> np.ndarray:
    """The jaw's table (1, JAW_COLUMNS) from corners, signed radius (positive: convex) and the
    tangent of the return face (None: folded back under the edge, out of any target's way)."""
    start, end, rho = np.array(a) / unit, np.array(b) / unit, rho / unit
    chord = np.hypot(*(end - start))
    forward = (end - start) / chord
    left = np.array([-forward[1], forward[0]])
    row = np.zeros((1, c.JAW_COLUMNS))
    tangents, centre = (forward, forward), np.zeros(2)
    if rho != 0.0:
        half = np.arcsin(chord / 2.0 / rho)  # a convex arc turns to the right, by twice this
        tangents = (
            forward * np.cos(half) + left * np.sin(half),
            forward * np.cos(half) - left * np.sin(half),
        )
        centre = (start + end) / 2.0 - rho * np.cos(half) * left
    face = -tangents[0] if face is None else np.array(face)
    row[0] = [*start, *end, *tangents[0], *tangents[1], *centre, rho, *face]
    return row


def jaw_samples(jaw: np.ndarray, count: int) -> np.ndarray:
    """Points (count, 2) of the edge from a to b, evenly spaced, in the jaw's frame."""
    start, end, rho = jaw[0, [c.AX, c.AY]], jaw[0, [c.BX, c.BY]], jaw[0, c.RHO]
    fraction = np.linspace(0.0, 1.0, count)[:, None]
    if rho == 0.0:
        return start + fraction * (end - start)
    half = np.arcsin(np.hypot(*(end - start)) / 2.0 / rho)
    turn = -2.0 * half * fraction  # of the radius from the centre to a
    centre = jaw[0, [c.MX, c.MY]]
    arm = start - centre
    return centre + np.cos(turn) * arm + np.sin(turn) * np.array([-arm[1], arm[0]])


def target_row(radius: float, length: float = 0.0) -> np.ndarray:
    """The target's table (1, TARGET_COLUMNS); a block of length 0 is endless."""
    return np.array([[radius, TARGET_Y, length]])
