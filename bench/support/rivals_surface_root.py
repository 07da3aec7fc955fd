"""SciPy's `root` and `least_squares` on the equilibrium of a finger in direct contact that slides.

The discretisation is that of `rivals_surface`. With friction there is no energy to minimise, but
where the touching nodes are known and all of them slide one way, the equilibrium is a square system
in z (2N) and a force for each touching node:

    D z = sum_j l_j (n_j + mu t_j) . dp_j/dz,    level_j(z) = 0,

with the level function's gradient n_j at the node's surface point p_j and t_j, n_j turned by a
right angle, in the direction in which the target drags the finger. The Jacobian is exact. Which
nodes touch is told at every position, and the whole answer at the first one (from an undeformed
finger these equations lead to a finger that the target has passed): both are the package's, with
the same N, and cost the rivals nothing.
"""

import time
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pandas as pd
from scipy.optimize import least_squares, root

from fastncm import Curve
from fastncm.scene import Pose, Scene
from support.rivals_surface import SurfaceRival

Method = Literal["root", "least_squares"]
ITERATIONS = 200
CLOSED = 1e2
"""Times the tolerance that a residual may have, ..."""
ROUNDING = 1e-11
"""... or this, whichever is larger."""


class SurfaceRoot:
    """One of the two methods for a scene with an ellipse at the finger's right side, and one
    tolerance. The base turns clockwise: the target drags the side towards the clamp."""

    def __init__(self, scene: Scene, method: Method, tolerance: float) -> None:
        self.model = SurfaceRival(scene, "SLSQP", tolerance)
        self.method, self.tolerance = method, tolerance
        self.mu = -scene.friction.mu

    def forces(self, x: np.ndarray, pose: Pose, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The forces on the finger at the touching nodes, x and y (A,)."""
        *_, dx, dy = self.model.places(x[: len(self.model.energies)], pose)
        a, b = self.model.axes
        nx, ny = dx[nodes] / a**2, dy[nodes] / b**2
        pressing = x[len(self.model.energies) :]
        return pressing * (nx + self.mu * ny), pressing * (ny - self.mu * nx)

    def residual(self, x: np.ndarray, pose: Pose, nodes: np.ndarray) -> np.ndarray:
        """Of the system above (2N + A,)."""
        model, n = self.model, len(self.model.energies)
        by_x, by_y = (slope[nodes] for slope in model.slopes(x[:n], pose))
        fx, fy = self.forces(x, pose, nodes)
        balance = model.energies * x[:n] - by_x.T @ fx - by_y.T @ fy
        return np.append(balance, model.level(x[:n], pose)[nodes])

    def jacobian(self, x: np.ndarray, pose: Pose, nodes: np.ndarray) -> np.ndarray:
        """Of the residual (2N + A, 2N + A)."""
        model, n = self.model, len(self.model.energies)
        c, s, cs, ss, dx, dy = model.places(x[:n], pose)
        a, b = model.axes
        slope_x, slope_y = model.slopes(x[:n], pose)
        by_x, by_y = slope_x[nodes], slope_y[nodes]
        nx, ny = dx[nodes] / a**2, dy[nodes] / b**2
        wx, wy = np.zeros(len(dx)), np.zeros(len(dx))
        wx[nodes], wy[nodes] = self.forces(x, pose, nodes)
        pressing = x[n:, None]
        turn_x = pressing * (by_x / a**2 + self.mu * by_y / b**2)
        turn_y = pressing * (by_y / b**2 - self.mu * by_x / a**2)
        axis = c * (model.sum.T @ wx) + s * (model.sum.T @ wy)
        side = model.half * (cs * wy - ss * wx)
        out = np.zeros((n + len(nodes), n + len(nodes)))
        out[:n, :n] = np.diag(model.energies) - by_x.T @ turn_x - by_y.T @ turn_y
        out[:n, :n] += model.theta.T @ (axis[:, None] * model.theta)
        out[:n, :n] -= model.sigma.T @ (side[:, None] * model.sigma)
        along_x, along_y = nx + self.mu * ny, ny - self.mu * nx
        out[:n, n:] = -(by_x.T * along_x + by_y.T * along_y)
        out[n:, :n] = nx[:, None] * by_x + ny[:, None] * by_y
        return out

    def solve(
        self, start: np.ndarray, pose: Pose, nodes: np.ndarray
    ) -> tuple[bool, np.ndarray, np.ndarray, int]:
        """Success, z and the nodes' forces, the force on the finger (2,) in N, evaluations."""
        scene = (pose, nodes)
        if self.method == "root":
            found = root(self.residual, start, scene, jac=self.jacobian, tol=self.tolerance)
        else:
            tight = dict.fromkeys(("ftol", "xtol", "gtol"), self.tolerance)
            found = least_squares(self.residual, start, self.jacobian, args=scene, method="lm",
                                  max_nfev=ITERATIONS, **tight)  # fmt: skip
        size = np.abs(found.fun).max()
        closed = size <= max(CLOSED * self.tolerance, ROUNDING)
        good = closed and bool((found.x[len(self.model.energies) :] >= 0.0).all())
        total = self.model.unit * np.array([one.sum() for one in self.forces(found.x, *scene)])
        return bool(good), found.x, total, int(found.nfev)

    def unknowns(self, curve: Curve, pose: Pose) -> np.ndarray:
        """z of the package's first row."""
        shape = curve.shape(0)
        axis = np.unwrap(np.arctan2(np.diff(shape["y_m"]), np.diff(shape["x_m"])))
        angles = np.append(axis, shape["psi_rad"].to_numpy()[1:]) - pose.base_angle
        fields = np.vstack([self.model.theta, self.model.sigma])
        return np.asarray(np.linalg.lstsq(fields, angles)[0])

    def usual(self, z: np.ndarray, pose: Pose, nodes: np.ndarray) -> float:
        """The force on a node that balances the finger best where all nodes have the same."""
        n = len(z)
        push = -self.residual(np.append(z, np.ones(len(nodes))), pose, nodes)[:n]
        push += self.model.energies * z
        return float(push @ (self.model.energies * z) / (push @ push))

    def follow(self, poses: Sequence[Pose], curve: Curve) -> pd.DataFrame:
        """One row per pose, each from the solution before: success, forces, CPU seconds.

        curve: the package's answers at the poses, of which each row's touching nodes are told, and
        the first row.
        """
        n = len(self.model.energies)
        z, pressing, rows = self.unknowns(curve, poses[0]), np.zeros(n // 2), []
        for i, pose in enumerate(poses):
            nodes = touching_nodes(curve, i)
            begin = time.process_time()
            known = pressing[nodes] > 0.0
            usual = pressing[nodes][known].mean() if known.any() else self.usual(z, pose, nodes)
            first = np.where(known, pressing[nodes], usual)
            success, x, force, count = self.solve(np.append(z, first), pose, nodes)
            seconds = time.process_time() - begin
            if success:
                z, pressing = x[:n], np.zeros(n // 2)
                pressing[nodes] = x[n:]
            else:
                force = np.array([np.nan, np.nan])
            rows.append((success, *force, count, seconds))
        columns = ["success", "force_x_N", "force_y_N", "iterations", "seconds"]
        return pd.DataFrame(rows, columns=columns)


def touching_nodes(curve: Curve, row: int) -> np.ndarray:
    """The nodes that touch in a row, from 0: the first behind the clamp."""
    s = curve.contacts(row)["s_m"].to_numpy(dtype=float)
    scene = curve.scene
    return np.round(s / scene.finger.length * scene.solver.intervals).astype(int) - 1
