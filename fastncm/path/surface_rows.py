"""What is kept of each solved position of a finger in direct contact.

The error estimate has five parts. A node touches where the target would touch between two: the
finger is held off by up to an eighth of the second difference of the gaps around the ends of the
contact, or at the tip by how deep the side lies in the target before it. The axis is a chain of
chords, each shorter than its arc by ``(h psi')^2 / 24``, which moves a contact by their sum. The
energy is a midpoint rule, which misses the second differences of ``M^2 / B``: so much the finger is
too stiff. Forces act on nodes (`path.misplaced`). And what the iteration left. What a move of all
contacts along their normals does to the force is one pass along the finger.
"""

import numpy as np

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.distance import ELLIPSE
from fastncm.kernels.nodal import contact_direction, friction_ratio
from fastncm.path.misplaced import (
    before_tip,
    depth_between,
    misplaced_forces,
    tip_slope,
    unsure_senses,
)
from fastncm.sqp.chain_step import solve_chain
from fastncm.sqp.surface_state import ROUNDING, kkt_residual, strain_energy

# --- columns of a row: dimensionless, in space (not in the base's frame) -------------------------
# LOST: how the finger came into contact (`surface_way.FOLLOWED` and so on). SNAP, RELEASED: the
# position of the first snap on the way to the row and its energy (0: none). Of rows that are not
# solved: END, the position where the branch has ended; CRITICAL, the friction up to which it would
# reach the row, 0 where it does not without friction (NaN: not known).
(
    POSITION,
    STATUS,
    FORCE_X,
    FORCE_Y,
    INSERTION,
    NORMAL,
    FRICTION,
    CONTACTS,
    STICKING,
    S_MEAN,
    X_MEAN,
    Y_MEAN,
    S_FROM,
    S_TO,
    TIP_X,
    TIP_Y,
    TIP_ANGLE,
    ENERGY,
    STRAIN,
    WORK_RATE,
    ITERATIONS,
    RESIDUAL,
    ESTIMATE,
    OVERLAP,
    LOST,
    SNAP,
    RELEASED,
    END,
    CRITICAL,
) = range(29)
COLUMNS = 29

#: Safety of the estimate; compared with the true error in tests/path/test_surface_estimate.py.
SAFETY = 2.1
#: Relative error of the force per unit of KKT residual, and the arithmetic's own.
ALGEBRAIC, FORCE_ROUNDING = 10.0, 1e-12


@inlined
def velocity(motion, x, y, px, py):
    """Velocity of the target's point at `px`, `py`, in the base's frame: `motion` (vx, vy, turn) of
    the target about its reference point at `x`, `y`."""
    return motion[0] - motion[2] * (py - y), motion[1] + motion[2] * (px - x)


@inner
def _stiffness(problem, d, work):
    """Change of the sum of normal forces per unit by which all contacts are moved along their
    normals."""
    state, chain = work.state, work.chain
    for k in range(state.force.shape[0]):
        chain.touching[k] = state.force[k] > 0.0
    solve_chain(problem, d, state, chain, work.size[0], 0.0)
    total = 0.0
    for k in range(state.force.shape[0]):
        total += chain.force[k]
    return total


@inner
def doubted_forces(problem, d, work):
    """Change of the contact forces by what is in doubt of where contacts stick, at most: they stay
    within friction. One pass along the finger with all of them held, moved by so much."""
    state, chain, mu, doubtful = work.state, work.chain, problem.mu[d], False
    for k in range(state.force.shape[0]):
        chain.touching[k], chain.mark[k] = state.force[k] > 0.0, False
        if chain.touching[k] and state.doubt[k] > 0.0:
            doubtful = True
            if not state.stuck[k]:
                chain.mark[k], state.stuck[k], state.slide[k] = True, True, 0.0
                state.shear[k] = mu * state.along[k] * state.force[k]
            state.slide[k] += state.doubt[k]
    if not doubtful:
        return 0.0
    solve_chain(problem, d, state, chain, work.size[0], 1.0)
    change = 0.0
    for k in range(state.force.shape[0]):
        if chain.touching[k]:
            moved = abs(chain.force[k] - state.force[k]) + abs(chain.shear[k] - state.shear[k])
            change += min(moved, 2.0 * mu * state.force[k])
            state.slide[k] -= state.doubt[k]
        if chain.mark[k]:
            state.stuck[k], state.shear[k] = False, 0.0
    return change


