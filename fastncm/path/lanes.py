"""State and workspace of `LANES` designs that walk along their paths side by side.

State. design: which design; t: (LANES,) position of the target; hold: feature to keep, -1: the
nearest; active: bool, to be solved; u: (m, LANES) unknowns; force: multiplier; rub: friction
force along the contact's tangent ``t = (-ny, nx)``; u_rate, force_rate, rub_rate, pose_rate (3,
LANES): derivatives by the target's position.

Friction. mu: (LANES,) coefficient; sticks: bool; side: friction over normal force of a sliding
contact, +mu or -mu; 0 where it sticks; anchor: slip (`path.slip`) to keep where it sticks, and
slipped, what it has instead. rubs, holds: (1,) bool, whether any lane has friction, sticks:
what no lane needs is left out.

Evaluation. sin, cos: (Q, LANES); pose: (3, LANES); gradient: (2, m, LANES); gap: (GAP_COLUMNS,
LANES); jacobian: (m, LANES) dg/du; loaded: (3, LANES) the contact's wrench; tangent: (3, LANES)
that of a unit force along t; arm: (2, LANES) from the tip to the contact.

Workspace. hessian: (m, m, LANES) and its factor; negative: (LANES,) its negative pivots; down:
(m, LANES) and across: (3, m, LANES), solutions with it; pull: (3, m, LANES) of
`path.frictionless`; work: (Q, LANES); fx, fy, moved: (LANES,); pending: bool. Of `path.tip`:
flexible, change, small: (3, 3, LANES); reach, slide,
leaned, driven, pushed, held, shift, answer: (3, LANES); inverse: (2, 2, LANES); penalty, crept,
determinant: (LANES,).

Outcome. residual: KKT; iterations: int64; good: bool.

Basis of the designs (`kernels.problem.fill_basis`). slope: (m, Q, LANES) d theta / du; end: (m,
LANES) d psi_tip / du; beyond, beyond_end: the same of the first modes that are left out, BEYOND of
each field, for the error estimate; strain: (Q, LANES) surface strain by a unit moment, (w0/w)^2,
over that at the clamp; strain_end: (LANES,) the same at the tip.
"""

from fastncm.kernels import constants as c
from fastncm.kernels.basis import BEYOND, MAX_POINTS
from fastncm.kernels.constants import LANES, MAX_ORDER
from fastncm.kernels.workspace import FLAG, INDEX, NUMBER, Layout

#: A hold that keeps the gap as it stands: the resultant of several contacts.
AS_STORED = -2

#: Sizes of the lanes' workspaces, and the most that each may be: unknowns of both fields, Gauss
#: points, and modes that are left out.
MOST = {"modes": 2 * MAX_ORDER, "points": MAX_POINTS, "beyond": 2 * BEYOND}

LAYOUT = Layout(
    "Lanes",
    MOST,
    {
        "design": (INDEX, (LANES,)),
        "t": (NUMBER, (LANES,)),
        "hold": (INDEX, (LANES,)),
        "active": (FLAG, (LANES,)),
        "u": (NUMBER, ("modes", LANES)),
        "force": (NUMBER, (LANES,)),
        "rub": (NUMBER, (LANES,)),
        "u_rate": (NUMBER, ("modes", LANES)),
        "force_rate": (NUMBER, (LANES,)),
        "rub_rate": (NUMBER, (LANES,)),
        "pose_rate": (NUMBER, (3, LANES)),
        "mu": (NUMBER, (LANES,)),
        "sticks": (FLAG, (LANES,)),
        "side": (NUMBER, (LANES,)),
        "anchor": (NUMBER, (LANES,)),
        "slipped": (NUMBER, (LANES,)),
        "rubs": (FLAG, (1,)),
        "holds": (FLAG, (1,)),
        "sin": (NUMBER, ("points", LANES)),
        "cos": (NUMBER, ("points", LANES)),
        "pose": (NUMBER, (3, LANES)),
        "gradient": (NUMBER, (2, "modes", LANES)),
        "gap": (NUMBER, (c.GAP_COLUMNS, LANES)),
        "jacobian": (NUMBER, ("modes", LANES)),
        "loaded": (NUMBER, (3, LANES)),
        "tangent": (NUMBER, (3, LANES)),
        "arm": (NUMBER, (2, LANES)),
        "hessian": (NUMBER, ("modes", "modes", LANES)),
        "negative": (NUMBER, (LANES,)),
        "down": (NUMBER, ("modes", LANES)),
        "across": (NUMBER, (3, "modes", LANES)),
        "pull": (NUMBER, (3, "modes", LANES)),
        "work": (NUMBER, ("points", LANES)),
        "fx": (NUMBER, (LANES,)),
        "fy": (NUMBER, (LANES,)),
        "moved": (NUMBER, (LANES,)),
        "pending": (FLAG, (LANES,)),
        "flexible": (NUMBER, (3, 3, LANES)),
        "change": (NUMBER, (3, 3, LANES)),
        "small": (NUMBER, (3, 3, LANES)),
        "reach": (NUMBER, (3, LANES)),
        "leaned": (NUMBER, (3, LANES)),
        "driven": (NUMBER, (3, LANES)),
        "slide": (NUMBER, (3, LANES)),
        "pushed": (NUMBER, (3, LANES)),
        "held": (NUMBER, (3, LANES)),
        "shift": (NUMBER, (3, LANES)),
        "answer": (NUMBER, (3, LANES)),
        "inverse": (NUMBER, (2, 2, LANES)),
        "penalty": (NUMBER, (LANES,)),
        "crept": (NUMBER, (LANES,)),
        "determinant": (NUMBER, (LANES,)),
        "residual": (NUMBER, (LANES,)),
        "iterations": (INDEX, (LANES,)),
        "good": (FLAG, (LANES,)),
        "slope": (NUMBER, ("modes", "points", LANES)),
        "end": (NUMBER, ("modes", LANES)),
        "beyond": (NUMBER, ("beyond", "points", LANES)),
        "beyond_end": (NUMBER, ("beyond", LANES)),
        "strain": (NUMBER, ("points", LANES)),
        "strain_end": (NUMBER, (LANES,)),
    },
)
