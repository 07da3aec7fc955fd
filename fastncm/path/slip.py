"""How far the target's surface has moved along the jaw's.

While two surfaces slide and roll on one another the place of contact moves on both. What it has
moved on the jaw less what it has moved on the target, both measured along ``t = (-ny, nx)`` with n
the normal out of the target, is the slip: its rate is the velocity of the target's surface relative
to the jaw's. By the jaw's arc from corner a (towards b) and the target's from its own corner (of a
circle: the angle phi of the normal from straight down, times the radius) it is one number, which
does not jump where the contact goes from one feature to the next.
"""

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.cache import inner


@inner
def slip(problem, lanes, lane):
    """Slip of the evaluated contact of `lane`, in finger lengths."""
    d = lanes.design[lane]
    return contact_slip(
        problem.jaw,
        problem.target,
        d,
        lanes.gap[:, lane],
        lanes.t[lane],
        lanes.pose[0, lane],
        lanes.pose[1, lane],
        lanes.pose[2, lane],
    )


@inner
def contact_slip(jaw, target, d, gap, t, x, y, psi):
    """`slip` of a stored gap (GAP_COLUMNS,) at the pose (x, y, psi) and the target's position t."""
    feature = gap[c.FEATURE]
    nx, ny = gap[c.GX], gap[c.GY]
    rho = jaw[d, c.RHO]
    phi = np.arctan2(nx, -ny)
    edge = feature == c.ON_EDGE or feature == c.FAR_EDGE
    at_b = feature == c.ON_B or feature == c.B_UNDERSIDE or feature == c.B_FACE
    on_jaw = 0.0
    if feature == c.ON_RETURN or feature == c.FAR_RETURN:
        cos, sin = np.cos(psi), np.sin(psi)
        dx, dy = gap[c.PX] - x, gap[c.PY] - y
        px, py = cos * dx + sin * dy, cos * dy - sin * dx
        on_jaw = jaw[d, c.TRX] * (px - jaw[d, c.AX]) + jaw[d, c.TRY] * (py - jaw[d, c.AY])
    elif rho == 0.0:
        if edge or at_b:
            px, py = jaw[d, c.BX], jaw[d, c.BY]
            if edge:
                cos, sin = np.cos(psi), np.sin(psi)
                dx, dy = gap[c.PX] - x, gap[c.PY] - y
                px, py = cos * dx + sin * dy, cos * dy - sin * dx
            on_jaw = jaw[d, c.TAX] * (px - jaw[d, c.AX]) + jaw[d, c.TAY] * (py - jaw[d, c.AY])
    else:
        at_a = np.arctan2(jaw[d, c.TAY], jaw[d, c.TAX])  # phi of the normal at a in the jaw's frame
        if edge or feature == c.ARC_UNDERSIDE or feature == c.ARC_FACE:
            on_jaw = -rho * (phi - psi - at_a)
        elif at_b:
            on_jaw = -rho * (np.arctan2(jaw[d, c.TBY], jaw[d, c.TBX]) - at_a)
    if feature == c.FAR_RETURN or feature == c.FAR_EDGE:
        return on_jaw - target[d, c.TARGET_LENGTH]
    if feature < c.FAR_RETURN:
        return on_jaw - target[d, c.TARGET_RADIUS] * phi
    # along the underside t points to +x, along the face downwards, along the back upwards
    begin = target[d, c.TARGET_LENGTH] if feature == c.A_BACK else 0.0
    along = ny * (gap[c.PX] - t) - nx * (gap[c.PY] - target[d, c.TARGET_Y])
    return on_jaw - begin + along
