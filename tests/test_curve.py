"""One scene along its path, against exact solutions by shooting and the figures of the issue."""

from dataclasses import replace

import numpy as np
import pytest
import shooting

import fastncm
from fastncm.columns import CURVE_UNITS

CIRCLE = fastncm.load_scene("snapfit-circle")
CORNER = fastncm.load_scene("snapfit-corner")


@pytest.mark.parametrize(
    ("thickness", "force"), [(0.0022, 1.8902), (0.0032, 5.8170), (0.0042, 13.1521)]
)
def test_peak_of_the_circle(thickness: float, force: float) -> None:
    peak = fastncm.solve(CIRCLE.replace({"finger.thickness": thickness})).peak
    assert peak.position == pytest.approx(0.0634628, abs=1e-7)
    assert peak.insertion_force_N == pytest.approx(force, rel=1e-4)


@pytest.mark.parametrize(
    ("scene", "case"), [(CIRCLE, shooting.SNAPFIT_CIRCLE), (CORNER, shooting.SNAPFIT_CORNER)]
)
def test_peaks_to_1e_8(scene: fastncm.Scene, case: shooting.ShootingCase) -> None:
    exact = shooting.peak_position(case)
    span = 0.02
    scene = scene.replace({"solver.rtol": 1e-9})
    for mu in (0.0, 0.2):
        recovered = scene.replace({"friction.mu": mu, "friction.model": "recovered"})
        curve = fastncm.solve(recovered)
        force = -shooting.recovered(exact, mu)[0]
        assert curve.peak.position == pytest.approx(exact.position, abs=1e-9 * span)
        assert curve.peak.insertion_force_N == pytest.approx(force, rel=1e-8)
    for mu in (0.2, 0.4, 0.8):
        sliding = shooting.peak_position(replace(case, mu=mu))
        curve = fastncm.solve(scene.replace({"friction.mu": mu}))
        assert curve.peak.position == pytest.approx(sliding.position, abs=1e-9 * span)
        assert curve.peak.insertion_force_N == pytest.approx(-sliding.force_x, rel=1e-8)


def test_after_the_corner_has_passed_the_force_is_constant() -> None:
    for mu in (0.0, 0.3):
        frame = fastncm.solve(CORNER.replace({"friction.mu": mu})).frame()
        after = frame[frame["position"] < 0.0579]["insertion_force_N"]
        assert len(after) > 5
        assert np.ptp(after) < 1e-9 * 6.2
        assert (after.iloc[0] == 0.0) == (mu == 0.0)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_rtol_picks_the_order(scene: fastncm.Scene, rtol: float) -> None:
    curve = fastncm.solve(scene.replace({"solver.rtol": rtol}))
    assert curve.frame()["error_estimate"].max() <= rtol
    assert 2 <= curve.order <= 8


def test_columns_and_units() -> None:
    frame = fastncm.solve(CIRCLE).frame()
    assert list(frame.columns) == [*CURVE_UNITS, "advice"] == list(frame.attrs["units"])
    assert (frame["advice"] == "").all()
    assert frame.attrs["units"]["force_x_N"] == "N"
    assert len(frame) == CIRCLE.path.steps
    first = frame.iloc[0]
    assert first["status"] == "no_contact"
    assert first["insertion_force_N"] == 0.0


def test_shape_against_shooting() -> None:
    position = 0.0688
    curve = fastncm.solve(CIRCLE.replace({"solver.order": 10}), positions=[position])
    shape = curve.shape(0)
    exact = shooting.solve(shooting.SNAPFIT_CIRCLE, position).axis(shape["s_m"].to_numpy())
    for column, values in zip(("x_m", "y_m", "psi_rad"), exact[:3], strict=True):
        np.testing.assert_allclose(shape[column], values, atol=1e-11)
    np.testing.assert_allclose(shape["moment_Nm"], exact[4], atol=1e-9 * abs(exact[4]).max())
    contact = curve.contacts(0)
    assert len(contact) == 1
    assert np.hypot(contact["x_m"] - position, contact["y_m"] - 0.0105)[0] == pytest.approx(0.0089)


