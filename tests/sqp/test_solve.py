"""The SQP on one contact: optimality recomputed in plain NumPy, from easy and from bad starts."""

import dataclasses

import numpy as np
import pytest
from entrance import entrance
from tracing import BFGS, CIRCLE, CORNER, EXACT, lowered_scene, solved_path

from fastncm.kernels import constants as c
from fastncm.kernels.problem import Problem
from fastncm.lowering import Lowered
from fastncm.path import rows
from fastncm.path.careful import make_sqp
from fastncm.sqp import design as model
from fastncm.sqp import qp, status
from fastncm.sqp import solve as sqp_solve
from fastncm.sqp.solve import Options, SqpWork

solve, cholesky = entrance(sqp_solve.solve), entrance(qp.cholesky)
evaluate, hessian_of = entrance(model.evaluate), entrance(model.hessian)

pytestmark = pytest.mark.compiled

ORDER = 8
TINY = 1e-30

SHALLOW = {CIRCLE: 0.0738, CORNER: 0.0672}
DEEP = {CIRCLE: 0.0625, CORNER: 0.0600}
"""Positions (m): soon after touch, and far enough in for the tip to have turned by 10 degrees."""


@dataclasses.dataclass
class OneContact:
    """One design in front of its target at `t` (finger lengths)."""

    lowered: Lowered
    problem: Problem
    design: model.Design
    work: SqpWork
    t: float
    u: np.ndarray
    result: int = -1
    iterations: int = -1
    residual: float = np.nan

    def run(self, options: Options = EXACT) -> "OneContact":
        self.result, _, self.iterations, self.residual = solve(
            self.design, self.t, self.u, 0, self.work, options
        )
        return self

    @property
    def contacts(self) -> list[int]:
        """The loaded features."""
        loaded = self.work.multipliers > 0.0
        return self.work.at.gaps[c.FEATURE, loaded].astype(int).tolist()


def one_contact(
    scene: str,
    position: float,
    changes: dict[str, object] | None = None,
    start: np.ndarray | float = 0.0,
) -> OneContact:
    """The scene with its target at `position` (m); `start`: unknowns (ORDER,) or all of them."""
    lowered = lowered_scene(scene, changes, [position])
    problem = lowered.problem(ORDER, np.arange(1))
    tables = (problem.profile.slope[0, :ORDER], problem.profile.end[0, :ORDER])
    slope, end = (np.ascontiguousarray(t.T) for t in tables)
    design = model.Design(
        slope, end, problem.rule.weights, problem.jaw, problem.target, 0, problem.kind,
        problem.form, problem.points,
    )  # fmt: skip
    t = float(problem.positions[0, 0])
    u = np.zeros(ORDER) + start
    return OneContact(lowered, problem, design, make_sqp(problem), t, u)


def plain_gap(contact: OneContact, feature: int, u: np.ndarray) -> complex:
    """Gap of one feature in plain NumPy, for real or complex `u` (ORDER,)."""
    theta = u @ contact.problem.profile.slope[0, :ORDER]
    weights, jaw = contact.problem.rule.weights, contact.problem.jaw[0]
    x, y = weights @ np.cos(theta), weights @ np.sin(theta)
    psi = u @ contact.problem.profile.end[0, :ORDER]
    radius, path_y = contact.problem.target[0, [c.TARGET_RADIUS, c.TARGET_Y]]

    def in_space(point: np.ndarray) -> tuple[complex, complex]:
        px, py = point
        return (
            x + np.cos(psi) * px - np.sin(psi) * py,
            y + np.sin(psi) * px + np.cos(psi) * py,
        )

    def distance(point: np.ndarray) -> complex:
        px, py = in_space(point)
        return np.sqrt((px - contact.t) ** 2 + (py - path_y) ** 2)

    a, b = jaw[[c.AX, c.AY]], jaw[[c.BX, c.BY]]
    if feature == c.A_UNDERSIDE:
        return path_y - in_space(a)[1]
    if feature == c.ON_A:
        return distance(a) - radius
    if feature == c.ON_B:
        return distance(b) - radius
    assert feature == c.ON_EDGE
    if jaw[c.RHO] != 0.0:
        return np.sign(jaw[c.RHO]) * distance(jaw[[c.MX, c.MY]]) - jaw[c.RHO] - radius
    (ax, ay), (bx, by) = in_space(a), in_space(b)
    length = np.hypot(*(b - a))
    across = (bx - ax) * (path_y - ay) - (by - ay) * (contact.t - ax)
    return across / length - radius


