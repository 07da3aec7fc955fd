"""Following the stable equilibria of one design, from one position of the target to the next, and
over their end to what the finger snaps to.

What counts is the branch that starts at first touch. So a move, by Newton's method or for the point
forms by the SQP, is taken only if the solution is a minimum along its active constraints and has
come there evenly, and is divided otherwise. The SQP also finds what the finger snaps to: by itself
it finds some minimum. A branch ends at a limit point, or where an edge or a corner slips
off another; there the finger snaps to a state of less energy.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.path import several
from fastncm.path.corners import corners_meet
from fastncm.sqp import qp, status
from fastncm.sqp.design import hessian
from fastncm.sqp.solve import solve

#: Shortest move of the target, as a share of the way to a position (and of a length, by rounding);
#: a move that fails is tried again with a part of it, one that does not is followed by a longer
#: one. Moves that are tried for one position, at most.
_SHORTEST, _ROUNDING = 1e-7, 1e-13
_SHORTER, _LONGER = 0.25, 2.0
_MOST_MOVES = 400
#: By how much the shape may change within the shortest move, even or not, over its length: a kink
#: looks like a jump, and an edge may be as steep as this.
_STEEPEST = 30.0
#: How far beyond the end of a branch (in shortest moves) a state to snap to is looked for: just
#: there its constraints may hardly be told from those of the branch.
_BEYOND = (1.0, 1e2, 1e4)
#: From where: the last shape (True), or evenly bent fingers, by the turn of their tip (rad).
_STARTS = ((True, 0.0), (False, 0.0), (False, -1.0), (False, 1.0), (False, -3.0), (False, 3.0))
#: How far a snap may turn the tip (rad): beyond, the finger winds around itself.
_LONGEST_TURN = 2.0 * np.pi
#: How much more energy (of its share by the way there) a snap releases than a smooth way does.
_FALL = 4.0
#: Force over the size of the shape, which is one over how far the contact gives way to a unit force
#: (its root; some 0.5 for a finger that bends): from here on the finger is taut.
_TAUT = 500.0
#: A change of shape (share of the shape) that is small; and by how much (share of the change) the
#: shape half-way may be off the middle: half of it is a jump. A finger that is hit head-on buckles
#: with the square root of the way, 0.21 off.
_SMALL, _TINY = 0.1, 1e-4
_OFF_MIDDLE = 0.25
#: Stiffness of the active constraints, over the Hessian's largest entry, by which the stability
#: along them is judged.
_STIFF = 1e4


class Spare(NamedTuple):
    """One design's tables, slope (Q, m) and end (m,), and its shapes (m,): the one in work, one
    half-way there, and the last one."""

    slope: np.ndarray
    end: np.ndarray
    u: np.ndarray
    u_middle: np.ndarray
    u_start: np.ndarray


def make_spare(modes: int, points: int) -> Spare:
    """Room for one design."""
    return Spare(
        np.zeros((points, modes)),
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(modes),
    )


@inner
def approach(design, mu, start, stop, spare, work, rubbing, options):
    """Follow the shape ``spare.u_start`` from the target's position `start` to `stop`; the solution
    is left in ``spare.u`` and ``spare.u_start``, and with friction in ``rubbing.kept``.

    A move counts where the solution changes little, or evenly. Where the branch ends (a limit
    point, an edge that slips off a corner) the finger snaps to what the SQP finds from there, if
    that has less energy; with friction (`path.several`) what follows is not looked for.

    Returns ``(status, reached, released, iterations)``: the last position of the branch from
    `start`, which is `stop` unless it ended, and the energy that the snap released there (0: none).
    """
    t, room, reached, released = start, stop - start, stop, 0.0
    shortest = max(_SHORTEST * abs(room), _ROUNDING * (1.0 + abs(start)))
    total, result = 0, status.MAX_ITERATIONS
    for _ in range(_MOST_MOVES):
        left = stop - t
        whole = abs(left) <= abs(room)
        goal = stop if whole else t + room
        least = _STEEPEST * shortest if abs(room) <= shortest else 0.0
        if design.form == c.CLOSEST:
            result, iterations, followed = _slide(
                design, mu, t, goal, least, spare, work, rubbing, options
            )
        else:
            result, iterations, followed = _move(design, t, goal, 0.0, spare, work, options)
        total += iterations
        if not followed and abs(room) <= shortest and mu == 0.0:
            if design.form == c.CLOSEST:
                _, iterations, followed = _move(design, t, goal, least, spare, work, options)
                total += iterations
            if not followed:
                goal, fallen, iterations = _snap(design, t, stop, shortest, spare, work, options)
                total += iterations
                followed = fallen > 0.0
                whole = goal == stop
                if followed and released == 0.0:
                    reached, released = t, fallen
            if followed:
                result = status.CONVERGED
                for k in range(work.multipliers.shape[0]):
                    pressed = work.multipliers[k] > 0.0
                    rubbing.state[k] = several.FORWARD if pressed else several.OPEN
                several.keep(work, rubbing)
        if followed:
            _copy(spare.u, spare.u_start)
            t = goal
            if whole:
                return result, reached, released, total
            room *= _LONGER
        elif abs(room) > shortest:
            room = np.copysign(max(_SHORTER * min(abs(room), abs(left)), shortest), left)
        else:
            break
    if result == status.CONVERGED or mu == 0.0 and result == status.NO_EQUILIBRIUM:
        result = status.MAX_ITERATIONS
    if mu == 0.0 and _is_taut(spare, rubbing):
        result = status.INFEASIBLE
    return result, t if released == 0.0 else reached, released, total


@inner
def _is_taut(spare, rubbing):
    """True where the finger of the last position hardly gives way to its contact force."""
    force = 0.0
    for k in range(rubbing.kept_force.shape[0]):
        force += rubbing.kept_force[k]
    return force > _TAUT * np.sqrt(2.0 * energy(spare.u_start))


@inner
def _copy(source, target):
    for k in range(source.shape[0]):
        target[k] = source[k]


@inner
def energy(u):
    """Strain energy of the modes `u` (m,)."""
    total = 0.0
    for k in range(u.shape[0]):
        total += 0.5 * u[k] * u[k]
    return total


@inner
def _turn(design, u):
    """Angle of the tip's section, rad."""
    total = 0.0
    for k in range(u.shape[0]):
        total += design.end[k] * u[k]
    return total


