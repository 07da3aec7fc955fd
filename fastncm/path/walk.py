"""The predictor: where a shape and its contact force will be at the target's next position."""

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.workspace import FLAG, INDEX, NUMBER, Layout
from fastncm.path import rows
from fastncm.path.lanes import MOST

#: How much longer than the last move the next one may be, for the predictor to trust three
#: positions: their polynomial of fifth degree turns away fast.
_FARTHER = 1.5

#: What a block of lanes remembers of its last solved positions, for the predictor.
#:
#: t, t_before, t_earlier: (LANES,) of the last three, newest first; u, u_rate ...: (m, LANES);
#: force, force_rate ... likewise (LANES,); points: (LANES,) int64: how many positions in a row were
#: solved on one contact feature (0 to 3); feature: (LANES,); slip, side, sticks, rub: (LANES,) of
#: the contact's friction (`path.lanes`); sense: (LANES,) of the target's last move, 0 before the
#: first one; lost: (LANES,) bool, whether the branch of sliding equilibria from first touch has
#: ended.
#:
#: Of the way to the next position: touching: (LANES,) bool, whether there is contact at it; going:
#: bool, whether the target is still on its way; room: the longest next move; blocked: the sense in
#: which nothing was found (`path.careful`). busy: (LANES,) bool and weight, lever: (3, LANES)
#: workspace.
WALK = Layout(
    "Walk",
    MOST,
    {
        "t": (NUMBER, (LANES,)),
        "t_before": (NUMBER, (LANES,)),
        "t_earlier": (NUMBER, (LANES,)),
        "u": (NUMBER, ("modes", LANES)),
        "u_before": (NUMBER, ("modes", LANES)),
        "u_earlier": (NUMBER, ("modes", LANES)),
        "u_rate": (NUMBER, ("modes", LANES)),
        "u_rate_before": (NUMBER, ("modes", LANES)),
        "u_rate_earlier": (NUMBER, ("modes", LANES)),
        "force": (NUMBER, (LANES,)),
        "force_before": (NUMBER, (LANES,)),
        "force_earlier": (NUMBER, (LANES,)),
        "force_rate": (NUMBER, (LANES,)),
        "force_rate_before": (NUMBER, (LANES,)),
        "force_rate_earlier": (NUMBER, (LANES,)),
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
        "busy": (FLAG, (LANES,)),
        "weight": (NUMBER, (3, LANES)),
        "lever": (NUMBER, (3, LANES)),
    },
)


@inner
def _weigh(lanes, walk):
    """Weights of the last positions' values and rates in Hermite's polynomial through them, at
    ``lanes.t``: with one position the tangent, without rates the value itself."""
    weight, lever = walk.weight, walk.lever
    for lane in range(LANES):
        x0, x1 = lanes.t[lane] - walk.t[lane], lanes.t[lane] - walk.t_before[lane]
        x2 = lanes.t[lane] - walk.t_earlier[lane]
        last = walk.t[lane] - walk.t_before[lane]
        points = walk.points[lane]
        if points == 3 and not abs(x0) <= _FARTHER * abs(last):
            points = 2
        # Lagrange's polynomials of the positions at lanes.t, and their slopes at their own position
        l0, l1, l2, slope0, slope1, slope2 = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if points == 2:
            l0, l1 = x1 / last, -x0 / last
            slope0, slope1 = 1.0 / last, -1.0 / last
        elif points == 3:
            both, first = walk.t[lane] - walk.t_earlier[lane], x2 - x1
            l0, l1, l2 = (
                x1 * x2 / (last * both),
                -x0 * x2 / (last * first),
                x0 * x1 / (both * first),
            )
            slope0, slope1 = 1.0 / last + 1.0 / both, 1.0 / first - 1.0 / last
            slope2 = -1.0 / both - 1.0 / first
        weight[0, lane] = l0 * l0 * (1.0 - 2.0 * slope0 * x0)
        weight[1, lane] = l1 * l1 * (1.0 - 2.0 * slope1 * x1)
        weight[2, lane] = l2 * l2 * (1.0 - 2.0 * slope2 * x2)
        lever[0, lane] = l0 * l0 * x0 if points > 0 else 0.0
        lever[1, lane] = l1 * l1 * x1
        lever[2, lane] = l2 * l2 * x2


@inner
def predict(lanes, walk):
    """Shape and force of the active lanes at ``lanes.t``, by Hermite's polynomial through up to
    three positions on one contact feature."""
    modes = lanes.u.shape[0]
    weight, lever = walk.weight, walk.lever
    _weigh(lanes, walk)
    for k in range(modes):
        for lane in range(LANES):
            ahead = (
                weight[0, lane] * walk.u[k, lane]
                + weight[1, lane] * walk.u_before[k, lane]
                + weight[2, lane] * walk.u_earlier[k, lane]
                + lever[0, lane] * walk.u_rate[k, lane]
                + lever[1, lane] * walk.u_rate_before[k, lane]
                + lever[2, lane] * walk.u_rate_earlier[k, lane]
            )
            lanes.u[k, lane] = ahead if lanes.active[lane] else lanes.u[k, lane]
    for lane in range(LANES):
        ahead = (
            weight[0, lane] * walk.force[lane]
            + weight[1, lane] * walk.force_before[lane]
            + weight[2, lane] * walk.force_earlier[lane]
            + lever[0, lane] * walk.force_rate[lane]
            + lever[1, lane] * walk.force_rate_before[lane]
            + lever[2, lane] * walk.force_rate_earlier[lane]
        )
        lanes.force[lane] = ahead if lanes.active[lane] else lanes.force[lane]


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
            walk.points[lane] = min(walk.points[lane] + 1, 3)
        else:
            walk.points[lane] = 1
        walk.feature[lane] = feature
        walk.t_earlier[lane], walk.t_before[lane] = walk.t_before[lane], walk.t[lane]
        walk.force_earlier[lane], walk.force_before[lane] = (
            walk.force_before[lane],
            walk.force[lane],
        )
        walk.force_rate_earlier[lane] = walk.force_rate_before[lane]
        walk.force_rate_before[lane] = walk.force_rate[lane]
        walk.t[lane], walk.force[lane] = lanes.t[lane], lanes.force[lane]
        walk.force_rate[lane] = lanes.force_rate[lane]
    for k in range(modes):
        for lane in range(LANES):
            if lanes.active[lane] and lanes.good[lane]:
                walk.u_earlier[k, lane] = walk.u_before[k, lane]
                walk.u_rate_earlier[k, lane] = walk.u_rate_before[k, lane]
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
    walk.force[lane] = 0.0
    for k in range(walk.u.shape[0]):
        walk.u[k, lane] = 0.0
