"""Where the undeformed finger and the target touch.

Without contact the finger is straight, and straight is the global minimum of the energy wherever it
is admissible. So whether a position has contact, and where contact begins and ends, follows from
the gap of the undeformed finger alone: nothing is solved.
"""

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined, inner, kernel
from fastncm.kernels.gap import closest_gap
from fastncm.kernels.points import smallest_gap

#: Bisections until a bracket in finger lengths is at the rounding error.
_HALVINGS = 60


@inlined
def undeformed_gap(problem, d, t):
    """Smallest gap of the undeformed finger of design `d` with the target at `t`."""
    return smallest_gap(
        problem.form,
        problem.points,
        problem.kind,
        problem.jaw,
        problem.target,
        d,
        t,
        1.0,
        0.0,
        1.0,
        0.0,
    )


@inner
def locate_touch(problem, d, free, touching):
    """Position where contact begins, between `free` (gap >= 0) and `touching` (gap < 0), to
    rounding."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (free + touching)
        if middle == free or middle == touching:
            break
        if undeformed_gap(problem, d, middle) >= 0.0:
            free = middle
        else:
            touching = middle
    return free


@inner
def _undeformed_gap(kind, jaw, target, d, t):
    """The same from what is known before there is a problem: the closed form."""
    return closest_gap(kind, -1, jaw, target, d, t, 1.0, 0.0, 1.0, 0.0)[c.GAP]


@inner
def first_touch(kind, jaw, target, d, far, stop):
    """First contact of the undeformed finger with a target that comes from `far` down to `stop`.

    As the gap changes by at most the distance moved, steps as long as the gap can miss nothing; the
    last part is bisected. Returns `far` where the target never touches.
    """
    t = far
    while t > stop:
        gap = _undeformed_gap(kind, jaw, target, d, t)
        if gap <= 0.0:
            return t
        ahead = t - max(gap * 1.001, 1e-7)
        if _undeformed_gap(kind, jaw, target, d, ahead) < 0.0:
            for _ in range(_HALVINGS):
                middle = 0.5 * (t + ahead)
                if middle == t or middle == ahead:
                    break
                if _undeformed_gap(kind, jaw, target, d, middle) >= 0.0:
                    t = middle
                else:
                    ahead = middle
            return t if t > stop else far
        t = ahead
    return far


@kernel
def first_touches(kind, jaw, target, far, stop, out):
    """`first_touch` of D designs. jaw: (D, JAW_COLUMNS); target: (D, TARGET_COLUMNS); far, stop,
    out: (D,)."""
    for d in range(out.shape[0]):
        out[d] = first_touch(kind, jaw, target, d, far[d], stop[d])
