"""The shooting solutions against figures that were obtained without them."""

from dataclasses import replace

import numpy as np
import pytest
from shooting import (
    SNAPFIT_CIRCLE,
    SNAPFIT_CORNER,
    ShootingCase,
    peak_position,
    recovered,
    solve,
    touch_position,
)

TAPERED = replace(SNAPFIT_CIRCLE, thickness=0.0040, thickness_tip=0.0028, shear=True)
CONCAVE = replace(SNAPFIT_CORNER, convex=False, shear=True)

FEM_FRICTIONLESS = {
    "circle": (
        SNAPFIT_CIRCLE,
        [
            (0.0738, -0.6773, -1.309),
            (0.0688, -2.2119, -3.7113),
            (0.064, -5.2899, -7.6523),
            (0.0625, -4.4407, -8.6541),
            (0.061, -2.5986, -9.0359),
        ],
    ),
    "corner": (
        SNAPFIT_CORNER,
        [
            (0.0725, -0.2964, -0.5557),
            (0.0672, -1.0733, -2.3863),
            (0.06, -1.8323, -5.4215),
            (0.05794, -1.9592, -6.4186),
            (0.0565, 0.0, -6.2298),
        ],
    ),
}
"""Position (m) and force on the finger (N) by two-dimensional finite elements, error 1e-4."""


@pytest.mark.parametrize(
    ("thickness", "peak_force"), [(0.0022, 1.8902), (0.0032, 5.8170), (0.0042, 13.1521)]
)
def test_circle_peak(thickness: float, peak_force: float) -> None:
    peak = peak_position(replace(SNAPFIT_CIRCLE, thickness=thickness))
    assert peak.position == pytest.approx(0.0634628, abs=5e-8)
    assert -peak.force_x == pytest.approx(peak_force, abs=5e-5)


def test_circle_peak_recovered_friction() -> None:
    peak = peak_position(SNAPFIT_CIRCLE)
    assert -recovered(peak, 0.2)[0] == pytest.approx(8.8711, abs=5e-5)
    np.testing.assert_allclose(recovered(peak, 0.0), [peak.force_x, peak.force_y], rtol=1e-12)


def test_corner_peak() -> None:
    peak = peak_position(SNAPFIT_CORNER)
    assert peak.position == pytest.approx(0.0579281, abs=5e-8)
    assert -peak.force_x == pytest.approx(1.9647, abs=5e-5)


def test_first_touch_of_the_circle() -> None:
    assert touch_position(SNAPFIT_CIRCLE) == pytest.approx(0.078162, abs=5e-7)


def test_underside_gives_no_insertion_force() -> None:
    passed = [solve(SNAPFIT_CORNER, position) for position in (0.0575, 0.050)]
    assert [result.feature for result in passed] == ["corner", "corner"]
    assert abs(passed[0].force_x) < 1e-12
    assert passed[0].force_y == pytest.approx(passed[1].force_y, rel=1e-12)


def test_thick_finger_with_shear() -> None:
    """The converged force of a jaw finger with w = 0.0128 whose section turns by psi."""
    result = solve(replace(SNAPFIT_CIRCLE, thickness=0.0128, shear=True), 0.0678)
    assert result.normal_force == pytest.approx(316.2266, abs=2e-4)


@pytest.mark.parametrize("scene", FEM_FRICTIONLESS)
@pytest.mark.parametrize(("shear", "tolerance"), [(False, 0.003), (True, 0.0015)])
def test_finite_elements(scene: str, shear: bool, tolerance: float) -> None:
    case, rows = FEM_FRICTIONLESS[scene]
    for position, *force in rows:
        result = solve(replace(case, shear=shear), position)
        assert np.hypot(*force) == pytest.approx(result.normal_force, rel=tolerance)
        assert np.hypot(result.force_x - force[0], result.force_y - force[1]) < (
            tolerance * result.normal_force
        )


@pytest.mark.parametrize("case", [SNAPFIT_CIRCLE, SNAPFIT_CORNER, TAPERED, CONCAVE])
@pytest.mark.parametrize("beyond_peak", [0.004, -0.001])
def test_force_is_the_slope_of_the_energy(case: ShootingCase, beyond_peak: float) -> None:
    """Without friction the target's work is stored: dV/dx = F_x."""
    position, h = peak_position(case).position + beyond_peak, 1e-5
    before, here, after = (solve(case, position + step) for step in (-h, 0.0, h))
    slope = (after.energy - before.energy) / (2.0 * h)
    assert slope == pytest.approx(here.force_x, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("case", [SNAPFIT_CIRCLE, SNAPFIT_CORNER, TAPERED, CONCAVE])
@pytest.mark.parametrize("beyond_peak", [0.004, -0.001])
def test_equilibrium_and_contact_hold(case: ShootingCase, beyond_peak: float) -> None:
    """Clamp, tip, curvature and contact, evaluated from the finger's axis alone."""
    result = solve(case, peak_position(case).position + beyond_peak)
    s = np.linspace(0.0, case.length, 201)
    x, y, psi, gamma, moment = result.axis(s)
    np.testing.assert_allclose([x[0], y[0], psi[0]], 0.0, atol=1e-12)
    np.testing.assert_allclose([x[-1], y[-1], psi[-1]], result.tip_pose, atol=1e-12)
    curvature = moment / np.array([case.bending_stiffness(si) for si in s])
    assert curvature[0] == pytest.approx(result.psi0_slope, rel=1e-12)
    inside = slice(1, -1)  # where np.gradient is of second order
    np.testing.assert_allclose(np.gradient(psi, s)[inside], curvature[inside], atol=1e-3)
    np.testing.assert_allclose(np.gradient(x, s)[inside], np.cos(psi + gamma)[inside], atol=1e-5)
    strain = np.array([case.thickness_at(si) for si in s]) / 2.0 * abs(curvature)
    assert result.max_strain == pytest.approx(strain.max(), rel=1e-4)

    reach = result.contact_xy - [result.position, case.path_y]
    if case.target_radius is not None:
        assert np.hypot(*reach) == pytest.approx(case.target_radius, rel=1e-11)
        push = result.normal_force / case.target_radius
        np.testing.assert_allclose([result.force_x, result.force_y], push * reach, rtol=1e-9)
    else:
        assert abs(reach[1]) < 1e-13
        assert result.feature == "corner" or abs(reach[0]) < 1e-13


def test_shape_does_not_depend_on_stiffness() -> None:
    soft = solve(SNAPFIT_CIRCLE, 0.066)
    stiff = solve(replace(SNAPFIT_CIRCLE, young=2.62e11, width=0.02), 0.066)
    np.testing.assert_allclose(stiff.tip_pose, soft.tip_pose, rtol=1e-12)


def test_absent_contact_is_refused() -> None:
    with pytest.raises(ValueError, match="no contact of the jaw's edge"):
        solve(SNAPFIT_CIRCLE, 0.0782)
