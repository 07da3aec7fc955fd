"""SciPy's SLSQP and trust-constr on a finger in direct contact with an ellipse.

The discretisation is the package's and `ipopt_baseline.py`'s (see there): psi at nodes, gamma at
midpoints, N level functions >= 0. Written out densely: with theta = phi + A z and the section's
angle sigma = phi + P z, where z are the unknowns in which the energy is V = 1/2 z.z (the unit
matrix that SLSQP starts its updates from), places and all derivatives are products of matrices,
which BLAS does. Only the scene's description is taken from the package.

`printed` is the shear energy of the paper's (5) instead: gamma at nodes, the mean of neighbours
squared, the axis summed up by the trapezoidal rule. An alternating gamma then has no energy, but
shortens the axis. (The energy is 1/2 z.Dz there, with a 0 for that mode in the diagonal matrix D.)
"""

import time
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pandas as pd
from scipy.linalg import block_diag, eigh
from scipy.optimize import NonlinearConstraint, minimize

from fastncm.scene import Pose, Scene
from support.profiles_of_thickness import mean_thickness

Method = Literal["SLSQP", "trust-constr"]
ITERATIONS = {"SLSQP": 500, "trust-constr": 3000}
ROUNDING = 1e-13
"""Of an eigenvalue, relative to the largest."""


