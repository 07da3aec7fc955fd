"""SciPy's `solve_bvp` on the equilibrium equation of a jaw's finger, with friction where there is.

In units of L and EI/L^2, with u = s/L, over the states x, y, psi, m (the moment):

    x' = cos(psi),  y' = sin(psi),  psi' = m,  m' = F_x sin(psi) - F_y cos(psi)

and the unknown parameters F_x, F_y and the place of the contact on the jaw. Conditions: clamped at
u = 0; at the tip the moment is that of F about it, F lies on the edge of the friction cone, and
the target's point meets the jaw's (two equations). `tests/shooting.py` solves the same equation;
they share no code.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_bvp

from support import rivals_problem as rp
from support import shooting
from support.rivals import Answer

FIRST_MESH = 9
FIRST_FORCE = 1e-3
MOST_NODES = 20_000


class BvpState(NamedTuple):
    """A solution to start from."""

    mesh: np.ndarray  # (n,)
    states: np.ndarray  # (4, n)
    parameters: np.ndarray  # (3,): F_x, F_y, place
    feature: int


class BvpRival:
    """`solve_bvp` with one tolerance, and the Jacobian of the right-hand side."""

    def __init__(self, case: shooting.ShootingCase, tolerance: float) -> None:
        assert case.thickness_tip is None and not case.shear
        self.case, self.tolerance = case, tolerance
        self.numbers = rp.geometry(case)

    def solve(self, feature: int, position: float, before: Sequence[BvpState]) -> Answer:
        """The contact at `position` (m) of this part of the jaw."""
        start = before[-1] if before else self._straight(position / self.case.length)
        parameters = start.parameters.copy()
        if feature != start.feature:  # places along the edge and angles at a corner differ
            parameters[2] = 0.0
        length = self.case.length

        def conditions(clamp: np.ndarray, tip: np.ndarray, p: np.ndarray) -> np.ndarray:
            return self._conditions(feature, position / length, clamp, tip, p)

        found = solve_bvp(
            _slope,
            conditions,
            start.mesh,
            start.states,
            parameters,
            fun_jac=_slope_jacobian,
            tol=self.tolerance,
            max_nodes=MOST_NODES,
        )
        force = rp.force_unit(self.case) * found.p[:2]
        state = BvpState(found.x, found.y, found.p, feature)
        return Answer(bool(found.success), force, found.y[:3, -1], int(found.niter), state)

    def _straight(self, position: float) -> BvpState:
        """The undeformed finger, touched lightly where the target faces the edge."""
        g = self.numbers
        to_target = [position - 1.0 - g[rp.AX], g[rp.PATH_Y] - g[rp.AY]]
        place = float(np.dot(g[[rp.TX, rp.TY]], to_target))
        states = np.zeros((4, FIRST_MESH))
        states[0] = np.linspace(0.0, 1.0, FIRST_MESH)
        force = -FIRST_FORCE * g[[rp.NX, rp.NY]]
        return BvpState(states[0], states, np.array([*force, place]), rp.EDGE)

    def _jaw(self, feature: int, place: float) -> tuple[np.ndarray, np.ndarray]:
        """A point of the jaw seen from the undeformed tip, and the outward normal there.

        `place` is the distance from a along the edge, or the angle by which the normal at a is
        turned from the edge's, anticlockwise.
        """
        g = self.numbers
        a, normal = g[[rp.AX, rp.AY]], g[[rp.NX, rp.NY]]
        if feature == rp.CORNER:
            return a, _turned(normal, place)
        if g[rp.RHO] == 0.0:
            return a + place * g[[rp.TX, rp.TY]], normal
        normal = _turned(normal, -place / g[rp.RHO])
        return g[[rp.MX, rp.MY]] + g[rp.RHO] * normal, normal

    def _conditions(
        self, feature: int, position: float, clamp: np.ndarray, tip: np.ndarray, p: np.ndarray
    ) -> np.ndarray:
        """Seven residuals."""
        point, normal = self._jaw(feature, p[2])
        arm, normal = _turned(point, tip[2]), _turned(normal, tip[2])
        push = -normal + self.case.mu * np.array([-normal[1], normal[0]])
        met = tip[:2] + arm + self.numbers[rp.RADIUS] * normal
        target = np.array([position, self.numbers[rp.PATH_Y]])
        meeting = met - target
        if feature == rp.CORNER and self.numbers[rp.RADIUS] == 0.0:  # anywhere on the underside
            meeting = np.array([meeting[1], normal[0]])
        moment = tip[3] - (arm[0] * p[1] - arm[1] * p[0])
        across = push[0] * p[1] - push[1] * p[0]
        return np.array([*clamp[:3], moment, across, *meeting])


def _turned(vector: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]])


def _slope(u: np.ndarray, states: np.ndarray, p: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(states[2]), np.sin(states[2])
    return np.array([cos, sin, states[3], p[0] * sin - p[1] * cos])


def _slope_jacobian(
    u: np.ndarray, states: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """By the states (4, 4, n) and by the parameters (4, 3, n)."""
    cos, sin = np.cos(states[2]), np.sin(states[2])
    by_states, by_parameters = np.zeros((4, 4, len(u))), np.zeros((4, 3, len(u)))
    by_states[0, 2], by_states[1, 2], by_states[2, 3] = -sin, cos, 1.0
    by_states[3, 2] = p[0] * cos + p[1] * sin
    by_parameters[3, 0], by_parameters[3, 1] = sin, -cos
    return by_states, by_parameters