def plain_gradient(contact: OneContact, feature: int) -> np.ndarray:
    """d gap / du (ORDER,) by complex steps."""
    steps = contact.u + 1j * TINY * np.eye(ORDER)
    return np.array([plain_gap(contact, feature, u).imag for u in steps]) / TINY


def check_optimality(contact: OneContact, tolerance: float = 1e-9) -> None:
    """Stationarity, no penetration, no pulling, no force at a distance."""
    assert contact.result == status.CONVERGED
    multipliers, gaps = contact.work.multipliers, contact.work.at.gaps
    force = np.zeros(ORDER)
    deflection = np.abs(contact.u).max()
    for k in range(len(multipliers)):
        feature = int(gaps[c.FEATURE, k])
        if feature in (c.ON_EDGE, c.ON_A, c.ON_B, c.A_UNDERSIDE):
            gap = plain_gap(contact, feature, contact.u)
            assert gap == pytest.approx(gaps[c.GAP, k], abs=1e-14)
            assert gap > -tolerance * deflection
        if multipliers[k] != 0.0:
            assert abs(gap) < tolerance * deflection
            force += multipliers[k] * plain_gradient(contact, feature)
    assert multipliers.min() >= 0.0
    np.testing.assert_allclose(contact.u, force, atol=tolerance * deflection)


def random_starts(size: float) -> list[np.ndarray]:
    """Shapes (ORDER,) bent up and down; upwards is into the target."""
    rng = np.random.default_rng(0)
    return [size * rng.uniform(-1.0, 1.0, ORDER) / (1.0 + np.arange(ORDER)) for _ in range(8)]


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("positions", [SHALLOW, DEEP])
def test_from_the_undeformed_finger(scene: str, positions: dict[str, float]) -> None:
    contact = one_contact(scene, positions[scene]).run()
    check_optimality(contact)
    assert contact.iterations <= 12
    assert contact.residual < 1e-11


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("size", [0.1, 0.25])
def test_from_random_shapes(scene: str, size: float) -> None:
    """Feasible and infeasible starts end in the same shape."""
    expected = one_contact(scene, SHALLOW[scene]).run().u
    feasible = set()
    for start in random_starts(size):
        contact = one_contact(scene, SHALLOW[scene], start=start)
        evaluate(contact.design, contact.t, contact.u, contact.work.at)
        feasible.add(bool(contact.work.at.gaps[c.GAP].min() >= 0.0))
        contact.run()
        check_optimality(contact)
        np.testing.assert_allclose(contact.u, expected, atol=1e-9)
    assert feasible == {True, False}


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("options", [EXACT, BFGS])
def test_from_the_far_side_of_the_target(scene: str, options: Options) -> None:
    """Starts bent beyond the target: another solution, or none, but never a wrong one."""
    for start in random_starts(0.5):
        contact = one_contact(scene, SHALLOW[scene], start=start).run(options)
        if contact.result == status.CONVERGED:
            check_optimality(contact)
        else:
            assert contact.residual > options.tolerance


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("positions", [SHALLOW, DEEP])
def test_bfgs_finds_the_same_shape(scene: str, positions: dict[str, float]) -> None:
    exact = one_contact(scene, positions[scene]).run()
    bfgs = one_contact(scene, positions[scene]).run(BFGS)
    check_optimality(bfgs)
    np.testing.assert_allclose(bfgs.u, exact.u, atol=1e-8 * np.abs(exact.u).max())
    np.testing.assert_allclose(
        bfgs.work.multipliers, exact.work.multipliers, atol=1e-8 * exact.work.multipliers.max()
    )


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_no_contact_needs_no_step(scene: str) -> None:
    contact = one_contact(scene, 0.080).run()
    assert contact.result == status.CONVERGED
    assert contact.iterations == 0
    assert not contact.u.any()


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_quadratic_convergence(scene: str) -> None:
    """Errors after k iterations, from runs stopped there: each at most the square of the last."""
    solution = one_contact(scene, DEEP[scene]).run()
    errors = []
    for iterations in range(1, solution.iterations + 1):
        stopped = one_contact(scene, DEEP[scene]).run(EXACT._replace(iterations=iterations))
        errors.append(np.abs(stopped.u - solution.u).max())
    errors = [error for error in errors if error > 1e-14]
    close = [i for i in range(len(errors) - 1) if errors[i] < 0.1]
    assert close
    for i in close:
        assert errors[i + 1] < max(4.0 * errors[i] ** 2, 1e-13)


