"""The rivals solve the same problem as the package, as well as they are said to.

The truth is shooting. Their compiled functions run as Python here, which needs no compiler.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher
from support import rivals, rivals_paper, rivals_root, shooting
from support import rivals_problem as rp
from support.random_scenes import random_scenes
from support.rivals_bvp import BvpRival
from support.rivals_paper import PaperRival
from support.rivals_root import RootRival
from support.rivals_scipy import SciPyRival
from support.rivals_surface import SurfaceRival
from support.rivals_surface_root import SurfaceRoot

import fastncm

CIRCLE, CORNER = shooting.SNAPFIT_CIRCLE, shooting.SNAPFIT_CORNER
CONCAVE = replace(CORNER, convex=False)
POSITIONS = {CIRCLE: (0.0719, 0.0660, 0.0625), CORNER: (0.0688, 0.0620, 0.0565)}
"""In m; at the last one the jaw's corner a touches."""
STEP = 1e-6


@pytest.fixture(autouse=True)
def interpreted(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for module in (rp, rivals_paper, rivals_root):
        for name, value in list(vars(module).items()):
            if isinstance(value, CPUDispatcher):
                monkeypatch.setattr(module, name, value.py_func)
    yield


def errors(rival: rivals.Rival) -> np.ndarray:
    """Relative errors of the force at the case's positions; NaN where it failed."""
    positions = POSITIONS[replace(rival.case, mu=0.0)]
    solved = [shooting.solve(rival.case, position) for position in positions]
    truth = np.array([[one.force_x, one.force_y] for one in solved])
    return rivals.relative_errors(rivals.follow(rival, positions), truth)


@pytest.mark.parametrize("case", [CIRCLE, CORNER, CONCAVE], ids=["line", "arc", "concave"])
@pytest.mark.parametrize("feature", [rp.EDGE, rp.CORNER])
def test_derivatives_of_the_gap(case: shooting.ShootingCase, feature: int) -> None:
    problem = rp.jaw_problem(case, 4)
    q, scene = np.array([-0.15, 0.06, 0.01, 0.004]), (*problem[1:], feature, 1.12)
    gradient, hessian = rp.gap_gradient(q, *scene), rp.gap_hessian(q, *scene)
    for k, step in enumerate(STEP * np.eye(4)):
        slope = (rp.gap(q + step, *scene) - rp.gap(q - step, *scene)) / (2 * STEP)
        bend = (rp.gap_gradient(q + step, *scene) - rp.gap_gradient(q - step, *scene)) / (2 * STEP)
        assert gradient[k] == pytest.approx(slope, abs=1e-8)
        np.testing.assert_allclose(hessian[k], bend, atol=1e-8)


@pytest.mark.parametrize("case", [CIRCLE, CORNER], ids=["circle", "corner"])
def test_slsqp(case: shooting.ShootingCase) -> None:
    assert errors(SciPyRival(case, "SLSQP", 6, 1e-13)).max() < 1e-6


def test_trust_constr() -> None:
    assert errors(SciPyRival(CIRCLE, "trust-constr", 5, 1e-12)).max() < 1e-5


@pytest.mark.parametrize("case", [CIRCLE, CORNER], ids=["circle", "corner"])
def test_ipopt(case: shooting.ShootingCase) -> None:
    pytest.importorskip("casadi")
    from support.rivals_ipopt import IpoptRival

    assert errors(IpoptRival(case, 6, 1e-10)).max() < 1e-6


@pytest.mark.parametrize("case", [CIRCLE, CORNER, CONCAVE], ids=["line", "arc", "concave"])
@pytest.mark.parametrize("feature", [rp.EDGE, rp.CORNER])
def test_the_slope_of_sliding(case: shooting.ShootingCase, feature: int) -> None:
    z = np.array([-0.15, 0.06, 0.01, 0.004, 0.3])
    scene = (*rp.jaw_problem(case, 4), feature, 1.12, 0.3)
    slope = rivals_root.sliding_slope(z, *scene)
    for k, step in enumerate(STEP * np.eye(5)):
        change = rivals_root.sliding(z + step, *scene) - rivals_root.sliding(z - step, *scene)
        np.testing.assert_allclose(slope[:, k], change / (2 * STEP), atol=1e-8)


@pytest.mark.parametrize("method", ["root", "least_squares"])
@pytest.mark.parametrize("mu", [0.0, 0.2])
@pytest.mark.parametrize("case", [CIRCLE, CORNER], ids=["circle", "corner"])
def test_root(case: shooting.ShootingCase, mu: float, method: rivals_root.Method) -> None:
    assert errors(RootRival(replace(case, mu=mu), method, 6, 1e-10)).max() < 1e-6


@pytest.mark.parametrize("mu", [0.0, 0.2])
@pytest.mark.parametrize("case", [CIRCLE, CORNER], ids=["circle", "corner"])
def test_solve_bvp(case: shooting.ShootingCase, mu: float) -> None:
    assert errors(BvpRival(replace(case, mu=mu), 1e-7)).max() < 1e-6


def test_the_printed_line_search_never_leaves_the_undeformed_finger() -> None:
    assert np.isnan(errors(PaperRival(CIRCLE, 4, 10, 1e-6, "printed"))).all()


def test_the_papers_algorithm_is_wrong_by_the_distance_of_its_points() -> None:
    """First order in M: a fourth of the error for four times the points, or thereabouts."""
    coarse, fine = (errors(PaperRival(CIRCLE, 4, points, 1e-8))[:2].max() for points in (8, 32))
    assert 1e-2 < coarse < 0.5
    assert 2.0 < coarse / fine < 10.0


def test_the_papers_friction_is_the_recovered_one() -> None:
    """(14)-(17) by the paper's algorithm and by shooting, both on the frictionless shape."""
    rival = PaperRival(replace(CIRCLE, mu=0.2), 6, 8, 1e-10)
    position = 0.0625  # corner a, one of the points, touches
    found = rivals.follow(rival, [0.0660, position]).iloc[-1]
    wanted = shooting.recovered(shooting.solve(CIRCLE, position), 0.2)
    assert found["success"]
    np.testing.assert_allclose(found[["force_x_N", "force_y_N"]].to_list(), wanted, rtol=1e-3)


@pytest.mark.parametrize("method", ["SLSQP", "trust-constr"])
@pytest.mark.compiled
def test_direct_contact_is_discretised_alike(method: str) -> None:
    """The same forces as the package with as many intervals, by another program."""
    angles = np.radians([120.0, 112.0, 104.0])
    scene = fastncm.load_scene("rubber-ellipse").replace({"solver.intervals": 8})
    ours = fastncm.solve(scene, positions=angles).frame()[["force_x_N", "force_y_N"]].to_numpy()
    turned = np.append(np.linspace(math.pi, angles[0], 12)[:-1], angles)
    poses = [scene.pose(min(x, angles[0]))._replace(base_angle=x) for x in turned]
    found = SurfaceRival(scene, method, 1e-10).follow(poses).iloc[-3:]
    assert found["success"].all()
    assert rivals.relative_errors(found, ours).max() < 1e-5


@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("method", ["root", "least_squares"])
@pytest.mark.compiled
def test_sliding_in_direct_contact_as_equations(method: str, mu: float) -> None:
    """The same forces as the package's, and a Jacobian by differences."""
    changes = {"solver.intervals": 16, "friction.mu": mu}
    scene = fastncm.load_scene("rubber-ellipse").replace(changes)
    angles = np.radians([126.0, 124.0, 122.0])
    curve, poses = fastncm.solve(scene, positions=angles), [scene.pose(x) for x in angles]
    rival = SurfaceRoot(scene, method, 1e-10)
    found = rival.follow(poses, curve)
    ours = curve.frame()[["force_x_N", "force_y_N"]].to_numpy()
    assert found["success"].all()
    assert rivals.relative_errors(found, ours).max() < 1e-8
    x, nodes = np.append(0.1 * np.cos(np.arange(32)), [1.0, 2.0]), np.array([3, 7])
    steps = STEP * np.eye(len(x))
    by_differences = [
        (rival.residual(x + step, poses[0], nodes) - rival.residual(x - step, poses[0], nodes))
        for step in steps
    ]
    slope = rival.jacobian(x, poses[0], nodes)
    np.testing.assert_allclose(slope, np.transpose(by_differences) / (2 * STEP), atol=1e-7)


@pytest.mark.compiled
def test_random_scenes_have_one_answer() -> None:
    """Shooting, the package and SLSQP agree at all positions of three scenes."""
    from support.fastncm_runs import FastNcm, solve_together

    scenes, _ = random_scenes(3, 2, seed=5)
    for scene in scenes:
        for run in (
            FastNcm(scene.case, 1e-8),
            lambda positions, case=scene.case: rivals.follow(
                SciPyRival(case, "SLSQP", 8, 1e-13), positions
            ),
        ):
            found = run(scene.positions)
            assert found["success"].all()
            assert rivals.relative_errors(found, scene.truth).max() < 1e-6
    together = solve_together(scenes, [1e-8])
    assert sorted(together["scene"]) == [0, 0, 1, 1, 2, 2]  # cold and warm
    assert together["error"].max() < 1e-8
