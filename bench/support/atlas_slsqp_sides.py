"""SciPy's SLSQP on the atlas's fingers in direct contact, from several starts, without friction.

As `atlas_slsqp` for jaws: whether there is a shape where the package finds none. The finger is a
chain of links whose ends' surface points stay outside the target.
"""

import numpy as np
from scipy.optimize import minimize

from fastncm.scene import Scene
from support import atlas_overlaps
from support.atlas_slsqp import CURVATURES, FTOL, MOST_ITERATIONS

Array = np.ndarray

N_LINKS = 40
BETWEEN = 10
"""Points of each link's surface that are looked at in an answer."""
CLEAR = 1e-3
"""Sizes of the target, by which it may cut between the ends of links."""


class _Chain:
    """A scene at the end of its path; lengths in units of the finger's, energies of EI/L at the
    clamp."""

    def __init__(self, scene: Scene) -> None:
        self.scene, finger = scene, scene.finger
        self.where = scene.pose(scene.path.stop)
        self.h = 1.0 / N_LINKS
        s = np.linspace(0.0, 1.0, N_LINKS + 1)
        stations = np.array(finger.stations).T
        thick = np.interp(s * finger.length, *stations)
        clamp, middle = thick[0], 0.5 * (thick[1:] + thick[:-1])
        modulus = finger.shear_modulus or finger.young / (2.0 * (1.0 + finger.poisson))
        weight = (middle / clamp) ** 3 * self.h
        if scene.model.shear:
            stiff = 12.0 * finger.shear_correction * modulus / finger.young
            sheared = stiff * (finger.length / clamp) ** 2 * middle / clamp
            weight = np.append(weight, sheared * self.h)
        self.scale = 1.0 / np.sqrt(weight)  # unknowns in which the energy is 1/2 z.z
        half = 0.5 * thick / finger.length * (scene.model.surface == "side")
        self.half = half * (1.0 if finger.side == "right" else -1.0)

    def surface(self, z: Array) -> Array:
        """The surface's points (N_LINKS + 1, 2) in m, seen from the target's reference point."""
        fields, where = self.scale * z, self.where
        turn = where.base_angle + np.append(0.0, np.cumsum(fields[:N_LINKS] * self.h))
        theta = 0.5 * (turn[1:] + turn[:-1])
        if len(fields) > N_LINKS:
            theta = theta + fields[N_LINKS:]
        step = self.h * np.column_stack([np.cos(theta), np.sin(theta)])
        axis = np.vstack([np.zeros(2), np.cumsum(step, axis=0)])
        side = axis + self.half[:, None] * np.column_stack([np.sin(turn), -np.cos(turn)])
        offset = self.scene.finger.offset
        begin = offset * np.array([np.cos(where.base_angle), np.sin(where.base_angle)])
        points: Array = begin + self.scene.finger.length * side - [where.target_x, where.target_y]
        return points

    def gaps(self, z: Array) -> Array:
        """Of the links' ends, in sizes of the target; the clamp cannot move."""
        return atlas_overlaps.level(self.scene, self.surface(z)[1:])

    def clear(self, z: Array) -> bool:
        """Whether the surface between the links' ends is outside, too."""
        points = self.surface(z)
        at = np.linspace(0.0, N_LINKS, BETWEEN * N_LINKS + 1)[1:]
        ends = np.arange(N_LINKS + 1)
        fine = np.column_stack([np.interp(at, ends, points[:, i]) for i in (0, 1)])
        return bool(atlas_overlaps.level(self.scene, fine).min() > -CLEAR)


def solve(kind: str, index: int) -> bool:
    """Whether any start ends in a shape that does not penetrate."""
    chain = _Chain(atlas_overlaps.side_scene(kind, index))
    outside = {"type": "ineq", "fun": chain.gaps}
    for curvature in CURVATURES:
        start = np.zeros(len(chain.scale))
        start[:N_LINKS] = curvature / chain.scale[:N_LINKS]
        found = minimize(
            lambda z: 0.5 * z @ z, start, jac=lambda z: z, method="SLSQP", constraints=outside,
            options={"ftol": FTOL, "maxiter": MOST_ITERATIONS},
        )  # fmt: skip
        if found.success and chain.clear(found.x):
            return True
    return False
