"""Newton's method on the equilibrium with one working contact, for all lanes at once.

    u - J(u)^T (lambda a + rub tau) = 0,    g(u; t) = 0,    rub = side lambda, or no slip

Without friction (rub = 0) these are the KKT conditions of the minimum, and this is the SQP
(`sqp.solve`) where its active set is settled: along a path the smallest gap is the one that is
active, and the predictor starts inside the region of quadratic convergence. What does not converge
here, or comes out with a pulling force, goes to the SQP (`path.careful`). The linear algebra of a
step is in `path.frictionless`, or, in a block of lanes with friction, in `path.rubbing`; whether a
contact slides or sticks in `path.stick`.
"""

from fastncm.kernels import constants as c
from fastncm.kernels import rod
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import closest_gap, store
from fastncm.kernels.lanewise import dot
from fastncm.kernels.trig import sincos
from fastncm.path import frictionless, rubbing, tip
from fastncm.path.lanes import AS_STORED
from fastncm.path.slip import slip

#: Residual that is accepted with friction where all steps do not get below the tolerance: a finger
#: that would buckle if its contact did not stick is close to singular without it.
_STALLED = 1e-9

# sizes that LLVM knows (`kernels.rod`)
_4, _5 = (0,) * 4, (0,) * 5


@inner
def evaluate(problem, lanes):
    """Pose, smallest gap, its gradient and the residual of every active lane, from `u`, `force`,
    `rub` and `t`.

    The residual is that of `sqp.solve.kkt_residual` for one loaded constraint, with the friction
    force and a slip that should not be; it depends on nothing else that the solver keeps.
    """
    modes, rule = lanes.u.shape[0], problem.rule
    rod.tip_pose(lanes.slope, lanes.end, rule.weights, lanes.u, lanes.sin, lanes.cos, lanes.pose)
    rod.pose_gradient(lanes.slope, rule.weights, lanes.sin, lanes.cos, lanes.gradient)
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
    for lane in range(LANES):
        lanes.loaded[0, lane] = lanes.force[lane] * lanes.gap[c.GX, lane]
        lanes.loaded[1, lane] = lanes.force[lane] * lanes.gap[c.GY, lane]
        lanes.loaded[2, lane] = lanes.force[lane] * lanes.gap[c.GP, lane]
    if lanes.rubs[0]:
        _tangent(problem, lanes)
        for i in range(3):
            for lane in range(LANES):
                lanes.loaded[i, lane] += lanes.rub[lane] * lanes.tangent[i, lane]
    if modes == 4:
        _jacobian(lanes, _4)
        _residual(lanes, _4)
    elif modes == 5:
        _jacobian(lanes, _5)
        _residual(lanes, _5)
    else:
        _jacobian(lanes, lanes.u)
        _residual(lanes, lanes.u)
    if lanes.holds[0]:
        dot(lanes.jacobian, lanes.u, lanes.moved)
        for lane in range(LANES):
            if lanes.sticks[lane]:
                deflection = max(abs(lanes.moved[lane]), c.GAP_ROUNDING)
                crept = abs(lanes.slipped[lane] - lanes.anchor[lane]) / deflection
                lanes.residual[lane] = max(lanes.residual[lane], crept)


@inlined
def _jacobian(lanes, modes):
    """dg/du. modes: a tuple of the number of modes, where LLVM shall know it, or anything else of
    that length."""
    gap, gradient, end = lanes.gap, lanes.gradient, lanes.end
    for lane in range(LANES):
        for k in range(len(modes)):
            lanes.jacobian[k, lane] = (
                gap[c.GX, lane] * gradient[0, k, lane]
                + gap[c.GY, lane] * gradient[1, k, lane]
                + gap[c.GP, lane] * end[k, lane]
            )


@inlined
def _residual(lanes, modes):
    """Stationarity over the largest unknown, gap over the deflection ``A u`` of the contact.

    ``lanes.loaded`` is the contact's wrench; modes as in `_jacobian`.
    """
    gradient, end, loaded = lanes.gradient, lanes.end, lanes.loaded
    for lane in range(LANES):
        largest, slack, moved = c.GAP_ROUNDING, 0.0, 0.0
        for k in range(len(modes)):
            u = lanes.u[k, lane]
            lack = u - (
                loaded[0, lane] * gradient[0, k, lane]
                + loaded[1, lane] * gradient[1, k, lane]
                + loaded[2, lane] * end[k, lane]
            )
            largest = max(largest, abs(u))
            slack = max(slack, abs(lack))
            moved += lanes.jacobian[k, lane] * u
        contact = abs(lanes.gap[c.GAP, lane]) / max(abs(moved), c.GAP_ROUNDING)
        lanes.residual[lane] = max(slack / largest, contact)


@inner
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
def linearise(problem, lanes):
    """Factors of the evaluated state for a step of the pending lanes; sets their `determinant`,
    positive where the solution is one that counts."""
    if lanes.rubs[0]:
        rubbing.linearise(problem, lanes)
        tip.prepare(lanes)
    else:
        frictionless.linearise(problem, lanes)


@inner
def step(lanes):
    """One Newton step of the pending lanes with the factors of `linearise`."""
    if lanes.rubs[0]:
        rubbing.step(lanes)
    else:
        frictionless.step(lanes)


@inner
def rates(lanes):
    """Derivatives of shape, forces and pose by the target's position, with the last factor."""
    if lanes.rubs[0]:
        rubbing.rates(lanes)
    else:
        frictionless.rates(lanes)


@inner
def refresh(problem, lanes):
    """Evaluation, factor and rates of the active lanes as they stand, without a step."""
    evaluate(problem, lanes)
    for lane in range(LANES):
        lanes.pending[lane] = lanes.active[lane]
    linearise(problem, lanes)
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
    for done in range(most + 1):
        evaluate(problem, lanes)
        left = done == 0
        for lane in range(LANES):
            if pending[lane] and done > 0 and lanes.residual[lane] <= tolerance:
                pending[lane] = False
            left = left or pending[lane]
        if done == most or not left:
            break
        linearise(problem, lanes)
        for lane in range(LANES):
            if pending[lane]:
                lanes.iterations[lane] += 1
                pending[lane] = lanes.determinant[lane] > 0.0
        step(lanes)
    for lane in range(LANES):
        if lanes.active[lane]:
            # a gap is a difference of numbers as large as the two radii and the distance
            d = lanes.design[lane]
            radii = problem.target[d, c.TARGET_RADIUS] + abs(problem.jaw[d, c.RHO])
            rounding = c.GAP_ROUNDING * (1.0 + radii + abs(lanes.t[lane]))
            lanes.good[lane] = (
                lanes.determinant[lane] > 0.0
                and lanes.force[lane] >= 0.0
                and (
                    lanes.residual[lane] <= tolerance
                    or abs(lanes.gap[c.GAP, lane]) <= rounding
                    and lanes.residual[lane] <= c.GRAZING
                    or lanes.mu[lane] > 0.0
                    and lanes.residual[lane] <= _STALLED
                )
            )
