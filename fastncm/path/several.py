"""Newton's method with friction where several pairs of a jaw and a target may touch at once.

    u - sum_k J^T (lambda_k a_k + rub_k tau_k) = 0,    g >= 0,    lambda >= 0,    lambda g = 0

with the wrenches a_k = dg_k/dp and tau_k of a unit force along the contact's tangent on the tip's
pose p, J = dp/du (`path.tip`). Each closed pair slides in the sense in which its slip (`path.slip`)
has changed since the last position, ``rub = side lambda``, or sticks, ``|rub| <= mu lambda``. The
matrix is unsymmetric: there is no energy that falls. So each step solves the linearised conditions
with the pairs' last states, and where their answer breaks a condition, with others until it does
not. Positions are close together (`path.follow`), which is why full steps converge.

Two closed pairs leave the jaw one way to move; where one of them sticks, so does the other. How
they share the friction force is then open; one of them is given its limit.
"""

from typing import NamedTuple

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.elimination import eliminate
from fastncm.path.corners import corners_meet
from fastncm.path.slip import contact_slip
from fastncm.sqp import design as model
from fastncm.sqp import status

#: States of a pair.
OPEN, FORWARD, BACKWARD, STICKS = range(4)
#: Steps at most; closed pairs at most, and the equations that they add: two gaps and a slip.
_STEPS = 30
_EQUATIONS = 3
#: What is rounding: a gap, or a slip against its sense (finger lengths); a force (share of the
#: largest).
_GAP_ROUNDING, _FORCE_ROUNDING = 1e-13, 1e-11
#: By how much a step may turn the tip: a thin end turns far.
_LONGEST_TURN = 0.05
#: Residual that is accepted where rounding lets it fall no further.
_STALLED = 1e-9


class Rubbing(NamedTuple):
    """Workspace for m unknowns and K pairs.

    state, rub: (K,) of the pairs, int64 and friction force; kept, kept_force, kept_rub: (K,)
    states, normal and friction forces at the last position; states, forces, rubs: (LANES, K) the
    same of each design that is under way; anchor, slipped: (K,) slip at the last position and now;
    tangent: (K, 3) tau; drag: (K, m) J^T tau. change: (3, 3) derivative of all contacts' wrench by
    the pose; carried: (3, m) that by the unknowns; base: (m, m) Hessian; matrix: (m + 3, m + 3),
    right, scale: (m + 3,) of the system.
    """

    state: np.ndarray
    kept: np.ndarray
    kept_force: np.ndarray
    kept_rub: np.ndarray
    states: np.ndarray
    forces: np.ndarray
    rubs: np.ndarray
    anchor: np.ndarray
    slipped: np.ndarray
    rub: np.ndarray
    tangent: np.ndarray
    drag: np.ndarray
    change: np.ndarray
    carried: np.ndarray
    base: np.ndarray
    matrix: np.ndarray
    right: np.ndarray
    scale: np.ndarray


def make_rubbing(modes: int, pairs: int) -> Rubbing:
    """A workspace, all pairs open."""
    size = modes + _EQUATIONS
    return Rubbing(
        np.zeros(pairs, np.int64),
        np.zeros(pairs, np.int64),
        np.zeros(pairs),
        np.zeros(pairs),
        np.zeros((LANES, pairs), np.int64),
        np.zeros((LANES, pairs)),
        np.zeros((LANES, pairs)),
        np.zeros(pairs),
        np.zeros(pairs),
        np.zeros(pairs),
        np.zeros((pairs, 3)),
        np.zeros((pairs, modes)),
        np.zeros((3, 3)),
        np.zeros((3, modes)),
        np.zeros((modes, modes)),
        np.zeros((size, size)),
        np.zeros(size),
        np.zeros(size),
    )


