"""Where the undeformed finger and the target touch.

Without contact the finger is straight, and straight is the global minimum of the energy wherever it
is admissible. So whether a position has contact, and where contact begins and ends, follows from
the gap of the undeformed finger alone: nothing is solved.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined, inner, kernel
from fastncm.kernels.points import smallest_gap
from fastncm.kernels.problem import Problem

Array = np.ndarray

#: How far from the ends of its bracket a trial stays (share of the position and a finger length);
#: trials at most: twelve are usual; a bracket that does not shrink is halved every fourth time.
_ROUNDING = 4e-16
_TRIALS = 240
#: Largest gap (finger lengths and target's sizes up to 1000) that is a touch.
_TOUCHING = 1e-9


@inner
def undeformed_gap(problem, d, t):
    """Smallest gap of the undeformed finger of design `d` with the target at `t`."""
    return _gap(problem.form, problem.points, problem.kind, problem.jaw, problem.target, d, t)


@inner
def _gap(form, points, kind, jaw, target, d, t):
    return smallest_gap(form, points, kind, jaw, target, d, t, 1.0, 0.0, 1.0, 0.0)


@inner
def locate_touch(problem, d, free, touching):
    """Position where contact begins, between `free` (gap >= 0) and `touching` (gap < 0), to
    rounding."""
    form, points = problem.form, problem.points
    return _locate(form, points, problem.kind, problem.jaw, problem.target, d, free, touching)


@inlined
def is_inside(problem, d, t):
    """True where the gap at the located touch `t` is no touch: the gap jumps there, because the
    target comes out of the inside of the jaw (from below into a cup, or out of its free end)."""
    return problem.form == c.CLOSEST and undeformed_gap(problem, d, t) > _TOUCHING


@inner
def _locate(form, points, kind, jaw, target, d, free, touching):
    """By the Illinois variant of the false position: of an end that stays twice the gap is
    halved."""
    at_free = _gap(form, points, kind, jaw, target, d, free)
    at_touching = _gap(form, points, kind, jaw, target, d, touching)
    stayed = 0
    for count in range(_TRIALS):
        middle = _trial(count, free, touching, at_free, at_touching)
        if middle == free or middle == touching:
            break
        gap = _gap(form, points, kind, jaw, target, d, middle)
        if gap >= 0.0:
            at_touching *= 0.5 if stayed > 0 else 1.0
            free, at_free, stayed = middle, gap, 1
        else:
            at_free *= 0.5 if stayed < 0 else 1.0
            touching, at_touching, stayed = middle, gap, -1
    return free


@inlined
def _trial(count, free, touching, at_free, at_touching):
    """Where to look for contact next: where the line through the two gaps is zero, but not at an
    end of the bracket; in the middle where there is no room for more."""
    way = touching - free
    least = _ROUNDING * (1.0 + abs(free)) / abs(way)
    if count % 4 == 3 or least >= 0.5:
        return 0.5 * (free + touching)
    return free + way * min(max(at_free / (at_free - at_touching), least), 1.0 - least)


@inner
def first_touch(kind, jaw, target, d, far, stop):
    """First contact of the undeformed finger with a target that comes from `far` down to `stop`.

    As the gap changes by at most the distance moved, steps as long as the gap can miss nothing.
    Returns `far` where the target never touches.
    """
    t = far
    while t > stop:
        gap = _gap(c.CLOSEST, 0, kind, jaw, target, d, t)
        if gap <= 0.0:
            return t
        ahead = t - max(gap * 1.001, 1e-7)
        if _gap(c.CLOSEST, 0, kind, jaw, target, d, ahead) < 0.0:
            t = _locate(c.CLOSEST, 0, kind, jaw, target, d, t, ahead)
            return t if t > stop else far
        t = ahead
    return far


@kernel
def _find(searching, form, points, kind, jaw, target, design, start, stop, out):
    """`first_touch` where it is still to be found (`searching`), else `locate_touch`: one function,
    so that the gap is compiled once for both."""
    for i in range(out.shape[0]):
        d = design[i]
        if searching:
            out[i] = first_touch(kind, jaw, target, d, start[i], stop[i])
        else:
            out[i] = _locate(form, points, kind, jaw, target, d, start[i], stop[i])


def first_touches(kind: int, jaw: Array, target: Array, far: Array, stop: Array) -> Array:
    """`first_touch` of D designs, (D,). jaw: (D, JAW_COLUMNS); target: (D, TARGET_COLUMNS); far,
    stop: (D,)."""
    out, design = np.empty(len(far)), np.arange(len(far))
    _find(True, c.CLOSEST, 0, kind, jaw, target, design, far, stop, out)
    return out


def locate_touches(problem: Problem, design: Array, free: Array, touching: Array) -> Array:
    """`locate_touch` for S designs, (S,). design: (S,) int64; free, touching: (S,)."""
    out = np.empty(len(design))
    form, points, kind = problem.form, problem.points, problem.kind
    _find(False, form, points, kind, problem.jaw, problem.target, design, free, touching, out)
    return out
