"""Direct contact along the target's way: what the finger is pushed by, and on which branch it is.

The scenes with a kind and an index are those of `tests/extremes.py` that were once answered wrongly
or not at all.
"""

import math

import extremes
import numpy as np
import pytest
from surfaces import RUBBER, check_equilibrium, solved_surface

import fastncm
from fastncm.sqp import status

pytestmark = pytest.mark.compiled
LENGTH, OFFSET = RUBBER.finger.length, RUBBER.finger.offset
#: A thin finger along x, and a pin that is pushed up against its right side from below.
THICK, RADIUS, AT = 0.0004, 0.0005, 0.6 * LENGTH
PIN = {
    "path.kind": "translation",
    "path.angle": 0.5 * math.pi,
    "path.y": OFFSET + AT,
    "path.start": 0.03,
    "path.stop": -0.03,
    "target.shape": "circle",
    "target.radius": RADIUS,
    "finger.thickness": THICK,
    "model.shear": False,
    "solver.intervals": 40,
}
TOUCH = RADIUS + 0.5 * THICK
"""x of the pin where it first touches the finger, which points along y from the origin."""


def solve_extreme(kind: str, index: int, **changes: object) -> "fastncm.curve_base.Curve":
    made = extremes.one(kind, index) | {name.replace("_", "."): v for name, v in changes.items()}
    return fastncm.solve(fastncm.load_scene(extremes.base_scene(kind)).replace(made))


@pytest.mark.parametrize("way", [[0.002, -0.0022], [0.03, -0.0022], np.linspace(0.03, -0.0022, 40)])
def test_a_pin_that_has_passed_the_straight_finger_still_bends_it(way: list[float]) -> None:
    """It lies all on the other side of the undeformed finger: P = 3 E I d / s^3."""
    solved = solved_surface(PIN, way)
    depth = TOUCH + 0.0022
    assert depth > 2.0 * RADIUS + THICK
    inertia = RUBBER.finger.width * THICK**3 / 12.0
    force = 3.0 * RUBBER.finger.young * inertia * depth / AT**3
    assert solved.status[-1] == status.CONVERGED
    assert -solved.newtons[-1, 0] == pytest.approx(force, rel=5e-3)


def test_a_pin_that_goes_back_lets_go() -> None:
    solved = solved_surface(PIN, [0.002, -0.01, -0.002, 0.002, 0.003])
    touching = [status.NO_CONTACT, status.CONVERGED, status.CONVERGED]
    assert list(solved.status) == [*touching, status.NO_CONTACT, status.NO_CONTACT]
    assert solved.energy[-1] == 0.0


def test_a_pin_that_the_finger_slips_off_leaves_it_straight() -> None:
    """Pushed farther than the finger is long, the pin is left behind the tip, which springs back;
    then nothing is between them."""
    solved = solved_surface(PIN, np.linspace(0.01, -0.3, 80))
    loaded = solved.status == status.CONVERGED
    assert loaded.sum() > 10
    assert solved.status[-1] == status.NO_CONTACT
    assert np.isin(solved.status, (status.CONVERGED, status.NO_CONTACT)).all()


@pytest.mark.parametrize(
    ("kind", "index"),
    [("ellipse", 392), ("circle", 300), ("polygon", 448), ("polygon", 661), ("polygon", 601)],
)
def test_few_positions_and_many_lead_to_the_same_branch(kind: str, index: int) -> None:
    """Each jumped to another shape when the target came in one move."""
    rows = [solve_extreme(kind, index, path_steps=steps).frame().iloc[-1] for steps in (2, 20, 200)]
    assert {row["status"] for row in rows} == {"converged"}
    for row in rows[:-1]:
        assert row["tip_angle_rad"] == pytest.approx(rows[-1]["tip_angle_rad"], abs=1e-6)
        assert row["normal_force_N"] == pytest.approx(rows[-1]["normal_force_N"], rel=1e-5)


