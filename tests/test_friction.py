"""Friction in equilibrium, on paths: forces against shooting, sticking, locking, the energy
balance."""

import math
from dataclasses import replace

import extremes
import numpy as np
import pandas as pd
import pytest
import shooting

import fastncm

CIRCLE = fastncm.load_scene("snapfit-circle").replace({"solver.rtol": 1e-10})
CORNER = fastncm.load_scene("snapfit-corner").replace({"solver.rtol": 1e-10})

FORCES = [
    (CIRCLE, shooting.SNAPFIT_CIRCLE, 0.0738, {0.2: 1.0669, 0.4: 1.5779}),
    (CIRCLE, shooting.SNAPFIT_CIRCLE, 0.0688, {0.2: 3.4418, 0.4: 5.1436}),
    (CORNER, shooting.SNAPFIT_CORNER, 0.0652, {0.2: 2.1782, 0.4: 3.2465}),
    (CORNER, shooting.SNAPFIT_CORNER, 0.0580, {0.2: 3.5136, 0.4: 5.3599}),
]
"""Scene, exact case, position (m), and the issue's insertion forces (N) by friction."""


@pytest.mark.parametrize(("scene", "case", "position", "figures"), FORCES)
def test_insertion_force(
    scene: fastncm.Scene, case: shooting.ShootingCase, position: float, figures: dict[float, float]
) -> None:
    for mu, figure in figures.items():
        exact = shooting.solve(replace(case, mu=mu), position)
        row = (
            fastncm.solve(scene.replace({"friction.mu": mu}), positions=[position]).frame().iloc[0]
        )
        assert row["insertion_force_N"] == pytest.approx(figure, abs=1e-4)
        assert row["force_x_N"] == pytest.approx(exact.force_x, rel=1e-8)
        assert row["force_y_N"] == pytest.approx(exact.force_y, rel=1e-8)
        assert row["friction_force_N"] == pytest.approx(mu * row["normal_force_N"], rel=1e-12)


@pytest.mark.parametrize("feature_position", [0.0612, 0.0604])
def test_force_on_the_corner_of_the_jaw(feature_position: float) -> None:
    """The circle slides around corner a; with a taper and shear."""
    changes = {
        "finger.thickness": [0.0040, 0.0028],
        "model.shear": True,
        "friction.mu": 0.3,
        "solver.order": 12,
    }
    case = replace(
        shooting.SNAPFIT_CIRCLE, thickness=0.0040, thickness_tip=0.0028, shear=True, mu=0.3
    )
    exact = shooting.solve(case, feature_position)
    assert exact.feature == "corner"
    row = fastncm.solve(CIRCLE.replace(changes), positions=[feature_position]).frame().iloc[0]
    assert row["force_x_N"] == pytest.approx(exact.force_x, rel=1e-8)
    assert row["force_y_N"] == pytest.approx(exact.force_y, rel=1e-8)
    assert row["energy_J"] == pytest.approx(exact.energy, rel=1e-8)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_without_friction_both_models_agree(scene: fastncm.Scene) -> None:
    ours = fastncm.solve(scene).frame()
    recovered = fastncm.solve(scene.replace({"friction.model": "recovered"})).frame()
    assert ours.equals(recovered)


@pytest.mark.parametrize(
    ("scene", "case"), [(CIRCLE, shooting.SNAPFIT_CIRCLE), (CORNER, shooting.SNAPFIT_CORNER)]
)
def test_friction_that_locks_at_touch(scene: fastncm.Scene, case: shooting.ShootingCase) -> None:
    """The undeformed finger gives way as long as a C b > 0, with its flexibility C, the wrench a of
    a unit normal force and b of one on the edge of the friction cone."""
    point, outward = shooting._jaw(case, "edge", shooting.touch_place(case))
    arm = (point - [case.length, 0.0]) / case.length
    flexibility = np.array([[0.0, 0.0, 0.0], [0.0, 1.0 / 3.0, 0.5], [0.0, 0.5, 1.0]])

    def wrench(force: np.ndarray) -> np.ndarray:
        return np.array([*force, arm[0] * force[1] - arm[1] * force[0]])

    normal, drag = wrench(-outward), wrench(np.array([-outward[1], outward[0]]))
    critical = -(normal @ flexibility @ normal) / (normal @ flexibility @ drag)
    below = fastncm.solve(scene.replace({"friction.mu": critical - 5e-3, "path.steps": 200}))
    assert below.frame()["status"].iloc[1] == "converged"
    above = fastncm.solve(scene.replace({"friction.mu": critical + 1e-4}))
    assert above.status == "no_equilibrium"
    assert set(above.frame()["status"].iloc[1:]) == {"no_equilibrium"}
    assert float(above.advice.split("up to ")[1].rstrip(".")) == pytest.approx(critical, abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "index"),
    [("corner-convex", 694), ("corner-convex", 5823), ("corner-straight", 12118),
     ("corner-concave", 6215), ("corner-concave", 0)],
)  # fmt: skip
def test_what_locks_at_touch_ends_there_with_any_step(kind: str, index: int) -> None:
    """Equilibria far beyond, which a long move found, were told for the end of the branch."""
    scene = fastncm.load_scene(extremes.base_scene(kind)).replace(extremes.one(kind, index))
    for steps in (2, 12, 400):
        curve = fastncm.solve(scene.replace({"path.start": "touch", "path.steps": steps}))
        end = float(curve.advice.split("beyond ")[1].split(" m")[0])
        assert end == pytest.approx(curve.frame()["position"].iloc[0], rel=1e-8)


