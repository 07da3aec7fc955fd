"""Exact equilibria of a finger whose own side lies on an ellipse, by shooting on the continuum.

It shares nothing with the package but the scene's numbers. Along the axis, in metres and newtons,
with n and M the force and the moment that the part beyond s exerts on the part before it:

    r' = (cos, sin)(theta),  theta = psi + gamma,  E I psi' = M,  kappa G A gamma = n . (-sin, cos),
    n' = -f,  M' = -r' x n - (p - r) x f,  p = r + w/2 (sin psi, -cos psi)      (the right side)

(Lan & Lee 2008, eqs. (1), (2), (6), the section turned by psi). With shear there are no forces at
points: one would kink the surface into the target. So the surface is free up to s1, touches
smoothly there (g = g' = 0), carries the pressure f = q (nu + mu t) that keeps it on the ellipse
(g'' = 0) up to s2, and is straight and without load from there on (n = M = 0). The five unknowns
are n and M at the clamp, s1 and s2. The contact is about as long as the finger is thick, over which
the growing solutions grow by little, so that single shooting is accurate.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

Array = np.ndarray

TOLERANCE = 1e-12
LOCAL_ERROR = 1e-12
CLOSED = 1e-8
"""Largest residual of an answer, in the units of `_units`."""
FAR = 1e3
"""Residual where s1 and s2 make no sense."""
LONGEST = 4.0
"""Thicknesses that a contact may be long, over which growing solutions grow by e^8."""
TINY = 1e-40
"""Imaginary step of a derivative."""
SHEAR_STEPS = 5
"""Of Newton's method for theta, which needs three."""
INERTIA = 12.0
"""b w^3 over I."""


class Finger(NamedTuple):
    """rubber-ellipse; lengths in m, moduli in Pa. mu: signed, positive where the ellipse drags the
    touching side towards the tip."""

    length: float = 0.1524
    offset: float = 0.0254
    clamp: float = 0.030
    tip: float = 0.017
    width: float = 0.025
    young: float = 4.8e6
    shear_modulus: float = 1.71e6
    kappa: float = 7.0 / 8.0  # (5 + 5 nu) / (6 + 5 nu) with nu = 0.4, (20)
    semi_x: float = 0.09906
    semi_y: float = 0.06731
    mu: float = 0.0


@dataclass(frozen=True)
class Touch:
    """force: (2,) N on the finger; s: (2,) m, where the contact begins and ends; unknowns: (5,) for
    the next start; pressure: the least q (N/m) on the contact; closed: the largest residual."""

    force: Array
    s: Array
    unknowns: Array
    pressure: float
    closed: float


def solve(
    finger: Finger, base: float, centre: Array, start: Array, local: float = LOCAL_ERROR
) -> Touch:
    """The equilibrium at a base angle (rad) with the ellipse's centre at `centre` (2,) m.

    start: (5,) n_x, n_y (N) and M (Nm) at the clamp, s1 and s2 (m); local: relative error of a step
    of the integration. Raises ValueError where shooting does not close or the solution pulls.
    """
    scale, goal = _units(finger)

    def missed(z: Array) -> Array:
        residual = _miss(finger, base, centre, z * scale, local)[0] / goal
        return np.nan_to_num(residual, posinf=FAR)

    found = root(missed, start / scale, tol=TOLERANCE)
    z = found.x * scale
    closed = float(np.abs(found.fun).max())
    _, pressure = _miss(finger, base, centre, z, local)
    if not closed < max(CLOSED, 1e2 * local) or pressure < 0.0:
        raise ValueError(f"no equilibrium at {base}: {found.message}, {closed:.0e}, {pressure:.3g}")
    return Touch(z[:2], z[3:], z, pressure, closed)


def _units(finger: Finger) -> tuple[Array, Array]:
    """Of the unknowns and of the residuals (5,)."""
    stiffness = finger.young * finger.width * finger.clamp**3 / INERTIA
    force, moment = stiffness / finger.length**2, stiffness / finger.length
    short = 1e-2 * finger.length
    return (
        np.array([force, force, moment, short, short]),
        np.array([short, 1e-2, force, force, moment]),
    )