def test_base_moment_rule() -> None:
    """(14)-(17): the turned force has the moment E I psi'(0) about the clamp, and lies on the
    cone."""
    position, mu = 0.0688, 0.4
    row = fastncm.solve(
        CIRCLE.replace({"friction.mu": mu, "friction.model": "recovered", "solver.order": 10}),
        positions=[position],
    )
    frame = row.frame().iloc[0]
    moment = frame["contact_x_m"] * frame["force_y_N"] - frame["contact_y_m"] * frame["force_x_N"]
    exact = shooting.solve(shooting.SNAPFIT_CIRCLE, position)
    stiffness = shooting.SNAPFIT_CIRCLE.bending_stiffness(0.0)
    assert moment == pytest.approx(stiffness * exact.psi0_slope, rel=1e-9)
    assert frame["friction_force_N"] == pytest.approx(mu * frame["normal_force_N"], rel=1e-14)


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_work_is_the_energy_stored(scene: fastncm.Scene) -> None:
    """Without friction, and but for the energy set free where corner a snaps off the block's
    corner."""
    scene = scene.replace({"solver.rtol": 1e-9})
    curve = fastncm.solve(scene)
    change = curve.events().query("event == 'before_change'")["position"].iloc[0]
    before = (
        fastncm.solve(scene.replace({"path.stop": change + 1e-10})).frame()["energy_J"].iloc[-1]
    )
    after = fastncm.solve(scene, positions=[change - 1e-10]).frame()["energy_J"].iloc[0]
    stored = curve.frame()["energy_J"].iloc[-1] + before - after
    assert curve.insertion_work_J == pytest.approx(stored, rel=1e-6)
    assert (before - after > 1e-5) == (scene.name == "snapfit-corner")


def test_smooth_peak_is_a_maximum() -> None:
    """A strongly curved jaw has its peak between two changes of contact: neighbours are lower."""
    scene = CORNER.replace({"jaw.radius": 0.03, "jaw.height": 0.0045, "solver.rtol": 1e-10})
    curve = fastncm.solve(scene)
    assert (curve.events()["position"] - curve.peak.position).abs().min() > 1e-4
    offsets = np.array([-2e-5, -1e-5, 1e-5, 2e-5])
    around = fastncm.solve(scene, positions=curve.peak.position + offsets).frame()
    lack = curve.peak.insertion_force_N - around["insertion_force_N"].to_numpy()
    assert (lack > 0.0).all()
    # a parabola about the peak: the lack is even in the offset, to the order of the cubic term
    np.testing.assert_allclose(lack[[0, 1]], lack[[3, 2]], rtol=2e-2)
    np.testing.assert_allclose(lack[0] / lack[1], 4.0, rtol=2e-2)


def test_release_where_the_circle_has_passed() -> None:
    curve = fastncm.solve(CIRCLE.replace({"path.stop": 0.04}))
    assert list(curve.events()["event"]) == ["touch", "before_change", "after_change", "release"]
    # corner a of the undeformed finger, at the height of the circle's centre, is one radius away
    assert curve.events()["position"].iloc[-1] == pytest.approx(0.057 - 0.0089, abs=1e-12)
    assert curve.insertion_work_J == pytest.approx(0.0, abs=1e-5)


def test_never_touching_is_a_result() -> None:
    curve = fastncm.solve(CIRCLE.replace({"path.y": 0.1}))
    assert curve.status == "no_contact"
    assert set(curve.frame()["status"]) == {"no_contact"}
    assert curve.peak.insertion_force_N == 0.0


def test_locking_friction_is_a_status() -> None:
    curve = fastncm.solve(CIRCLE.replace({"friction.mu": 3.0}))
    assert curve.status == "no_equilibrium"
    assert "friction.mu" in curve.advice
    failed = curve.frame().query("status == 'no_equilibrium'")
    assert failed["insertion_force_N"].isna().all()
    assert failed["advice"].str.contains("friction.mu up to").all()
    assert np.isnan(curve.peak.insertion_force_N)
    assert np.isnan(curve.insertion_work_J)


@pytest.mark.parametrize("positions", [[], "ab", [[0.07]], [0.07, float("nan")], [None]])
def test_bad_positions_are_refused(positions: object) -> None:
    with pytest.raises(fastncm.SceneError, match="positions"):
        fastncm.solve(CIRCLE, positions=positions)  # type: ignore[arg-type]


def test_rows_that_are_not_there() -> None:
    curve = fastncm.solve(CIRCLE)
    with pytest.raises(IndexError, match="rows 0 to 59"):
        curve.shape(60)


def test_a_curve_says_what_it_is() -> None:
    scene = CIRCLE.replace({"path.start": 0.09, "path.steps": 31})
    said = repr(fastncm.solve(scene))
    assert said.startswith("<curve of snapfit-circle:") and len(said) < 200
    assert "no_contact" in said and "converged" in said and "5.81" in said
