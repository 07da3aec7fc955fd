"""The predictor: where a shape and its contact force will be at the target's next position."""

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.lanewise import dot
from fastncm.kernels.workspace import FLAG, INDEX, NUMBER, Layout
from fastncm.path import rows
from fastncm.path.lanes import MOST

#: Energy that the target's work does not explain, over all that is stored, from which a move is
#: taken again in shorter ones; and what is too little to matter (deflections near 1e-10).
_LEAP, _NOTHING = 0.1, 1e-20

#: What a block of lanes remembers of its last solved position, for the predictor.
#:
#: t, t_before: (LANES,); u, u_before, u_rate, u_rate_before: (m, LANES); force, force_rate ...
#: likewise (LANES,); power: (LANES,) the target's, per unit of its way; points: (LANES,) int64: how
#: many positions in a row were solved on one contact feature (0, 1, 2); feature: (LANES,); slip,
#: side, sticks, rub: (LANES,) of the contact's friction (`path.lanes`); sense: (LANES,) of the
#: target's last move, 0 before the first one; lost: (LANES,) bool, whether the branch of sliding
#: equilibria from first touch has ended.
#:
#: Of the way to the next position: touching: (LANES,) bool, whether there is contact at it; going:
#: bool, whether the target is still on its way; room: the longest next move; blocked: the sense in
#: which nothing was found (`path.careful`); falls: bool, whether the move was doubted for the
#: energy that it loses (`doubt_leaps`), fell: length of the last such move from here (0: none),
#: over: bool, whether it is now to be taken (`path.snap`). busy: (LANES,) bool and w0, w1, r0, r1:
#: (LANES,) workspace.
WALK = Layout(
    "Walk",
    MOST,
    {
        "t": (NUMBER, (LANES,)),
        "t_before": (NUMBER, (LANES,)),
        "u": (NUMBER, ("modes", LANES)),
        "u_before": (NUMBER, ("modes", LANES)),
        "u_rate": (NUMBER, ("modes", LANES)),
        "u_rate_before": (NUMBER, ("modes", LANES)),
        "power": (NUMBER, (LANES,)),
        "force": (NUMBER, (LANES,)),
        "force_before": (NUMBER, (LANES,)),
        "force_rate": (NUMBER, (LANES,)),
        "force_rate_before": (NUMBER, (LANES,)),
        "points": (INDEX, (LANES,)),
        "feature": (INDEX, (LANES,)),
        "slip": (NUMBER, (LANES,)),
        "side": (NUMBER, (LANES,)),
        "sticks": (FLAG, (LANES,)),
        "rub": (NUMBER, (LANES,)),
        "sense": (NUMBER, (LANES,)),
        "lost": (FLAG, (LANES,)),
        "going": (FLAG, (LANES,)),
        "touching": (FLAG, (LANES,)),
        "room": (NUMBER, (LANES,)),
        "blocked": (NUMBER, (LANES,)),
        "falls": (FLAG, (LANES,)),
        "fell": (NUMBER, (LANES,)),
        "over": (FLAG, (LANES,)),
        "busy": (FLAG, (LANES,)),
        "w0": (NUMBER, (LANES,)),
        "w1": (NUMBER, (LANES,)),
        "r0": (NUMBER, (LANES,)),
        "r1": (NUMBER, (LANES,)),
    },
)


@inner
def predict(lanes, walk):
    """Shape and force of the active lanes at ``lanes.t``: cubic through the last two positions and
    their rates, along the tangent from one, and the last shape itself where there is no rate."""
    modes = lanes.u.shape[0]
    w0, w1, r0, r1 = walk.w0, walk.w1, walk.r0, walk.r1
    for lane in range(LANES):
        w0[lane], w1[lane], r0[lane], r1[lane] = 0.0, 1.0, 0.0, 0.0
        ahead = lanes.t[lane] - walk.t[lane]
        if walk.points[lane] == 1:
            r1[lane] = ahead
        elif walk.points[lane] >= 2:
            # cubic Hermite polynomial on [t_before, t], evaluated beyond t
            h = walk.t[lane] - walk.t_before[lane]
            z = 1.0 + ahead / h
            w0[lane] = (1.0 + 2.0 * z) * (1.0 - z) ** 2
            w1[lane] = z * z * (3.0 - 2.0 * z)
            r0[lane] = h * z * (1.0 - z) ** 2
            r1[lane] = h * z * z * (z - 1.0)
    for k in range(modes):
        for lane in range(LANES):
            ahead = (
                w0[lane] * walk.u_before[k, lane]
                + w1[lane] * walk.u[k, lane]
                + r0[lane] * walk.u_rate_before[k, lane]
                + r1[lane] * walk.u_rate[k, lane]
            )
            lanes.u[k, lane] = ahead if lanes.active[lane] else lanes.u[k, lane]
    for lane in range(LANES):
        ahead = (
            w0[lane] * walk.force_before[lane]
            + w1[lane] * walk.force[lane]
            + r0[lane] * walk.force_rate_before[lane]
            + r1[lane] * walk.force_rate[lane]
        )
        lanes.force[lane] = ahead if lanes.active[lane] else lanes.force[lane]