@inlined
def _beyond_end(problem, d, i, state, k):
    """How deep an ellipse lies in the side beside its point `k`, with another normal than the
    side's: that of the last point of a sharp end, short of where the nodes touch."""
    if problem.shape != ELLIPSE or not problem.nodes_touch:
        return 0.0
    a, b = problem.vertices[d, 0, 0], problem.vertices[d, 0, 1]
    angle = problem.placement[d, i, 2]
    sin, cos = np.sin(angle), np.cos(angle)
    dx, dy = state.px[k] - problem.placement[d, i, 0], state.py[k] - problem.placement[d, i, 1]
    ux, uy = (cos * dx + sin * dy) / (a * a), (cos * dy - sin * dx) / (b * b)
    size = np.sqrt(ux * ux + uy * uy)
    ux, uy = ux / size, uy / size
    nx, ny = cos * state.nx[k] + sin * state.ny[k], cos * state.ny[k] - sin * state.nx[k]
    turned = np.arctan2(ux * ny - uy * nx, ux * nx + uy * ny)
    radius = (a * b) ** 2 / (a * a * ux * ux + b * b * uy * uy) ** 1.5
    return 0.5 * radius * turned * turned


@inner
def _estimate(problem, d, i, work, normal, residual):
    """Estimated relative error of the contact force at position `i`."""
    state = work.state
    intervals = problem.step.shape[0]
    first, beyond = (1, intervals) if problem.nodes_touch else (intervals + 3, len(state.gap) - 1)
    held_off = 0.0
    for k in range(first, beyond):
        if state.force[k] > 0.0:
            bend = state.gap[k - 1] - 2.0 * state.gap[k] + state.gap[k + 1]
            held_off = max(held_off, 0.125 * abs(bend))
    if problem.nodes_touch and problem.points.shape[1] > 0:
        for k in range(1, intervals):  # nodes beside a point of the target, which do not touch
            if state.nx[k] == 0.0 and state.ny[k] == 0.0:
                held_off = max(held_off, -state.seen[k])
    if problem.nodes_touch and state.force[intervals] > 0.0:
        held_off = max(held_off, 0.5 * tip_slope(problem, d, state) * before_tip(problem, d, state))
    shortened, missed, uneven, energy, before, last = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    change = 0.0
    for j in range(1, work.size[0] + 1):
        h = problem.step[j - 1]
        turned = state.psi[j] - state.psi[j - 1]
        shortened += h * turned * turned / 24.0
        bent = problem.bending[d, j - 1] * turned * turned
        # by the change of the moment over the interval; by the neighbours' where it is curved
        rise = h * (state.cos[j] * state.fy[j] - state.sin[j] * state.fx[j])
        lost = problem.flexibility[d, j - 1] * rise * rise / 12.0
        if j > 2:
            lost = max(lost, abs(bent - 2.0 * last + before) / 24.0)
        if problem.printed_section:  # what turns sections turns them the more, the shorter h
            couple = h * state.couple[j]
            lost += problem.shear_flexibility[d, j - 1] * couple * couple
        missed += lost
        before, last = last, bent
        # the moment is not the same all over an interval: nor then is the mean of its flexibility
        middle = h / problem.thickness[d, j - 1] ** 3
        uneven += bent * abs(1.0 - middle / problem.flexibility[d, j - 1])
        energy += bent
    for k in range(intervals + 2, len(state.gap)):
        if state.force[k] > 0.0:  # its force acts on the section beside it, short of some shear
            j = state.node[k]
            beside = abs(state.seen_x[k] - problem.arc[j])
            give = problem.shear_flexibility[d, j - 1] * problem.step[j - 1]
            shortened += state.force[k] * beside * give
            if problem.printed_section and j < intervals:  # its normal turns with the shear
                change += state.force[k] * abs(state.gamma[j + 1] - state.gamma[j])
            bend = problem.flexibility[d, j - 1] / problem.step[j - 1]
            missed += bend * state.force[k] ** 2 * beside**3 / 3.0
            held_off = max(held_off, _beyond_end(problem, d, i, state, k))
            behind = depth_between(problem, d, problem.placement[d, i, 2], state, k)
            held_off = max(held_off, behind)
    moved = held_off + shortened + ROUNDING
    stiffness = abs(_stiffness(problem, d, work))
    change += stiffness * moved + normal * (missed + uneven) / energy
    change += misplaced_forces(problem, d, state) + unsure_senses(problem, d, state)
    change += doubted_forces(problem, d, work)
    return SAFETY * change / normal + ALGEBRAIC * residual + FORCE_ROUNDING


