"""The finger's axis: angle, position and tip pose with derivatives, for `LANES` designs side by
side.

Unknowns are the coefficients ``u`` (m, LANES) of the energy-orthonormal basis (`kernels.basis`):
bending modes first, then shear modes where the scene has shear. In units of the finger's length L
and of E I / L:

* angle ``theta(s_q) = psi + gamma = sum_k u_k slope_kq``
* position ``x(s) = int cos theta ds``, ``y(s) = int sin theta ds``     (Lan & Lee 2008, eq. (1))
* energy ``V = 1/2 sum_k u_k^2``                                       (Lan & Lee 2008, eq. (2))

All arrays carry the lane as their last axis; every inner loop runs over the lanes.
"""

from fastncm.kernels.cache import inlined, inner
from fastncm.kernels.constants import LANES
from fastncm.kernels.trig import sincos

# Sizes that LLVM knows at compile time: the length of a tuple is part of its type. With them the
# sums over modes and nodes are unrolled and stay in registers: gradient 35 -> 7 ns, Hessian 77 ->
# 15 ns per design.
_4, _5, _7, _8 = (0,) * 4, (0,) * 5, (0,) * 7, (0,) * 8


@inlined
def _has_size(slope, modes, points):
    """True for (modes, points, LANES): behind this LLVM knows the strides."""
    return slope.shape[0] == modes and slope.shape[1] == points and slope.shape[2] == LANES


@inner
def tip_pose(slope, end, weights, u, sin, cos, pose):
    """Angles at the Gauss points and the tip's pose.

    slope: (m, Q, LANES); end: (m, LANES); weights: (Q,); u: (m, LANES). Overwritten: sin, cos: (Q,
    LANES) of the angle; pose: (3, LANES), the tip's x, y and the angle of its section.
    """
    modes, points = slope.shape[0], slope.shape[1]
    add_up(slope, u, sin)
    for q in range(points):
        for lane in range(LANES):
            sin[q, lane], cos[q, lane] = sincos(sin[q, lane])
    if points == 7:
        _integral(weights, cos, pose[0], _7)
        _integral(weights, sin, pose[1], _7)
    elif points == 8:
        _integral(weights, cos, pose[0], _8)
        _integral(weights, sin, pose[1], _8)
    else:
        for lane in range(LANES):
            pose[0, lane] = 0.0
            pose[1, lane] = 0.0
        for q in range(points):
            weight = weights[q]
            for lane in range(LANES):
                pose[0, lane] += weight * cos[q, lane]
            for lane in range(LANES):
                pose[1, lane] += weight * sin[q, lane]
    for lane in range(LANES):
        pose[2, lane] = 0.0
    for k in range(modes):
        for lane in range(LANES):
            pose[2, lane] += end[k, lane] * u[k, lane]


@inner
def add_up(slope, u, theta):
    """Angles at the Gauss points, ``theta_q = sum_k slope_kq u_k``.

    slope: (m, Q, LANES); u: (m, LANES); theta: (Q, LANES), overwritten.
    """
    if _has_size(slope, 4, 7) and u.shape[1] == LANES:
        _add_up(slope, u, theta, _4, _7)
    elif _has_size(slope, 5, 8) and u.shape[1] == LANES:
        _add_up(slope, u, theta, _5, _8)
    else:
        for q in range(slope.shape[1]):
            for lane in range(LANES):
                theta[q, lane] = slope[0, q, lane] * u[0, lane]
            for k in range(1, slope.shape[0]):
                for lane in range(LANES):
                    theta[q, lane] += slope[k, q, lane] * u[k, lane]


@inlined
def _add_up(slope, u, theta, modes, points):
    for q in range(len(points)):
        for lane in range(LANES):
            total = 0.0
            for k in range(len(modes)):
                total += slope[k, q, lane] * u[k, lane]
            theta[q, lane] = total


@inner
def project(slope, values, out):
    """The transpose of `add_up`: ``out_k = sum_q slope_kq values_q``.

    slope: (n, Q, LANES); values: (Q, LANES); out: (n, LANES), overwritten.
    """
    known = slope.shape[2] == LANES and values.shape[1] == LANES
    if known and slope.shape[1] == 7:
        _project(slope, values, out, _7)
    elif known and slope.shape[1] == 8:
        _project(slope, values, out, _8)
    else:
        for k in range(slope.shape[0]):
            for lane in range(LANES):
                out[k, lane] = 0.0
            for q in range(slope.shape[1]):
                for lane in range(LANES):
                    out[k, lane] += slope[k, q, lane] * values[q, lane]


