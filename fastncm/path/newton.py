"""Newton's method on the KKT conditions with one working constraint, for all lanes at once.

    u - A(u)^T lambda = 0,    g(u; t) = 0

This is the SQP (`sqp.solve`) where its active set is settled: along a path the smallest gap is the
one that is active, and the predictor starts inside the region of quadratic convergence. What does
not converge here, or comes out with a pulling force, goes to the SQP (`path.careful`).
"""

from fastncm.kernels import constants as c
from fastncm.kernels import rod, symmetric
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import closest_gap, store
from fastncm.kernels.trig import sincos
from fastncm.path.lanes import AS_STORED


@inner
def evaluate(problem, lanes):
    """Pose, smallest gap, its gradient and the KKT residual of every active lane, from `u`, `force`
    and `t`.

    The residual is that of `sqp.solve.kkt_residual` for one loaded constraint; it depends on
    nothing else that the solver keeps.
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
    # stationarity over the largest unknown, gap over the deflection A u of the contact
    largest, slack, moved = lanes.fx, lanes.fy, lanes.moved
    for lane in range(LANES):
        largest[lane] = 0.0
        slack[lane] = 0.0
        moved[lane] = 0.0
    for k in range(modes):
        for lane in range(LANES):
            u = lanes.u[k, lane]
            error = abs(u - lanes.jacobian[k, lane] * lanes.force[lane])
            largest[lane] = max(largest[lane], abs(u))
            slack[lane] = max(slack[lane], error)
            moved[lane] += lanes.jacobian[k, lane] * u
    for lane in range(LANES):
        stationarity = slack[lane] / max(largest[lane], c.GAP_ROUNDING)
        contact = abs(lanes.gap[c.GAP, lane]) / max(abs(moved[lane]), c.GAP_ROUNDING)
        lanes.residual[lane] = max(stationarity, contact)


@inlined
def _pull(lanes, by_x, by_y, by_psi, x, y, end, row, k):
    """One component of lambda d(grad g) for unknown `k`.

    One array is written per loop over the lanes: with more, LLVM would have to check more pairs of
    arrays for overlap than it is ready to, and would not vectorise.
    """
    for lane in range(LANES):
        lanes.pull[row, k, lane] = lanes.force[lane] * (
            lanes.gap[by_x, lane] * x[k, lane]
            + lanes.gap[by_y, lane] * y[k, lane]
            + lanes.gap[by_psi, lane] * end[k, lane]
        )


@inner
def factorise(problem, lanes):
    """Factor of the Lagrangian's Hessian; ``A`` and ``H^-1 A`` of the working constraint.

    Overwrites hessian and pull (lambda d(grad g) by the unknowns), and for the pending lanes across
    (H^-1 A^T), along (H^-1 pull_x) and compliance (A H^-1 A^T).
    """
    modes = lanes.u.shape[0]
    gap, end = lanes.gap, lanes.basis.end
    x, y = lanes.gradient[0], lanes.gradient[1]
    for k in range(modes):
        _pull(lanes, c.HXX, c.HXY, c.HXP, x, y, end, 0, k)
        _pull(lanes, c.HXY, c.HYY, c.HYP, x, y, end, 1, k)
        _pull(lanes, c.HXP, c.HYP, c.HPP, x, y, end, 2, k)
        for j in range(k + 1):
            unit = 1.0 if j == k else 0.0
            for lane in range(LANES):
                lanes.hessian[k, j, lane] = (
                    unit
                    - lanes.pull[0, k, lane] * x[j, lane]
                    - lanes.pull[1, k, lane] * y[j, lane]
                    - lanes.pull[2, k, lane] * end[j, lane]
                )
    for lane in range(LANES):
        lanes.fx[lane] = lanes.force[lane] * gap[c.GX, lane]
        lanes.fy[lane] = lanes.force[lane] * gap[c.GY, lane]
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
    _keep_solution(lanes, lanes.jacobian, lanes.across)
    _keep_solution(lanes, lanes.pull[0], lanes.along)
    compliance = lanes.fx
    for lane in range(LANES):
        compliance[lane] = 0.0
    for k in range(modes):
        for lane in range(LANES):
            compliance[lane] += lanes.jacobian[k, lane] * lanes.across[k, lane]
    for lane in range(LANES):
        if lanes.pending[lane]:
            lanes.compliance[lane] = compliance[lane]


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


@inner
def step(lanes):
    """One Newton step of the pending lanes with the factor of `factorise`.

    ``H du - A^T (lambda + dlambda) = -u``, ``A du = -g``.
    """
    modes, pending = lanes.u.shape[0], lanes.pending
    for k in range(modes):
        for lane in range(LANES):
            lanes.down[k, lane] = lanes.u[k, lane]
    symmetric.solve(lanes.hessian, lanes.down)
    force = lanes.fx
    for lane in range(LANES):
        force[lane] = -lanes.gap[c.GAP, lane]
    for k in range(modes):
        for lane in range(LANES):
            force[lane] += lanes.jacobian[k, lane] * lanes.down[k, lane]
    for lane in range(LANES):
        force[lane] /= lanes.compliance[lane]
        lanes.force[lane] = force[lane] if pending[lane] else lanes.force[lane]
    for k in range(modes):
        for lane in range(LANES):
            change = force[lane] * lanes.across[k, lane] - lanes.down[k, lane]
            lanes.u[k, lane] += change if pending[lane] else 0.0


@inner
def rates(lanes):
    """Derivatives of shape and force by the target's position, with the last factor.

    ``H u' - A^T lambda' = lambda dA^T/dt``, ``A u' = -dg/dt``. The gap depends on target minus tip
    position, so ``d/dt = -d/dx`` of the pose.
    """
    modes = lanes.u.shape[0]
    for lane in range(LANES):
        lanes.force_rate[lane] = lanes.gap[c.GX, lane]
    for k in range(modes):
        for lane in range(LANES):
            lanes.force_rate[lane] += lanes.jacobian[k, lane] * lanes.along[k, lane]
    for lane in range(LANES):
        lanes.force_rate[lane] /= lanes.compliance[lane]
    for k in range(modes):
        for lane in range(LANES):
            lanes.u_rate[k, lane] = (
                lanes.force_rate[lane] * lanes.across[k, lane] - lanes.along[k, lane]
            )


@inner
def refresh(problem, lanes):
    """Evaluation, factor and rates of the active lanes as they stand, without a step."""
    evaluate(problem, lanes)
    for lane in range(LANES):
        lanes.pending[lane] = lanes.active[lane]
    factorise(problem, lanes)
    rates(lanes)


@inlined
def _is_minimum(negative, compliance):
    """True where the Hessian, with that many negative pivots, is positive definite along the
    constraint."""
    return (negative == 0.0 and compliance > 0.0) or (negative == 1.0 and compliance < 0.0)


@inner
def correct(problem, lanes, tolerance, most):
    """Newton's method in the active lanes, at least one step each.

    Sets `good`, `residual`, `iterations`, and the factor and `compliance` that `rates` and the
    error estimate need (of the last but one iterate, which is as close as the last step was short).
    """
    pending = lanes.pending
    for lane in range(LANES):
        pending[lane] = lanes.active[lane]
        lanes.iterations[lane] = 0
    evaluate(problem, lanes)
    for _ in range(most):
        factorise(problem, lanes)
        for lane in range(LANES):
            if pending[lane]:
                lanes.iterations[lane] += 1
                pending[lane] = _is_minimum(lanes.negative[lane], lanes.compliance[lane])
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
        lanes.good[lane] = (
            lanes.active[lane]
            and lanes.force[lane] >= 0.0
            and (
                lanes.residual[lane] <= tolerance
                or abs(lanes.gap[c.GAP, lane]) <= c.GAP_ROUNDING
                and lanes.residual[lane] <= c.GRAZING
            )
        )
