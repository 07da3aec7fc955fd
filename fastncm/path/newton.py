"""Newton's method on the equilibrium with one working contact, for all lanes at once.

    u - J(u)^T (lambda a + rub tau) = 0,    g(u; t) = 0,    rub = side lambda, or no slip

Without friction (rub = 0) these are the KKT conditions of the minimum, and this is the SQP
(`sqp.solve`) where its active set is settled: along a path the smallest gap is the one that is
active, and the predictor starts inside the region of quadratic convergence. What does not converge
here, or comes out with a pulling force, goes to the SQP (`path.careful`). The contact's own part is
in `path.tip`, whether it slides or sticks in `path.stick`.
"""

from fastncm.kernels import constants as c
from fastncm.kernels import rod, symmetric
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import closest_gap, store
from fastncm.kernels.trig import sincos
from fastncm.path import tip
from fastncm.path.lanes import AS_STORED
from fastncm.path.slip import slip

#: The penalty's stiffness over that of the finger against the contact, which is near 1 / |A|^2.
_PENALTY = 10.0


@inner
def evaluate(problem, lanes):
    """Pose, smallest gap, its gradient and the residual of every active lane, from `u`, `force`,
    `rub` and `t`.

    The residual is that of `sqp.solve.kkt_residual` for one loaded constraint, with the friction
    force and a slip that should not be; it depends on nothing else that the solver keeps.
    """
    basis, rule = lanes.basis, problem.rule
    modes = lanes.u.shape[0]
    rod.tip_pose(basis.slope, basis.end, rule.weights, lanes.u, lanes.sin, lanes.cos, lanes.pose)
    rod.pose_gradient(basis.slope, rule.weights, lanes.sin, lanes.cos, lanes.gradient)
    for lane in range(LANES):
        lanes.fx[lane], lanes.fy[lane] = sincos(lanes.pose[2, lane])
    for lane in range(LANES):
        if lanes.active[lane] and lanes.hold[lane] != AS_STORED:
            d = lanes.design[lane]
            gap = closest_gap(
                problem.kind,
                lanes.hold[lane],
                problem.jaw,
                problem.target,
                d,
                lanes.t[lane],
                lanes.pose[0, lane],
                lanes.pose[1, lane],
                lanes.fy[lane],
                lanes.fx[lane],
            )
            store(gap, lanes.gap, lane)
    for k in range(modes):
        for lane in range(LANES):
            lanes.jacobian[k, lane] = (
                lanes.gap[c.GX, lane] * lanes.gradient[0, k, lane]
                + lanes.gap[c.GY, lane] * lanes.gradient[1, k, lane]
                + lanes.gap[c.GP, lane] * basis.end[k, lane]
            )
    if lanes.rubs[0]:
        _tangent(problem, lanes)
    # stationarity over the largest unknown, gap over the deflection A u of the contact
    largest, slack, moved = lanes.fx, lanes.fy, lanes.moved
    for lane in range(LANES):
        largest[lane] = 0.0
        slack[lane] = 0.0
        moved[lane] = 0.0
    for k in range(modes):
        for lane in range(LANES):
            lanes.down[k, lane] = lanes.u[k, lane] - lanes.jacobian[k, lane] * lanes.force[lane]
        if lanes.rubs[0]:
            for lane in range(LANES):
                lanes.down[k, lane] -= lanes.rub[lane] * (
                    lanes.tangent[0, lane] * lanes.gradient[0, k, lane]
                    + lanes.tangent[1, lane] * lanes.gradient[1, k, lane]
                    + lanes.tangent[2, lane] * basis.end[k, lane]
                )
        for lane in range(LANES):
            largest[lane] = max(largest[lane], abs(lanes.u[k, lane]))
        for lane in range(LANES):
            slack[lane] = max(slack[lane], abs(lanes.down[k, lane]))
        for lane in range(LANES):
            moved[lane] += lanes.jacobian[k, lane] * lanes.u[k, lane]
    for lane in range(LANES):
        stationarity = slack[lane] / max(largest[lane], c.GAP_ROUNDING)
        deflection = max(abs(moved[lane]), c.GAP_ROUNDING)
        contact = abs(lanes.gap[c.GAP, lane]) / deflection
        lanes.residual[lane] = max(stationarity, contact)
        if lanes.holds[0] and lanes.sticks[lane]:
            crept = abs(lanes.slipped[lane] - lanes.anchor[lane]) / deflection
            lanes.residual[lane] = max(lanes.residual[lane], crept)