@inner
def measure(problem, d, i, x, y, work, row):
    """Fill the row of the solved position `i` of finger `d`, the target at `x`, `y`.

    ``work.chain`` is overwritten.
    """
    state, mu = work.state, problem.mu[d]
    intervals = problem.step.shape[0]
    turn_cos, turn_sin = np.cos(problem.base[d, i]), np.sin(problem.base[d, i])
    fx, fy, normal, friction, rate, s_mean, x_mean, y_mean = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    contacts, sticking, first, last = 0, 0, np.inf, -np.inf
    motion = problem.motion[d, i, 0], problem.motion[d, i, 1], problem.motion[d, i, 2]
    for k in range(state.force.shape[0]):
        s = problem.arc[state.node[k]] if k <= intervals + 1 else state.seen_x[k]
        force = state.force[k]
        if force <= 0.0:
            continue
        qx, qy = contact_direction(state, k, mu)
        vx, vy = velocity(motion, x, y, state.px[k], state.py[k])
        fx, fy = fx + force * qx, fy + force * qy
        rate += force * (qx * vx + qy * vy)
        normal += force
        friction += force * abs(friction_ratio(state, k, mu))
        contacts += 1
        sticking += 1 if state.stuck[k] else 0
        s_mean, x_mean, y_mean = (
            s_mean + force * s,
            x_mean + force * state.px[k],
            y_mean + force * state.py[k],
        )
        first, last = min(first, s), max(last, s)
    row[CONTACTS], row[STICKING] = contacts, sticking
    row[FORCE_X], row[FORCE_Y] = turn_cos * fx - turn_sin * fy, turn_sin * fx + turn_cos * fy
    row[NORMAL], row[FRICTION], row[WORK_RATE] = normal, friction, rate
    if normal > 0.0:
        s_mean, x_mean, y_mean = s_mean / normal, x_mean / normal, y_mean / normal
        vx, vy = velocity(motion, x, y, x_mean, y_mean)
        speed = np.sqrt(vx * vx + vy * vy)
        row[INSERTION] = (fx * vx + fy * vy) / speed if speed > 0.0 else 0.0
        row[S_MEAN], row[S_FROM], row[S_TO] = s_mean, first, last
        x_mean += problem.arm[d]
        row[X_MEAN] = turn_cos * x_mean - turn_sin * y_mean
        row[Y_MEAN] = turn_sin * x_mean + turn_cos * y_mean
    tip_x, tip_y = problem.arm[d] + state.x[intervals], state.y[intervals]
    row[TIP_X], row[TIP_Y] = (
        turn_cos * tip_x - turn_sin * tip_y,
        turn_sin * tip_x + turn_cos * tip_y,
    )
    row[TIP_ANGLE] = problem.base[d, i] + state.psi[intervals]
    row[ENERGY] = strain_energy(problem, d, state, work.size[0])
    row[STRAIN] = 0.0
    for j in range(1, work.size[0] + 1):
        bent = abs(state.psi[j] - state.psi[j - 1]) / problem.step[j - 1]
        row[STRAIN] = max(row[STRAIN], problem.thickness[d, j - 1] * bent)
    row[RESIDUAL] = kkt_residual(problem, d, state, work.size[0])
    row[ESTIMATE] = 0.0
    if normal > 0.0:
        row[ESTIMATE] = _estimate(problem, d, i, work, normal, row[RESIDUAL])