def _miss(
    finger: Finger, base: float, centre: Array, z: Array, local: float
) -> tuple[Array, float]:
    """g and g' at s1, n and M at s2; and the least pressure."""
    s1, s2 = z[3:]
    if not 0.0 < s1 < s2 < finger.length or s2 - s1 > LONGEST * finger.clamp:
        return np.full(5, np.inf), -np.inf
    begin = finger.offset * np.array([np.cos(base), np.sin(base)]) - centre
    state = np.array([*begin, base, *z[:3]])
    options = {"method": "DOP853", "rtol": local, "atol": 1e-2 * local}
    free = solve_ivp(_free, (0.0, s1), state, args=(finger,), **options).y[:, -1]
    on = solve_ivp(_touching, (s1, s2), free, args=(finger,), **options)
    least = min(_pressure(s, u, finger) for s, u in zip(on.t, on.y.T, strict=True))
    gap, slope = _gap(s1, free, finger), _gap_slope(s1, free, finger)
    return np.array([gap, slope, *on.y[3:, -1]]), float(least)


@numba.njit(cache=True)
def _thickness(s, f):  # type: ignore[no-untyped-def]
    return f.clamp + (f.tip - f.clamp) * s / f.length


@numba.njit(cache=True)
def _direction(s, u, f):  # type: ignore[no-untyped-def]
    """cos and sin of theta."""
    stiffness = f.kappa * f.shear_modulus * f.width * _thickness(s, f)
    theta = u[2] + 0.0 * stiffness
    for _ in range(SHEAR_STEPS):
        cos, sin = np.cos(theta), np.sin(theta)
        along, across = u[3] * cos + u[4] * sin, u[4] * cos - u[3] * sin
        theta = theta - (theta - u[2] - across / stiffness) / (1.0 + along / stiffness)
    return np.cos(theta), np.sin(theta)


@numba.njit(cache=True)
def _surface(s, u, f):  # type: ignore[no-untyped-def]
    """The right side's place seen from the ellipse's centre, and the outward unit normal there."""
    half = 0.5 * _thickness(s, f)
    px, py = u[0] + half * np.sin(u[2]), u[1] - half * np.cos(u[2])
    nx, ny = px / f.semi_x**2, py / f.semi_y**2
    size = np.sqrt(nx**2 + ny**2)
    return px, py, nx / size, ny / size


@numba.njit(cache=True)
def _gap(s, u, f):  # type: ignore[no-untyped-def]
    """In m, to first order."""
    px, py, _, _ = _surface(s, u, f)
    level = (px / f.semi_x) ** 2 + (py / f.semi_y) ** 2 - 1.0
    return level / (2.0 * np.hypot(px / f.semi_x**2, py / f.semi_y**2))


@numba.njit(cache=True)
def _gap_slope(s, u, f):  # type: ignore[no-untyped-def]
    """The part of p' along the normal (0 on the ellipse's tangent); no pressure enters."""
    half = 0.5 * _thickness(s, f)
    bend = INERTIA * u[5] / (f.young * f.width * (2.0 * half) ** 3)
    thins = 0.5 * (f.tip - f.clamp) / f.length
    cos, sin = _direction(s, u, f)
    px = cos + half * bend * np.cos(u[2]) + thins * np.sin(u[2])
    py = sin + half * bend * np.sin(u[2]) - thins * np.cos(u[2])
    _, _, nx, ny = _surface(s, u, f)
    return nx * px + ny * py


@numba.njit(cache=True)
def _slope(s, u, q, f):  # type: ignore[no-untyped-def]
    """u' for a pressure q (N/m)."""
    cos, sin = _direction(s, u, f)
    px, py, nx, ny = _surface(s, u, f)
    # the tangent towards the tip: the ellipse lies to the right
    fx, fy = q * (nx + f.mu * ny), q * (ny - f.mu * nx)
    bend = INERTIA * u[5] / (f.young * f.width * _thickness(s, f) ** 3)
    turn = cos * u[4] - sin * u[3] + (px - u[0]) * fy - (py - u[1]) * fx
    return np.array([cos, sin, bend, -fx, -fy, -turn])


@numba.njit(cache=True)
def _free(s, u, f):  # type: ignore[no-untyped-def]
    """u' where nothing touches."""
    return _slope(s, u, 0.0, f)


@numba.njit(cache=True)
def _pressure(s, u, f):  # type: ignore[no-untyped-def]
    """q by which the surface stays on the ellipse: the derivative of `_gap_slope` vanishes."""
    rest = _slope(s, u, 0.0, f)
    pushed = _slope(s, u, 1.0, f) - rest
    by_rest = _gap_slope(s + 1j * TINY, u + 1j * TINY * rest, f).imag / TINY
    by_push = _gap_slope(s + 0j, u + 1j * TINY * pushed, f).imag / TINY
    return -by_rest / by_push


@numba.njit(cache=True)
def _touching(s, u, f):  # type: ignore[no-untyped-def]
    """u' on the contact."""
    return _slope(s, u, _pressure(s, u, f), f)
