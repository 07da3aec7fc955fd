"""Tip pose and its derivatives against SciPy's quadrature and complex steps."""

import numpy as np
import pytest
from entrance import entrance
from numpy.polynomial import legendre
from scipy.integrate import quad

from fastncm.kernels import basis, rod
from fastncm.kernels.constants import LANES

tip_pose, pose_gradient = entrance(rod.tip_pose), entrance(rod.pose_gradient)
add_position_hessian = entrance(rod.add_position_hessian)
running_integral = entrance(rod.running_integral)

MODES = 6
POINTS = basis.quadrature_points(27)  # enough for shapes of six modes to double precision
TINY = 1e-30


def random_shapes() -> np.ndarray:
    """Coefficients (MODES, LANES), bent by up to a radian or so."""
    falling = 0.8 / (1.0 + np.arange(MODES)[:, None])
    return np.random.default_rng(1).uniform(-1.0, 1.0, (MODES, LANES)) * falling


class Rod:
    """A uniform finger with the same modes in every lane."""

    def __init__(self) -> None:
        profile = basis.profiles(np.ones(1), 27, False)
        self.rule = basis.quadrature(POINTS)
        self.slope = np.repeat(profile.slope[0, :MODES, :, None], LANES, axis=2)
        self.end = np.repeat(profile.end[0, :MODES, None], LANES, axis=1)
        self.u = random_shapes()
        self.sin = np.zeros((POINTS, LANES))
        self.cos = np.zeros((POINTS, LANES))
        self.pose = np.zeros((3, LANES))
        tip_pose(self.slope, self.end, self.rule.weights, self.u, self.sin, self.cos, self.pose)

    def position(self, u: np.ndarray, lane: int) -> np.ndarray:
        """Tip (2,) by the same rule in plain NumPy; `u` (MODES,) may be complex."""
        theta = u @ self.slope[:, :, lane]
        return np.array([self.rule.weights @ np.cos(theta), self.rule.weights @ np.sin(theta)])

    def gradient(self, u: np.ndarray, lane: int) -> np.ndarray:
        """d(x, y)/du (2, MODES) in plain NumPy; `u` may be complex."""
        theta, slope = u @ self.slope[:, :, lane], self.slope[:, :, lane]
        weighted = self.rule.weights * slope
        return np.array([-weighted @ np.sin(theta), weighted @ np.cos(theta)])


def exact_angle(u: np.ndarray, s: float) -> float:
    """theta(s) for the Legendre coefficients `u` (MODES,) of the curvature."""
    curvature = u * np.sqrt(2.0 * np.arange(MODES) + 1.0)
    return float(legendre.legval(2.0 * s - 1.0, legendre.legint(curvature, lbnd=-1.0) / 2.0))


def exact_position(u: np.ndarray, s: float) -> list[float]:
    x, _ = quad(lambda r: np.cos(exact_angle(u, r)), 0.0, s, epsabs=1e-13)
    y, _ = quad(lambda r: np.sin(exact_angle(u, r)), 0.0, s, epsabs=1e-13)
    return [x, y]


@pytest.mark.parametrize("lane", [0, LANES - 1])
def test_tip_pose(lane: int) -> None:
    finger = Rod()
    u = finger.u[:, lane]
    expected = [*exact_position(u, 1.0), exact_angle(u, 1.0)]
    np.testing.assert_allclose(finger.pose[:, lane], expected, atol=1e-13)


