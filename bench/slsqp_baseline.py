"""How long does SciPy's SLSQP take for one contact solve of snapfit-circle?

The fixed yardstick that the package's speed is divided by; it imports nothing of the package.

The problem is the paper's (Lan & Lee 2008, Example II(a), without friction and shear), in units of
the finger's length L and of EI/L. The curvature is psi'(u) = sum_k q_k phi_k(u) with four modes on
0 <= u <= 1, so that the strain energy (2) is V = 1/2 q.H q exactly. M = 50 points of the jaw stay
outside the circle, (10a), with the signed distance as gap function.

SLSQP gets every help that its public interface takes: compiled objective, gradient, constraints
and constraint Jacobian that write into ready buffers; orthonormal Legendre modes, with which H is
the unit matrix that SLSQP starts its BFGS updates from; warm starts extrapolated quadratically
along the path; and the loosest `ftol` with forces good to about 1e-8. For comparison the same
without extrapolation, and with the paper's monomials (7), where BFGS has to find H.
"""

import time
from typing import Literal, NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import Legendre, Polynomial
from scipy.optimize import minimize

Basis = Literal["legendre", "monomial"]

LENGTH, THICKNESS, WIDTH, YOUNG = 0.057, 0.0032, 0.0095, 2.62e9
JAW_A, JAW_B = (0.057, 0.0105), (0.0762, 0.0016)
RADIUS, PATH_Y = 0.0089, 0.0105
START, STOP = 0.078162, 0.0600
"""snapfit-circle in SI units; the path runs from first touch."""

FORCE_UNIT = YOUNG * WIDTH * THICKNESS**3 / 12.0 / LENGTH**2
"""EI/L^2 in N."""
ORDER = 4
POINTS = 50
QUADRATURE = 8
"""Gauss-Legendre points; at this rotation the tip's place is then exact to 1e-14 L."""
FTOL = 3e-14
"""Force error at most 1.4e-9 of the largest force along the path; with 1e-13 it is 1.6e-8."""
FTOL_PLAIN = 1e-11
"""The same for plain warm starts: 1.9e-9; with 1e-10 it is 3e-7."""
FTOL_REFERENCE = 1e-16
"""Where SLSQP's forces no longer change by more than 1e-9."""


class Problem(NamedTuple):
    """The dimensionless problem: lengths in units of L."""

    stiffness: np.ndarray  # (ORDER, ORDER): int_0^1 phi_k phi_l, the energy's Hessian H
    integrals: np.ndarray  # (QUADRATURE + 1, ORDER): int_0^u phi_k, the last row for the tip
    weights: np.ndarray  # (QUADRATURE,)
    jaw: np.ndarray  # (2, POINTS): the jaw's points seen from the tip
    centre: np.ndarray  # (2,): the circle's; overwritten from position to position


def snapfit_circle(basis: Basis) -> Problem:
    """The scene's stiffness, quadrature and jaw points; the circle's centre is still unset."""
    if basis == "legendre":
        modes = [np.sqrt(2 * k + 1) * Legendre.basis(k, domain=[0.0, 1.0]) for k in range(ORDER)]
    else:
        modes = [Polynomial.basis(k) for k in range(ORDER)]
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE)
    u, weights = (nodes + 1.0) / 2.0, weights / 2.0
    values = np.column_stack([mode(u) for mode in modes])
    integrals = np.column_stack([mode.integ(lbnd=0.0)(np.append(u, 1.0)) for mode in modes])
    along = np.linspace(0.0, 1.0, POINTS)
    jaw = np.array([a + along * (b - a) for a, b in zip(JAW_A, JAW_B, strict=True)])
    jaw[0] -= LENGTH
    stiffness = values.T @ (weights[:, None] * values)
    return Problem(stiffness, integrals, weights, jaw / LENGTH, np.empty(2))


@njit
def energy(q, stiffness):
    """V = 1/2 q.H q, eq. (2) in units of EI/L."""
    total = 0.0
    for k in range(ORDER):
        for m in range(ORDER):
            total += q[k] * stiffness[k, m] * q[m]
    return 0.5 * total


@njit
def energy_gradient(q, stiffness):
    """dV/dq (ORDER,)."""
    gradient = np.zeros(ORDER)
    for k in range(ORDER):
        for m in range(ORDER):
            gradient[k] += stiffness[k, m] * q[m]
    return gradient


@njit(error_model="numpy")
def gaps(q, integrals, weights, jaw, centre, out):
    """Signed distances (POINTS,) of the jaw's points from the circle, eq. (10a); written to out."""
    x = y = tip = 0.0
    for k in range(ORDER):
        tip += integrals[QUADRATURE, k] * q[k]
    for i in range(QUADRATURE):
        psi = 0.0
        for k in range(ORDER):
            psi += integrals[i, k] * q[k]
        x += weights[i] * np.cos(psi)
        y += weights[i] * np.sin(psi)
    cos, sin = np.cos(tip), np.sin(tip)
    for j in range(POINTS):
        dx = x + cos * jaw[0, j] - sin * jaw[1, j] - centre[0]
        dy = y + sin * jaw[0, j] + cos * jaw[1, j] - centre[1]
        out[j] = np.sqrt(dx * dx + dy * dy) - RADIUS / LENGTH
    return out


