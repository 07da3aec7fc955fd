"""A finger in direct contact in plain NumPy with dense matrices: what the O(N) code is tested with.

Unknowns u: psi_1 ... psi_N, then gamma_1 ... gamma_N where the finger shears. Contact points are
those of a `kernels.nodal` problem and state, from which only the placement, the forces and which
section a target's point acts on are taken.
"""

from dataclasses import dataclass

import numpy as np
from entrance import entrance

from fastncm.kernels import distance as distances
from fastncm.kernels.nodal import Nodal, NodalProblem

STEP = 1e-5
distance = entrance(distances.distance)


@dataclass(frozen=True)
class Dense:
    """Finger 0 of `problem`; place: (3,) of the target; mu: of sliding friction."""

    problem: NodalProblem
    state: Nodal
    place: tuple[float, float, float]

    @property
    def intervals(self) -> int:
        return len(self.problem.step)

    @property
    def shears(self) -> bool:
        return bool(self.problem.shear_flexibility.max() > 0.0)

    def unknowns(self) -> np.ndarray:
        """u of the state."""
        fields = [self.state.psi[1:], self.state.gamma[1:]]
        return np.concatenate(fields[: 1 + self.shears])

    def angles(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """psi (N + 1,) and theta (N,)."""
        n = self.intervals
        psi = np.concatenate([[0.0], u[:n]])
        gamma = u[n:] if self.shears else np.zeros(n)
        return psi, 0.5 * (psi[1:] + psi[:-1]) + gamma

    def nodes(self, u: np.ndarray) -> np.ndarray:
        """(N + 1, 2)."""
        _, theta = self.angles(u)
        steps = self.problem.step[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
        return np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])

    def energy(self, u: np.ndarray) -> float:
        psi, _ = self.angles(u)
        energy = 0.5 * float(self.problem.bending[0] @ np.diff(psi) ** 2)
        if self.shears:
            energy += 0.5 * float(
                (u[self.intervals :] ** 2 / self.problem.shear_flexibility[0]).sum()
            )
        return energy

    def energy_slope(self, u: np.ndarray) -> np.ndarray:
        """dV/du."""
        psi, _ = self.angles(u)
        moment = self.problem.bending[0] * np.diff(psi)
        slope = moment - np.append(moment[1:], 0.0)
        if self.shears:
            slope = np.append(slope, u[self.intervals :] / self.problem.shear_flexibility[0])
        return slope

    def section_angle(self, u: np.ndarray, j: int) -> float:
        """psi_j, as printed with the mean of gamma on both sides of the node."""
        psi, n = self.angles(u)[0], self.intervals
        if not self.problem.printed_section or not self.shears or j == 0:
            return float(psi[j])
        return float(psi[j] + 0.5 * (u[n + j - 1] + u[n + min(j, n - 1)]))

    def turn(self, j: int) -> np.ndarray:
        """Derivative of the section's angle by u."""
        n = self.intervals
        row = np.zeros(n * (1 + self.shears))
        if j > 0:
            row[j - 1] = 1.0
            if self.problem.printed_section and self.shears:
                row[n + j - 1] += 0.5
                row[n + min(j, n - 1)] += 0.5
        return row

    def move(self, u: np.ndarray, j: int) -> np.ndarray:
        """d r_j / du (2, U)."""
        _, theta = self.angles(u)
        n = self.intervals
        out = np.zeros((2, n * (1 + self.shears)))
        for i in range(j):
            across = self.problem.step[i] * np.array([-np.sin(theta[i]), np.cos(theta[i])])
            out[:, i] += 0.5 * across
            if i > 0:
                out[:, i - 1] += 0.5 * across
            if self.shears:
                out[:, n + i] += across
        return out

    def contact(self, u: np.ndarray, k: int) -> tuple[np.ndarray, float, np.ndarray]:
        """Place, gap and normal of contact point `k`: a node, a corner, or a target's point."""
        n, state = self.intervals, self.state
        nodes, j = self.nodes(u), int(state.node[k])
        along, outward = section(self.section_angle(u, j))
        x, y, angle = self.place
        turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        if k <= n + 1:
            point = nodes[j] + self.problem.offset[0, k] * outward
            q = turned.T @ (point - [x, y])
            g, nx, ny, _ = distance(self.problem.shape, self.problem.vertices, 0, *q)
            return point, float(g), turned @ [nx, ny]
        point = np.array([x, y]) + turned @ self.problem.points[0, k - n - 2]
        side = 1.0 if self.problem.left else -1.0
        thick, slope, bend = self.side(u, j)
        a, height = (point - nodes[j]) @ along, side * (point - nodes[j]) @ outward
        steep = slope + bend * a
        scale = 1.0 / np.hypot(1.0, steep)
        gap = (height - thick - slope * a - 0.5 * bend * a * a) * scale
        return point, float(gap), (steep * along - side * outward) * scale

    def steepness(self, u: np.ndarray, k: int) -> float:
        """Slope of the side against the section's normal at a target's point; 0 of others."""
        if k <= self.intervals + 1:
            return 0.0
        j = int(self.state.node[k])
        a = (self.contact(u, k)[0] - self.nodes(u)[j]) @ section(self.section_angle(u, j))[0]
        _, slope, bend = self.side(u, j)
        return float(slope + bend * a)

    def side(self, u: np.ndarray, j: int) -> tuple[float, float, float]:
        """Half thickness, slope and bend of the finger's side about section `j`, seen from outside;
        without shear with the bending of the state."""
        problem, n = self.problem, self.intervals
        side = 1.0 if problem.left else -1.0
        low, high = max(j - 1, 0), min(j + 1, n)
        span = problem.arc[high] - problem.arc[low]
        thick = side * problem.offset[0, j]
        taper = side * (problem.offset[0, high] - problem.offset[0, low]) / span
        psi, gamma = self.angles(u)[0] if self.shears else self.state.psi, 0.0
        curvature = side * (psi[high] - psi[low]) / span
        if self.shears and not problem.printed_section:
            gamma = 0.5 * (u[n + max(j, 1) - 1] + u[n + high - 1])
        advance = np.cos(gamma) - curvature * thick  # along the section's normal, a unit of axis
        return thick, (taper + side * np.sin(gamma)) / advance, curvature / advance

    def gap_slope(self, u: np.ndarray, k: int) -> np.ndarray:
        """(U,) derivative of the gap at contact `k`; what scales a height over the side to a gap is
        held fixed."""
        if k <= self.intervals + 1 or not self.shears:
            return self.direction(u, k, 0.0)

        def height(v: np.ndarray) -> np.ndarray:
            return np.array(self.contact(v, k)[1] * np.hypot(1.0, self.steepness(v, k)))

        slope: np.ndarray = differences(height, u) / np.hypot(1.0, self.steepness(u, k))
        return slope

    def direction(self, u: np.ndarray, k: int, ratio: float) -> np.ndarray:
        """(U,) virtual work of a unit normal force with its friction at contact `k`."""
        point, _, normal = self.contact(u, k)
        force = normal + ratio * np.array([-normal[1], normal[0]])
        j = int(self.state.node[k])
        arm = point - self.nodes(u)[j]
        return force @ self.move(u, j) + (arm[0] * force[1] - arm[1] * force[0]) * self.turn(j)

    def tangent(self, u: np.ndarray, k: int) -> np.ndarray:
        """(U,) virtual work of a unit force along t at contact `k`."""
        return self.direction(u, k, 1.0) - self.direction(u, k, 0.0)

    def load(self, u: np.ndarray, forces: np.ndarray, ratios: np.ndarray) -> np.ndarray:
        """(U,) of all contacts."""
        loads = [forces[k] * self.direction(u, k, ratios[k]) for k in np.flatnonzero(forces)]
        return sum(loads, np.zeros_like(u))

    def hessian(self, u: np.ndarray, forces: np.ndarray, ratios: np.ndarray) -> np.ndarray:
        """Derivative of dV/du less the load by central differences (U, U)."""

        def out_of_balance(v: np.ndarray) -> np.ndarray:
            return self.energy_slope(v) - self.load(v, forces, ratios)

        return differences(out_of_balance, u)


def section(psi: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors along the axis and to its left."""
    return np.array([np.cos(psi), np.sin(psi)]), np.array([-np.sin(psi), np.cos(psi)])


def differences(function, u: np.ndarray) -> np.ndarray:
    """Jacobian of `function` by central differences."""
    columns = []
    for i in range(len(u)):
        change = STEP * np.eye(len(u))[i]
        columns.append((function(u + change) - function(u - change)) / (2.0 * STEP))
    return np.stack(columns, axis=-1)
