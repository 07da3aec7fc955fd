"""What must hold of every solved finger in direct contact, from its output alone."""

import numpy as np
import pytest
from surfaces import RUBBER, check_equilibrium, solved_surface

pytestmark = pytest.mark.compiled
ANGLES = np.radians([124.0, 108.0, 93.0, 80.0])
POINTS = {"solver.contact": "points-on-target", "solver.points": 400}
VARIANTS = {
    "plain": {},
    "no shear": {"model.shear": False},
    "axis": {"model.surface": "axis"},
    "as printed": {"model.section": "psi+gamma"},
    "points of the target": POINTS,
}


@pytest.mark.parametrize("intervals", [4, 17, 90, 1000, 10_000])
def test_base_moment_at_any_number_of_intervals(intervals: int) -> None:
    solved = solved_surface({"solver.intervals": intervals}, ANGLES)
    assert solved.converged.all()
    for i in range(len(ANGLES)):
        check_equilibrium(solved, i)


@pytest.mark.parametrize(
    ("changes", "mu"),
    [
        pytest.param(changes, mu, id=f"{name}, mu = {mu}")
        for name, changes in VARIANTS.items()
        for mu in (0.0, 0.4)
        if (name, mu) != ("points of the target", 0.4)  # often without a solution
    ],
)
def test_every_interval_carries_what_lies_beyond(changes: dict, mu: float) -> None:
    solved = solved_surface({"solver.intervals": 60} | changes, ANGLES, mu)
    assert solved.converged.all()
    for i in range(len(ANGLES)):
        check_equilibrium(solved, i)


def test_no_moment_beyond_the_last_contact() -> None:
    solved = solved_surface({}, ANGLES)
    for i in range(len(ANGLES)):
        finger, last = solved.finger(i), solved.touching(i)["s"].max()
        straight = finger["s"] >= last - 1e-9
        assert np.ptp(finger["psi"][straight]) < 1e-12
        assert np.abs(finger["moment"][straight]).max() < 1e-12
        assert straight.sum() > 10


def test_left_is_the_mirror_image_of_right() -> None:
    """The ellipse and the base's turn mirrored about the y axis; all numbers alike to the last."""
    path = RUBBER.path
    mirrored = {
        "finger.side": "left",
        "path.x": -path.x,
        "path.start": np.pi - path.start,
        "path.stop": np.pi - path.stop,
        "target.tilt": -0.2,
    }
    angles = np.radians([126.0, 117.0, 99.0, 81.0])
    for mu in (0.0, 0.3):
        right = solved_surface({"target.tilt": 0.2}, angles, mu)
        left = solved_surface(mirrored, np.pi - angles, mu)
        assert right.converged.all()
        np.testing.assert_array_equal(left.contacts, right.contacts)
        np.testing.assert_allclose(left.force, right.force * [-1.0, 1.0], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(left.energy, right.energy, rtol=1e-11)
        np.testing.assert_allclose(left.insertion, right.insertion, rtol=1e-9)
        np.testing.assert_allclose(left.estimate, right.estimate, rtol=1e-6)


def test_single_positions_give_the_path_s_answers() -> None:
    """Without friction a shape does not depend on how the target came there."""
    along = solved_surface({}, ANGLES)
    backwards = solved_surface({}, ANGLES[::-1])
    mixed = solved_surface({}, ANGLES[[2, 0, 3, 1]])
    np.testing.assert_allclose(backwards.force[::-1], along.force, rtol=1e-8)
    np.testing.assert_allclose(mixed.force[[1, 3, 0, 2]], along.force, rtol=1e-8)
    for i, angle in enumerate(ANGLES):
        alone = solved_surface({}, [angle])
        np.testing.assert_allclose(alone.force[0], along.force[i], rtol=1e-8)
        assert alone.energy[0] == pytest.approx(along.energy[i], rel=1e-10)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_without_shear_the_modulus_only_scales(factor: float) -> None:
    changes = {"model.shear": False}
    base = solved_surface(changes, ANGLES)
    other = solved_surface(changes | {"finger.young": factor * RUBBER.finger.young}, ANGLES)
    np.testing.assert_allclose(other.newtons, factor * base.newtons, rtol=1e-12)
    np.testing.assert_allclose(other.joules, factor * base.joules, rtol=1e-12)
    np.testing.assert_array_equal(other.energy, base.energy)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_with_shear_both_moduli_only_scale(factor: float) -> None:
    finger = RUBBER.finger
    changes = {
        "finger.young": factor * finger.young,
        "finger.shear_modulus": factor * finger.shear_modulus,
    }
    other, base = solved_surface(changes, ANGLES), solved_surface({}, ANGLES)
    np.testing.assert_allclose(other.newtons, factor * base.newtons, rtol=1e-10)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_lengths_only_scale(unit: float) -> None:
    """The same finger in millimetres and kilometres: forces with the square of the length."""
    finger, path, target = RUBBER.finger, RUBBER.path, RUBBER.target
    changes = {
        "finger.length": unit * finger.length,
        "finger.thickness": [unit * w for w in finger.thickness],
        "finger.width": unit * finger.width,
        "finger.offset": unit * finger.offset,
        "target.semi_axes": [unit * a for a in target.semi_axes],
        "path.x": unit * path.x,
        "path.y": unit * path.y,
        "path.speed_ratio": unit * path.speed_ratio,
    }
    other, base = solved_surface(changes, ANGLES), solved_surface({}, ANGLES)
    np.testing.assert_allclose(other.newtons, unit**2 * base.newtons, rtol=1e-9)