@inlined
def _project(slope, values, out, points):
    for k in range(slope.shape[0]):
        for lane in range(LANES):
            total = 0.0
            for q in range(len(points)):
                total += slope[k, q, lane] * values[q, lane]
            out[k, lane] = total


@inlined
def _integral(weights, values, out, points):
    for lane in range(LANES):
        total = 0.0
        for q in range(len(points)):
            total += weights[q] * values[q, lane]
        out[lane] = total


@inner
def pose_gradient(slope, weights, sin, cos, gradient):
    """Derivatives of the tip's position by the unknowns.

    gradient: (2, m, LANES), overwritten: d(x, y)/du_k. (That of the angle is the constant `end`.)
    """
    modes, points = slope.shape[0], slope.shape[1]
    if _has_size(slope, 4, 7):
        _pose_gradient(slope, weights, sin, cos, gradient, _4, _7)
    elif _has_size(slope, 5, 8):
        _pose_gradient(slope, weights, sin, cos, gradient, _5, _8)
    else:
        for k in range(modes):
            for lane in range(LANES):
                gradient[0, k, lane] = 0.0
                gradient[1, k, lane] = 0.0
            for q in range(points):
                weight = weights[q]
                for lane in range(LANES):
                    moved = weight * slope[k, q, lane]
                    gradient[0, k, lane] -= moved * sin[q, lane]
                    gradient[1, k, lane] += moved * cos[q, lane]


@inlined
def _pose_gradient(slope, weights, sin, cos, gradient, modes, points):
    for k in range(len(modes)):
        for lane in range(LANES):
            x, y = 0.0, 0.0
            for q in range(len(points)):
                moved = weights[q] * slope[k, q, lane]
                x -= moved * sin[q, lane]
                y += moved * cos[q, lane]
            gradient[0, k, lane] = x
            gradient[1, k, lane] = y


@inner
def add_position_hessian(slope, weights, sin, cos, fx, fy, work, hessian):
    """Add the Hessian of ``-(fx x + fy y)`` of the tip: the stiffness that the force `(fx, fy)`
    gives.

    fx, fy: (LANES,); work: (Q, LANES), overwritten; hessian: (m, m, LANES), lower triangle changed.
    """
    modes, points = slope.shape[0], slope.shape[1]
    for q in range(points):
        weight = weights[q]
        for lane in range(LANES):
            work[q, lane] = weight * (fx[lane] * cos[q, lane] + fy[lane] * sin[q, lane])
    if _has_size(slope, 4, 7) and work.shape[1] == LANES:
        _add_outer_products(slope, work, hessian, _4, _7)
    elif _has_size(slope, 5, 8) and work.shape[1] == LANES:
        _add_outer_products(slope, work, hessian, _5, _8)
    else:
        for k in range(modes):
            for j in range(k + 1):
                for q in range(points):
                    for lane in range(LANES):
                        hessian[k, j, lane] += work[q, lane] * slope[k, q, lane] * slope[j, q, lane]


@inlined
def _add_outer_products(slope, work, hessian, modes, points):
    for k in range(len(modes)):
        for j in range(k + 1):
            for lane in range(LANES):
                total = 0.0
                for q in range(len(points)):
                    total += work[q, lane] * slope[k, q, lane] * slope[j, q, lane]
                hessian[k, j, lane] += total


@inner
def running_integral(integral, values, out):
    """Integrals from the clamp to the Gauss points: of ``cos theta`` and ``sin theta`` these are
    the nodes' positions. integral: (Q, Q); values, out: (Q, LANES), `out` overwritten."""
    points = values.shape[0]
    known = values.shape[1] == LANES
    if known and points == 7:
        _running_integral(integral, values, out, _7)
    elif known and points == 8:
        _running_integral(integral, values, out, _8)
    else:
        for i in range(points):
            for lane in range(LANES):
                out[i, lane] = 0.0
            for q in range(points):
                weight = integral[i, q]
                for lane in range(LANES):
                    out[i, lane] += weight * values[q, lane]


@inlined
def _running_integral(integral, values, out, points):
    for i in range(len(points)):
        for lane in range(LANES):
            total = 0.0
            for q in range(len(points)):
                total += integral[i, q] * values[q, lane]
            out[i, lane] = total