@inlined
def power(lanes, lane):
    """What the target does on the finger per unit of its way: the contact force along it."""
    return lanes.force[lane] * lanes.gap[c.GX, lane] - lanes.rub[lane] * lanes.gap[c.GY, lane]


@inlined
def stored_energy(walk, lane):
    """Strain energy of the last solved position."""
    energy = 0.0
    for k in range(walk.u.shape[0]):
        energy += 0.5 * walk.u[k, lane] ** 2
    return energy


@inner
def doubt_leaps(lanes, walk):
    """Take a shape that the target's work on the way does not explain, less what friction takes of
    it, for none: the move was so long that it may have led to another branch of equilibria, or
    there is none that goes on."""
    before, now, gained = lanes.work[0], lanes.work[1], lanes.work[2]
    dot(walk.u, walk.u, before)
    dot(lanes.u, lanes.u, now)
    for lane in range(LANES):
        work = 0.5 * (walk.power[lane] + power(lanes, lane)) * (lanes.t[lane] - walk.t[lane])
        gained[lane] = 0.5 * (now[lane] - before[lane]) - work
    if lanes.rubs[0]:
        for lane in range(LANES):
            slid = 0.0 if lanes.sticks[lane] else abs(lanes.slipped[lane] - lanes.anchor[lane])
            rubbed = 0.5 * (abs(walk.rub[lane]) + abs(lanes.rub[lane])) * slid
            gained[lane] += rubbed if lanes.mu[lane] > 0.0 else 0.0
    for lane in range(LANES):
        least = max(0.5 * _LEAP * max(before[lane], now[lane]), _NOTHING)
        walk.falls[lane] = lanes.active[lane] and lanes.good[lane] and gained[lane] < -least
        if walk.falls[lane]:
            walk.fell[lane] = abs(lanes.t[lane] - walk.t[lane])
        explained = abs(gained[lane]) <= least or not lanes.active[lane]
        lanes.good[lane] = lanes.good[lane] and explained


@inner
def remember(lanes, walk):
    """Store the solved positions of the active lanes; a new feature starts the predictor afresh."""
    modes = lanes.u.shape[0]
    for lane in range(LANES):
        if not (lanes.active[lane] and lanes.good[lane]):
            continue
        feature = int(lanes.gap[c.FEATURE, lane])
        if feature == rows.SEVERAL:
            walk.points[lane] = 0
        elif feature == walk.feature[lane] and walk.t[lane] != lanes.t[lane]:
            walk.points[lane] = min(walk.points[lane] + 1, 2)
        else:
            walk.points[lane] = 1
        walk.feature[lane] = feature
        walk.fell[lane], walk.over[lane] = 0.0, False
        walk.power[lane] = power(lanes, lane)
        walk.t_before[lane], walk.t[lane] = walk.t[lane], lanes.t[lane]
        walk.force_before[lane], walk.force[lane] = walk.force[lane], lanes.force[lane]
        walk.force_rate_before[lane] = walk.force_rate[lane]
        walk.force_rate[lane] = lanes.force_rate[lane]
    for k in range(modes):
        for lane in range(LANES):
            if lanes.active[lane] and lanes.good[lane]:
                walk.u_before[k, lane] = walk.u[k, lane]
                walk.u_rate_before[k, lane] = walk.u_rate[k, lane]
                walk.u[k, lane] = lanes.u[k, lane]
                walk.u_rate[k, lane] = lanes.u_rate[k, lane]


@inner
def forget(walk, lane, t):
    """Back to the undeformed finger with the target at `t`."""
    walk.t[lane] = t
    walk.points[lane] = 0
    walk.lost[lane] = False
    walk.feature[lane] = c.VOID
    walk.force[lane], walk.power[lane] = 0.0, 0.0
    walk.fell[lane], walk.over[lane] = 0.0, False
    for k in range(walk.u.shape[0]):
        walk.u[k, lane] = 0.0