def test_a_finger_that_sticking_keeps_from_buckling() -> None:
    """Rounding near the buckling load ended the path with 400 positions, not with 2. What sticks
    from first touch on has one answer, however the way is divided."""
    scene = fastncm.load_scene("snapfit-corner").replace(extremes.one("corner-convex", 3408))
    short, long = (
        fastncm.solve(scene.replace({"path.steps": steps})).frame() for steps in (2, 400)
    )
    assert set(long["status"]) == {"no_contact", "converged"}
    assert (long["sticking"].iloc[1:] == 1).all()
    assert long["force_x_N"].iloc[-1] == pytest.approx(short["force_x_N"].iloc[-1], rel=1e-8)


def test_limit_point_of_the_path() -> None:
    """At mu = 1 the finger snaps where the circle gets to corner a, later than without friction."""
    curve = fastncm.solve(CIRCLE.replace({"friction.mu": 1.0}))
    exact = shooting.peak_position(replace(shooting.SNAPFIT_CIRCLE, mu=1.0))
    assert curve.status == "converged"
    assert float(curve.advice.split("limit point at ")[1].split(" m")[0]) == pytest.approx(
        exact.position, abs=1e-9
    )
    assert 0.01 < float(curve.advice.split("releases ")[1].split(" J")[0]) < exact.energy
    # the branch of equilibria on corner a turns back there: beyond the event it goes uphill
    behind = replace(shooting.SNAPFIT_CIRCLE, mu=1.0)
    assert shooting.solve(behind, exact.position + 1e-6, "corner").energy < exact.energy


@pytest.mark.parametrize("mu", [0.9, 0.95, 1.0, 1.1])
def test_a_path_with_friction_goes_on_behind_a_snap(mu: float) -> None:
    """The circle gets to corner a where the branch turns back: the finger snaps to an equilibrium
    that shooting finds on the corner, however far that is, and goes on there."""
    case = replace(shooting.SNAPFIT_CIRCLE, mu=mu)
    curve = fastncm.solve(CIRCLE.replace({"friction.mu": mu}))
    frame, edge = curve.frame(), shooting.peak_position(case)
    assert curve.status == "converged"
    told = frame["advice"] != ""
    assert list(frame.index[told]) == [frame.index[frame["position"] < edge.position][0]]
    place, energy = (
        float(curve.advice.split(word)[1].split()[0]) for word in ("limit point at", "releases")
    )
    assert place == pytest.approx(edge.position, abs=1e-9)
    jaw = CIRCLE.jaw
    leaning = math.atan2(jaw.b[1] - jaw.a[1], jaw.b[0] - jaw.a[0]) + math.pi / 2
    for _, row in frame[frame["position"] < edge.position].iterrows():
        to_centre = row["position"] - row["contact_x_m"], CIRCLE.path.y - row["contact_y_m"]
        turned = math.atan2(to_centre[1], to_centre[0]) - row["tip_angle_rad"] - leaning
        near = row["normal_force_N"], turned
        exact = shooting.solve(case, row["position"], "corner", near)
        assert row["force_x_N"] == pytest.approx(exact.force_x, rel=1e-8)
        assert exact.energy < edge.energy
    behind = curve.events().iloc[-1]
    assert behind["event"] == "after_change"
    assert energy == pytest.approx(edge.energy - behind["energy_J"], rel=1e-3)


WAYS = [
    (CIRCLE, {"path.stop": 0.064}),
    (CIRCLE, {"path.stop": 0.060}),
    (CORNER, {"path.stop": 0.062}),
]


