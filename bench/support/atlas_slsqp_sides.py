"""The atlas's fingers in direct contact as chains of links, for `atlas_follow`.

Points of the links' surface stay outside the target. Lengths in units of the
finger's, energies of EI/L at the clamp.
"""

from functools import cached_property

import numpy as np

from support import atlas_overlaps
from support.atlas_follow import Followed, first_touch, follow

Array = np.ndarray

N_LINKS = 20
POINTS = 6
"""Of each link's surface."""
FINER = np.array(
    [
        np.interp(np.linspace(0.0, N_LINKS, POINTS * N_LINKS + 1), np.arange(N_LINKS + 1), one)
        for one in np.eye(N_LINKS + 1)
    ]
).T
BETWEEN = 5
"""As many of each of their intervals are looked at in an answer."""
THROUGH = 1e-3
"""Sizes of the target, by which it may cut between the ends of links."""
DIFFERENCE = 1e-7
"""Of a place, in finger lengths."""
WAYS = np.unique([*np.logspace(-9.0, 0.0, 121), *1.0 - np.logspace(-9.0, 0.0, 121)])
"""Shares of the path, from its end, at which first touch is looked for."""


class SideChain:
    """A scene of a kind, by its index."""

    def __init__(self, kind: str, index: int) -> None:
        scene = self.scene = atlas_overlaps.side_scene(kind, index)
        finger = scene.finger
        self.start, self.stop = float(scene.path.start), float(scene.path.stop)
        s = np.linspace(0.0, 1.0, N_LINKS + 1)
        stations = np.array(finger.stations).T
        thick = np.interp(s * finger.length, *stations)
        clamp, middle = thick[0], 0.5 * (thick[1:] + thick[:-1])
        modulus = finger.shear_modulus or finger.young / (2.0 * (1.0 + finger.poisson))
        weight = (middle / clamp) ** 3 / N_LINKS
        if scene.model.shear:
            stiff = 12.0 * finger.shear_correction * modulus / finger.young
            sheared = stiff * (finger.length / clamp) ** 2 * middle / clamp
            weight = np.append(weight, sheared / N_LINKS)
        self.scale = 1.0 / np.sqrt(weight)
        self.size = len(weight)
        half = 0.5 * thick / finger.length * (scene.model.surface == "side")
        self.half = half * (1.0 if finger.side == "right" else -1.0)
        # turns of the links' ends and of their middles over the links' curvatures
        self.turns = np.tril(np.full((N_LINKS + 1, N_LINKS), 1.0 / N_LINKS), -1)
        self.middles = 0.5 * (self.turns[1:] + self.turns[:-1])

    @cached_property
    def first(self) -> float:
        """Where the target first touches the undeformed finger; NaN: nowhere on its path."""
        flat, way = np.zeros(self.size), self.start - self.stop

        def is_inside(share: float) -> bool:
            return bool(self.gaps(flat, self.stop + share * way).min() < 0.0)

        if is_inside(float(WAYS[-1])):
            return float("nan")
        return self.stop + first_touch(is_inside, WAYS) * way

    def follow(self) -> Followed:
        """The branch from the first touch; positions as the path's."""
        return follow(self, self.first, self.stop)

    def gaps(self, z: Array, position: float) -> Array:
        """See `atlas_follow.Chain`; in sizes of the target. The clamp cannot move."""
        return self._level(self.surface(z, position)[0][1:])

    def slopes(self, z: Array, position: float) -> Array:
        """See `atlas_follow.Chain`."""
        points, rates = self.surface(z, position)
        slopes = np.zeros((len(points) - 1, self.size))
        for axis in (0, 1):
            aside = DIFFERENCE * np.eye(2)[axis]
            change = self._level(points[1:] + aside) - self._level(points[1:] - aside)
            slopes += change[:, None] / (2.0 * DIFFERENCE) * rates[axis, 1:]
        return slopes

    def is_clear(self, z: Array, position: float) -> bool:
        """Whether the surface between the links' ends is outside, too."""
        points = self.surface(z, position)[0]
        ends = np.arange(len(points))
        at = np.linspace(0.0, ends[-1], BETWEEN * ends[-1] + 1)[1:]
        fine = np.column_stack([np.interp(at, ends, points[:, i]) for i in (0, 1)])
        return bool(self._level(fine).min() > -THROUGH)

    def surface(self, z: Array, position: float) -> tuple[Array, Array]:
        """The surface's points (m + 1, 2), seen from the target's reference point, and their
        derivatives (2, m + 1, n)."""
        fields, where, length = self.scale * z, self.scene.pose(position), self.scene.finger.length
        bends = fields[:N_LINKS]
        turn = where.base_angle + self.turns @ bends
        theta = where.base_angle + self.middles @ bends
        theta_rates = self.middles
        if self.size > N_LINKS:
            theta = theta + fields[N_LINKS:]
            theta_rates = np.hstack([self.middles, np.eye(N_LINKS)])
        turn_rates = np.hstack([self.turns, np.zeros((N_LINKS + 1, self.size - N_LINKS))])
        rates = np.zeros((2, N_LINKS + 1, self.size))
        step = np.array([np.cos(theta), np.sin(theta)]) / N_LINKS
        axis = np.zeros((N_LINKS + 1, 2))
        axis[1:] = np.cumsum(step, axis=1).T
        for at, across in ((0, -step[1]), (1, step[0])):
            rates[at, 1:] = np.cumsum(across[:, None] * theta_rates, axis=0)
        outward = np.array([np.sin(turn), -np.cos(turn)])
        rates[0] += (self.half * -outward[1])[:, None] * turn_rates
        rates[1] += (self.half * outward[0])[:, None] * turn_rates
        along = np.array([np.cos(where.base_angle), np.sin(where.base_angle)])
        clamp = self.scene.finger.offset * along - [where.target_x, where.target_y]
        points = clamp / length + axis + (self.half * outward).T
        return FINER @ points, FINER @ rates * self.scale

    def _level(self, points: Array) -> Array:
        return atlas_overlaps.level(self.scene, self.scene.finger.length * points)
