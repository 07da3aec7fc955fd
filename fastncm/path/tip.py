"""The contact in the space of the tip's pose ``p = (x, y, psi)``, where it acts: three unknowns
instead of m.

With G the Hessian of the modes under the force as it stands, J = dp/du, W = G^-1 J^T and the
tip's flexibility C = J W, a wrench f on the tip moves the modes and the tip by

    du = W f - G^-1 u,    dp = C f + p0,    p0 = -J G^-1 u

The wrench of the contact is ``B(p) = lambda a + rub tau``: the normal force lambda with a = dg/dp,
and the friction force rub with tau that of a unit force along the contact's tangent. Linearised,

    f = lambda a + rub tau + D dp,    D = dB/dp

which is unsymmetric with friction: there is no energy that it belongs to. A sliding contact has
``rub = side lambda`` and the one condition ``a dp = -g``; one that sticks has also ``tau dp = h``,
h the slip that has crept in (the slip's derivative is -tau, see `path.slip`). Both are answered by
the factors of the 3 x 3 matrix ``1 - D C`` and a system of one or two equations.

G is singular at the finger's buckling load, and ``1 - D C`` where a corner slides around a small
circle, though the contact keeps both stable. So G gets the penalty ``w (a0 J)^T a0 J``, with a0 = a
where it was factorised, and D gets ``w a0 a0^T - w b a^T`` with b = a + side tau: the first term
undoes the penalty, and the second one, as ``a dp`` is known, changes nothing but how much of lambda
is left to the constraint.

The determinant of the whole linear system is the product of those of G, of ``1 - D C`` and of the
last system. It is positive at first touch and changes its sign at a limit point; without friction
it is positive at minima (Nocedal & Wright 2006, th. 16.3).
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels import unsymmetric
from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.lanewise import dot, multiply


@inner
def prepare(lanes):
    """Factors for `respond` from the evaluated state and the flexibility of the last factor.

    Overwrites driven (the change of the wrench with a target that moves to +x), change (D), reach
    (C a), small (the factors of 1 - D C), pushed and held (the wrenches that the tip bears for a
    unit of lambda and of rub), inverse (of the last system) and determinant.
    """
    gap, change, leaned, flexible = lanes.gap, lanes.change, lanes.leaned, lanes.flexible
    _change_of_wrench(lanes)
    for lane in range(LANES):
        for i in range(3):
            tangent = lanes.tangent[i, lane]
            lanes.pushed[i, lane] = gap[c.GX + i, lane] + lanes.side[lane] * tangent
    for lane in range(LANES):
        for i in range(3):
            lanes.driven[i, lane] = -change[i, 0, lane]
    bend(lanes, gap[c.GX : c.GP + 1], lanes.reach)
    for lane in range(LANES):
        for i in range(3):
            for j in range(3):
                change[i, j, lane] += lanes.penalty[lane] * (
                    leaned[i, lane] * leaned[j, lane] - lanes.pushed[i, lane] * gap[c.GX + j, lane]
                )
    for lane in range(LANES):
        for i in range(3):
            for j in range(3):
                unit = 1.0 if i == j else 0.0
                lanes.small[i, j, lane] = (
                    unit
                    - change[i, 0, lane] * flexible[0, j, lane]
                    - change[i, 1, lane] * flexible[1, j, lane]
                    - change[i, 2, lane] * flexible[2, j, lane]
                )
    unsymmetric.factorise(lanes.small)
    unsymmetric.solve(lanes.small, lanes.pushed)
    dot(lanes.reach, lanes.pushed, lanes.moved)
    for lane in range(LANES):
        lanes.inverse[0, 0, lane] = 1.0 / lanes.moved[lane]
    if lanes.holds[0]:
        _hold(lanes)
    for lane in range(LANES):
        # the pivots are kept as 1 / U: the sign is what counts
        lanes.determinant[lane] = (
            lanes.moved[lane]
            * lanes.small[0, 0, lane]
            * lanes.small[1, 1, lane]
            * lanes.small[2, 2, lane]
        )
    for lane in range(LANES):
        half = 0.5 * lanes.negative[lane]
        odd = half != np.floor(half)
        lanes.determinant[lane] = -lanes.determinant[lane] if odd else lanes.determinant[lane]


@inner
def _change_of_wrench(lanes):
    """D = lambda d(a) + rub d(tau), column by column with the row of the gap's Hessian that belongs
    to it."""
    gap, force, rub = lanes.gap, lanes.force, lanes.rub
    for lane in range(LANES):
        # t turns with n; tau_psi = (P - r) . n turns with n and follows a turn of the jaw
        for j in range(3):
            hx = gap[c.HXP, lane] if j == 2 else gap[c.HXX + j, lane]
            hy = gap[c.HYP, lane] if j == 2 else gap[c.HXY + j, lane]
            hp = gap[c.HPP, lane] if j == 2 else gap[c.HXP + j, lane]
            turned = lanes.arm[0, lane] * hx + lanes.arm[1, lane] * hy
            turned += gap[c.GP, lane] if j == 2 else 0.0
            lanes.change[0, j, lane] = force[lane] * hx - rub[lane] * hy
            lanes.change[1, j, lane] = force[lane] * hy + rub[lane] * hx
            lanes.change[2, j, lane] = force[lane] * hp + rub[lane] * turned


@inner
def bend(lanes, wrench, out):
    """``out = C wrench``: by how much a wrench (3, LANES) moves the tip."""
    multiply(lanes.flexible, wrench, out)


@inner
def _hold(lanes):
    """The second equation of the lanes that stick. ``lanes.moved`` has the first one's coefficient
    on entry, the determinant on return."""
    for i in range(3):
        for lane in range(LANES):
            lanes.held[i, lane] = lanes.tangent[i, lane]
    unsymmetric.solve(lanes.small, lanes.held)
    bend(lanes, lanes.tangent, lanes.slide)
    dot(lanes.reach, lanes.held, lanes.inverse[0, 1])
    dot(lanes.slide, lanes.pushed, lanes.inverse[1, 0])
    dot(lanes.slide, lanes.held, lanes.inverse[1, 1])
    for lane in range(LANES):
        a, b = lanes.moved[lane], lanes.inverse[0, 1, lane]
        p, q = lanes.inverse[1, 0, lane], lanes.inverse[1, 1, lane]
        if lanes.sticks[lane]:
            determinant = a * q - b * p
            lanes.inverse[0, 0, lane] = q / determinant
            lanes.inverse[0, 1, lane] = -b / determinant
            lanes.inverse[1, 0, lane] = -p / determinant
            lanes.inverse[1, 1, lane] = a / determinant
            lanes.moved[lane] = determinant
        else:
            lanes.inverse[0, 1, lane] = 0.0
            lanes.inverse[1, 0, lane] = 0.0
            lanes.inverse[1, 1, lane] = 0.0


@inner
def respond(lanes, lack, crept, force, rub):
    """What the tip does: the wrench `lanes.answer` (3, LANES), and what it consists of.

    On entry `answer` is the wrench that is there anyway, and ``lanes.shift`` (3, LANES) what moves
    the tip anyway. lack: (LANES,) by how much the tip shall open the gap; crept: (LANES,) by how
    much it shall slip back where the contact sticks. force, rub: (LANES,), overwritten.
    """
    answer, shift, left = lanes.answer, lanes.shift, lanes.moved
    unsymmetric.solve(lanes.small, answer)
    dot(lanes.gap[c.GX : c.GP + 1], shift, left)
    dot(lanes.reach, answer, force)
    for lane in range(LANES):
        force[lane] = lack[lane] - left[lane] - force[lane]
    if lanes.holds[0]:
        _answer_slip(lanes, crept, force, rub)
    else:
        for lane in range(LANES):
            force[lane] *= lanes.inverse[0, 0, lane]
        for lane in range(LANES):
            rub[lane] = 0.0
    for i in range(3):
        for lane in range(LANES):
            answer[i, lane] += force[lane] * lanes.pushed[i, lane]
    for lane in range(LANES):
        force[lane] -= lanes.penalty[lane] * lack[lane]
    for lane in range(LANES):
        rub[lane] += lanes.side[lane] * force[lane]


@inner
def _answer_slip(lanes, crept, force, rub):
    """The last system with the lanes that stick. force: (LANES,), its first right side on entry,
    lambda on return; rub: (LANES,), overwritten."""
    rest = lanes.crept
    dot(lanes.slide, lanes.answer, rub)
    dot(lanes.tangent, lanes.shift, rest)
    for lane in range(LANES):
        first, second = force[lane], crept[lane] - rest[lane] - rub[lane]
        force[lane] = lanes.inverse[0, 0, lane] * first + lanes.inverse[0, 1, lane] * second
        rub[lane] = lanes.inverse[1, 0, lane] * first + lanes.inverse[1, 1, lane] * second
    for i in range(3):
        for lane in range(LANES):
            if lanes.sticks[lane]:
                lanes.answer[i, lane] += rub[lane] * lanes.held[i, lane]


@inner
def adjoint(lanes, which, wrench, kept, moved):
    """What a lack of equilibrium does to the normal force (which: 0): ``d lambda = - y . rho`` for
    a residual ``rho`` of the modes' equations; or to the friction force of a contact that sticks
    (1; nothing to that of one that slides, which follows the normal force).

    The transposed linear system with the right-hand side of the force's equation. wrench, kept,
    moved: (3, LANES), overwritten: the adjoint wrench on the tip; the same with the penalty, so
    that ``y = W kept`` in the modes; and the pose that belongs to it.
    """
    for i in range(3):
        for lane in range(LANES):
            kept[i, lane] = lanes.inverse[which, 0, lane] * lanes.gap[c.GX + i, lane]
        if lanes.holds[0]:
            for lane in range(LANES):
                kept[i, lane] += lanes.inverse[which, 1, lane] * lanes.tangent[i, lane]
    _transpose(lanes, wrench, kept, moved)


@inner
def adjoint_turn(lanes, turn, wrench, kept, moved):
    """`adjoint` for the direction of the force: ``lambda dtheta = - y . rho``. turn: (3, LANES),
    ``lambda dtheta/dp``."""
    pressed, rubbed = lanes.fx, lanes.fy
    bend(lanes, turn, moved)
    dot(moved, lanes.pushed, pressed)
    if lanes.holds[0]:
        dot(moved, lanes.held, rubbed)
        for lane in range(LANES):
            one, other = pressed[lane], rubbed[lane]
            inverse = lanes.inverse
            pressed[lane] = one * inverse[0, 0, lane] + other * inverse[1, 0, lane]
            rubbed[lane] = one * inverse[0, 1, lane] + other * inverse[1, 1, lane]
    else:
        for lane in range(LANES):
            pressed[lane] *= lanes.inverse[0, 0, lane]
        for lane in range(LANES):
            rubbed[lane] = 0.0
    for i in range(3):
        for lane in range(LANES):
            kept[i, lane] = turn[i, lane] - (
                pressed[lane] * lanes.gap[c.GX + i, lane] + rubbed[lane] * lanes.tangent[i, lane]
            )
    _transpose(lanes, wrench, kept, moved)


@inner
def _transpose(lanes, wrench, kept, moved):
    """The transposed system of the tip for the right-hand side in `kept`; as in `adjoint`."""
    bend(lanes, kept, moved)
    unsymmetric.solve_transposed(lanes.small, moved)
    for i in range(3):
        for lane in range(LANES):
            kept[i, lane] += (
                lanes.change[0, i, lane] * moved[0, lane]
                + lanes.change[1, i, lane] * moved[1, lane]
                + lanes.change[2, i, lane] * moved[2, lane]
            )
    dot(lanes.leaned, moved, lanes.moved)
    for i in range(3):
        for lane in range(LANES):
            wrench[i, lane] = kept[i, lane] - (
                lanes.penalty[lane] * lanes.moved[lane] * lanes.leaned[i, lane]
            )
