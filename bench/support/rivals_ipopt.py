"""IPOPT through CasADi on the problem of `rivals_problem`, with CasADi's exact derivatives.

The jaw's and target's numbers are parameters, so that one compiled program serves all scenes with
the same kinds of jaw and target; its making is not timed.
"""

from collections.abc import Sequence
from functools import lru_cache

import casadi as ca
import numpy as np

from support import rivals_problem as rp
from support import shooting
from support.ipopt_options import OPTIONS, WARM_START
from support.rivals import Answer, extrapolated

MOST_ITERATIONS = {"ipopt.max_iter": 500}


class IpoptRival:
    """IPOPT with `order` modes and one tolerance."""

    def __init__(self, case: shooting.ShootingCase, order: int, tolerance: float) -> None:
        self.case, self.tolerance, self.cold = case, tolerance, np.zeros(order + 1)
        self.problem = rp.jaw_problem(case, order)
        for feature in (rp.EDGE, rp.CORNER):
            self._solver(feature, False), self._solver(feature, True)

    def _solver(self, feature: int, warm: bool) -> ca.Function:
        numbers, order = self.problem.geometry, len(self.problem.end)
        sense = int(np.sign(numbers[rp.RHO]))
        return program(order, feature, sense, numbers[rp.RADIUS] > 0.0, self.tolerance, warm)

    def solve(self, feature: int, position: float, before: Sequence[np.ndarray]) -> Answer:
        """The contact at `position` (m) of this part; states are q and the multiplier."""
        place, start = position / self.case.length, extrapolated(before, self.cold)
        solver = self._solver(feature, bool(before))
        found = solver(
            x0=start[:-1],
            lam_g0=-start[-1],
            p=np.append(self.problem.geometry, place),
            lbg=0.0,
            ubg=np.inf,
        )
        stats, q = solver.stats(), np.array(found["x"]).ravel()
        multiplier = -float(found["lam_g"])
        pose = rp.tip_pose(self.problem, q)
        unit = rp.force_unit(self.case)
        force = unit * multiplier * rp.direction(self.problem, feature, place, pose)
        state = np.append(q, multiplier)
        return Answer(bool(stats["success"]), force, pose, int(stats["iter_count"]), state)


@lru_cache
def program(
    order: int, feature: int, sense: int, circle: bool, tolerance: float, warm: bool
) -> ca.Function:
    """The solver for one part of the jaw; `sense` of its arc: 1 convex, -1 concave, 0 straight."""
    problem = rp.jaw_problem(shooting.SNAPFIT_CIRCLE, order)  # the beam's arrays, of any jaw
    q, numbers = ca.SX.sym("q", order), ca.SX.sym("p", rp.PATH_Y + 2)
    psi = ca.mtimes(ca.DM(problem.slope), q)
    x, y = (ca.dot(ca.DM(problem.weights), turn(psi)) for turn in (ca.cos, ca.sin))
    tip = ca.dot(ca.DM(problem.end), q)
    cos, sin = ca.cos(tip), ca.sin(tip)
    ax, ay = numbers[rp.AX], numbers[rp.AY]
    if feature == rp.CORNER and not circle:
        gap = numbers[rp.PATH_Y] - y - (sin * ax + cos * ay)
    else:
        dx, dy = numbers[rp.PATH_Y + 1] - x, numbers[rp.PATH_Y] - y
        qx, qy = cos * dx + sin * dy, cos * dy - sin * dx
        if feature == rp.CORNER:
            gap = ca.sqrt((qx - ax) ** 2 + (qy - ay) ** 2)
        elif sense == 0:
            gap = numbers[rp.NX] * (qx - ax) + numbers[rp.NY] * (qy - ay)
        else:
            arm = ca.sqrt((qx - numbers[rp.MX]) ** 2 + (qy - numbers[rp.MY]) ** 2)
            gap = sense * arm - numbers[rp.RHO]
        gap -= numbers[rp.RADIUS]
    energy = ca.dot(q, ca.mtimes(ca.DM(problem.stiffness), q)) / 2
    options = (
        OPTIONS | MOST_ITERATIONS | {f"ipopt.{name}tol": tolerance for name in ("", "constr_viol_")}
    )
    options |= WARM_START if warm else {}
    return ca.nlpsol("jaw", "ipopt", {"x": q, "p": numbers, "f": energy, "g": gap}, options)