def numeric_hessian(contact: OneContact, feature: int) -> np.ndarray:
    """Hessian (ORDER, ORDER) of a gap, by differences of complex-step gradients."""
    step, middle, result = 1e-5, contact.u.copy(), np.empty((ORDER, ORDER))
    for i in range(ORDER):
        contact.u = middle + step * np.eye(ORDER)[i]
        ahead = plain_gradient(contact, feature)
        contact.u = middle - step * np.eye(ORDER)[i]
        result[i] = (ahead - plain_gradient(contact, feature)) / (2.0 * step)
    contact.u = middle
    return result


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_hessian_of_the_lagrangian(scene: str) -> None:
    contact = one_contact(scene, DEEP[scene]).run()
    out = np.zeros((ORDER, ORDER))
    hessian_of(contact.design, contact.work.at, contact.work.multipliers, out)
    expected = np.eye(ORDER)
    for k in np.flatnonzero(contact.work.multipliers):
        feature = int(contact.work.at.gaps[c.FEATURE, k])
        expected -= contact.work.multipliers[k] * numeric_hessian(contact, feature)
    np.testing.assert_allclose(out, expected, atol=1e-8)


def test_indefinite_hessian() -> None:
    """Pushed along its axis beyond the buckling load the Lagrangian's Hessian is indefinite at the
    start; the solution that is found is a minimum on the constraint's tangent all the same."""
    contact = one_contact(CIRCLE, DEEP[CIRCLE], start=np.eye(ORDER)[0] * -0.2)
    evaluate(contact.design, contact.t, contact.u, contact.work.at)
    contact.work.multipliers[0] = 40.0
    hessian = np.zeros((ORDER, ORDER))
    hessian_of(contact.design, contact.work.at, contact.work.multipliers, hessian)
    assert not cholesky(hessian.copy(), ORDER)
    expected = one_contact(CIRCLE, DEEP[CIRCLE]).run()
    contact.run()
    check_optimality(contact)
    np.testing.assert_allclose(contact.u, expected.u, atol=1e-9)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("positions", [SHALLOW, DEEP])
def test_solution_is_a_minimum(scene: str, positions: dict[str, float]) -> None:
    """Second-order condition: the Hessian is positive definite on the constraint's tangent."""
    contact = one_contact(scene, positions[scene]).run()
    (k,) = np.flatnonzero(contact.work.multipliers)
    hessian = np.zeros((ORDER, ORDER))
    hessian_of(contact.design, contact.work.at, contact.work.multipliers, hessian)
    tangent = np.linalg.svd(contact.work.at.jacobian[[k]])[2][1:]
    assert np.linalg.eigvalsh(tangent @ hessian @ tangent.T).min() > 0.0


