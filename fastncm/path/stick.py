"""Which contacts stick and which slide, and in which sense (Coulomb friction, in steps).

From one position of the target to the next a contact either keeps its slip (`path.slip`), with
``|rub| <= mu lambda``, or slips so that the target's surface drags the finger along: ``rub = side
lambda`` with ``side = +-mu`` of the slip's sign. A contact goes on as before, sticks first where
the target turns back, and is solved again with the other assumption where its own comes out wrong.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.gap import closest_gap, store
from fastncm.path import newton
from fastncm.path.slip import contact_slip, slip
from fastncm.path.walk import predict

#: Assumptions that are tried for one position: to slide on, to stick, to slide the other way, ...
_ROUNDS = 4
#: Friction over its limit, and slip against its sense (finger lengths), that are rounding.
_CONE_ROUNDING = 1e-11
_SLIP_ROUNDING = 1e-13


@inner
def begin_contact(problem, lanes, walk, lane):
    """Friction of the undeformed finger of `lane` that the target at ``walk.t`` just touches.

    Sets the slip to count from, and the side for a target that moves to +x (sense 0: not moved
    yet).
    """
    d, t = lanes.design[lane], walk.t[lane]
    gap = closest_gap(problem.kind, -1, problem.jaw, problem.target, d, t, 1.0, 0.0, 1.0, 0.0)
    store(gap, lanes.gap, lane)
    walk.slip[lane] = contact_slip(
        problem.jaw, problem.target, d, lanes.gap[:, lane], t, 1.0, 0.0, 0.0
    )
    walk.side[lane] = lanes.mu[lane] if lanes.gap[c.GY, lane] <= 0.0 else -lanes.mu[lane]
    walk.sticks[lane] = False
    walk.rub[lane], walk.sense[lane] = 0.0, 0.0


@inner
def locking_friction(problem, lanes, walk, lane, sense):
    """Friction from which on the undeformed finger of `lane`, touched by a target that goes on in
    `sense`, does not give way (infinite: it always does).

    After `begin_contact`. There the determinant of `path.tip` is ``a C b``, linear in the friction,
    with the undeformed finger's flexibility ``C = J J^T`` and dx/du = 0.
    """
    gap = lanes.gap[:, lane]
    side = sense if walk.side[lane] > 0.0 else -sense
    arm_x, arm_y = gap[c.PX] - 1.0, gap[c.PY]
    drag_y, drag_turn = side * gap[c.GX], side * (arm_x * gap[c.GX] + arm_y * gap[c.GY])
    slope, end, weights = lanes.slope, lanes.end, problem.rule.weights
    give, drag = 0.0, 0.0
    for k in range(end.shape[0]):
        rise = 0.0
        for q in range(weights.shape[0]):
            rise += weights[q] * slope[k, q, lane]
        turn = end[k, lane]
        opens = gap[c.GY] * rise + gap[c.GP] * turn
        give += opens * opens
        drag += opens * (drag_y * rise + drag_turn * turn)
    return -give / drag if drag < 0.0 else np.inf


@inner
def assume(lanes, walk):
    """Before a move of the targets: each contact goes on as it did; where the target turns back it
    sticks."""
    for lane in range(LANES):
        if not lanes.active[lane]:
            continue
        lanes.sticks[lane] = False
        lanes.side[lane] = 0.0
        if lanes.mu[lane] == 0.0:
            continue
        sense = np.sign(lanes.t[lane] - walk.t[lane])
        lanes.anchor[lane] = walk.slip[lane]
        if walk.sense[lane] == 0.0:
            lanes.side[lane] = walk.side[lane] * sense
        elif sense == -walk.sense[lane] or walk.sticks[lane]:
            lanes.sticks[lane] = True
        else:
            lanes.side[lane] = walk.side[lane]
    _begin_friction(lanes, walk)


@inner
def _begin_friction(lanes, walk):
    """Friction forces of the active lanes to start from, and whether any contact sticks."""
    lanes.holds[0] = False
    for lane in range(LANES):
        if lanes.active[lane]:
            slides = lanes.side[lane] * lanes.force[lane]
            lanes.rub[lane] = walk.rub[lane] if lanes.sticks[lane] else slides
            lanes.slipped[lane] = lanes.anchor[lane]
        lanes.holds[0] = lanes.holds[0] or lanes.sticks[lane]


@inner
def settle(problem, lanes, walk, tolerance, most):
    """Solve the active lanes again whose assumption came out wrong, with the other one.

    Leaves the slip of every lane with friction in `slipped`.
    """
    for lane in range(LANES):
        walk.busy[lane] = lanes.active[lane]
    for round in range(_ROUNDS):
        wrong = False
        for lane in range(LANES):
            lanes.active[lane] = walk.busy[lane] and _is_wrong(problem, lanes, lane)
            wrong = wrong or lanes.active[lane]
        if not wrong:
            break
        if round == _ROUNDS - 1:
            for lane in range(LANES):
                lanes.good[lane] = lanes.good[lane] and not lanes.active[lane]
            break
        predict(lanes, walk)
        for lane in range(LANES):
            if lanes.active[lane]:
                if lanes.sticks[lane]:
                    lanes.side[lane] = np.copysign(lanes.mu[lane], lanes.rub[lane])
                else:
                    lanes.side[lane] = 0.0
                lanes.sticks[lane] = not lanes.sticks[lane]
        _begin_friction(lanes, walk)
        newton.correct(problem, lanes, tolerance, most)
    for lane in range(LANES):
        lanes.active[lane] = walk.busy[lane]


@inner
def _is_wrong(problem, lanes, lane):
    """True where friction is beyond its limit, a contact slips against its sense, or cannot stick.

    Where it cannot slide friction locks: that is no reason to stick.
    """
    mu = lanes.mu[lane]
    if mu == 0.0 or not lanes.good[lane]:
        return mu > 0.0 and lanes.sticks[lane]
    if lanes.sticks[lane]:
        return abs(lanes.rub[lane]) > (1.0 + _CONE_ROUNDING) * mu * lanes.force[lane]
    lanes.slipped[lane] = slip(problem, lanes, lane)
    return (lanes.slipped[lane] - lanes.anchor[lane]) * lanes.side[lane] < -_SLIP_ROUNDING * mu


@inner
def keep(lanes, walk):
    """Remember the friction of the solved lanes; called before `walk.remember`, whose predictor
    starts afresh where a contact changed between sticking and sliding or the target turned back."""
    for lane in range(LANES):
        if not lanes.active[lane] or lanes.mu[lane] == 0.0:
            continue
        if not lanes.good[lane]:
            walk.lost[lane] = True
            continue
        sense = np.sign(lanes.t[lane] - walk.t[lane])
        if sense == 0.0:
            sense = walk.sense[lane]
        same = lanes.sticks[lane] == walk.sticks[lane] and lanes.side[lane] == walk.side[lane]
        if not same or sense != walk.sense[lane]:
            walk.points[lane] = 0
        walk.sense[lane] = sense
        walk.sticks[lane], walk.side[lane] = lanes.sticks[lane], lanes.side[lane]
        walk.rub[lane] = lanes.rub[lane]
        walk.slip[lane] = lanes.anchor[lane] if lanes.sticks[lane] else lanes.slipped[lane]