@inner
def solve(design, mu, before, t, u, work, rubbing, options):
    """Equilibrium of `design` with friction `mu` and the target at `t`, from the shape `u` with the
    target at `before`.

    u: (m,), start on entry, solution on return; ``rubbing.state``, the normal forces
    ``work.multipliers`` and the friction forces ``rubbing.rub`` likewise. Leaves the evaluation in
    ``work.at``. Returns ``(status, iterations, residual)``.
    """
    evaluate(design, mu, before, u, work.at, rubbing)
    for k in range(rubbing.state.shape[0]):
        faces = work.at.gaps[c.FEATURE, k] != c.VOID
        rubbing.anchor[k] = rubbing.slipped[k] if faces else np.nan
    evaluate(design, mu, t, u, work.at, rubbing)
    for k in range(rubbing.state.shape[0]):
        if np.isnan(rubbing.anchor[k]):  # what begins to face: less the target's own way
            rubbing.anchor[k] = rubbing.slipped[k] + work.at.gaps[c.GY, k] * (t - before)
    last = np.inf
    for iteration in range(_STEPS):
        add_up_stiffness(design, work, rubbing)
        if not _step(mu, u, work, rubbing):
            return status.NO_EQUILIBRIUM, iteration + 1, last
        turn = 0.0
        for i in range(u.shape[0]):
            turn += design.end[i] * rubbing.right[i]
        share = min(1.0, _LONGEST_TURN / abs(turn)) if turn != 0.0 else 1.0
        for i in range(u.shape[0]):
            u[i] += share * rubbing.right[i]
        evaluate(design, mu, t, u, work.at, rubbing)
        residual = friction_residual(mu, u, work, rubbing)
        stalled = residual >= 0.5 * last
        rounded = residual <= _STALLED or _grazes(design, t, residual, work)
        if residual <= options.tolerance or stalled and rounded:
            held = corners_meet(work.at.gaps, work.multipliers)
            result = status.NO_EQUILIBRIUM if held else status.CONVERGED
            return result, iteration + 1, residual
        last = residual
    return status.MAX_ITERATIONS, _STEPS, last


@inner
def recall(work, rubbing):
    """Begin from the last position's states and forces."""
    for k in range(rubbing.kept.shape[0]):
        rubbing.state[k], rubbing.rub[k] = rubbing.kept[k], rubbing.kept_rub[k]
        work.multipliers[k] = rubbing.kept_force[k]


@inner
def keep(work, rubbing):
    """Remember the states and forces of the solution."""
    for k in range(rubbing.kept.shape[0]):
        rubbing.kept[k], rubbing.kept_rub[k] = rubbing.state[k], rubbing.rub[k]
        rubbing.kept_force[k] = work.multipliers[k]


@inner
def load(lane, free, rubbing):
    """The states and forces of the design in `lane`: all open where it is `free`."""
    for k in range(rubbing.kept.shape[0]):
        rubbing.kept[k] = OPEN if free else rubbing.states[lane, k]
        rubbing.kept_force[k] = 0.0 if free else rubbing.forces[lane, k]
        rubbing.kept_rub[k] = 0.0 if free else rubbing.rubs[lane, k]
        rubbing.rub[k] = 0.0


@inner
def unload(lane, rubbing):
    """Store them again."""
    for k in range(rubbing.kept.shape[0]):
        rubbing.states[lane, k] = rubbing.kept[k]
        rubbing.forces[lane, k], rubbing.rubs[lane, k] = rubbing.kept_force[k], rubbing.kept_rub[k]


@inner
def _grazes(design, t, residual, work):
    """True where only rounding keeps the gaps of a light contact from being closed, as in
    `path.newton`."""
    d = design.which
    reach = design.target[d, c.TARGET_RADIUS] + abs(design.jaw[d, c.RHO]) + abs(t)
    for k in range(work.multipliers.shape[0]):
        gap = work.at.gaps[c.GAP, k]
        off = abs(gap) if work.multipliers[k] != 0.0 else -gap
        if off > c.GAP_ROUNDING * (1.0 + reach):
            return False
    return residual <= c.GRAZING


