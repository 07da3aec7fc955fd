"""Helpers of the tests of direct contact: from a scene to solved rows, in few words."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from fastncm.direct.lowering import LoweredSurface, lower_surface
from fastncm.direct.solving import SolvedSurface, contacts_at, finger_at, solve_surfaces
from fastncm.kernels.cache import JIT_OFF
from fastncm.kernels.nodal import NodalProblem
from fastncm.path import surface_rows
from fastncm.path.surface_trace import SurfaceTrace
from fastncm.scene import load_scene, tabulate
from fastncm.sqp import status

interpreted = pytest.mark.skipif(
    not JIT_OFF,
    reason="functions of the whole state cannot be called from Python where they are compiled",
)
RUBBER = load_scene("rubber-ellipse")
PLANE = {
    "target.shape": "half-plane",
    "target.tilt": math.pi / 2,
    "path.kind": "translation",
    "path.angle": 1.3,
    "path.start": 0.06,
    "path.stop": 0.0225,
}
"""A wall on the right of a finger that leans towards it: its tip touches first."""


@dataclass(frozen=True)
class Solved:
    """One finger's solved path. Columns are those of `path.surface_rows`, in lower case."""

    lowered: LoweredSurface
    solved: SolvedSurface

    def __getattr__(self, name: str) -> np.ndarray:
        """A column over the positions (P,), dimensionless."""
        return self.trace.rows[0, :, getattr(surface_rows, name.upper())]

    @property
    def problem(self) -> NodalProblem:
        return self.lowered.problem

    @property
    def trace(self) -> SurfaceTrace:
        return self.solved.trace

    @property
    def converged(self) -> np.ndarray:
        """(P,) bool."""
        return self.status == status.CONVERGED

    @property
    def force(self) -> np.ndarray:
        """(P, 2), dimensionless, on the finger, in space."""
        return np.column_stack([self.force_x, self.force_y])

    @property
    def newtons(self) -> np.ndarray:
        """(P, 2), on the finger, in space."""
        return self.force * self.lowered.scale.force[0]

    @property
    def joules(self) -> np.ndarray:
        """Strain energy (P,)."""
        return self.energy * self.lowered.scale.force[0] * self.lowered.scale.length[0]

    def finger(self, i: int) -> dict[str, np.ndarray]:
        """Position `i`, dimensionless, in space: s, x, y, psi, gamma, moment (N + 1,)."""
        return finger_at(self.lowered, self.solved, 0, i)

    def touching(self, i: int) -> dict[str, np.ndarray]:
        """Touching points at `i`, dimensionless, in space: s, x, y, force_x, force_y (k,)."""
        return contacts_at(self.lowered, self.solved, 0, i)


def lowered_surface(
    changes: Mapping[str, Any] | None = None,
    positions: Sequence[float] | None = None,
    mu: float = 0.0,
) -> LoweredSurface:
    """rubber-ellipse with changes; `positions` in m or rad; `mu` of true sliding."""
    (group,) = tabulate(RUBBER.replace(dict(changes or {})), {})
    lowered = lower_surface(group, None if positions is None else np.asarray(positions, float))
    return replace(lowered, problem=lowered.problem._replace(mu=np.array([mu])))


def solved_surface(
    changes: Mapping[str, Any] | None = None,
    positions: Sequence[float] | None = None,
    mu: float = 0.0,
) -> Solved:
    """Solve rubber-ellipse with changes at `positions` (m or rad), in this order."""
    lowered = lowered_surface(changes, positions, mu)
    (solved,) = solve_surfaces(lowered, shapes=True)
    return Solved(lowered, solved)


def check_equilibrium(solved: Solved, i: int) -> None:
    """Every interval carries the contact forces beyond its middle, to 1e-9 of the largest."""
    problem, finger, contacts = solved.problem, solved.finger(i), solved.touching(i)
    force = np.column_stack([contacts["force_x"], contacts["force_y"]])
    place = np.column_stack([contacts["x"], contacts["y"]])
    nodes = np.column_stack([finger["x"], finger["y"]])
    np.testing.assert_allclose(force.sum(axis=0), solved.force[i], rtol=1e-12, atol=1e-13)
    count = len(problem.step)
    bent = problem.bending[0] * np.diff(finger["psi"])
    largest = np.abs(bent).max()
    chosen = np.unique(np.linspace(0, count - 1, 200).astype(int))
    if problem.points.shape[1] > 0:  # a target's point may act on either section beside it
        apart = np.abs(contacts["s"][None, :] - finger["s"][chosen + 1][:, None]).min(axis=1)
        chosen = chosen[apart * count > 1.5]
    middle = 0.5 * (nodes[chosen + 1] + nodes[chosen])
    s = 0.5 * (finger["s"][chosen + 1] + finger["s"][chosen])
    carried = np.where(
        contacts["s"][None, :] > s[:, None], cross(place[None] - middle[:, None], force), 0.0
    ).sum(axis=1)
    np.testing.assert_allclose(bent[chosen], carried, atol=1e-9 * largest)
    # at the clamp: half an interval farther than the first middle
    total = cross(place - nodes[0], force).sum()
    first = 0.5 * (nodes[1] - nodes[0])
    assert bent[0] + cross(first, force.sum(axis=0)) == pytest.approx(total, rel=1e-9)


def cross(arm: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Moments of forces (..., 2) with arms (..., 2)."""
    moment: np.ndarray = arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0]
    return moment
