"""Where a finger whose base turns comes to touch its target: `path.start = "touch"` in a rotation.

The finger is straight and turns towards the side that touches, while the target goes on in space.
Back from the path's end the base is turned to where the finger touches, by strides that the
distance allows (conservative advancement; B. Mirtich, "Impulse-based Dynamic Simulation of Rigid
Body Systems", 1996, sec. 2.3), then on to where it does not any more; bisection between.
"""

import numpy as np

from fastncm.kernels.cache import inner, kernel
from fastncm.kernels.nodal import place_axis, place_surface
from fastncm.kernels.shared import share
from fastncm.path.surface_free import is_free, longest_reach

#: Shortest turn (rad) that is looked at, halvings between two, and the turn up to which contact is
#: looked for; without any the path begins so far before its end.
_SHORTEST, _HALVINGS, _HALF_TURN, _WITHOUT = 1e-3, 45, np.pi, 1.0


@inner
def _place(problem, d, target, base):
    """Placement ``(x, y, angle)`` in the base's frame of the target with the row `target`, the base
    at `base` (Lan & Lee 2008, eq. (18))."""
    along, speed, height, tilt = target[d, 0], target[d, 1], target[d, 2], target[d, 3]
    x, cos, sin = along + speed * (base - 0.5 * np.pi), np.cos(base), np.sin(base)
    return cos * x + sin * height - problem.arm[d], cos * height - sin * x, tilt - base


@inner
def _is_clear(problem, d, target, base, walk):
    x, y, angle = _place(problem, d, target, base)
    return is_free(problem, d, x, y, angle, walk)


@inner
def _stride(problem, d, target, base, walk):
    """A turn of the base in which a free finger cannot come to touch; at least the shortest."""
    x, y, angle = _place(problem, d, target, base)
    place_surface(problem, d, x, y, angle, walk.straight, np.inf)
    clear = np.inf
    for k in range(1, walk.straight.gap.shape[0]):
        clear = min(clear, walk.straight.gap[k])
    return max(_SHORTEST, clear / (longest_reach(problem, d) + abs(target[d, 1])))


@inner
def _find(problem, walk, target, stop, touch):
    """`turn_to_touch` with shared records."""
    back = -1.0 if problem.left else 1.0
    for d in range(stop.shape[0]):
        for k in range(walk.straight.seen.shape[0]):
            walk.straight.seen[k] = -np.inf
        place_axis(problem, walk.straight, problem.step.shape[0])
        turned = 0.0
        while turned < _HALF_TURN and _is_clear(problem, d, target, stop[d] + back * turned, walk):
            turned += _stride(problem, d, target, stop[d] + back * turned, walk)
        touch[d] = stop[d] + back * _WITHOUT
        if turned >= _HALF_TURN:
            continue
        inside = turned
        while turned < inside + _HALF_TURN:
            turned += _SHORTEST
            if _is_clear(problem, d, target, stop[d] + back * turned, walk):
                break
        inside = turned - _SHORTEST
        for _ in range(_HALVINGS):
            middle = 0.5 * (inside + turned)
            if _is_clear(problem, d, target, stop[d] + back * middle, walk):
                turned = middle
            else:
                inside = middle
        touch[d] = stop[d] + back * turned


@kernel
def turn_to_touch(problem, walk, target, stop, touch):
    """Write into `touch` (D,) the directions of the base (rad) at first touch on the way to `stop`
    (D,).

    walk: of `make_walk`; target: (D, 4), x at pi/2, speed ratio, y (finger lengths) and tilt.
    """
    _find(share(problem), share(walk), target, stop, touch)
