"""Jaws that touch in two places with friction: each case against shooting on the exact equilibrium
equation with two contact forces, and the laws that hold for any."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import shooting
from hard_jaws import CUP, STEEP, scene
from scipy.optimize import root
from shooting import ShootingCase

import fastncm

pytestmark = pytest.mark.compiled

ON_THE_CUP = {"jaw.return_angle": 1.3, "path.stop": 0.0684, "path.steps": 12}
CUP_POSITION = 0.0684
FLAT_POSITION = 0.0555


def exact_cup(mu: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Both contact forces (2, 2) on the finger, N, in space, the places (2, 2), m, and the tip's
    angle: the circle lies on both ends of the arc and turns neither."""
    case = replace(CUP, mu=mu)
    ends = (np.array([CUP.a, CUP.b]) - [CUP.length, 0.0]) / CUP.length
    half = 0.5 * (ends[1] - ends[0])
    left = np.array([-half[1], half[0]]) / np.hypot(*half)
    radius = CUP.target_radius / CUP.length
    centre = ends[0] + half + np.sqrt(radius**2 - half @ half) * left
    pushes = [shooting._push(case, (centre - end) / radius) for end in ends]

    def clamp(normal_forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The clamp's x, y, psi seen from the tip section; both forces as one at its place."""
        forces = np.array([n * push for n, push in zip(normal_forces, pushes, strict=True)])
        total = forces.sum(axis=0)
        moment = sum(shooting._cross(e, f) for e, f in zip(ends, forces, strict=True))
        arm = moment * np.array([total[1], -total[0]]) / (total @ total)
        seen, _ = shooting._integrate(case, arm, total * shooting._force_unit(case))
        return seen, forces

    def miss(normal_forces: np.ndarray) -> np.ndarray:
        seen, _ = clamp(normal_forces)
        at = shooting._turn(-seen[2]) @ (centre - seen[:2])
        return at - np.array([CUP_POSITION, CUP.path_y]) / CUP.length

    found = root(miss, [1.2, 0.1], tol=1e-14)
    assert np.abs(found.fun).max() < 1e-12
    assert (found.x > 0.0).all()
    seen, forces = clamp(found.x)
    turn = shooting._turn(-seen[2])
    places = (ends - seen[:2]) @ turn.T
    return forces @ turn.T * shooting._force_unit(case), places * CUP.length, -seen[2]


@pytest.mark.parametrize("mu", [0.05, 0.3])
def test_a_circle_slides_on_both_ends_of_a_concave_arc(mu: float) -> None:
    forces, places, angle = exact_cup(mu)
    curve = fastncm.solve(scene(CUP, **ON_THE_CUP, **{"friction.mu": mu}))
    row, contacts = curve.frame().iloc[-1], curve.contacts(-1)
    assert row["status"] == "converged"
    assert (row["contacts"], row["sticking"], len(contacts)) == (2, 0, 2)
    found = contacts[["force_x_N", "force_y_N"]].to_numpy()
    assert found == pytest.approx(forces, rel=1e-8)
    assert contacts[["x_m", "y_m"]].to_numpy() == pytest.approx(places, rel=1e-9)
    assert row[["force_x_N", "force_y_N"]].tolist() == pytest.approx(forces.sum(axis=0), rel=1e-8)
    assert row["tip_angle_rad"] == pytest.approx(angle, rel=1e-8)
    assert row["kkt_residual"] < 1e-11


@pytest.mark.parametrize("mu", [0.0, 0.05, 0.1])
def test_an_edge_slides_flat_along_the_face(mu: float) -> None:
    """Its two parallel forces are one on the cone, normal to the face but for friction."""
    case = replace(STEEP, mu=mu)

    def miss(unknowns: np.ndarray) -> np.ndarray:
        target, normal = shooting._contact(case, "edge", *unknowns)
        return np.array([target[0] - FLAT_POSITION / case.length, normal[1]])

    truth = shooting._result(
        case, "edge", FLAT_POSITION, *shooting._newton(miss, np.array([1.5, 0.3]))
    )
    path = {"path.stop": FLAT_POSITION, "path.steps": 20, "friction.mu": mu}
    curve = fastncm.solve(scene(case, **path))
    row, contacts = curve.frame().iloc[-1], curve.contacts(-1)
    assert (row["contacts"], row["sticking"], len(contacts)) == (2, 0, 2)
    assert row["force_x_N"] == pytest.approx(truth.force_x, rel=1e-8)
    assert row["force_y_N"] == pytest.approx(truth.force_y, rel=1e-8, abs=1e-9)
    assert row["tip_angle_rad"] == pytest.approx(truth.tip_pose[2], rel=1e-9)
    assert row["energy_J"] == pytest.approx(truth.energy, rel=1e-8)
    assert row["max_strain"] == pytest.approx(truth.max_strain, rel=1e-3)  # at Gauss points
    x, y, fx, fy = contacts[["x_m", "y_m", "force_x_N", "force_y_N"]].to_numpy().T
    assert fy == pytest.approx(-mu * fx, rel=1e-9, abs=1e-9)
    base = case.bending_stiffness(0.0) * truth.psi0_slope
    assert (x * fy - y * fx).sum() == pytest.approx(base, rel=1e-8)
    assert curve.shape(-1)["moment_Nm"].iloc[0] == pytest.approx(base, rel=1e-8)
    # the block's corner, and the jaw's
    assert [x[0], y[0]] == pytest.approx([FLAT_POSITION, case.path_y], rel=1e-9)
    tip = row[["tip_x_m", "tip_y_m"]].to_numpy(float)
    arm = np.array(case.a) - [case.length, 0.0]
    assert [x[1], y[1]] == pytest.approx(tip + shooting._turn(row["tip_angle_rad"]) @ arm, rel=1e-9)


def test_two_contacts_that_stick_move_with_the_target() -> None:
    """The target turns back by a little: the jaw goes with it, and the force is that of a finger
    whose tip is held there."""
    mu, back = 0.1, 2e-6
    path = {"path.stop": FLAT_POSITION, "path.steps": 20, "friction.mu": mu}
    way = np.append(fastncm.solve(scene(STEEP, **path)).frame()["position"], FLAT_POSITION + back)
    curve = fastncm.solve(scene(STEEP, **path), positions=way)
    before, after = curve.frame().iloc[-2], curve.frame().iloc[-1]
    assert (after["contacts"], after["sticking"]) == (2, 2)
    pose = ["tip_x_m", "tip_y_m", "tip_angle_rad"]
    moved = (after[pose] - before[pose]).to_numpy(float)
    assert moved == pytest.approx([back, 0.0, 0.0], abs=1e-12)
    held = after[pose].to_numpy(float) / [STEEP.length, STEEP.length, 1.0]
    unit = shooting._force_unit(STEEP)

    def miss(wrench: np.ndarray) -> np.ndarray:
        force = wrench[:2]
        arm = wrench[2] * np.array([force[1], -force[0]]) / (force @ force)
        seen, _ = shooting._integrate(STEEP, arm, force * unit)
        return np.append(-shooting._turn(-seen[2]) @ seen[:2], -seen[2]) - held

    start = before[["force_x_N", "force_y_N"]].to_numpy(float) / unit
    seen_from_tip = shooting._turn(-held[2]) @ start
    contacts = curve.contacts(-2)
    arms = contacts[["x_m", "y_m"]].to_numpy() / STEEP.length - held[:2]
    forces = contacts[["force_x_N", "force_y_N"]].to_numpy() / unit
    found = root(miss, [*seen_from_tip, shooting._cross(arms.T, forces.T).sum()], tol=1e-14)
    assert np.abs(found.fun).max() < 1e-12
    truth = shooting._turn(held[2]) @ found.x[:2] * unit
    assert after[["force_x_N", "force_y_N"]].tolist() == pytest.approx(truth, rel=1e-6)
    check_cone(curve, mu)


def check_cone(curve: fastncm.Curve, mu: float) -> None:
    """Every contact's force presses and lies in the cone, on it where it slides; the normals of the
    cup are from the circle's centre, those of the block's face level."""
    frame = curve.frame()
    for i in np.flatnonzero(frame["contacts"] == 2):
        row, contacts = frame.iloc[i], curve.contacts(i)
        force = contacts[["force_x_N", "force_y_N"]].to_numpy()
        normal = np.array([[-1.0, 0.0], [-1.0, 0.0]])
        if curve.scene.target.radius:
            at = contacts[["x_m", "y_m"]].to_numpy()
            normal = at - [row["position"], curve.scene.path.y]
            normal /= np.hypot(*normal.T)[:, None]
        pressing = (force * normal).sum(axis=1)
        along = np.abs(normal[:, 0] * force[:, 1] - normal[:, 1] * force[:, 0])
        size = np.hypot(*force.T).max()
        assert (pressing > 0.0).all()
        assert (along <= mu * pressing + 1e-10 * size).all()
        if row["sticking"] == 0:
            assert along == pytest.approx(mu * pressing, abs=1e-10 * size)


def test_the_work_of_two_sliding_contacts_is_stored_or_lost() -> None:
    """Between two positions with two contacts each, by the midpoint rule: of second order."""
    mu, errors = 0.3, []
    for steps in (4, 8, 16):
        way = np.linspace(0.0684, 0.0680, steps + 1)
        start = np.linspace(0.0745, 0.0684, 8)[:-1]
        curve = fastncm.solve(
            scene(CUP, **ON_THE_CUP, **{"friction.mu": mu}), positions=[*start, *way]
        )
        check_cone(curve, mu)
        frame = curve.frame().iloc[len(start) :]
        assert (frame["contacts"] == 2).all()
        assert (frame["sticking"] == 0).all()
        work = np.trapezoid(frame["force_x_N"], frame["position"])
        stored = frame["energy_J"].iloc[-1] - frame["energy_J"].iloc[0]
        loss = 0.0
        for i in range(len(start), len(start) + steps):
            loss += friction_loss(curve, i)
        assert loss > 0.0
        errors.append(abs(work - stored - loss) / stored)
    assert errors[0] / errors[1] > 3.5
    assert errors[1] / errors[2] > 3.5
    assert errors[2] < 1e-3


def friction_loss(curve: fastncm.Curve, i: int) -> float:
    """Work (J) of the contact forces on what the target's surface slides along the jaw from row i
    to the next: the target moves by dx, and each place of the jaw as the tip does."""
    one, other = (curve.frame().iloc[j] for j in (i, i + 1))
    loss = 0.0
    for k in range(2):
        a, b = curve.contacts(i).iloc[k], curve.contacts(i + 1).iloc[k]
        force = 0.5 * (a + b)[["force_x_N", "force_y_N"]].to_numpy(float)
        jaw = _jaw_motion(one, other, 0.5 * (a + b))
        loss += float(force @ (np.array([other["position"] - one["position"], 0.0]) - jaw))
    return loss


def _jaw_motion(one: pd.Series, other: pd.Series, contact: pd.Series) -> np.ndarray:
    tips = [row[["tip_x_m", "tip_y_m"]].to_numpy(float) for row in (one, other)]
    arm = contact[["x_m", "y_m"]].to_numpy(float) - 0.5 * (tips[0] + tips[1])
    turn = other["tip_angle_rad"] - one["tip_angle_rad"]
    return tips[1] - tips[0] + turn * np.array([-arm[1], arm[0]])


@pytest.mark.parametrize("order", [3, 4, 5, 6])
@pytest.mark.parametrize(("case", "changes", "position"), [
    (STEEP, {}, FLAT_POSITION), (CUP, {"jaw.return_angle": 1.3}, CUP_POSITION),
])  # fmt: skip
@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_the_estimate_counts_both_contacts(
    case: ShootingCase, changes: dict[str, object], position: float, mu: float, order: int
) -> None:
    """Once to twenty times the true error of the force, a vector."""
    force = {}
    for modes in (order, 16):
        made = scene(case, **changes, **{"friction.mu": mu, "solver.order": modes})
        row = fastncm.solve(made, positions=[position]).frame().iloc[0]
        assert row["contacts"] == 2
        force[modes] = row[["force_x_N", "force_y_N"]].to_numpy(float)
        if modes == order:
            estimate = row["error_estimate"]
    error = np.hypot(*(force[order] - force[16])) / np.hypot(*force[16])
    assert error > 1e-13
    assert error <= estimate <= 20.0 * error