@pytest.mark.parametrize("beyond", [0.2, -0.2])
def test_a_corner_beyond_the_finger_s_end_does_not_touch_it(beyond: float) -> None:
    """A needle from below, its point above the side, a fraction of an interval beside the tip."""
    intervals, thick = 40, 0.01
    at = OFFSET + LENGTH * (1.0 + beyond / intervals)
    needle = {
        "path.kind": "translation",
        "path.angle": 0.0,
        "path.start": at,
        "path.stop": at + 0.01,
        "path.y": -0.4 * thick,
        "target.shape": "polygon",
        "target.vertices": [[0.0, 0.0], [-0.002, -0.2], [0.002, -0.2]],
        "finger.thickness": thick,
        "solver.intervals": intervals,
    }
    solved = solved_surface(needle, [at])
    assert solved.status[0] == (status.NO_CONTACT if beyond > 0.0 else status.CONVERGED)


@pytest.mark.parametrize(
    ("kind", "index", "times"),
    [("ellipse", 467, 8), ("polygon", 146, 8), ("circle", 300, 8), ("ellipse", 467, 64)],
)
def test_estimates_of_few_intervals(kind: str, index: int, times: int) -> None:
    """The contact lies in the last or the first interval, which nodes alone do not see."""
    solved = solve_extreme(kind, index).frame().iloc[-1]
    intervals = times * int(extremes.one(kind, index)["solver.intervals"])
    truth = solve_extreme(kind, index, solver_intervals=intervals).frame().iloc[-1]
    columns = ["force_x_N", "force_y_N"]
    exact = truth[columns].to_numpy(dtype=float)
    off = np.linalg.norm(solved[columns].to_numpy(dtype=float) - exact) / np.linalg.norm(exact)
    assert off > 1e-4  # else it says nothing
    assert off <= solved["error_estimate"] + truth["error_estimate"]


@pytest.mark.parametrize("intervals", [12, 45])
def test_estimate_of_a_tip_that_its_shear_turns(intervals: int) -> None:
    """The printed section at the tip: the shorter the last interval, the more it turns."""
    tip = {"model.section": "psi+gamma", "solver.intervals": intervals}
    solved = solve_extreme("half-plane", 615, **{k.replace(".", "_"): v for k, v in tip.items()})
    finer = solve_extreme("half-plane", 615, solver_intervals=2 * intervals)
    first, second = (one.frame().iloc[-1] for one in (solved, finer))
    off = abs(first["normal_force_N"] / second["normal_force_N"] - 1.0)
    assert 1e-4 < off <= first["error_estimate"]


@pytest.mark.parametrize(
    ("semi_axes", "tilt", "thick", "intervals", "angle", "mu"),
    [
        ([0.11074924, 0.09981171], -0.82437843, [0.02787681, 0.02230609], 57, 124.0, 0.3),
        ([0.08599613, 0.11900641], -0.85405394, [0.03106058, 0.02050657], 159, 112.0, 0.5),
        ([0.10805460, 0.11036530], -1.01546302, [0.02971890, 0.01565301], 86, 124.0, 0.5),
    ],
)
def test_friction_next_to_the_clamp_without_shear(
    semi_axes, tilt, thick, intervals, angle, mu
) -> None:
    """From a cold start: the frictionless shape first, then friction in steps."""
    changes = {
        "target.semi_axes": semi_axes,
        "target.tilt": tilt,
        "finger.thickness": thick,
        "model.shear": False,
        "solver.intervals": intervals,
    }
    solved = solved_surface(changes, [math.radians(angle)], mu)
    assert solved.converged[0]
    check_equilibrium(solved, 0)
    assert solved.friction[0] <= mu * solved.normal[0] * (1.0 + 1e-10)


def test_nothing_touches_behind_the_clamp() -> None:
    """Points of a target beside the clamp of a finger that has turned far."""
    curve = solve_extreme("polygon", 8)
    rows = curve.frame()
    assert (rows["status"] == "converged").any()
    for i in np.flatnonzero(rows["status"] == "converged"):
        assert (curve.contacts(int(i))["s_m"] > 0.0).all()
        assert rows["error_estimate"][i] > 0.0