@pytest.mark.parametrize(("scene", "changes"), WAYS)
def test_the_way_out_of_a_sliding_contact(scene: fastncm.Scene, changes: dict[str, float]) -> None:
    """Far from the turn it slides back with friction reversed, as if it came from there."""
    there = scene.replace({**changes, "friction.mu": 0.3, "path.withdraw": True})
    frame = fastncm.solve(there).frame()
    steps = there.path.steps
    assert len(frame) == 2 * steps - 1
    np.testing.assert_allclose(frame["position"][steps - 1 :], frame["position"][steps - 1 :: -1])
    case = shooting.SNAPFIT_CIRCLE if scene is CIRCLE else shooting.SNAPFIT_CORNER
    for i in (steps + 5, steps + 20, 2 * steps - 10):
        row = frame.iloc[i]
        exact = shooting.solve(replace(case, mu=-0.3), row["position"])
        assert row["insertion_force_N"] == pytest.approx(exact.force_x, rel=1e-8)
        assert row["force_y_N"] == pytest.approx(exact.force_y, rel=1e-8)


@pytest.mark.parametrize(("scene", "changes"), WAYS)
def test_halving_the_step_changes_the_way_back_to_first_order(
    scene: fastncm.Scene, changes: dict[str, float]
) -> None:
    """At the turn the contact sticks for some hundredths of a millimetre."""
    stop, start = changes["path.stop"], changes["path.stop"] + 4e-4
    base = scene.replace({"friction.mu": 0.5})
    work = []
    for steps in (20, 40, 80, 160, 640):
        way = np.linspace(start, stop, steps)
        path = np.concatenate([way, way[-2::-1]])
        frame = fastncm.solve(base, positions=path).frame()
        assert frame["sticking"].max() == (1 if steps > 40 else frame["sticking"].max())
        assert set(frame["status"]) == {"converged"}
        force = frame["force_x_N"].to_numpy()[steps - 1 :]
        work.append(np.trapezoid(force, path[steps - 1 :]))
        ratio = frame["friction_force_N"] / frame["normal_force_N"]
        assert ratio.max() <= 0.5 * (1.0 + 1e-10)
        assert (ratio[frame["sticking"] == 0] >= 0.5 * (1.0 - 1e-10)).all()
    errors = np.abs(np.array(work[:-1]) - work[-1])
    assert (errors[1:] < 0.75 * errors[:-1]).all()


def test_a_closed_loop_loses_nothing_without_friction() -> None:
    """The circle in front of, over and behind the jaw, and back: it does no work."""
    loop = CIRCLE.replace({"path.stop": 0.044, "path.withdraw": True, "path.steps": 200})
    curve = fastncm.solve(loop)
    frame = curve.frame()
    work = np.trapezoid(frame["force_x_N"], frame["position"])
    assert abs(work) < 1e-10
    assert curve.retention.insertion_force_N > curve.peak.insertion_force_N > 5.0
    back = frame.iloc[200:].set_index(frame["position"].iloc[200:].round(12))
    there = frame.iloc[:199].set_index(frame["position"].iloc[:199].round(12))
    np.testing.assert_allclose(
        back["force_x_N"], there["force_x_N"].loc[back.index], rtol=1e-9, atol=1e-9
    )


def test_hysteresis_is_the_loss_by_friction_and_snapping() -> None:
    frame = pd.DataFrame({"friction.mu": [0.0, 0.2, 0.4]})
    scene = CORNER.replace(
        {
            "path.stop": 0.045,
            "path.withdraw": True,
            "target.length": 0.006,
            "jaw.return_angle": 0.9,
            "path.steps": 200,
        }
    )
    table = fastncm.solve_cases(scene, frame)
    assert set(table["status"]) == {"converged"}
    lost = table["insertion_work_J"] + table["withdrawal_work_J"]  # the finger ends straight
    np.testing.assert_allclose(table["hysteresis_J"], lost, rtol=1e-12)
    assert (table["hysteresis_J"] > 0.0).all()
    assert table["hysteresis_J"].is_monotonic_increasing
    assert table["retention_force_N"].is_monotonic_increasing
    # without friction: what is released where a snaps off the block's corners, on both ways
    events = fastncm.solve(scene).events().set_index("event")["energy_J"]
    released = events["before_change"].to_numpy() - events["after_change"].to_numpy()
    assert len(released) == 4
    assert table["hysteresis_J"][0] == pytest.approx(released.sum(), rel=1e-5)


def test_a_vertical_return_face_locks() -> None:
    """A straight finger pulled at height h gives way by turning: h^2 against mu h / 2."""
    frame = pd.DataFrame({"friction.mu": [0.25, 0.38]})
    scene = CIRCLE.replace({"path.stop": 0.044, "path.withdraw": True})
    table = fastncm.solve_cases(scene, frame)
    assert list(table["status"]) == ["converged", "no_equilibrium"]
    critical = 2.0 * scene.jaw.a[1] / scene.finger.length
    assert f"{critical:.6f}" in table["advice"][1]
    assert table["peak_force_N"].notna().all()
    assert list(table["retention_force_N"].isna()) == [False, True]
