"""Where the next solve of a finger in direct contact begins: extrapolated from those before.

The target mostly goes on as it came. Angles follow the parabola through the last three solved
states, contact forces the line through the last two (they have kinks, where contacts come and go).
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inlined, inner

#: The target goes on where the cosine between its move and its last stride is as large, and the
#: move at most so many times as long.
_STRAIGHT, _FARTHER = 0.9, 1.5


class Strides(NamedTuple):
    """Solved states before the last one.

    psi, gamma: (2, N + 1) of the one before and of the one before that; force: (K,) of the one
    before. stride: (3,) of the target from that to the last; length: (2,) of this stride and of the
    one before, 0 where there is none.
    """

    psi: np.ndarray
    gamma: np.ndarray
    force: np.ndarray
    stride: np.ndarray
    length: np.ndarray


def make_strides(nodes: int, points: int) -> Strides:
    """Room for the states of fingers with so many nodes and contact points."""
    return Strides(
        np.zeros((2, nodes)), np.zeros((2, nodes)), np.zeros(points), np.zeros(3), np.zeros(2)
    )


@inlined
def forget(strides):
    """There are no states before."""
    strides.length[0], strides.length[1] = 0.0, 0.0


@inner
def remember(strides, kept, move, share):
    """`kept`, the last solved state, will be the one before after `share` of the target's move."""
    for i in range(kept.psi.shape[0]):
        strides.psi[1, i], strides.gamma[1, i] = strides.psi[0, i], strides.gamma[0, i]
        strides.psi[0, i], strides.gamma[0, i] = kept.psi[i], kept.gamma[i]
    for k in range(kept.force.shape[0]):
        strides.force[k] = kept.force[k]
    square = 0.0
    for c in range(3):
        strides.stride[c] = share * move[c]
        square += strides.stride[c] * strides.stride[c]
    strides.length[1] = strides.length[0]
    strides.length[0] = np.sqrt(square)


@inner
def predict(strides, kept, move, share, state):
    """Write into `state` where the finger may be after `share` of the target's move."""
    last, before = strides.length[0], strides.length[1]
    along, square = 0.0, 0.0
    for c in range(3):
        along += share * move[c] * strides.stride[c]
        square += share * share * move[c] * move[c]
    if not (last > 0.0 and along > _STRAIGHT * np.sqrt(square) * last):
        return
    far = along / last
    if far > _FARTHER * last:
        return
    # Newton's divided differences: kept + line (kept - first) + bend ((kept - first) / last -
    # (first - second) / before)
    line = far / last
    bend = far * (far + last) / (last + before) if before > 0.0 else 0.0
    rate, rate_before = line + bend / last, bend / before if before > 0.0 else 0.0
    for i in range(kept.psi.shape[0]):
        first, second = strides.psi[0, i], strides.psi[1, i]
        state.psi[i] += rate * (kept.psi[i] - first) - rate_before * (first - second)
        first, second = strides.gamma[0, i], strides.gamma[1, i]
        state.gamma[i] += rate * (kept.gamma[i] - first) - rate_before * (first - second)
    for k in range(kept.force.shape[0]):
        if kept.force[k] > 0.0 and strides.force[k] > 0.0:
            force = kept.force[k] + line * (kept.force[k] - strides.force[k])
            state.force[k] = max(force, 0.0)
            state.shear[k] = kept.shear[k] * (state.force[k] / kept.force[k])
