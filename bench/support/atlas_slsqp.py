"""The atlas's fingers with a jaw as chains of links, for `atlas_follow`; nothing of the package.

Points of the jaw stay outside the target, and the target's corners or its centre away from the
jaw. Lengths in units of the finger's, energies of EI/L at the clamp.
"""

from functools import cached_property

import extremes
import numpy as np
import shooting_many
from scipy.linalg import block_diag

from support.atlas_follow import Followed, first_touch, follow

Array = np.ndarray

N_LINKS = 24
BENDING_MODES, SHEAR_MODES = 10, 6
"""Polynomials over the links, which a load at the tip needs; they are what SLSQP gets."""
EDGE_POINTS = 121
"""Of a convex arc; of what else a target's straight side or circle touches only the ends."""
SEEN_POINTS, THROUGH = 401, 1e-5
"""Points of any jaw that are looked at in an answer, and how deep they may be."""
DIFFERENCE = 1e-7
"""Of a pose."""
UNDEFORMED = np.array([1.0, 0.0, 0.0])
WAYS = np.logspace(-13.0, 3.0, 481)
"""Distances from the end of the path at which first touch is looked for."""


class JawChain:
    """The scene in row `row` of a table."""

    def __init__(self, columns: extremes.Columns, row: int) -> None:
        rows = np.array([row])
        self.stop = float(columns["path.stop"][row] / columns["finger.length"][row])
        f = shooting_many.fingers(columns, rows, columns["path.stop"][rows].astype(float))
        ratio, shear = float(f.ratio[0]), float(f.shear[0])
        grows = np.log(ratio)
        z = np.linspace(0.0, 1.0, N_LINKS + 1)
        s = z if abs(grows) < 1e-12 else np.expm1(grows * z) / (ratio - 1.0)
        self.links, middle = np.diff(s), 0.5 * (s[1:] + s[:-1])
        thick = 1.0 + (ratio - 1.0) * middle
        weight = thick**3 * self.links
        if np.isfinite(shear):
            weight = np.append(weight, shear * thick * self.links)
        modes = [_polynomials(BENDING_MODES), _polynomials(SHEAR_MODES)][: len(weight) // N_LINKS]
        self.fields = block_diag(*modes) / np.sqrt(weight)[:, None]
        self.size = self.fields.shape[1]
        self.a, self.b, self.half = f.a[0], f.b[0], float(f.half[0])
        self.down = -np.array([np.cos(f.back[0]), np.sin(f.back[0])])
        self.y, self.radius, self.length = float(f.at[0, 1]), float(f.radius[0]), float(f.length[0])
        count = EDGE_POINTS if self.half > 0.0 and self.radius == 0.0 else 2
        self.jaw = self.edge(np.linspace(0.0, 1.0, count))[0]

    @cached_property
    def first(self) -> float:
        """Where the target first touches the undeformed finger; NaN: nowhere on its path."""

        def is_inside(way: float) -> bool:
            return bool(self.pose_gaps(UNDEFORMED, self.stop + way).min() < 0.0)

        return self.stop + first_touch(is_inside, WAYS)

    def follow(self) -> Followed:
        """The branch from the first touch; positions in finger lengths."""
        return follow(self, self.first, self.stop)

    def gaps(self, z: Array, position: float) -> Array:
        """See `atlas_follow.Chain`."""
        return self.pose_gaps(self.pose(z)[0], position)

    def slopes(self, z: Array, position: float) -> Array:
        """See `atlas_follow.Chain`."""
        pose, turns = self.pose(z)
        aside = DIFFERENCE * np.eye(3)
        rates = [
            self.pose_gaps(pose + one, position) - self.pose_gaps(pose - one, position)
            for one in aside
        ]
        slopes: Array = np.column_stack(rates) / (2.0 * DIFFERENCE) @ turns
        return slopes

    def is_clear(self, z: Array, position: float) -> bool:
        """The gaps do not see the back of an arc that is nearly half a circle."""
        pose = self.pose(z)[0]
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        edge = self.edge(np.linspace(0.0, 1.0, SEEN_POINTS))[0] @ [[cos, sin], [-sin, cos]]
        return bool(self.outside(pose[:2] + edge - [position, self.y]).min() > -THROUGH)

    def pose(self, z: Array) -> tuple[Array, Array]:
        """The tip's x, y, psi (3,) and their derivatives (3, n)."""
        n, fields = N_LINKS, self.fields @ z
        turn = np.cumsum(fields[:n] * self.links)
        theta = turn - 0.5 * fields[:n] * self.links
        if len(fields) > n:
            theta = theta + fields[n:]
        step = self.links * np.array([np.cos(theta), np.sin(theta)])
        rates = np.array([-step[1], step[0]])  # over theta
        beyond = np.cumsum(rates[:, ::-1], axis=1)[:, ::-1]
        bend = np.vstack([(beyond - 0.5 * rates) * self.links, self.links])
        shear = np.vstack([rates, np.zeros(n)])
        derivatives = np.hstack([bend, shear])[:, : len(fields)] @ self.fields
        return np.append(step.sum(axis=1), turn[-1]), derivatives

    def pose_gaps(self, pose: Array, position: float) -> Array:
        """Distances (m,) of the jaw's points from the target and of the target's from the jaw."""
        at = np.array([position, self.y])
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        turned = np.array([[cos, sin], [-sin, cos]])
        own = np.array([self._from_jaw(turned @ (at - pose[:2])) - self.radius])
        if self.length > 0.0:
            other = at + [self.length, 0.0]
            own = np.append(own, self._from_jaw(turned @ (other - pose[:2])))
        return np.append(self.outside(pose[:2] + self.jaw @ turned - at), own)

    def outside(self, p: Array) -> Array:
        """Distances (m,) from the target of points (m, 2) seen from its corner or centre, negative
        inside."""
        if self.radius > 0.0:
            return np.hypot(*p.T) - self.radius
        across = -p[:, 0]  # a block to the right of and above its corner
        if self.length > 0.0:
            across = np.maximum(across, p[:, 0] - self.length)
        out = np.hypot(np.maximum(across, 0.0), np.maximum(-p[:, 1], 0.0))
        return np.where(out > 0.0, out, np.maximum(across, -p[:, 1]))

    def _from_jaw(self, p: Array) -> float:
        """Signed distance of a point (2,) in the tip's frame from the jaw, which is below its edge,
        in front of its return face and not beyond b."""
        chord = self.b - self.a
        place = along = (p - self.a) @ chord / (chord @ chord)
        if self.half != 0.0:
            size = np.hypot(*chord)
            left = np.array([-chord[1], chord[0]]) / size
            rho = 0.5 * size / np.sin(self.half)
            normal = (p - 0.5 * (self.a + self.b) + rho * np.cos(self.half) * left) / rho
            turn = np.arctan2(left[0] * normal[1] - left[1] * normal[0], left @ normal)
            place = 0.5 * (1.0 - turn / self.half)
        point, outward = self.edge(np.array([min(max(place, 0.0), 1.0)]))
        above = float((p - point[0]) @ outward[0]) if 0.0 < place < 1.0 else np.inf
        behind = float((p - self.a) @ [self.down[1], -self.down[0]])
        if behind < 0.0 and above < 0.0:
            return max(above, behind) if along <= 1.0 else float(np.hypot(*(p - self.b)))
        back = self.a + max((p - self.a) @ self.down, 0.0) * self.down
        from_back = np.hypot(*(p - back)) if behind > 0.0 else np.inf
        return float(min(np.hypot(*(p - point[0])), from_back))

    def edge(self, place: Array) -> tuple[Array, Array]:
        """Points (m, 2) of the jaw from 0 at a to 1 at b, seen from the tip, and normals (m, 2)."""
        each = np.ones((len(place), 1))
        return extremes.jaw_point(each * self.a, each * self.b, each[:, 0] * self.half, place)


def _polynomials(count: int) -> Array:
    """Orthonormal polynomials at the links' middles (N_LINKS, count)."""
    middle = (2.0 * np.arange(N_LINKS) + 1.0) / N_LINKS - 1.0
    return np.linalg.qr(np.polynomial.legendre.legvander(middle, count - 1))[0]
