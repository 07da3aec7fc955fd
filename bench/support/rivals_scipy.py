"""SciPy's SLSQP and trust-constr on the problem of `rivals_problem`, with exact derivatives.

SLSQP gets a Legendre basis, whose H is the unit matrix that it starts its BFGS updates from;
trust-constr also exact second derivatives. Both start from the parabola through the last three
solutions.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.optimize import NonlinearConstraint, minimize

from support import rivals_problem as rp
from support import shooting
from support.rivals import Answer, extrapolated

Method = Literal["SLSQP", "trust-constr"]
ITERATIONS = {"SLSQP": 200, "trust-constr": 2000}


class SciPyRival:
    """One of the two methods, with `order` modes and one tolerance."""

    def __init__(
        self, case: shooting.ShootingCase, method: Method, order: int, tolerance: float
    ) -> None:
        self.case, self.method, self.tolerance = case, method, tolerance
        self.problem = rp.jaw_problem(case, order)
        self.cold = np.zeros(order)

    def solve(self, feature: int, position: float, before: Sequence[np.ndarray]) -> Answer:
        """The contact at `position` (m) of this part of the jaw."""
        problem, place = self.problem, position / self.case.length
        start = extrapolated(before, self.cold)
        run = self._slsqp if self.method == "SLSQP" else self._trust_constr
        found, multiplier = run(start, (*problem[1:], feature, place))
        pose = rp.tip_pose(problem, found.x)
        force = rp.force_unit(self.case) * multiplier * rp.direction(problem, feature, place, pose)
        return Answer(bool(found.success), force, pose, int(found.nit), found.x)

    def _slsqp(self, start: np.ndarray, scene: tuple) -> tuple:
        found = minimize(
            rp.energy,
            start,
            args=(self.problem.stiffness,),
            method="SLSQP",
            jac=rp.energy_gradient,
            constraints={"type": "ineq", "fun": rp.gap, "jac": rp.gap_gradient, "args": scene},
            options={"ftol": self.tolerance, "maxiter": ITERATIONS["SLSQP"]},
        )
        return found, found.multipliers[0]

    def _trust_constr(self, start: np.ndarray, scene: tuple) -> tuple:
        outside = NonlinearConstraint(
            lambda q: rp.gap(q, *scene),
            0.0,
            np.inf,
            jac=lambda q: rp.gap_gradient(q, *scene)[None, :],
            hess=lambda q, v: v[0] * rp.gap_hessian(q, *scene),
        )
        found = minimize(
            rp.energy,
            start,
            args=(self.problem.stiffness,),
            method="trust-constr",
            jac=rp.energy_gradient,
            hess=lambda q, stiffness: stiffness,
            constraints=outside,
            options={
                **dict.fromkeys(("gtol", "xtol", "barrier_tol"), self.tolerance),
                "maxiter": ITERATIONS["trust-constr"],
            },
        )
        return found, -found.v[0][0]
