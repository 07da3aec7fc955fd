"""Newton's method with friction: one step, and the rates, through the tip's pose (`path.tip`).

The modes' Hessian under the force as it stands has no part of the contact in it but the penalty;
the contact is answered by the wrench on the tip. Three systems are solved with the factor, one for
each component of the wrench.
"""

from fastncm.kernels import constants as c
from fastncm.kernels import rod, symmetric
from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.lanewise import dot, multiply
from fastncm.path import tip
from fastncm.path.frictionless import PENALTY


@inner
def linearise(problem, lanes):
    """Factor of the modes' Hessian under the force as it stands, and the tip's flexibility.

    Overwrites hessian, and for the pending lanes penalty (w), leaned (a0), across (W) and flexible
    (C) of `path.tip`.
    """
    modes = lanes.u.shape[0]
    gap, penalty = lanes.gap, lanes.fx
    dot(lanes.jacobian, lanes.jacobian, penalty)
    for lane in range(LANES):
        penalty[lane] = PENALTY / penalty[lane]
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
        lanes.fx[lane] = lanes.force[lane] * gap[c.GX, lane] - lanes.rub[lane] * gap[c.GY, lane]
    for lane in range(LANES):
        lanes.fy[lane] = lanes.force[lane] * gap[c.GY, lane] + lanes.rub[lane] * gap[c.GX, lane]
    rod.add_position_hessian(
        lanes.slope,
        problem.rule.weights,
        lanes.sin,
        lanes.cos,
        lanes.fx,
        lanes.fy,
        lanes.work,
        lanes.hessian,
    )
    symmetric.factorise(lanes.hessian, lanes.negative)
    x, y, end = lanes.gradient[0], lanes.gradient[1], lanes.end
    _keep_solution(lanes, x, lanes.across[0])
    _keep_solution(lanes, y, lanes.across[1])
    _keep_solution(lanes, end, lanes.across[2])
    _keep_flexibility(lanes, x, 0, 0)
    _keep_flexibility(lanes, y, 1, 0)
    _keep_flexibility(lanes, y, 1, 1)
    _keep_flexibility(lanes, end, 2, 0)
    _keep_flexibility(lanes, end, 2, 1)
    _keep_flexibility(lanes, end, 2, 2)


@inner
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
def _keep_flexibility(lanes, row, i, j):
    """Entries (i, j) and (j, i) of C, kept like the solutions. row: (m, LANES) of J."""
    total = lanes.fx
    dot(row, lanes.across[j], total)
    for lane in range(LANES):
        kept = lanes.flexible[i, j, lane]
        lanes.flexible[i, j, lane] = total[lane] if lanes.pending[lane] else kept
    for lane in range(LANES):
        lanes.flexible[j, i, lane] = lanes.flexible[i, j, lane]


@inner
def step(lanes):
    """One Newton step of the pending lanes with the factors of `linearise` and `tip.prepare`."""
    modes, pending = lanes.u.shape[0], lanes.pending
    for i in range(3):
        dot(lanes.across[i], lanes.u, lanes.shift[i])
        for lane in range(LANES):
            lanes.shift[i, lane] = -lanes.shift[i, lane]
    for k in range(modes):
        for lane in range(LANES):
            lanes.down[k, lane] = lanes.u[k, lane]
    symmetric.solve(lanes.hessian, lanes.down)
    multiply(lanes.change, lanes.shift, lanes.answer)
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
            lanes.u[k, lane] -= lanes.down[k, lane] if pending[lane] else 0.0
    _bend_modes(lanes, lanes.answer, lanes.down)
    for k in range(modes):
        for lane in range(LANES):
            lanes.u[k, lane] += lanes.down[k, lane] if pending[lane] else 0.0


@inner
def rates(lanes):
    """Derivatives of shape, force and pose by the target's position, with the last factor.

    Everything in the contact depends on the tip's position minus the target's: where the target
    moves by 1 along x, the tip has to follow as if it had been moved by -1.
    """
    tip.prepare(lanes)
    for i in range(3):
        for lane in range(LANES):
            lanes.shift[i, lane] = 0.0
        for lane in range(LANES):
            lanes.answer[i, lane] = lanes.driven[i, lane]
    tip.respond(lanes, lanes.gap[c.GX], lanes.tangent[0], lanes.force_rate, lanes.rub_rate)
    _bend_modes(lanes, lanes.answer, lanes.u_rate)
    tip.bend(lanes, lanes.answer, lanes.pose_rate)


@inner
def adjoint(lanes, which, wrench, kept, moved):
    """`tip.adjoint`, with the shape that belongs to it in ``lanes.down``: the counterpart of
    `frictionless.adjoint`."""
    tip.adjoint(lanes, which, wrench, kept, moved)
    _bend_modes(lanes, kept, lanes.down)


@inner
def adjoint_turn(lanes, turn, wrench, kept, moved):
    """The same of `tip.adjoint_turn`."""
    tip.adjoint_turn(lanes, turn, wrench, kept, moved)
    _bend_modes(lanes, kept, lanes.down)


@inner
def _bend_modes(lanes, wrench, out):
    """``out = W wrench``: how a wrench (3, LANES) on the tip moves the modes. out: (m, LANES)."""
    across = lanes.across
    for k in range(out.shape[0]):
        for lane in range(LANES):
            out[k, lane] = (
                wrench[0, lane] * across[0, k, lane]
                + wrench[1, lane] * across[1, k, lane]
                + wrench[2, lane] * across[2, k, lane]
            )