@njit(error_model="numpy")
def gap_jacobian(q, integrals, weights, jaw, centre, out):
    """d(gaps)/dq (POINTS, ORDER); written to out."""
    x = y = tip = 0.0
    x_q, y_q = np.zeros(ORDER), np.zeros(ORDER)
    for k in range(ORDER):
        tip += integrals[QUADRATURE, k] * q[k]
    for i in range(QUADRATURE):
        psi = 0.0
        for k in range(ORDER):
            psi += integrals[i, k] * q[k]
        dx, dy = weights[i] * np.cos(psi), weights[i] * np.sin(psi)
        x += dx
        y += dy
        for k in range(ORDER):
            x_q[k] -= dy * integrals[i, k]
            y_q[k] += dx * integrals[i, k]
    cos, sin = np.cos(tip), np.sin(tip)
    for j in range(POINTS):
        arm_x = cos * jaw[0, j] - sin * jaw[1, j]
        arm_y = sin * jaw[0, j] + cos * jaw[1, j]
        dx, dy = x + arm_x - centre[0], y + arm_y - centre[1]
        distance = np.sqrt(dx * dx + dy * dy)
        n_x, n_y = dx / distance, dy / distance
        turned = n_y * arm_x - n_x * arm_y
        for k in range(ORDER):
            out[j, k] = n_x * x_q[k] + n_y * y_q[k] + turned * integrals[QUADRATURE, k]
    return out


@njit(error_model="numpy")
def contact_force(q, multipliers, integrals, weights, jaw, centre):
    """Force (x, y) on the finger: the multipliers along the gaps' normals, in units of EI/L^2."""
    x = y = tip = force_x = force_y = 0.0
    for k in range(ORDER):
        tip += integrals[QUADRATURE, k] * q[k]
    for i in range(QUADRATURE):
        psi = 0.0
        for k in range(ORDER):
            psi += integrals[i, k] * q[k]
        x += weights[i] * np.cos(psi)
        y += weights[i] * np.sin(psi)
    for j in range(POINTS):
        if multipliers[j] != 0.0:
            dx = x + np.cos(tip) * jaw[0, j] - np.sin(tip) * jaw[1, j] - centre[0]
            dy = y + np.sin(tip) * jaw[0, j] + np.cos(tip) * jaw[1, j] - centre[1]
            force_x += multipliers[j] * dx / np.hypot(dx, dy)
            force_y += multipliers[j] * dy / np.hypot(dx, dy)
    return force_x, force_y


def solve_path(
    positions: int, basis: Basis = "legendre", extrapolate: bool = True, ftol: float = FTOL
) -> tuple[np.ndarray, int]:
    """The insertion path by SLSQP: forces on the finger (positions, 2) in N, and its iterations.

    Each solve starts from the solution before it, or from the parabola through the last three.
    Raises RuntimeError where SLSQP reports failure.
    """
    problem = snapfit_circle(basis)
    scene = (problem.integrals, problem.weights, problem.jaw, problem.centre)
    distances, jacobian = np.empty(POINTS), np.empty((POINTS, ORDER))
    no_penetration = {
        "type": "ineq",
        "fun": lambda q: gaps(q, *scene, distances),
        "jac": lambda q: gap_jacobian(q, *scene, jacobian),
    }
    forces = np.empty((positions, 2))
    iterations = 0
    solutions = [np.zeros(ORDER)]
    for i, position in enumerate(np.linspace(START, STOP, positions)):
        problem.centre[:] = position / LENGTH, PATH_Y / LENGTH
        start = solutions[-1]
        if extrapolate and i >= 3:
            start = 3.0 * (solutions[-1] - solutions[-2]) + solutions[-3]
        found = minimize(
            energy,
            start,
            args=(problem.stiffness,),
            method="SLSQP",
            jac=energy_gradient,
            constraints=no_penetration,
            options={"ftol": ftol},
        )
        if not found.success:
            raise RuntimeError(f"SLSQP at {position} m: {found.message}")
        forces[i] = contact_force(found.x, found.multipliers, *scene)
        iterations += found.nit
        solutions.append(found.x)
    return FORCE_UNIT * forces, iterations


def time_slsqp(
    positions: int = 60,
    repeats: int = 10,
    basis: Basis = "legendre",
    extrapolate: bool = True,
    ftol: float = FTOL,
) -> tuple[float, np.ndarray]:
    """Seconds per solve (best of `repeats` paths, compilation excluded), and the path's forces.

    The forces (positions, 2) act on the finger, in N. Warm starts along the path; the defaults are
    the fastest set-up.
    """
    forces, _ = solve_path(positions, basis, extrapolate, ftol)
    seconds = []
    for _ in range(repeats):
        begin = time.perf_counter()
        solve_path(positions, basis, extrapolate, ftol)
        seconds.append(time.perf_counter() - begin)
    return min(seconds) / positions, forces


def main() -> None:
    """Print time and accuracy of the yardstick and of its two slower variants."""
    positions = 60
    reference, _ = solve_path(positions, extrapolate=False, ftol=FTOL_REFERENCE)
    print(f"SciPy SLSQP, snapfit-circle, order {ORDER}, M = {POINTS}, {positions} positions:")
    variants: list[tuple[Basis, bool, float]] = [
        ("legendre", True, FTOL),
        ("legendre", False, FTOL_PLAIN),
        ("monomial", False, FTOL),
    ]
    for basis, extrapolate, ftol in variants:
        seconds, forces = time_slsqp(positions, 10, basis, extrapolate, ftol)
        _, iterations = solve_path(positions, basis, extrapolate, ftol)
        error = abs(forces - reference).max() / abs(reference).max()
        start = "extrapolated" if extrapolate else "last solution"
        print(
            f"  {basis:8}, start: {start:13}  {seconds * 1e6:6.1f} us a solve, "
            f"{iterations / positions:5.2f} iterations, force error {error:.1e}"
        )


if __name__ == "__main__":
    main()