def test_positions_along_the_axis() -> None:
    finger = Rod()
    x, y = np.zeros((POINTS, LANES)), np.zeros((POINTS, LANES))
    running_integral(finger.rule.integral, finger.cos, x)
    running_integral(finger.rule.integral, finger.sin, y)
    for q in (0, POINTS // 2, POINTS - 1):
        expected = exact_position(finger.u[:, 1], finger.rule.nodes[q])
        np.testing.assert_allclose([x[q, 1], y[q, 1]], expected, atol=1e-13)


def test_undeformed_finger_is_straight() -> None:
    finger = Rod()
    finger.u[:] = 0.0
    tip_pose(
        finger.slope, finger.end, finger.rule.weights, finger.u, finger.sin, finger.cos, finger.pose
    )
    np.testing.assert_allclose(finger.pose, [[1.0], [0.0], [0.0]] * np.ones(LANES), atol=1e-15)


def test_gradient_of_the_tip() -> None:
    finger = Rod()
    gradient = np.zeros((2, MODES, LANES))
    pose_gradient(finger.slope, finger.rule.weights, finger.sin, finger.cos, gradient)
    for lane in range(LANES):
        for k in range(MODES):
            step = 1j * TINY * np.eye(MODES)[k]
            expected = finger.position(finger.u[:, lane] + step, lane).imag / TINY
            np.testing.assert_allclose(gradient[:, k, lane], expected, atol=1e-14)
        plain = finger.gradient(finger.u[:, lane], lane)
        np.testing.assert_allclose(gradient[:, :, lane], plain, atol=1e-14)


def test_hessian_of_the_tip() -> None:
    """``-(fx x + fy y)`` is added to the lower triangle, and nothing is lost that was there."""
    finger = Rod()
    rng = np.random.default_rng(2)
    force = rng.normal(size=(2, LANES))
    before = rng.normal(size=(MODES, MODES, LANES))
    hessian, work = before.copy(), np.zeros((POINTS, LANES))
    add_position_hessian(
        finger.slope, finger.rule.weights, finger.sin, finger.cos, force[0], force[1], work, hessian
    )
    upper = np.triu_indices(MODES, 1)
    np.testing.assert_array_equal(hessian[upper], before[upper])
    for lane in range(LANES):
        for j in range(MODES):
            step = 1j * TINY * np.eye(MODES)[j]
            second = finger.gradient(finger.u[:, lane] + step, lane).imag / TINY
            expected = before[j:, j, lane] - (force[:, lane] @ second)[j:]
            np.testing.assert_allclose(hessian[j:, j, lane], expected, atol=1e-13)


@pytest.mark.parametrize(("modes", "points"), [(4, 7), (5, 8), (3, 6)])
def test_sizes_that_are_unrolled(modes: int, points: int) -> None:
    """Orders 4 and 5 have loops of their own; a different basis in each lane."""
    rng = np.random.default_rng(modes)
    slope, end = rng.normal(size=(modes, points, LANES)), rng.normal(size=(modes, LANES))
    weights, u = rng.uniform(size=points), 0.3 * rng.normal(size=(modes, LANES))
    sin, cos, work = np.zeros((points, LANES)), np.zeros((points, LANES)), np.zeros((points, LANES))
    pose, gradient = np.zeros((3, LANES)), np.zeros((2, modes, LANES))
    hessian, force = np.zeros((modes, modes, LANES)), rng.normal(size=(2, LANES))
    integral, x = rng.normal(size=(points, points)), np.zeros((points, LANES))
    tip_pose(slope, end, weights, u, sin, cos, pose)
    pose_gradient(slope, weights, sin, cos, gradient)
    add_position_hessian(slope, weights, sin, cos, force[0], force[1], work, hessian)
    running_integral(integral, cos, x)
    theta = np.einsum("kql,kl->ql", slope, u)
    weighted = weights[:, None] * np.array([np.cos(theta), np.sin(theta)])
    expected = [*weighted.sum(axis=1), np.einsum("kl,kl->l", end, u)]
    np.testing.assert_allclose(pose, expected, atol=1e-13)
    by_x, by_y = np.einsum("kql,dql->dkl", slope, weighted)
    np.testing.assert_allclose(gradient, [-by_y, by_x], atol=1e-13)
    axial = np.einsum("dl,dql->ql", force, weighted)
    stiffness = np.einsum("ql,kql,jql->kjl", axial, slope, slope)
    for k in range(modes):
        np.testing.assert_allclose(hessian[k, : k + 1], stiffness[k, : k + 1], atol=1e-12)
    np.testing.assert_allclose(x, integral @ np.cos(theta), atol=1e-13)
