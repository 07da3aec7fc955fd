"""Solving any number of single states: a design, a target's position, a start, and a feature to
hold.

A path is one state after the other (`path.trace`); events and peaks (`path.events`, `path.peaks`)
ask for states here and there on many paths at once.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels.cache import inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.problem import fill_basis
from fastncm.path import newton, rows
from fastncm.path.trace import NEWTON_STEPS


class States(NamedTuple):
    """S states. design: (S,) int64 of the problem; t: (S,) position of the target; hold: (S,) int64
    feature to keep, -1: the nearest; side: (S,) friction over normal force of the sliding contact;
    u: (S, m) and force: (S,): start, overwritten by the solution.

    Overwritten: u_rate: (S, m), derivative of u by t; pose_rate: (S, 3), that of the tip's pose;
    row: (S, rows.COLUMNS); good: (S,) bool, whether it was solved.
    """

    design: np.ndarray
    t: np.ndarray
    hold: np.ndarray
    side: np.ndarray
    u: np.ndarray
    force: np.ndarray
    u_rate: np.ndarray
    pose_rate: np.ndarray
    row: np.ndarray
    good: np.ndarray


def make_states(design: np.ndarray, t: np.ndarray, hold: np.ndarray, modes: int) -> States:
    """States of the undeformed finger."""
    count = len(design)
    return States(
        design.astype(np.int64),
        t.copy(),
        hold.astype(np.int64),
        np.zeros(count),
        np.zeros((count, modes)),
        np.zeros(count),
        np.zeros((count, modes)),
        np.zeros((count, 3)),
        np.zeros((count, rows.COLUMNS)),
        np.zeros(count, np.bool_),
    )


def some(states: States, chosen: np.ndarray) -> States:
    """A copy of the chosen states (indices, or a mask)."""
    return States(*(field[chosen] for field in states))


@inner
def _load(problem, states, first, lanes):
    """Put the states from `first` on into the lanes."""
    count = states.t.shape[0]
    lanes.rubs[0] = False
    for lane in range(LANES):
        i = first + lane
        lanes.active[lane] = i < count
        lanes.design[lane] = states.design[i] if i < count else -1
        if i < count:
            fill_basis(problem, states.design[i], lane, lanes)
            lanes.t[lane] = states.t[i]
            lanes.hold[lane] = states.hold[i]
            lanes.force[lane] = states.force[i]
            lanes.side[lane] = states.side[i]
            lanes.mu[lane] = abs(states.side[i])
            lanes.rub[lane], lanes.rub_rate[lane] = states.side[i] * states.force[i], 0.0
            lanes.rubs[0] = lanes.rubs[0] or states.side[i] != 0.0
            for k in range(lanes.u.shape[0]):
                lanes.u[k, lane] = states.u[i, k]


@inner
def _unload(states, first, lanes, measured):
    """Write the lanes back. measured: (rows.COLUMNS, LANES)."""
    for lane in range(LANES):
        i = first + lane
        if i >= states.t.shape[0]:
            break
        states.good[i] = lanes.good[lane]
        states.force[i] = lanes.force[lane]
        for k in range(lanes.u.shape[0]):
            states.u[i, k] = lanes.u[k, lane]
            states.u_rate[i, k] = lanes.u_rate[k, lane]
        for k in range(3):
            states.pose_rate[i, k] = lanes.pose_rate[k, lane]
        for column in range(rows.COLUMNS):
            states.row[i, column] = measured[column, lane]


@inner
def solve_all(problem, tolerance, lanes, measuring, states):
    """Solve all `states` of `problem`, `LANES` side by side."""
    for first in range(0, states.t.shape[0], LANES):
        _load(problem, states, first, lanes)
        newton.correct(problem, lanes, tolerance, NEWTON_STEPS)
        newton.rates(lanes)
        rows.measure(problem, lanes, measuring)
        _unload(states, first, lanes, measuring.row)
