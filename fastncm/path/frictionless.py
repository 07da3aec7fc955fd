"""Newton's method without friction: the KKT conditions of a minimum, whose matrix is symmetric.

    u - A(u)^T lambda = 0,    g(u; t) = 0,    A = dg/du

H is the Hessian of the Lagrangian, the contact's curvature in it. With ``pull = lambda dA/dp``, p
the tip's pose, and the three rows J of dp/du it is ``1 - lambda d2(x, y)/du2 - pull^T J``. H may be
singular though the contact keeps the finger stable (at the buckling load; where a corner slides
around a small circle). So it gets the penalty ``w A^T A``, which changes nothing where ``A du`` is
known, but how much of lambda is left to the constraint:

    (H + w A^T A) du - A^T m = -u,    A du = -g,    m = lambda + dlambda - w g

The normal n only turns, ``dn = t dtheta`` with t = (-ny, nx), so that the first two rows of pull
are ``t spin`` with ``spin = lambda dtheta/du``. Two systems are solved with the factor, for A and
for spin; what a step, the rates and the error estimate need are products with their solutions. With
friction there is no such matrix: `path.tip`.
"""

from fastncm.kernels import constants as c
from fastncm.kernels import rod, symmetric
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.lanewise import dot

#: The penalty's stiffness over that of the finger against the contact, which is near 1 / |A|^2.
PENALTY = 10.0

# sizes that LLVM knows (`kernels.rod`)
_4, _5 = (0,) * 4, (0,) * 5


@inner
def linearise(problem, lanes):
    """Factor of the Hessian under the force as it stands, and the contact's compliance with it.

    Overwrites hessian, pull, and for the pending lanes penalty (w), across[0] (H^-1 A^T), across[1]
    (H^-1 spin), inverse[0, 0] (1 / (A H^-1 A^T), H with the penalty) and determinant, which is
    positive at a minimum. For the other lanes H is the identity, so that solving changes nothing:
    what a lane ends with must not depend on how long its neighbours take.
    """
    modes = lanes.u.shape[0]
    gap, pending = lanes.gap, lanes.pending
    force, stiffness, compliance = lanes.work[0], lanes.work[1], lanes.moved
    for lane in range(LANES):
        force[lane] = lanes.force[lane] if pending[lane] else 0.0
    dot(lanes.jacobian, lanes.jacobian, stiffness)
    for lane in range(LANES):
        stiffness[lane] = PENALTY / stiffness[lane] if pending[lane] else 0.0
    for lane in range(LANES):
        lanes.penalty[lane] = stiffness[lane] if pending[lane] else lanes.penalty[lane]
    if modes == 4:
        _contact_stiffness(lanes, force, stiffness, _4)
    elif modes == 5:
        _contact_stiffness(lanes, force, stiffness, _5)
    else:
        _contact_stiffness(lanes, force, stiffness, lanes.u)
    for lane in range(LANES):
        lanes.fx[lane] = force[lane] * gap[c.GX, lane]
    for lane in range(LANES):
        lanes.fy[lane] = force[lane] * gap[c.GY, lane]
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
    _solve_pending(lanes, lanes.jacobian, lanes.across[0])
    for k in range(modes):
        for lane in range(LANES):
            lanes.down[k, lane] = (
                gap[c.GX, lane] * lanes.pull[1, k, lane] - gap[c.GY, lane] * lanes.pull[0, k, lane]
            )
    _solve_pending(lanes, lanes.down, lanes.across[1])
    dot(lanes.jacobian, lanes.across[0], compliance)
    for lane in range(LANES):
        inverse = 1.0 / compliance[lane]
        lanes.inverse[0, 0, lane] = inverse if pending[lane] else lanes.inverse[0, 0, lane]
    for lane in range(LANES):
        upright = compliance[lane] if lanes.negative[lane] == 0.0 else -1.0
        found = -compliance[lane] if lanes.negative[lane] == 1.0 else upright
        lanes.determinant[lane] = found if pending[lane] else lanes.determinant[lane]


@inlined
def _contact_stiffness(lanes, force, stiffness, modes):
    """``pull = lambda d(grad g)`` by the unknowns, and ``1 + w A^T A - pull^T J`` in the Hessian.

    force, stiffness (w): (LANES,); modes: a tuple of the number of modes, where LLVM shall know it,
    or anything else of that length.
    """
    gap, pull, jacobian, end = lanes.gap, lanes.pull, lanes.jacobian, lanes.end
    x, y = lanes.gradient[0], lanes.gradient[1]
    for lane in range(LANES):
        for k in range(len(modes)):
            by_x, by_y, by_psi = x[k, lane], y[k, lane], end[k, lane]
            pull[0, k, lane] = force[lane] * (
                gap[c.HXX, lane] * by_x + gap[c.HXY, lane] * by_y + gap[c.HXP, lane] * by_psi
            )
            pull[1, k, lane] = force[lane] * (
                gap[c.HXY, lane] * by_x + gap[c.HYY, lane] * by_y + gap[c.HYP, lane] * by_psi
            )
            pull[2, k, lane] = force[lane] * (
                gap[c.HXP, lane] * by_x + gap[c.HYP, lane] * by_y + gap[c.HPP, lane] * by_psi
            )
    for k in range(len(modes)):
        for j in range(k + 1):
            unit = 1.0 if j == k else 0.0
            for lane in range(LANES):
                lanes.hessian[k, j, lane] = (
                    unit
                    + stiffness[lane] * jacobian[k, lane] * jacobian[j, lane]
                    - pull[0, k, lane] * x[j, lane]
                    - pull[1, k, lane] * y[j, lane]
                    - pull[2, k, lane] * end[j, lane]
                )


