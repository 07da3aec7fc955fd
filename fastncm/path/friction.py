"""The forces of a solved row, and Coulomb friction by the paper's base-moment rule (Lan & Lee 2008,
eqs. (14)-(17)): `friction.model = "recovered"`.

With `"equilibrium"` friction is in the row already, and nothing is turned. By the recovered rule
the shape is the frictionless one; only the contact force is turned, from the normal ``n`` to ``n +
mu t``, where ``t`` is the direction in which the target's surface moves along the finger, and
scaled so that its moment about the clamp stays the base moment ``E I psi'(0)``:

    N (p x (n + mu t)) = M_0

The base moment is taken from equilibrium, ``M_0 = p x (lambda n)`` with the multiplier ``lambda``:
its error is of second order in that of ``E I psi'(0)``, and at mu = 0 the rule gives the multiplier
back exactly.
"""

from fastncm.kernels.cache import inlined, kernel
from fastncm.path import rows


@inlined
def turned_force(table, d, i, mu):
    """Forces of row `i` of design `d`, turned by the friction `mu` of the recovered rule.

    table: (D, rows, rows.COLUMNS). Returns ``(normal, friction, force_x, force_y, insertion,
    insertion_rate, holds)``: the forces on the finger; the insertion force, positive where it
    resists the motion, and its derivative by the target's position; `holds` is False where no force
    balances the base moment.
    """
    direction = table[d, i, rows.DIRECTION]
    nx, ny = table[d, i, rows.NORMAL_X], table[d, i, rows.NORMAL_Y]
    px, py = table[d, i, rows.CONTACT_X], table[d, i, rows.CONTACT_Y]
    nx1, ny1 = table[d, i, rows.NORMAL_X_RATE], table[d, i, rows.NORMAL_Y_RATE]
    px1, py1 = table[d, i, rows.CONTACT_X_RATE], table[d, i, rows.CONTACT_Y_RATE]
    rub, rub1 = table[d, i, rows.RUB], table[d, i, rows.RUB_RATE]
    force, force1 = table[d, i, rows.FORCE], table[d, i, rows.FORCE_RATE]
    side = mu if -ny * direction >= 0.0 else -mu  # mu t = side (-ny, nx), with t along the motion
    lever = px * ny - py * nx
    lever1 = px1 * ny + px * ny1 - py1 * nx - py * nx1
    turned = lever + side * (px * nx + py * ny)
    turned1 = lever1 + side * (px1 * nx + px * nx1 + py1 * ny + py * ny1)
    holds = turned * lever > 0.0
    ratio = lever / turned if holds else 1.0
    ratio1 = (lever1 - ratio * turned1) / turned if holds else 0.0
    normal = force * ratio
    normal1 = force1 * ratio + force * ratio1
    ux, uy = nx - side * ny, ny + side * nx
    fx, fy = normal * ux - rub * ny, normal * uy + rub * nx
    fx1 = normal1 * ux + normal * (nx1 - side * ny1) - rub1 * ny - rub * ny1
    friction = mu * normal + abs(rub)  # one of them is zero
    return normal, friction, fx, fy, direction * fx, direction * fx1, holds


#: Columns of `turned_forces`: the forces on the finger, the insertion force and its derivative by
#: the target's position, and 1 where the rule holds (else 0).
NORMAL, FRICTION, FORCE_X, FORCE_Y, INSERTION, INSERTION_RATE, HOLDS = range(7)


@kernel
def turned_forces(table, design, mu, out):
    """`turned_force` of the first rows of many cases.

    design, mu: (C,); out: (C, R, 7), overwritten, for the first R rows of each case's design.
    """
    for case in range(out.shape[0]):
        for i in range(out.shape[1]):
            normal, friction, fx, fy, insertion, rate, holds = turned_force(
                table, design[case], i, mu[case]
            )
            out[case, i, NORMAL], out[case, i, FRICTION] = normal, friction
            out[case, i, FORCE_X], out[case, i, FORCE_Y] = fx, fy
            out[case, i, INSERTION], out[case, i, INSERTION_RATE] = insertion, rate
            unloaded = table[design[case], i, rows.FORCE] == 0.0
            out[case, i, HOLDS] = 1.0 if holds or unloaded else 0.0