@inner
def _snap(design, start, stop, shortest, spare, work, options):
    """The stable state to which the finger snaps from ``spare.u_start`` just beyond `start`, left
    in ``spare.u``; looked for from there, then from others (`_STARTS`). Returns ``(where, energy
    released, iterations)``, 0 released where none is found."""
    total = 0
    for last, turn in _STARTS:
        for reach in _BEYOND:
            way = min(reach * shortest, abs(stop - start))
            goal = stop if way == abs(stop - start) else start + np.copysign(way, stop - start)
            for k in range(spare.u.shape[0]):
                spare.u[k] = spare.u_start[k] if last else 0.0
            if not last:
                spare.u[0] = turn / spare.end[0]
            work.multipliers[:] = 0.0
            result, _, iterations, _ = solve(design, goal, spare.u, 0, work, options)
            total += iterations
            before = energy(spare.u_start)
            fallen = before - energy(spare.u)
            least = _FALL * _SHORTEST * reach * before
            turned = abs(_turn(design, spare.u) - _turn(design, spare.u_start))
            found = result == status.CONVERGED and fallen > least and turned <= _LONGEST_TURN
            if found and _is_stable(design, work):
                return goal, fallen, total
    return start, 0.0, total


@inner
def _move(design, start, goal, least, spare, work, options):
    """Solve at `goal` from ``spare.u_start`` at `start`. Returns ``(status, iterations, whether the
    solution is stable and was followed)``; a change below `least` is."""
    _copy(spare.u_start, spare.u)
    work.multipliers[:] = 0.0
    result, count, total, _ = solve(design, goal, spare.u, 0, work, options)
    if result != status.CONVERGED or not _is_stable(design, work):
        return result, total, False
    size, change = 0.0, 0.0
    for k in range(spare.u.shape[0]):
        size = max(size, abs(spare.u_start[k]))
        change = max(change, abs(spare.u[k] - spare.u_start[k]))
    small = _SMALL if design.form != c.CLOSEST else _TINY
    if change <= max(small * size, least):
        return result, total, True
    _copy(spare.u_start, spare.u_middle)
    work.multipliers[:] = 0.0
    middle = start + 0.5 * (goal - start)
    halfway, count, iterations, _ = solve(design, middle, spare.u_middle, 0, work, options)
    total += iterations
    if halfway != status.CONVERGED:
        return result, total, False
    _copy(spare.u_middle, spare.u)
    result, count, iterations, _ = solve(design, goal, spare.u, count, work, options)
    total += iterations
    return result, total, result == status.CONVERGED and _is_even(spare, 0.0, 0.0)


@inner
def _is_even(spare, tiny, least):
    """True where the shape half-way is in the middle, or the change is a `tiny` share, or below
    `least`."""
    size, change, off = 0.0, 0.0, 0.0
    for k in range(spare.u.shape[0]):
        size = max(size, abs(spare.u_start[k]))
        change = max(change, abs(spare.u[k] - spare.u_start[k]))
        even = 0.5 * (spare.u_start[k] + spare.u[k])
        off = max(off, abs(spare.u_middle[k] - even))
    return off <= _OFF_MIDDLE * change or change <= max(tiny * size, least)


@inner
def _slide(design, mu, start, goal, least, spare, work, rubbing, options):
    """`_move` by Newton's method, with or without friction (`path.several`), over the state
    half-way. A change below `least` counts, even or not: a kink looks like a jump."""
    middle = start + 0.5 * (goal - start)
    several.recall(work, rubbing)
    _copy(spare.u_start, spare.u_middle)
    result, total, _ = several.solve(
        design, mu, start, middle, spare.u_middle, work, rubbing, options
    )
    if result != status.CONVERGED:
        return result, total, False
    _copy(spare.u_middle, spare.u)
    result, iterations, _ = several.solve(design, mu, middle, goal, spare.u, work, rubbing, options)
    followed = result == status.CONVERGED and _is_even(spare, _TINY, least)
    if mu == 0.0:
        followed = followed and _is_stable(design, work)
    if followed:
        several.keep(work, rubbing)
    return result, total + iterations, followed


@inner
def _is_stable(design, work):
    """True where the solved shape is a minimum of the energy along its active constraints."""
    if design.form == c.CLOSEST and corners_meet(work.at.gaps, work.multipliers):
        return False
    modes = work.step.shape[0]
    hessian(design, work.at, work.multipliers, work.hessian)
    largest = 0.0
    for i in range(modes):
        largest = max(largest, abs(work.hessian[i, i]))
    for k in range(work.multipliers.shape[0]):
        if work.multipliers[k] <= 0.0:
            continue
        row = work.at.jacobian[k]
        norm = 0.0
        for i in range(modes):
            norm += row[i] * row[i]
        for i in range(modes):
            for j in range(modes):
                work.hessian[i, j] += _STIFF * largest / norm * row[i] * row[j]
    return qp.cholesky(work.hessian, modes)