@inner
def evaluate(design, mu, t, u, at, rubbing):
    """Gaps of all pairs at `u` with the target at `t`, and with friction the wrenches and slips."""
    model.evaluate(design, t, u, at)
    if mu == 0.0:
        return
    x, y, psi = at.pose[0], at.pose[1], at.pose[2]
    for k in range(at.gaps.shape[1]):
        gap = at.gaps[:, k]
        tangent = rubbing.tangent[k]
        tangent[0], tangent[1] = -gap[c.GY], gap[c.GX]
        tangent[2] = (gap[c.PX] - x) * gap[c.GX] + (gap[c.PY] - y) * gap[c.GY]
        if gap[c.FEATURE] <= c.FAR_RETURN:  # the place on the jaw
            tangent[2] += gap[c.GAP]
        for i in range(u.shape[0]):
            rubbing.drag[k, i] = (
                tangent[0] * at.gradient[0, i]
                + tangent[1] * at.gradient[1, i]
                + tangent[2] * design.end[i]
            )
        rubbing.slipped[k] = contact_slip(
            design.jaw, design.target, design.which, gap, t, x, y, psi
        )


@inner
def add_up_stiffness(design, work, rubbing):
    """``base = d(u - J^T wrench)/du`` under the forces as they stand."""
    at, base = work.at, rubbing.base
    modes = base.shape[0]
    rubbing.change[:, :] = 0.0
    at.force[:] = 0.0
    for k in range(rubbing.state.shape[0]):
        force, rub, gap = work.multipliers[k], rubbing.rub[k], at.gaps[:, k]
        if force == 0.0:
            continue
        at.force[0] += force * gap[c.GX] - rub * gap[c.GY]
        at.force[1] += force * gap[c.GY] + rub * gap[c.GX]
        arm_x, arm_y = gap[c.PX] - at.pose[0], gap[c.PY] - at.pose[1]
        for j in range(3):  # as in `path.tip`
            hx = gap[c.HXP] if j == 2 else gap[c.HXX + j]
            hy = gap[c.HYP] if j == 2 else gap[c.HXY + j]
            hp = gap[c.HPP] if j == 2 else gap[c.HXP + j]
            turned = arm_x * hx + arm_y * hy + (gap[c.GP] if j == 2 else 0.0)
            rubbing.change[0, j] += force * hx - rub * hy
            rubbing.change[1, j] += force * hy + rub * hx
            rubbing.change[2, j] += force * hp + rub * turned
    for j in range(modes):
        x, y, end = at.gradient[0, j], at.gradient[1, j], design.end[j]
        for i in range(3):
            row = rubbing.change[i]
            rubbing.carried[i, j] = row[0] * x + row[1] * y + row[2] * end
    base[:, :] = 0.0
    model.add_position_hessian(design, at, base)
    for i in range(modes):
        base[i, i] += 1.0
        for j in range(i):
            base[j, i] = base[i, j]
    for i in range(modes):
        x, y, end = at.gradient[0, i], at.gradient[1, i], design.end[i]
        for j in range(modes):
            moved = x * rubbing.carried[0, j] + y * rubbing.carried[1, j]
            base[i, j] -= moved + end * rubbing.carried[2, j]


@inner
def _step(mu, u, work, rubbing):
    """The step, in ``rubbing.right``, and the forces behind it; False where no states of the pairs
    agree with the linearised conditions on a branch whose determinant is positive."""
    if _agrees(mu, u, work, rubbing):
        return True
    pairs = rubbing.state.shape[0]
    rubbing.state[:] = OPEN  # on the way there may be no contact
    if _agrees(mu, u, work, rubbing):
        return True
    for apart in range(pairs):  # each pair alone, then two
        for k in range(pairs - apart):
            for code in range(FORWARD, STICKS + 1 if apart == 0 else (STICKS + 1) ** 2):
                one, other = code % (STICKS + 1), code // (STICKS + 1)
                if apart > 0 and (min(one, other) == OPEN or one + other == 2 * STICKS):
                    continue
                if mu == 0.0 and max(one, other) > FORWARD:
                    continue
                rubbing.state[:] = OPEN
                rubbing.state[k + apart] = other
                rubbing.state[k] = one
                if _agrees(mu, u, work, rubbing):
                    return True
    return False


