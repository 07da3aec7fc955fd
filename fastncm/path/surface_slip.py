"""Stick and slip of fingers in direct contact: which contacts slide, which way, and which hold.

A contact slides in the sense in which the target's surface moves along the finger there, and pulls
the finger with it, or it sticks to the target's point where it is. Which it does is found in
rounds: a contact that would have to slide backwards sticks, one that holds by more than ``mu
lambda`` slides. Where it would slide much farther backwards than friction could hold the finger
back, it slides the other way at once.
"""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.path.surface_rows import velocity

#: A contact that has slowed down to less than this part of its pace may have come back.
_SLOWED = 0.5
#: Safety of how far it may have: the law is checked at the ends of moves only.
_DOUBT = 4.0
#: Rounds after which contacts are only let go, so that the rounds end.
_BOTH_WAYS = 10
#: Rounds in which the sense of sliding is turned at once, and slip over the deflection times mu.
_TURNED, _FAR = 2, 10.0
#: Slip (finger lengths) and excess of friction that are rounding.
_SLIP_ROUNDING, _CONE_ROUNDING = 1e-13, 1e-10


@inlined
def _slip(state, kept, motion, x, y, k):
    """How far the target has moved along the finger at point `k` since the last solved state, in
    the sense of t."""
    if k > state.first.shape[0]:  # a point of the target
        j = state.node[k]
        across = state.section_sin[j] * state.nx[k] - state.section_cos[j] * state.ny[k]
        return (state.seen_y[k] - kept.seen_y[k]) * across
    vx, vy = velocity(motion, x, y, state.px[k], state.py[k])
    dx, dy = vx - (state.px[k] - kept.px[k]), vy - (state.py[k] - kept.py[k])
    return dy * state.nx[k] - dx * state.ny[k]


@inner
def choose_senses(state, motion, x, y, afresh):
    """A first guess for points that do not touch yet, or `afresh` for all: the target moves, the
    finger stands."""
    for k in range(state.force.shape[0]):
        if afresh or state.force[k] == 0.0:
            state.stuck[k], state.shear[k] = False, 0.0
            vx, vy = velocity(motion, x, y, state.px[k], state.py[k])
            slip = vy * state.nx[k] - vx * state.ny[k]
            state.along[k] = 1.0 if slip > 0.0 else (-1.0 if slip < 0.0 else 0.0)


@inner
def hold_new(state, motion, x, y, near):
    """Points without force that are as `near` to the target, at `x`, `y`, as they may come to touch
    it in its `motion` will stick to where they are.

    Next to the clamp, where the finger hardly gives way, a contact may stick from the beginning,
    and could not slide in either sense. Where in the motion it begins is in doubt.
    """
    for k in range(1, state.force.shape[0]):
        if state.force[k] == 0.0 and state.gap[k] <= near:
            vx, vy = velocity(motion, x, y, state.px[k], state.py[k])
            state.stuck[k], state.shear[k], state.pace[k] = True, 0.0, 0.0
            state.anchor_x[k], state.anchor_y[k] = state.seen_x[k], state.seen_y[k]
            state.doubt[k] = abs(vy * state.nx[k] - vx * state.ny[k])


@inner
def grip(state):
    """All contacts hold the target's points where they are, so far by no force."""
    for k in range(state.force.shape[0]):
        state.stuck[k], state.shear[k] = state.force[k] > 0.0, 0.0
        state.anchor_x[k], state.anchor_y[k] = state.seen_x[k], state.seen_y[k]
        state.pace[k], state.doubt[k] = 0.0, 0.0


@inlined
def _usual_pace(state):
    """Mean pace of all contacts, weighted by their forces."""
    total, weighted = 0.0, 0.0
    for k in range(state.force.shape[0]):
        total += state.force[k]
        weighted += state.force[k] * state.pace[k]
    return weighted / total if total > 0.0 else 0.0


@inner
def regrip(state, kept, motion, x, y, mu, turn, deflection, turned):
    """Change contacts of a solved state between stick and slip where their law is broken; turn:
    the number of the round; deflection: of the finger, by and large; turned: whether the target
    goes back, so that contacts stick where they were when it turned.

    Returns how many have changed.
    """
    changed = 0
    usual = 0.0 if turned else _usual_pace(kept)
    length = np.sqrt(motion[0] * motion[0] + motion[1] * motion[1] + motion[2] * motion[2])
    for k in range(state.force.shape[0]):
        if state.force[k] <= 0.0:
            continue
        if state.stuck[k]:
            if abs(state.shear[k]) > mu * state.force[k] * (1.0 + _CONE_ROUNDING):
                state.stuck[k] = False
                state.along[k] = 1.0 if state.shear[k] > 0.0 else -1.0
                state.shear[k], state.pace[k], state.doubt[k] = 0.0, 0.0, 0.0
                changed += 1
            continue
        slip = _slip(state, kept, motion, x, y, k)
        state.pace[k] = slip / length if length > 0.0 else 0.0
        before = usual * length
        slowed = slip * state.along[k] < _SLOWED * before * state.along[k]
        state.doubt[k] = _DOUBT * (abs(slip) + abs(before)) if slowed else 0.0
        if slip * state.along[k] > -_SLIP_ROUNDING and state.along[k] != 0.0:
            continue
        changed += 1
        if state.along[k] == 0.0:
            state.along[k] = 1.0 if slip > 0.0 else -1.0
        elif turn < _TURNED and abs(slip) > _FAR * mu * deflection:
            state.along[k] = -state.along[k]
        elif turn < _BOTH_WAYS and kept.force[k] > 0.0:
            state.stuck[k] = True
            state.shear[k] = mu * state.along[k] * state.force[k]
            state.anchor_x[k], state.anchor_y[k] = kept.seen_x[k], kept.seen_y[k]
        elif turn < _BOTH_WAYS:
            state.along[k] = -state.along[k]
        else:
            changed -= 1
    return changed


@inner
def finish_friction(state, mu):
    """Forget what no longer touches, and take off what a contact that sticks holds by rounding
    beyond ``mu lambda``."""
    for k in range(state.force.shape[0]):
        if state.force[k] <= 0.0:
            state.stuck[k], state.shear[k] = False, 0.0
        most = mu * state.force[k]
        state.shear[k] = min(max(state.shear[k], -most), most)
