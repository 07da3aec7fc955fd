"""True sliding in direct contact: cone, equilibrium, reversal, energy."""

import numpy as np
import pytest
from surfaces import Solved, check_equilibrium, solved_surface

pytestmark = pytest.mark.compiled
MU = 0.5
COARSE = {"solver.intervals": 60}
DOWN = np.radians(np.linspace(122.0, 82.0, 21))
VARIANTS = {
    "plain": {},
    "left": {"finger.side": "left", "path.x": -0.0508},
    "no shear": {"model.shear": False},
    "as printed": {"model.section": "psi+gamma"},
    "circle": {"target.shape": "circle", "target.radius": 0.067},
}


def path_of(changes: dict, angles: np.ndarray) -> np.ndarray:
    """Mirrored where the left side touches."""
    return np.pi - angles if "finger.side" in changes else angles


def friction_ratios(solved: Solved, i: int) -> np.ndarray:
    """Tangential over normal force of each contact at `i`, by the ellipse's own normals."""
    contacts, scene = solved.touching(i), solved.lowered.scene
    length = solved.lowered.scale.length[0]
    pose = scene.pose(float(solved.position[i]))
    target = scene.target
    a, b = target.semi_axes or (target.radius, target.radius)
    nx = (contacts["x"] - pose.target_x / length) / a**2
    ny = (contacts["y"] - pose.target_y / length) / b**2
    size = np.hypot(nx, ny)
    nx, ny = nx / size, ny / size
    normal = contacts["force_x"] * nx + contacts["force_y"] * ny
    along = contacts["force_y"] * nx - contacts["force_x"] * ny
    return along / normal


@pytest.mark.parametrize("changes", VARIANTS.values(), ids=VARIANTS)
@pytest.mark.parametrize("back", [False, True])
def test_cone_and_equilibrium(changes: dict, back: bool) -> None:
    """Forces on the cone, or within it where a contact sticks; in both senses of rotation."""
    angles = path_of(changes, DOWN[::-1] if back else DOWN)
    solved = solved_surface(COARSE | changes, angles, MU)
    assert solved.converged.all()
    for i in range(len(angles)):
        check_equilibrium(solved, i)
        ratios = np.abs(friction_ratios(solved, i))
        assert ratios.max() <= MU * (1.0 + 1e-10)
        assert (ratios > MU * (1.0 - 1e-10)).sum() >= len(ratios) - solved.sticking[i]


@pytest.mark.parametrize("angles", [DOWN, DOWN[::-1]])
def test_friction_takes_work_in_both_senses(angles: np.ndarray) -> None:
    """What the target puts in beyond the strain energy: nothing without friction."""
    losses = []
    for mu in (0.0, MU):
        solved = solved_surface(COARSE, angles, mu)
        assert solved.converged.all()
        # work_rate: of a target that goes the scene's own way, downwards in angle
        work = -np.trapezoid(solved.work_rate, angles)
        losses.append(work - (solved.energy[-1] - solved.energy[0]))
    assert abs(losses[0]) < 0.02 * losses[1]


def slips(solved: Solved) -> np.ndarray:
    """How far each node moves along the target between two positions (P - 1, N)."""
    problem, places = solved.problem, []
    for i in range(len(solved.position)):
        psi, gamma = solved.trace.psi[0, i], solved.trace.gamma[0, i]
        theta = 0.5 * (psi[1:] + psi[:-1]) + gamma[1:]
        x, y = np.cumsum(problem.step * np.cos(theta)), np.cumsum(problem.step * np.sin(theta))
        rho = problem.offset[0, 1:-1]
        dx = x - rho * np.sin(psi[1:]) - problem.placement[0, i, 0]
        dy = y + rho * np.cos(psi[1:]) - problem.placement[0, i, 1]
        c, s = np.cos(problem.placement[0, i, 2]), np.sin(problem.placement[0, i, 2])
        places.append([c * dx + s * dy, c * dy - s * dx])
    moved = np.diff(np.array(places), axis=0)
    return np.hypot(moved[:, 0], moved[:, 1])


def test_work_of_the_target_is_energy_and_friction_loss() -> None:
    """To the order of the step: halving it halves the difference, or better."""
    off = []
    for steps in (41, 81, 161):
        angles = np.radians(np.linspace(120.0, 100.0, steps))
        solved = solved_surface(COARSE, angles, MU)
        assert solved.converged.all()
        work = np.trapezoid(solved.work_rate, -angles)
        contact = solved.trace.contact[0, :, 1:61, 3:]
        force = np.linalg.norm(contact, axis=2) * MU / np.hypot(1.0, MU)
        loss = (0.5 * (force[1:] + force[:-1]) * slips(solved)).sum()
        assert loss > 0.0
        off.append(abs(work - (solved.energy[-1] - solved.energy[0]) - loss) / loss)
    assert off[2] < 0.02
    assert off[2] < 0.75 * off[0]


def test_half_the_step_gives_the_same_curve() -> None:
    curves = []
    for steps in (11, 21, 81):
        solved = solved_surface(COARSE, np.radians(np.linspace(122.0, 90.0, steps)), MU)
        assert solved.converged.all()
        curves.append(solved.force[:: (steps - 1) // 10])
    size = np.linalg.norm(curves[2], axis=1)
    far = [(np.linalg.norm(one - curves[2], axis=1) / size)[1:].max() for one in curves[:2]]
    assert far[1] < 0.02
    assert far[1] <= 0.6 * far[0] + 1e-6


def test_on_reversal_contacts_stick_first_and_then_slip() -> None:
    down = np.linspace(120.0, 104.0, 17)
    back = 104.0 + np.array([1e-4, 1e-3, 0.5, 2.0, 4.0, 8.0, 12.0])
    solved = solved_surface(COARSE, np.radians([*down, *back]), MU)
    assert solved.converged.all()
    first = len(down)
    assert solved.sticking[first - 1] == 0
    assert solved.sticking[first] >= 0.8 * solved.contacts[first]  # ends that are let go slip
    change = np.linalg.norm(solved.force[first] - solved.force[first - 1])
    assert change < 1e-3 * np.linalg.norm(solved.force[first])
    assert solved.sticking[-1] == 0
    # fully slipping, the past is forgotten
    up = solved_surface(COARSE, np.radians(np.arange(100.0, 116.1, 1.0)), MU)
    np.testing.assert_allclose(solved.force[-1], up.force[-1], rtol=1e-6)


def test_a_standing_target_changes_nothing() -> None:
    solved = solved_surface(COARSE, np.radians([110.0, 108.0, 106.0, 106.0, 106.0]), MU)
    assert solved.converged.all()
    np.testing.assert_allclose(solved.force[3], solved.force[2], rtol=1e-9)
    np.testing.assert_allclose(solved.force[4], solved.force[2], rtol=1e-9)


def test_small_friction_is_a_small_change() -> None:
    angles = np.radians([120.0, 110.0, 100.0])
    free = solved_surface(COARSE, angles)
    rough = solved_surface(COARSE, angles, 1e-6)
    np.testing.assert_allclose(rough.force, free.force, atol=1e-5 * np.abs(free.force).max())