@inner
def _solve_pending(lanes, right, out):
    """Solve with the factor for `right` (m, LANES); `out` (m, LANES) is left as it is in lanes that
    are not pending."""
    for k in range(right.shape[0]):
        for lane in range(LANES):
            out[k, lane] = right[k, lane] if lanes.pending[lane] else out[k, lane]
    symmetric.solve(lanes.hessian, out)


@inner
def step(lanes):
    """One Newton step of the pending lanes with the factor of `linearise`."""
    modes, pending = lanes.u.shape[0], lanes.pending
    force, down = lanes.fx, lanes.down
    for k in range(modes):
        for lane in range(LANES):
            down[k, lane] = lanes.u[k, lane]
    symmetric.solve(lanes.hessian, down)
    dot(lanes.jacobian, down, force)
    for lane in range(LANES):
        force[lane] = (force[lane] - lanes.gap[c.GAP, lane]) * lanes.inverse[0, 0, lane]
    for k in range(modes):
        for lane in range(LANES):
            change = force[lane] * lanes.across[0, k, lane] - down[k, lane]
            lanes.u[k, lane] += change if pending[lane] else 0.0
    for lane in range(LANES):
        whole = force[lane] + lanes.penalty[lane] * lanes.gap[c.GAP, lane]
        lanes.force[lane] = whole if pending[lane] else lanes.force[lane]


@inner
def rates(lanes):
    """Derivatives of shape, force and pose by the target's position, with the last factor.

    ``H u' - A^T lambda' = -pull_x``, ``A u' = gx``: the gap depends on target minus tip position,
    so ``d/dt = -d/dx`` of the pose; ``pull_x = -ny spin``.
    """
    rate, gap = lanes.force_rate, lanes.gap
    dot(lanes.jacobian, lanes.across[1], rate)
    for lane in range(LANES):
        answered = gap[c.GX, lane] - gap[c.GY, lane] * rate[lane]
        rate[lane] = answered * lanes.inverse[0, 0, lane]
    for k in range(lanes.u.shape[0]):
        for lane in range(LANES):
            lanes.u_rate[k, lane] = (
                rate[lane] * lanes.across[0, k, lane] + gap[c.GY, lane] * lanes.across[1, k, lane]
            )
    for lane in range(LANES):
        rate[lane] -= lanes.penalty[lane] * gap[c.GX, lane]
    _pose_of(lanes, lanes.u_rate, lanes.pose_rate)


@inner
def _pose_of(lanes, shape, out):
    """How a change of shape (m, LANES) moves the tip. out: (3, LANES), overwritten."""
    dot(lanes.gradient[0], shape, out[0])
    dot(lanes.gradient[1], shape, out[1])
    dot(lanes.end, shape, out[2])


@inner
def adjoint(lanes, wrench, moved):
    """What a lack of equilibrium does to the force: ``d lambda = - y . rho`` for a residual ``rho``
    of the modes' equations, with ``y = H^-1 A^T / (A H^-1 A^T)``.

    Overwrites ``lanes.down`` with y, and wrench (3, LANES): that on the tip which does the work
    ``y_l`` with a mode l that is left out, but for the stiffness that the force gives. moved: (3,
    LANES), workspace.
    """
    gap = lanes.gap
    for k in range(lanes.u.shape[0]):
        for lane in range(LANES):
            lanes.down[k, lane] = lanes.inverse[0, 0, lane] * lanes.across[0, k, lane]
    for i in range(3):
        for lane in range(LANES):
            stiffness = lanes.inverse[0, 0, lane] - lanes.penalty[lane]
            wrench[i, lane] = stiffness * gap[c.GX + i, lane]
    _add_turn(lanes, wrench, moved)


@inner
def adjoint_turn(lanes, turn, wrench, moved):
    """`adjoint` for the direction of the force: ``lambda dtheta = - y . rho``. turn: (3, LANES),
    ``lambda dtheta/dp``."""
    pressed = lanes.fx
    dot(lanes.jacobian, lanes.across[1], pressed)
    for lane in range(LANES):
        pressed[lane] *= -lanes.inverse[0, 0, lane]
    for k in range(lanes.u.shape[0]):
        for lane in range(LANES):
            lanes.down[k, lane] = (
                lanes.across[1, k, lane] + pressed[lane] * lanes.across[0, k, lane]
            )
    for i in range(3):
        for lane in range(LANES):
            wrench[i, lane] = turn[i, lane] + pressed[lane] * lanes.gap[c.GX + i, lane]
    _add_turn(lanes, wrench, moved)


@inner
def _add_turn(lanes, wrench, moved):
    """Add to `wrench` what the contact's changes with the shape ``lanes.down`` answer."""
    gap = lanes.gap
    _pose_of(lanes, lanes.down, moved)
    for i in range(3):
        for lane in range(LANES):
            by_x = gap[c.HXP, lane] if i == 2 else gap[c.HXX + i, lane]
            by_y = gap[c.HYP, lane] if i == 2 else gap[c.HXY + i, lane]
            by_psi = gap[c.HPP, lane] if i == 2 else gap[c.HXP + i, lane]
            turned = by_x * moved[0, lane] + by_y * moved[1, lane] + by_psi * moved[2, lane]
            wrench[i, lane] += lanes.force[lane] * turned
