"""Direct contact through CasADi and IPOPT: an independent answer, and the yardstick of the speed.

The scene's description is the only thing taken from the package. The discretisation is the same:
nodes i = 0 ... N, equal intervals h = L/N; psi_i at nodes (psi_0 = phi), gamma_i at midpoints,

    r_i = r_(i-1) + h (cos, sin)((psi_(i-1) + psi_i)/2 + gamma_i),   r_0 = offset (cos, sin)(phi),
    V   = 1/2 sum_i [E I (psi_i - psi_(i-1))^2 / h + kappa G A h gamma_i^2],  1/I, 1/A means,
    p_i = r_i +- w_i/2 (sin, -cos)(section_i),                        + for the right side,

and every p_i but the clamp's, which cannot move, stays outside the target: a level function
(ellipse, circle) or a distance (half-plane) >= 0. The section turns by psi_i, or as printed by
psi_i and the mean of gamma on both sides of the node (at the tip, of the last interval). IPOPT's
multipliers times the level function's gradients are the contact forces on the finger.

Two forms: "sparse" keeps the positions r_i as variables, which IPOPT solves five times as fast;
"reduced" writes them out as sums, as one would at first, with dense derivatives.
"""

import math
import time
from collections.abc import Sequence
from typing import Literal

import casadi as ca
import numpy as np
import pandas as pd
from support.ipopt_options import OPTIONS, WARM_START
from support.profiles_of_thickness import mean_thickness

from fastncm.scene import Scene

Form = Literal["sparse", "reduced"]

TOLERANCE = 1e-11
#: A node touches where its multiplier exceeds this part of the largest one: IPOPT's are never 0.
TOUCHING = 1e-4


