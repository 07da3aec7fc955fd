"""Jaws that touch in two places, slip off a corner or snap: each against shooting."""

import numpy as np
import pytest
import shooting
from hard_jaws import CUP, SNAPPING, STEEP, scene
from shooting import ShootingCase

import fastncm
from fastncm.lowering import lower
from fastncm.path.snap import END_ENERGY, END_POSITION
from fastncm.scene import Scene, tabulate
from fastncm.trace import solve_paths

pytestmark = pytest.mark.compiled


def ends(solved_scene: Scene) -> tuple[float, float]:
    """Where the branch from first touch ends (m), and the energy (J) that the snap releases."""
    lowered = lower(tabulate(solved_scene, {})[0])
    (solved,) = solve_paths(lowered)
    end = solved.trace.ends[0]
    length, force = lowered.scale.length[0], lowered.scale.force[0]
    return float(end[END_POSITION] * length), float(end[END_ENERGY] * length * force)


def test_an_edge_lies_flat_on_the_block() -> None:
    """Its two contacts have one resultant, normal to the face, somewhere between them."""
    case, position = STEEP, 0.0555

    def miss(unknowns: np.ndarray) -> np.ndarray:
        target, normal = shooting._contact(case, "edge", *unknowns)
        return np.array([target[0] - position / case.length, normal[1]])

    force, place = shooting._newton(miss, np.array([1.5, 0.3]))
    truth = shooting._result(case, "edge", position, force, place)
    path = {"path.stop": position, "path.steps": 20}
    row = fastncm.solve(scene(case, **path)).frame().iloc[-1]
    assert row["status"] == "converged"
    assert row["contacts"] == 2
    assert row["normal_force_N"] == pytest.approx(truth.normal_force, rel=1e-8)
    assert row["tip_angle_rad"] == pytest.approx(truth.tip_pose[2], rel=1e-9)
    place = [row["contact_x_m"], row["contact_y_m"]]
    assert place == pytest.approx(truth.contact_xy, rel=1e-7)
    assert ends(scene(case, **path)) == (0.0, 0.0)


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-10])
def test_a_corner_does_not_stay_on_a_corner(rtol: float) -> None:
    """A steep jaw whose corner a meets the block's corner slips under the block at once: the two
    cannot press on each other. (They did, with two contacts in one place, at most tolerances.)"""
    case = ShootingCase(
        a=(0.057, 0.02314360681578821), b=(0.07820238108791203, 0.0024724834765438852),
        path_y=0.013544044725070805, target_radius=None,
    )  # fmt: skip
    positions = [0.066471, 0.064605, 0.062739, 0.060873, 0.059007]
    edge = shooting.peak_position(case)
    solver = {"solver.order": "auto", "solver.rtol": rtol}
    curve = fastncm.solve(scene(case, **solver), positions=positions)
    for row, position in zip(curve.frame().itertuples(), positions, strict=True):
        exact = shooting.solve(case, position, "edge" if position > edge.position else "corner")
        assert row.normal_force_N == pytest.approx(exact.normal_force, rel=10.0 * rtol)
        assert row.contacts == 1
    place = float(curve.advice.split("limit point at ")[1].split()[0])
    assert place == pytest.approx(edge.position, abs=1e-6)


def test_a_corner_slips_off_the_block() -> None:
    """Corner a slides down the face until it is level with the block's corner; then the finger
    snaps under the block, where a goes on along the underside."""
    case, stop = STEEP, 0.0500

    def miss(unknowns: np.ndarray) -> np.ndarray:
        target, normal = shooting._contact(case, "corner", *unknowns)
        return np.array([target[1] - case.path_y / case.length, normal[1]])

    force, turn = shooting._newton(miss, np.array([1.5, -0.6]))
    before = shooting._result(case, "corner", stop, force, turn)

    def level(unknowns: np.ndarray) -> np.ndarray:
        target, normal = shooting._contact(case, "corner", *unknowns)
        return np.array([target[1] - case.path_y / case.length, normal[0]])

    force, turn = shooting._newton(level, np.array([1.0, 1.0]))
    after = shooting._result(case, "corner", stop, force, turn)
    path = {"path.stop": stop, "path.steps": 20}
    row = fastncm.solve(scene(case, **path)).frame().iloc[-1]
    assert row["status"] == "converged"
    assert row["normal_force_N"] == pytest.approx(after.normal_force, rel=1e-8)
    position, released = ends(scene(case, **path))
    assert position == pytest.approx(before.contact_xy[0], abs=1e-7 * case.length)
    assert released == pytest.approx(before.energy - after.energy, rel=1e-5)


def test_a_path_goes_on_behind_a_snap() -> None:
    """As the circle's contact comes to corner a, the branch turns back: the row behind is of the
    branch beyond."""
    case, position = SNAPPING, 0.0671
    start = shooting.peak_position(case).normal_force / shooting._force_unit(case)

    def miss(unknowns: np.ndarray) -> np.ndarray:
        target, _ = shooting._contact(case, "corner", *unknowns)
        return target - np.array([position, case.path_y]) / case.length

    force, turn = shooting._newton(miss, np.array([0.8 * start, 0.2]))
    truth = shooting._result(case, "corner", position, force, turn)
    path = {"path.stop": position, "path.steps": 97}
    frame = fastncm.solve(scene(case, **path)).frame()
    assert frame["status"].isin(["converged", "no_contact"]).all()
    assert frame["normal_force_N"].iloc[-1] == pytest.approx(truth.normal_force, rel=1e-8)


def test_a_circle_lies_on_both_ends_of_a_concave_arc() -> None:
    """Both forces pass through its centre, whose place in the jaw's frame its radius gives."""
    case, position = CUP, 0.0684
    a, b = np.array(case.a), np.array(case.b)
    half = 0.5 * (b - a)
    left = np.array([-half[1], half[0]]) / np.hypot(*half)
    centre = a + half + np.sqrt(case.target_radius**2 - half @ half) * left
    arm = (centre - [case.length, 0.0]) / case.length

    def miss(force: np.ndarray) -> np.ndarray:
        clamp, _ = shooting._integrate(case, arm, force * shooting._force_unit(case))
        at = shooting._turn(-clamp[2]) @ (arm - clamp[:2])
        return at - np.array([position, case.path_y]) / case.length

    force = shooting._newton(miss, np.array([-1.0, -0.3])) * shooting._force_unit(case)
    clamp, _ = shooting._integrate(case, arm, force)
    truth = shooting._turn(-clamp[2]) @ force
    path = {"path.stop": position, "path.steps": 12, "jaw.return_angle": 1.3}
    curve = fastncm.solve(scene(case, **path))
    row = curve.frame().iloc[-1]
    assert row["status"] == "converged"
    assert row["contacts"] == 2
    assert [row["force_x_N"], row["force_y_N"]] == pytest.approx(truth, rel=1e-8)
    assert row["tip_angle_rad"] == pytest.approx(-clamp[2], rel=1e-8)


def test_a_target_inside_the_jaw_is_infeasible() -> None:
    """A small circle that comes from below the free end b of a cup: the gap jumps there."""
    case = ShootingCase(
        a=(0.057, 0.0005), b=(0.0712, -0.0020), path_y=-0.0040, target_radius=0.0010,
        jaw_radius=0.0078, convex=False,
    )  # fmt: skip
    frame = fastncm.solve(scene(case, **{"path.stop": 0.0640, "path.steps": 4})).frame()
    assert set(frame["status"]) <= {"no_contact", "infeasible"}
    assert (frame["status"] == "infeasible").any()