@inner
def _agrees(mu, u, work, rubbing):
    """Solve the linearised conditions with the pairs' states; whether the answer keeps them."""
    modes, pairs = u.shape[0], rubbing.state.shape[0]
    size = fill(mu, u, work, rubbing)
    if size == 0 or eliminate(rubbing.matrix, rubbing.right, rubbing.scale, size) <= 0.0:
        return False
    largest, row = 0.0, modes
    for k in range(pairs):
        work.multipliers[k], rubbing.rub[k] = 0.0, 0.0
        if rubbing.state[k] == OPEN:
            continue
        work.multipliers[k] = rubbing.right[row]
        largest = max(largest, abs(rubbing.right[row]))
        row += 1
        if rubbing.state[k] == STICKS:
            rubbing.rub[k] = rubbing.right[row]
            row += 1
        else:
            rubbing.rub[k] = side_of(rubbing.state[k], mu) * work.multipliers[k]
    for k in range(pairs):
        opens, slips = work.at.gaps[c.GAP, k], rubbing.slipped[k] - rubbing.anchor[k]
        for i in range(modes):
            opens += work.at.jacobian[k, i] * rubbing.right[i]
            slips -= rubbing.drag[k, i] * rubbing.right[i]
        state, force = rubbing.state[k], work.multipliers[k]
        if state == OPEN:
            if opens < -_GAP_ROUNDING:
                return False
        elif force < -_FORCE_ROUNDING * largest:
            return False
        elif state == STICKS:
            if abs(rubbing.rub[k]) > mu * force + _FORCE_ROUNDING * largest:
                return False
        elif slips * side_of(state, mu) < -_GAP_ROUNDING * mu:
            return False
    return True


@inlined
def side_of(state, mu):
    """Friction over normal force of a pair that slides."""
    return mu if state == FORWARD else -mu


@inner
def fill(mu, u, work, rubbing):
    """The linear system of the pairs' states. Returns its size; 0 where a pair that is to be closed
    does not face."""
    modes, matrix, right = u.shape[0], rubbing.matrix, rubbing.right
    matrix[:, :] = 0.0
    for i in range(modes):
        right[i] = -u[i]
        for j in range(modes):
            matrix[i, j] = rubbing.base[i, j]
    row = modes
    for k in range(rubbing.state.shape[0]):
        state = rubbing.state[k]
        if state == OPEN:
            continue
        if work.at.gaps[c.FEATURE, k] == c.VOID:
            return 0
        side = 0.0 if state == STICKS else side_of(state, mu)
        for i in range(modes):
            matrix[row, i] = work.at.jacobian[k, i]
            matrix[i, row] = -work.at.jacobian[k, i] - side * rubbing.drag[k, i]
        right[row] = -work.at.gaps[c.GAP, k]
        row += 1
        if state == STICKS:
            for i in range(modes):
                matrix[row, i] = rubbing.drag[k, i]
                matrix[i, row] = -rubbing.drag[k, i]
            right[row] = rubbing.slipped[k] - rubbing.anchor[k]
            row += 1
    return row


@inner
def friction_residual(mu, u, work, rubbing):
    """Largest relative violation of the conditions of equilibrium and of Coulomb's law, from
    scratch: `sqp.solve.kkt_residual` with friction."""
    gaps, forces = work.at.gaps, work.multipliers
    largest, force, deflection, residual = c.GAP_ROUNDING, c.GAP_ROUNDING, c.GAP_ROUNDING, 0.0
    for k in range(forces.shape[0]):
        force = max(force, abs(forces[k]))
        moved = 0.0
        for i in range(u.shape[0]):
            moved += work.at.jacobian[k, i] * u[i]
        if forces[k] != 0.0:
            deflection = max(deflection, abs(moved))
    for i in range(u.shape[0]):
        largest = max(largest, abs(u[i]))
    for i in range(u.shape[0]):
        slack = u[i]
        for k in range(forces.shape[0]):
            slack -= work.at.jacobian[k, i] * forces[k] + rubbing.drag[k, i] * rubbing.rub[k]
        residual = max(residual, abs(slack) / largest)
    for k in range(forces.shape[0]):
        gap, state = gaps[c.GAP, k], rubbing.state[k]
        residual = max(residual, -gap / deflection)
        if state != OPEN:
            slips = rubbing.slipped[k] - rubbing.anchor[k]
            against = abs(slips) if state == STICKS else -slips * side_of(state, 1.0)
            residual = max(
                residual, abs(gap) / deflection, -forces[k] / force, against / deflection
            )
            residual = max(residual, (abs(rubbing.rub[k]) - mu * forces[k]) / force)
    return residual
