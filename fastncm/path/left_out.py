"""What the modes that are left out do to the force of any number of contacts: their estimate."""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner
from fastncm.kernels.elimination import eliminate
from fastncm.path import several


@inner
def left_out(design, own, mu, t, u, work, rubbing):
    """What the modes that are left out do to the resultant contact force: ``(their sum, the sum of
    their sizes)`` over the force.

    design: with these modes behind its `own`; u: (m,), zero for them; work, rubbing: for all of
    them, with the solution's forces and states. Each mode's lack of equilibrium, the contacts' work
    with it (`path.rows`), is answered by the linearised system of all modes.
    """
    several.evaluate(design, mu, t, u, work.at, rubbing)
    several.add_up_stiffness(design, work, rubbing)
    total_x, total_y, size = 0.0, 0.0, 0.0
    for mode in range(own, u.shape[0]):
        count = several.fill(mu, u, work, rubbing)
        rubbing.right[:] = 0.0
        for k in range(rubbing.state.shape[0]):
            rubbing.right[mode] += (
                work.multipliers[k] * work.at.jacobian[k, mode]
                + rubbing.rub[k] * rubbing.drag[k, mode]
            )
        if eliminate(rubbing.matrix, rubbing.right, rubbing.scale, count) == 0.0:
            return np.inf, np.inf
        fx, fy = _change_of_force(mu, u, work, rubbing)
        total_x, total_y = total_x + fx, total_y + fy
        size += np.sqrt(fx * fx + fy * fy)
    force = np.sqrt(work.at.force[0] ** 2 + work.at.force[1] ** 2)
    return np.sqrt(total_x**2 + total_y**2) / force, size / force


@inner
def _change_of_force(mu, u, work, rubbing):
    """Change of the contacts' resultant with the solution in ``rubbing.right``."""
    fx, fy, row = 0.0, 0.0, u.shape[0]
    for i in range(u.shape[0]):
        fx += rubbing.carried[0, i] * rubbing.right[i]
        fy += rubbing.carried[1, i] * rubbing.right[i]
    for k in range(rubbing.state.shape[0]):
        if rubbing.state[k] == several.OPEN:
            continue
        force, gap = rubbing.right[row], work.at.gaps[:, k]
        row += 1
        rub = several.side_of(rubbing.state[k], mu) * force
        if rubbing.state[k] == several.STICKS:
            rub = rubbing.right[row]
            row += 1
        fx += force * gap[c.GX] - rub * gap[c.GY]
        fy += force * gap[c.GY] + rub * gap[c.GX]
    return fx, fy
