"""Coulomb's law and the balance of energy on random scenes, from the columns of the curve alone."""

import numpy as np
import pandas as pd
from hypothesis import given, settings
from hypothesis import strategies as st

import fastncm

CIRCLE = fastncm.load_scene("snapfit-circle")
CORNER = fastncm.load_scene("snapfit-corner")
STEPS = 80

MU = st.floats(0.0, 0.6)
JAWS = st.fixed_dictionaries(
    {
        "jaw.height": st.floats(0.0075, 0.0105),
        "jaw.length": st.floats(0.018, 0.020),
        "jaw.return_angle": st.floats(0.6, 1.1),
    }
)


def jaw_in_space(scene: fastncm.Scene, row: pd.Series, count: int = 4001) -> np.ndarray:
    """Points (count, 2) of the straight jaw from a to b, moved with the tip."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    points = np.array(scene.jaw.a) * (1.0 - share) + np.array(scene.jaw.b) * share
    arm = points - [scene.finger.length, 0.0]
    cos, sin = np.cos(row["tip_angle_rad"]), np.sin(row["tip_angle_rad"])
    turned = arm @ np.array([[cos, sin], [-sin, cos]])
    return turned + row[["tip_x_m", "tip_y_m"]].to_numpy(float)


def normal(scene: fastncm.Scene, frame: pd.DataFrame) -> np.ndarray:
    """Unit normals (N, 2) out of the circle at the contact."""
    reach = frame[["contact_x_m", "contact_y_m"]].to_numpy()
    reach = reach - np.column_stack([frame["position"], np.full(len(frame), scene.path.y)])
    np.testing.assert_allclose(np.hypot(*reach.T), scene.target.radius, rtol=1e-9)
    return reach / scene.target.radius


def friction_loss(scene: fastncm.Scene, frame: pd.DataFrame) -> float:
    """Work (J) of the friction force on the slip, by the midpoint rule from row to row."""
    unit = normal(scene, frame)
    tangent = np.column_stack([-unit[:, 1], unit[:, 0]])
    force = frame[["force_x_N", "force_y_N"]].to_numpy()
    rub = (force * tangent).sum(axis=1)
    tip = frame[["tip_x_m", "tip_y_m"]].to_numpy()
    arm = frame[["contact_x_m", "contact_y_m"]].to_numpy() - tip
    arm = (arm[1:] + arm[:-1]) / 2.0
    turn = np.diff(frame["tip_angle_rad"])[:, None]
    jaw = np.diff(tip, axis=0) + turn * np.column_stack([-arm[:, 1], arm[:, 0]])
    target = np.column_stack([np.diff(frame["position"]), np.zeros(len(frame) - 1)])
    slip = ((target - jaw) * (tangent[1:] + tangent[:-1]) / 2.0).sum(axis=1)
    return float(((rub[1:] + rub[:-1]) / 2.0 * slip).sum())


def check_law(frame: pd.DataFrame, mu: float) -> None:
    """On the cone where it slides, inside where it sticks; nothing pulls."""
    loaded = frame[frame["status"] == "converged"]
    assert (loaded["normal_force_N"] >= 0.0).all()
    limit = mu * loaded["normal_force_N"]
    size = np.hypot(loaded["force_x_N"], loaded["force_y_N"]).max()
    excess = loaded["friction_force_N"] - limit
    assert excess.max() <= 1e-10 * size
    assert np.abs(excess[loaded["sticking"] == 0]).max() <= 1e-10 * size


@settings(max_examples=25, deadline=None, derandomize=True)
@given(mu=MU, jaw=JAWS, stop=st.floats(0.060, 0.072))
def test_in_and_out_on_the_circle(mu: float, jaw: dict[str, float], stop: float) -> None:
    scene = CIRCLE.replace(
        {**jaw, "friction.mu": mu, "path.stop": stop, "path.steps": STEPS, "path.withdraw": True}
    )
    frame = fastncm.solve(scene).frame()
    assert set(frame["status"]) <= {"converged", "no_contact"}
    check_law(frame, mu)
    for i in range(0, len(frame), 13):
        row = frame.iloc[i]
        away = jaw_in_space(scene, row) - [row["position"], scene.path.y]
        assert np.hypot(*away.T).min() >= scene.target.radius - 1e-10
    for way in (frame.iloc[2:STEPS], frame.iloc[STEPS + 4 : -2]):
        work = np.trapezoid(way["force_x_N"], way["position"])
        stored = way["energy_J"].iloc[-1] - way["energy_J"].iloc[0]
        loss = friction_loss(scene, way)
        assert loss >= -1e-12
        scale = frame["energy_J"].max()
        assert abs(work - stored - loss) < 2.0 / STEPS * scale


@settings(max_examples=25, deadline=None, derandomize=True)
@given(mu=MU, jaw=JAWS, stop=st.floats(0.052, 0.070), radius=st.floats(0.03, 0.2))
def test_in_and_out_on_the_block(
    mu: float, jaw: dict[str, float], stop: float, radius: float
) -> None:
    scene = CORNER.replace(
        {
            **jaw,
            "jaw.height": jaw["jaw.height"] - 0.002,
            "jaw.radius": radius,
            "friction.mu": mu,
            "path.stop": stop,
            "path.steps": STEPS,
            "path.withdraw": True,
        }
    )
    frame = fastncm.solve(scene).frame()
    assert set(frame["status"]) <= {"converged", "no_contact"}
    check_law(frame, mu)
    work = np.trapezoid(frame["force_x_N"], frame["position"])
    assert work >= -1e-3 * frame["energy_J"].max()  # the loop ends where it began


def test_the_energy_balance_is_of_second_order_between_events() -> None:
    scene = CIRCLE.replace({"friction.mu": 0.4, "solver.rtol": 1e-10})
    errors = []
    for steps in (20, 40, 80):
        way = fastncm.solve(scene, positions=np.linspace(0.077, 0.066, steps)).frame()
        work = np.trapezoid(way["force_x_N"], way["position"])
        stored = way["energy_J"].iloc[-1] - way["energy_J"].iloc[0]
        errors.append(abs(work - stored - friction_loss(scene, way)))
    assert errors[0] / errors[1] > 3.5
    assert errors[1] / errors[2] > 3.5