@inlined
def _tangent(problem, lanes):
    """The contact's arm and the wrench of a unit force along its tangent; the slip of the lanes
    that stick."""
    gap = lanes.gap
    for lane in range(LANES):
        lanes.arm[0, lane] = gap[c.PX, lane] - lanes.pose[0, lane]
    for lane in range(LANES):
        lanes.arm[1, lane] = gap[c.PY, lane] - lanes.pose[1, lane]
    for lane in range(LANES):
        lanes.tangent[0, lane] = -gap[c.GY, lane]
    for lane in range(LANES):
        lanes.tangent[1, lane] = gap[c.GX, lane]
    for lane in range(LANES):
        lanes.tangent[2, lane] = (
            lanes.arm[0, lane] * gap[c.GX, lane] + lanes.arm[1, lane] * gap[c.GY, lane]
        )
    for lane in range(LANES):  # the place on the jaw, where the gap gives that on the target
        on_target = gap[c.FEATURE, lane] <= c.FAR_RETURN
        lanes.tangent[2, lane] += gap[c.GAP, lane] if on_target else 0.0
    if lanes.holds[0]:
        for lane in range(LANES):
            if lanes.active[lane] and lanes.sticks[lane]:
                lanes.slipped[lane] = slip(problem, lanes, lane)


@inner
def factorise(problem, lanes):
    """Factor of the modes' Hessian under the force as it stands, and the tip's flexibility.

    Overwrites hessian, and for the pending lanes penalty (w), leaned (a0), across (W) and flexible
    (C) of `path.tip`.
    """
    modes = lanes.u.shape[0]
    gap, penalty = lanes.gap, lanes.fx
    for lane in range(LANES):
        penalty[lane] = 0.0
    for k in range(modes):
        for lane in range(LANES):
            penalty[lane] += lanes.jacobian[k, lane] * lanes.jacobian[k, lane]
    for lane in range(LANES):
        penalty[lane] = _PENALTY / penalty[lane]
    for k in range(modes):
        for j in range(k + 1):
            unit = 1.0 if j == k else 0.0
            for lane in range(LANES):
                lanes.hessian[k, j, lane] = (
                    unit + penalty[lane] * lanes.jacobian[k, lane] * lanes.jacobian[j, lane]
                )
    for lane in range(LANES):
        lanes.penalty[lane] = penalty[lane] if lanes.pending[lane] else lanes.penalty[lane]
    for i in range(3):
        for lane in range(LANES):
            kept = lanes.leaned[i, lane]
            lanes.leaned[i, lane] = gap[c.GX + i, lane] if lanes.pending[lane] else kept
    for lane in range(LANES):
        lanes.fx[lane] = lanes.force[lane] * gap[c.GX, lane]
    for lane in range(LANES):
        lanes.fy[lane] = lanes.force[lane] * gap[c.GY, lane]
    if lanes.rubs[0]:
        for lane in range(LANES):
            lanes.fx[lane] -= lanes.rub[lane] * gap[c.GY, lane]
        for lane in range(LANES):
            lanes.fy[lane] += lanes.rub[lane] * gap[c.GX, lane]
    rod.add_position_hessian(
        lanes.basis.slope,
        problem.rule.weights,
        lanes.sin,
        lanes.cos,
        lanes.fx,
        lanes.fy,
        lanes.work,
        lanes.hessian,
    )
    symmetric.factorise(lanes.hessian, lanes.negative)
    x, y, end = lanes.gradient[0], lanes.gradient[1], lanes.basis.end
    _keep_solution(lanes, x, lanes.across[0])
    _keep_solution(lanes, y, lanes.across[1])
    _keep_solution(lanes, end, lanes.across[2])
    _keep_flexibility(lanes, x, 0, 0)
    _keep_flexibility(lanes, y, 1, 0)
    _keep_flexibility(lanes, y, 1, 1)
    _keep_flexibility(lanes, end, 2, 0)
    _keep_flexibility(lanes, end, 2, 1)
    _keep_flexibility(lanes, end, 2, 2)


@inlined
def _keep_solution(lanes, right, out):
    """Solve with the factor for `right` (m, LANES), and keep the solution in `out` for the pending
    lanes only: what a lane ends with must not depend on how long its neighbours take."""
    modes = right.shape[0]
    for k in range(modes):
        for lane in range(LANES):
            lanes.down[k, lane] = right[k, lane]
    symmetric.solve(lanes.hessian, lanes.down)
    for k in range(modes):
        for lane in range(LANES):
            out[k, lane] = lanes.down[k, lane] if lanes.pending[lane] else out[k, lane]


@inlined
def _keep_flexibility(lanes, row, i, j):
    """Entries (i, j) and (j, i) of C, kept like the solutions. row: (m, LANES) of J."""
    total, across = lanes.fx, lanes.across[j]
    for lane in range(LANES):
        total[lane] = 0.0
    for k in range(row.shape[0]):
        for lane in range(LANES):
            total[lane] += row[k, lane] * across[k, lane]
    for lane in range(LANES):
        kept = lanes.flexible[i, j, lane]
        lanes.flexible[i, j, lane] = total[lane] if lanes.pending[lane] else kept
    for lane in range(LANES):
        lanes.flexible[j, i, lane] = lanes.flexible[i, j, lane]