BIG_CIRCLE = {
    "jaw.shape": "arc",
    "jaw.radius": 0.03,
    "jaw.convex": False,
    "target.radius": 0.06,
    "path.y": 0.050,
}
"""On snapfit-circle: a concave jaw and a circle too large for it, which touches both corners."""


def test_two_corners_touch_a_big_circle() -> None:
    contact = one_contact(CIRCLE, 0.0985, BIG_CIRCLE).run()
    check_optimality(contact)
    assert sorted(contact.contacts) == [c.ON_A, c.ON_B]
    loaded = contact.work.multipliers > 0.0
    assert loaded.sum() == 2
    # equilibrium: the clamp's moment is that of both forces together
    gaps = contact.work.at.gaps[:, loaded]
    forces = contact.work.multipliers[loaded]
    moment = forces @ (gaps[c.PX] * gaps[c.GY] - gaps[c.PY] * gaps[c.GX])
    legendre_at_clamp = np.sqrt(2.0 * np.arange(ORDER) + 1.0) * (-1.0) ** np.arange(ORDER)
    assert contact.u @ legendre_at_clamp == pytest.approx(moment, rel=1e-6)
    # each force points from the circle's centre
    centre = np.array([contact.t, contact.problem.target[0, c.TARGET_Y]])
    for k in range(2):
        arm = gaps[[c.PX, c.PY], k] - centre
        np.testing.assert_allclose(arm / np.hypot(*arm), gaps[[c.GX, c.GY], k], atol=1e-12)


POINTS = np.array([25, 50, 100, 200, 400])
BEFORE_THE_PEAK = {CIRCLE: (0.077, 0.064), CORNER: (0.073, 0.0585)}


def point_form_errors(scene: str, form: str) -> np.ndarray:
    """Largest error of the force along the path, over the largest force, for each of POINTS."""
    positions = np.linspace(*BEFORE_THE_PEAK[scene], 30)
    exact = solved_path(scene, 6, positions=positions).force
    errors = []
    for count in POINTS:
        changes = {"solver.contact": form, "solver.points": int(count)}
        solved = solved_path(scene, 6, changes, positions, EXACT)
        assert set(solved.status) <= {status.CONVERGED, status.NO_CONTACT}
        errors.append(np.abs(solved.force - exact).max() / exact.max())
    return np.array(errors)


@pytest.mark.parametrize("form", ["points-on-finger", "points-on-target"])
def test_point_forms_are_exact_at_a_sharp_corner(form: str) -> None:
    """The block's corner is one of the points, or has a constraint of its own."""
    assert point_form_errors(CORNER, form).max() < 1e-9


@pytest.mark.parametrize("form", ["points-on-finger", "points-on-target"])
def test_point_forms_converge_to_the_closest_point(form: str) -> None:
    """Of first order: the points hit or miss the closest one by up to half their distance."""
    errors = point_form_errors(CIRCLE, form)
    order = -np.polyfit(np.log(POINTS), np.log(errors), 1)[0]
    assert order > 0.9
    assert errors[-1] < 0.005


def test_points_on_the_target_have_its_corner_among_them() -> None:
    """(10b) on the block: the corner, which touches up to the peak, is one of the points."""
    assert point_form_errors(CORNER, "points-on-target").max() < 1e-12


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_whole_path_by_the_sqp(scene: str) -> None:
    """The SQP and the lanes' Newton method give the same rows."""
    lanes, sqp = solved_path(scene, ORDER), solved_path(scene, ORDER, options=EXACT)
    np.testing.assert_array_equal(sqp.status, lanes.status)
    np.testing.assert_array_equal(sqp.contacts[1:], lanes.contacts[1:])
    for column in (rows.FORCE, rows.NORMAL_X, rows.CONTACT_X, rows.TIP_Y, rows.ENERGY):
        np.testing.assert_allclose(
            sqp.trace.rows[0, : len(sqp.status), column],
            lanes.trace.rows[0, : len(sqp.status), column],
            atol=1e-9,
        )
