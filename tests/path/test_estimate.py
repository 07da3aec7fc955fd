"""The error estimate of the contact force against the true error, with order 24 as the truth."""

import extremes
import numpy as np
import pytest
from tracing import CIRCLE, CORNER, EXACT, Solved, solved_path

import fastncm
from fastncm.path import rows

pytestmark = pytest.mark.compiled

ORDERS = range(2, 11)
TRUTH = 24
NEGLIGIBLE = 1e-12
"""Errors below this are rounding."""

VARIANTS = {
    "plain": {},
    "tapered": {"finger.thickness": [0.0032, 0.0016]},
    "shear": {"model.shear": True},
    "tapered with shear": {"finger.thickness": [0.0032, 0.0016], "model.shear": True},
    "friction": {"friction.mu": 0.2},
    "much friction": {"friction.mu": 0.6},
    "shear and friction": {"model.shear": True, "friction.mu": 0.3},
    "slightly tapered with shear and friction": {
        "finger.thickness": [0.0040, 0.0028],
        "model.shear": True,
        "friction.mu": 0.3,
    },
}


def force(solved: Solved) -> np.ndarray:
    """The contact force (N, 2) on the finger: an error of its direction is one, too."""
    normal = np.column_stack([solved.normal_x, solved.normal_y])
    tangent = np.column_stack([-solved.normal_y, solved.normal_x])
    return solved.force[:, None] * normal + solved.rub[:, None] * tangent


def touching(solved: Solved) -> np.ndarray:
    """Rows (n, rows.COLUMNS) of all converged positions and of the events with a force."""
    found = np.vstack(
        [solved.trace.rows[0, : len(solved.force)][solved.converged], solved.events()]
    )
    return found[found[:, rows.FORCE] > 0.0]


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("order", ORDERS)
def test_between_once_and_twenty_times_the_true_error(scene: str, variant: str, order: int) -> None:
    truth = solved_path(scene, TRUTH, VARIANTS[variant])
    solved = solved_path(scene, order, VARIANTS[variant])
    assert solved.converged[1:].all()
    assert truth.converged[1:].all()
    # events move with the order, and a position between two places of an event has two contacts
    same = solved.feature[1:] == truth.feature[1:]
    assert (~same).sum() <= (1 if "tapered" in variant and order == 2 else 0)
    exact = force(truth)[1:][same]
    error = np.hypot(*(force(solved)[1:][same] - exact).T) / np.hypot(*exact.T)
    estimate = solved.estimate[1:][same]
    counts = error > NEGLIGIBLE
    ratio = estimate[counts] / error[counts]
    assert ratio.min(initial=1.0) >= 1.0
    assert ratio.max(initial=1.0) <= 20.0
    assert estimate[~counts].max(initial=0.0) < 1e-10


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_estimate_falls_to_rounding(scene: str) -> None:
    assert touching(solved_path(scene, 12))[:, rows.ESTIMATE].max() < 1e-12


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_events_have_estimates_like_their_neighbours(scene: str) -> None:
    solved = solved_path(scene, 4)
    for event in solved.events():
        if event[rows.FORCE] > 0.0:
            i = int(event[rows.INTERVAL])
            around = solved.estimate[max(i - 2, 0) : i + 4]
            assert 0.5 * around.min() < event[rows.ESTIMATE] < 2.0 * around.max()


@pytest.mark.parametrize("form", ["points-on-finger", "points-on-target"])
@pytest.mark.parametrize("count", [20, 50, 400])
def test_estimates_count_what_the_points_lack_of_the_closed_form(form: str, count: int) -> None:
    """The closed form's force, which shooting confirms, is the truth."""
    positions = np.linspace(0.0778, 0.0601, 60)
    exact = solved_path(CIRCLE, 8, positions=positions).force
    changes = {"solver.contact": form, "solver.points": count}
    solved = solved_path(CIRCLE, 8, changes, positions, EXACT)
    error = np.abs(solved.force / exact - 1.0)[solved.converged]
    estimate = solved.estimate[solved.converged]
    assert solved.converged.mean() > 0.9
    assert (error <= 5.0 * estimate).all()
    assert np.median(estimate / (error + NEGLIGIBLE)) < 10.0


def test_covers_what_the_last_digit_of_the_position_does() -> None:
    """Deflections near 1e-9 of the finger's length."""
    scene = fastncm.load_scene("snapfit-corner").replace(extremes.one("corner-convex", 4))
    there = np.linspace(scene.path.stop + 1e-9 * scene.finger.length, scene.path.stop, 5)
    beside = [
        fastncm.solve(scene, positions=there + one * np.spacing(scene.path.stop)).frame()
        for one in (0.0, 1.0)
    ]
    both = (beside[0]["normal_force_N"] > 0.0) & (beside[1]["normal_force_N"] > 0.0)
    assert both.sum() >= 2
    force = [one["normal_force_N"][both] for one in beside]
    assert (abs(force[1] / force[0] - 1.0) > 1e-9).any()
    assert (abs(force[1] / force[0] - 1.0) <= 10.0 * beside[0]["error_estimate"][both]).all()