@inner
def step(lanes):
    """One Newton step of the pending lanes with the factors of `factorise` and `tip.prepare`."""
    modes, pending = lanes.u.shape[0], lanes.pending
    for i in range(3):
        for lane in range(LANES):
            lanes.shift[i, lane] = 0.0
        for k in range(modes):
            for lane in range(LANES):
                lanes.shift[i, lane] -= lanes.across[i, k, lane] * lanes.u[k, lane]
    for k in range(modes):
        for lane in range(LANES):
            lanes.down[k, lane] = lanes.u[k, lane]
    symmetric.solve(lanes.hessian, lanes.down)
    for i in range(3):
        for lane in range(LANES):
            lanes.answer[i, lane] = (
                lanes.change[i, 0, lane] * lanes.shift[0, lane]
                + lanes.change[i, 1, lane] * lanes.shift[1, lane]
                + lanes.change[i, 2, lane] * lanes.shift[2, lane]
            )
    lack, crept, force, rub = lanes.work[0], lanes.work[1], lanes.fx, lanes.fy
    for lane in range(LANES):
        lack[lane] = -lanes.gap[c.GAP, lane]
    for lane in range(LANES):
        crept[lane] = lanes.slipped[lane] - lanes.anchor[lane]
    tip.respond(lanes, lack, crept, force, rub)
    for lane in range(LANES):
        lanes.force[lane] = force[lane] if pending[lane] else lanes.force[lane]
    for lane in range(LANES):
        lanes.rub[lane] = rub[lane] if pending[lane] else lanes.rub[lane]
    for k in range(modes):
        for lane in range(LANES):
            change = (
                lanes.answer[0, lane] * lanes.across[0, k, lane]
                + lanes.answer[1, lane] * lanes.across[1, k, lane]
                + lanes.answer[2, lane] * lanes.across[2, k, lane]
                - lanes.down[k, lane]
            )
            lanes.u[k, lane] += change if pending[lane] else 0.0


@inner
def rates(lanes):
    """Derivatives of shape, force and pose by the target's position, with the last factor.

    Everything in the contact depends on the tip's position minus the target's: where the target
    moves by 1 along x, the tip has to follow as if it had been moved by -1.
    """
    modes = lanes.u.shape[0]
    tip.prepare(lanes)
    for i in range(3):
        for lane in range(LANES):
            lanes.shift[i, lane] = 0.0
        for lane in range(LANES):
            lanes.answer[i, lane] = lanes.driven[i, lane]
    tip.respond(lanes, lanes.gap[c.GX], lanes.tangent[0], lanes.force_rate, lanes.rub_rate)
    for k in range(modes):
        for lane in range(LANES):
            lanes.u_rate[k, lane] = (
                lanes.answer[0, lane] * lanes.across[0, k, lane]
                + lanes.answer[1, lane] * lanes.across[1, k, lane]
                + lanes.answer[2, lane] * lanes.across[2, k, lane]
            )
    tip.bend(lanes, lanes.answer, lanes.pose_rate)


@inner
def refresh(problem, lanes):
    """Evaluation, factor and rates of the active lanes as they stand, without a step."""
    evaluate(problem, lanes)
    for lane in range(LANES):
        lanes.pending[lane] = lanes.active[lane]
    factorise(problem, lanes)
    rates(lanes)


@inner
def correct(problem, lanes, tolerance, most):
    """Newton's method in the active lanes, at least one step each.

    Sets their `good`, `residual`, `iterations`, and the factor that `rates` and the error estimate
    need (of the last but one iterate, which is as close as the last step was short).
    """
    pending = lanes.pending
    for lane in range(LANES):
        pending[lane] = lanes.active[lane]
        lanes.iterations[lane] = 0 if lanes.active[lane] else lanes.iterations[lane]
    evaluate(problem, lanes)
    for _ in range(most):
        factorise(problem, lanes)
        tip.prepare(lanes)
        for lane in range(LANES):
            if pending[lane]:
                lanes.iterations[lane] += 1
                pending[lane] = lanes.determinant[lane] > 0.0
        step(lanes)
        evaluate(problem, lanes)
        left = False
        for lane in range(LANES):
            if pending[lane] and lanes.residual[lane] <= tolerance:
                pending[lane] = False
            left = left or pending[lane]
        if not left:
            break
    for lane in range(LANES):
        if lanes.active[lane]:
            on_branch = lanes.mu[lane] == 0.0 or lanes.determinant[lane] > 0.0
            # a gap is a difference of numbers as large as the target and its distance
            radius = problem.target[lanes.design[lane], c.TARGET_RADIUS]
            rounding = c.GAP_ROUNDING * (1.0 + radius + abs(lanes.t[lane]))
            lanes.good[lane] = (
                on_branch
                and lanes.force[lane] >= 0.0
                and (
                    lanes.residual[lane] <= tolerance
                    or abs(lanes.gap[c.GAP, lane]) <= rounding
                    and lanes.residual[lane] <= c.GRAZING
                )
            )