class Baseline:
    """A scene of direct contact for IPOPT, dimensionless: lengths by L, forces by E I(0)/L^2."""

    def __init__(self, scene: Scene, form: Form = "sparse", tolerance: float = TOLERANCE) -> None:
        finger = scene.finger
        self.scene, self.length, self.intervals = scene, finger.length, scene.solver.intervals
        n, h = self.intervals, 1.0 / self.intervals
        thickness = np.array(finger.stations).T
        thickness[0] /= finger.length
        clamp = thickness[1, 0]
        stiffness = finger.young * finger.width * clamp**3 / 12.0
        self.force = stiffness / finger.length**2
        bent, sheared = mean_thickness(thickness, n, 3), mean_thickness(thickness, n, 1)

        phi, target_x, target_y = (ca.MX.sym(name) for name in ("phi", "x", "y"))
        psi, gamma, x, y = (ca.MX.sym(name, n) for name in ("psi", "gamma", "x", "y"))
        nodal = ca.vertcat(phi, psi)
        theta = (nodal[:-1] + nodal[1:]) / 2 + gamma
        cos, sin = ca.cos(theta), ca.sin(theta)
        energy = ca.sum1((bent / clamp) ** 3 * (nodal[1:] - nodal[:-1]) ** 2) / (2 * h)
        if scene.model.shear:
            modulus = finger.shear_modulus or finger.young / (2 * (1 + finger.poisson))
            shear = finger.shear_correction * modulus * finger.width * sheared / self.force
            energy += ca.sum1(shear * gamma**2) * h / 2
        start = ca.vertcat(ca.cos(phi), ca.sin(phi)) * (finger.offset / finger.length)
        fields = [psi, gamma] if scene.model.shear else [psi]
        if form == "sparse":
            fields += [x, y]
            steps = [
                axis - ca.vertcat(start[k], axis[:-1]) - h * direction
                for k, axis, direction in ((0, x, cos), (1, y, sin))
            ]
            equal = ca.vertcat(*steps)
        else:
            x, y = start[0] + h * ca.cumsum(cos), start[1] + h * ca.cumsum(sin)
            equal = ca.MX(0, 1)
        if not scene.model.shear:  # a constant in its place
            x, y, equal, energy = ca.graph_substitute(
                [x, y, equal, energy], [gamma], [ca.MX.zeros(n)]
            )

        section = psi
        if scene.model.section == "psi+gamma":
            section += ca.vertcat((gamma[:-1] + gamma[1:]) / 2, gamma[-1])
        half = np.interp(np.arange(1, n + 1) * h, *thickness) / (2 * finger.length)
        half *= 1.0 if finger.side == "right" else -1.0
        half *= scene.model.surface == "side"
        px, py = x + half * ca.sin(section), y - half * ca.cos(section)
        gap, nx, ny = self._level(px - target_x, py - target_y)

        self.variables, self.equations = ca.vertcat(*fields), equal.shape[0]
        self.parameters = ca.vertcat(phi, target_x, target_y)
        problem = {
            "x": self.variables,
            "p": self.parameters,
            "f": energy,
            "g": ca.vertcat(equal, gap),
        }
        options = OPTIONS | {f"ipopt.{name}tol": tolerance for name in ("", "constr_viol_")}
        self.cold = ca.nlpsol("cold", "ipopt", problem, options)
        self.warm = ca.nlpsol("warm", "ipopt", problem, options | WARM_START)
        self.state = ca.Function(
            "state", [self.variables, self.parameters], [px, py, nx, ny, x, y, psi]
        )
        self.form = form

    def _level(self, dx: ca.MX, dy: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX]:
        """A function that is positive outside the target, and its gradient."""
        target = self.scene.target
        cos, sin = math.cos(target.tilt), math.sin(target.tilt)
        if target.shape == "half-plane":
            return -sin * dx + cos * dy, ca.MX(-sin), ca.MX(cos)
        if target.shape == "circle":
            a = b = target.radius / self.length
        else:
            a, b = (axis / self.length for axis in target.semi_axes)
        u, v = cos * dx + sin * dy, -sin * dx + cos * dy
        nu, nv = u / a**2, v / b**2
        return ((u / a) ** 2 + (v / b) ** 2 - 1) / 2, cos * nu - sin * nv, sin * nu + cos * nv

    def straight(self, phi: float) -> np.ndarray:
        """The variables of the undeformed finger."""
        n = self.intervals
        along = self.scene.finger.offset / self.length + np.arange(1, n + 1) / n
        parts = [np.full(n, phi)] + [np.zeros(n)] * self.scene.model.shear
        if self.form == "sparse":
            parts += [along * math.cos(phi), along * math.sin(phi)]
        return np.concatenate(parts)

    def solve_path(self, poses: Sequence[tuple[float, float, float]]) -> pd.DataFrame:
        """One row per pose (target's x and y in m, base's angle in rad), each from the last."""
        rows = []
        last = None
        n, m = self.intervals, self.equations
        for target_x, target_y, phi in poses:
            given = {
                "x0": self.straight(phi) if last is None else last["x"],
                "p": [phi, target_x / self.length, target_y / self.length],
                "lbg": np.zeros(m + n),
                "ubg": np.concatenate([np.zeros(m), np.full(n, np.inf)]),
            }
            if last is not None:
                given |= {"lam_g0": last["lam_g"], "lam_x0": last["lam_x"]}
            solver = self.cold if last is None else self.warm
            begin = time.process_time()
            last = solver(**given)
            seconds = time.process_time() - begin
            rows.append(
                self._row(last, given["p"])
                | {
                    "success": solver.stats()["success"],
                    "iterations": solver.stats()["iter_count"],
                    "seconds": seconds,
                }
            )
        return pd.DataFrame(rows)

    def _row(self, answer: dict[str, ca.DM], given: list[float]) -> dict[str, float]:
        """The solution in SI units."""
        values = [np.array(value).ravel() for value in self.state(answer["x"], given)]
        nx, ny, x, y, psi = values[2:]
        multipliers = -np.array(answer["lam_g"]).ravel()[self.equations :]
        touching = np.flatnonzero(multipliers > TOUCHING * multipliers.max())
        if multipliers.sum() < 1e-7:  # what the barrier leaves where nothing touches
            touching = touching[:0]
        s = (touching + 1) * self.length / self.intervals
        return {
            "base_rad": given[0],
            "target_x_m": given[1] * self.length,
            "target_y_m": given[2] * self.length,
            "force_x_N": float(multipliers @ (nx * np.ones_like(multipliers))) * self.force,
            "force_y_N": float(multipliers @ (ny * np.ones_like(multipliers))) * self.force,
            "energy_J": float(answer["f"]) * self.force * self.length,
            "touching": len(touching),
            "s_from_m": s[0] if len(s) else math.nan,
            "s_to_m": s[-1] if len(s) else math.nan,
            "tip_x_m": x[-1] * self.length,
            "tip_y_m": y[-1] * self.length,
            "tip_angle_rad": psi[-1],
        }