class SurfaceRival:
    """One of the two methods for a scene with an ellipse, and one tolerance."""

    def __init__(
        self, scene: Scene, method: Method, tolerance: float, printed: bool = False
    ) -> None:
        assert scene.target.shape == "ellipse" and scene.model.shear
        finger, n = scene.finger, scene.solver.intervals
        self.scene, self.method, self.tolerance = scene, method, tolerance
        h, self.length = 1.0 / n, finger.length
        stations = np.array(finger.stations).T
        places = stations[0] / self.length, stations[1]
        bent, sheared = (mean_thickness(np.array(places), n, power) for power in (3, 1))
        node = np.interp(np.arange(1, n + 1) * h * self.length, *stations)
        clamp = stations[1, 0]
        self.unit = finger.young * finger.width * clamp**3 / 12.0 / self.length**2
        modulus = finger.shear_modulus or finger.young / (2 * (1 + finger.poisson))
        shear = finger.shear_correction * modulus * finger.width * sheared / self.unit
        self.half = node / (2 * self.length) * (1.0 if finger.side == "right" else -1.0)
        self.axes = np.array(scene.target.semi_axes) / self.length
        self.offset = finger.offset / self.length

        mean = 0.5 * (np.eye(n) + np.eye(n, k=-1))  # psi_0 = 0
        change = np.eye(n) - np.eye(n, k=-1)
        bending = change.T @ ((bent / clamp)[:, None] ** 3 / h * change)
        if printed:
            means = 0.5 * (np.eye(n, n + 1) + np.eye(n, n + 1, k=1))
            shearing = means.T @ ((shear * h)[:, None] * means)
            nodal = np.vstack([np.zeros((1, n)), np.eye(n)])
            theta, self.sum = (
                np.hstack([nodal, np.eye(n + 1)]),
                h * np.tril(np.ones((n, n))) @ means,
            )
        else:
            shearing = np.diag(shear * h)
            theta, self.sum = np.hstack([mean, np.eye(n)]), h * np.tril(np.ones((n, n)))
        values, vectors = eigh(block_diag(bending, shearing))
        self.energies = (values > ROUNDING * values.max()).astype(float)  # D
        to_fields = vectors / np.sqrt(np.where(self.energies > 0.0, values, 1.0))
        self.theta, self.sigma = theta @ to_fields, to_fields[:n]
        self.seen: tuple[bytes, tuple] = (b"", ())

    def places(self, z: np.ndarray, pose: Pose) -> tuple[np.ndarray, ...]:
        """cos and sin of theta and sigma, and the touching points seen from the target (N,)."""
        key = z.tobytes() + np.array(pose).tobytes()
        if key != self.seen[0]:  # function and derivatives are asked for at the same z
            theta, sigma = pose.base_angle + self.theta @ z, pose.base_angle + self.sigma @ z
            c, s, cs, ss = np.cos(theta), np.sin(theta), np.cos(sigma), np.sin(sigma)
            x = self.offset * np.cos(pose.base_angle) + self.sum @ c + self.half * ss
            y = self.offset * np.sin(pose.base_angle) + self.sum @ s - self.half * cs
            dx, dy = x - pose.target_x / self.length, y - pose.target_y / self.length
            self.seen = key, (c, s, cs, ss, dx, dy)
        return self.seen[1]

    def level(self, z: np.ndarray, pose: Pose) -> np.ndarray:
        """(N,): positive outside the ellipse."""
        *_, dx, dy = self.places(z, pose)
        a, b = self.axes
        return ((dx / a) ** 2 + (dy / b) ** 2 - 1.0) / 2.0

    def slopes(self, z: np.ndarray, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Of the points' x and y by z, (N, 2N) each."""
        c, s, cs, ss, _, _ = self.places(z, pose)
        by_x = -self.sum @ (s[:, None] * self.theta) + (self.half * cs)[:, None] * self.sigma
        by_y = self.sum @ (c[:, None] * self.theta) + (self.half * ss)[:, None] * self.sigma
        return by_x, by_y

    def jacobian(self, z: np.ndarray, pose: Pose) -> np.ndarray:
        """Of the level functions (N, 2N)."""
        *_, dx, dy = self.places(z, pose)
        a, b = self.axes
        by_x, by_y = self.slopes(z, pose)
        return (dx / a**2)[:, None] * by_x + (dy / b**2)[:, None] * by_y

    def hessian(self, z: np.ndarray, v: np.ndarray, pose: Pose) -> np.ndarray:
        """Of sum v_j level_j (2N, 2N)."""
        c, s, cs, ss, dx, dy = self.places(z, pose)
        a, b = self.axes
        by_x, by_y = self.slopes(z, pose)
        wx, wy = v * dx / a**2, v * dy / b**2
        axis = c * (self.sum.T @ wx) + s * (self.sum.T @ wy)
        side = self.half * (cs * wy - ss * wx)
        return (
            by_x.T @ ((v / a**2)[:, None] * by_x)
            + by_y.T @ ((v / b**2)[:, None] * by_y)
            - self.theta.T @ (axis[:, None] * self.theta)
            + self.sigma.T @ (side[:, None] * self.sigma)
        )

    def solve(self, start: np.ndarray, pose: Pose) -> tuple[bool, np.ndarray, np.ndarray, int]:
        """Success in its own words, z, the force on the finger (2,) in N, iterations."""
        d = self.energies
        common = {"fun": lambda z: 0.5 * z @ (d * z), "x0": start, "jac": lambda z: d * z}
        most = {"maxiter": ITERATIONS[self.method]}
        if self.method == "SLSQP":
            outside = {"type": "ineq", "fun": self.level, "jac": self.jacobian, "args": (pose,)}
            options = {"ftol": self.tolerance} | most
            found = minimize(**common, method="SLSQP", constraints=outside, options=options)
            pressing = found.multipliers
        else:
            limits = NonlinearConstraint(
                lambda z: self.level(z, pose),
                0.0,
                np.inf,
                jac=lambda z: self.jacobian(z, pose),
                hess=lambda z, v: self.hessian(z, v, pose),
            )
            bent = np.diag(d)
            options = dict.fromkeys(("gtol", "xtol", "barrier_tol"), self.tolerance) | most
            found = minimize(
                **common,
                method="trust-constr",
                hess=lambda z: bent,
                constraints=limits,
                options=options,
            )
            pressing = -found.v[0]
        *_, dx, dy = self.places(found.x, pose)
        a, b = self.axes
        force = self.unit * np.array([pressing @ (dx / a**2), pressing @ (dy / b**2)])
        return bool(found.success), found.x, force, int(found.nit)

    def follow(self, poses: Sequence[Pose], cap: float = np.inf) -> pd.DataFrame:
        """One row per pose, each from the solution before: success, forces, CPU seconds.

        The first start is the undeformed finger. Once one solve has taken more than `cap` seconds
        the rest is given up, as failures without time.
        """
        rows, z, given_up = [], np.zeros(len(self.energies)), False
        for pose in poses:
            if given_up:
                rows.append((False, np.nan, np.nan, 0, np.nan))
                continue
            begin = time.process_time()
            success, found, force, iterations = self.solve(z, pose)
            seconds = time.process_time() - begin
            given_up = seconds > cap
            success = success and not given_up
            z = found if success else z
            force = force if success else np.array([np.nan, np.nan])
            rows.append((success, *force, iterations, seconds))
        columns = ["success", "force_x_N", "force_y_N", "iterations", "seconds"]
        return pd.DataFrame(rows, columns=columns)
