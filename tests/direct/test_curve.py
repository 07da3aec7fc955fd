"""Curves of direct contact, against IPOPT on the same discretisation and the issue's figures."""

import json
import math

import numpy as np
import pandas as pd
import pytest
from surfaces import PLANE

import fastncm
from fastncm.columns import CURVE_UNITS

RUBBER = fastncm.load_scene("rubber-ellipse")
DEGREES = np.array([120.0, 108.0, 96.0, 84.0])


@pytest.fixture(scope="module")
def ipopt(pytestconfig) -> pd.DataFrame:
    return pd.read_csv(pytestconfig.rootpath / "bench" / "data" / "ipopt_rubber_ellipse.csv")


@pytest.fixture(scope="module")
def rubber() -> fastncm.Curve:
    return fastncm.solve(RUBBER)


def along(positions: np.ndarray) -> np.ndarray:
    """The positions with two more between each pair, as IPOPT took them."""
    at = np.arange((len(positions) - 1) * 3 + 1) / 3
    return np.interp(at, np.arange(len(positions)), positions)


@pytest.mark.parametrize(
    "case",
    [
        "N = 90",
        "N = 180",
        "N = 360",
        "section psi+gamma",
        "no shear",
        "axis",
        "thin tip",
        "tilted",
        "circle",
        "plane",
    ],
)
def test_forces_and_energies_are_those_of_ipopt(ipopt: pd.DataFrame, case: str) -> None:
    theirs = ipopt[ipopt["case"] == case].reset_index(drop=True)
    scene = RUBBER.replace(json.loads(theirs["changes"][0]))
    curve = fastncm.solve(scene, positions=along(theirs["position"].to_numpy()))
    ours = curve.frame().iloc[::3].reset_index(drop=True)
    size = np.hypot(theirs["force_x_N"], theirs["force_y_N"]).to_numpy()
    for column in ("force_x_N", "force_y_N"):
        assert (abs(ours[column] - theirs[column]) <= 1e-6 * size + 1e-5).all(), column
    np.testing.assert_allclose(ours["energy_J"], theirs["energy_J"], rtol=1e-6, atol=1e-8)
    for column in ("tip_x_m", "tip_y_m", "tip_angle_rad"):
        np.testing.assert_allclose(ours[column], theirs[column], atol=1e-6)
    touching = theirs["touching"] > 0
    assert (ours["status"][touching] == "converged").all()
    if case != "plane":  # flat on it, nodes touch with forces that IPOPT's barrier hides
        step = 1.01 * scene.finger.length / scene.solver.intervals
        np.testing.assert_allclose(ours["contact_from_m"], theirs["s_from_m"], atol=step)
        np.testing.assert_allclose(ours["contact_to_m"], theirs["s_to_m"], atol=step)


@pytest.mark.parametrize(
    ("section", "forces"),
    [
        ("psi", [(5.17, -115.20), (-31.35, -243.44), (-90.99, -201.16), (-62.14, -48.43)]),
        ("psi+gamma", [(5.35, -116.22), (-31.55, -252.70), (-93.08, -208.09), (-62.41, -48.75)]),
    ],
)
def test_the_figures_of_the_issue(section: str, forces: list[tuple[float, float]]) -> None:
    scene = RUBBER.replace({"solver.intervals": 180, "model.section": section})
    frame = fastncm.solve(scene, positions=np.radians(along(np.array([126, *DEGREES])))).frame()
    ours = frame.iloc[3::3]
    error = np.hypot(*(ours[["force_x_N", "force_y_N"]].to_numpy() - forces).T)
    assert (error <= 1e-3 * np.hypot(*np.transpose(forces))).all()
    if section == "psi":
        np.testing.assert_allclose(
            ours["energy_J"], [2.45188, 4.19190, 3.53668, 1.20275], rtol=1e-4
        )
        intervals = [(0.0576, 0.072), (0.0373, 0.0584), (0.0389, 0.0559), (0.061, 0.066)]
        shown = ours[["contact_from_m", "contact_to_m"]].to_numpy()
        np.testing.assert_allclose(shown, intervals, atol=RUBBER.finger.length / 180)


def test_columns_and_units(rubber: fastncm.Curve) -> None:
    frame = rubber.frame()
    shared = [name for name in CURVE_UNITS if name in frame.columns]
    assert list(frame.columns) == [*shared, "contact_from_m", "contact_to_m", "advice"]
    assert set(CURVE_UNITS) <= set(frame.columns)
    assert set(frame.attrs["units"]) == set(frame.columns)
    assert frame.attrs["units"]["position"] == "rad"
    assert frame.attrs["units"]["contact_to_m"] == "m"
    assert len(rubber) == len(frame) == RUBBER.path.steps
    assert isinstance(rubber, fastncm.Curve)
    plane = fastncm.solve(RUBBER.replace(PLANE | {"path.steps": 4}))
    assert plane.frame().attrs["units"]["position"] == "m"


def test_contacts_make_up_the_force_and_the_base_moment(rubber: fastncm.Curve) -> None:
    frame = rubber.frame()
    bending = RUBBER.finger.young * RUBBER.finger.width / 12
    for row in range(0, len(frame), 7):
        contacts, shape, whole = rubber.contacts(row), rubber.shape(row), frame.iloc[row]
        assert len(contacts) == whole["contacts"]
        for axis in "xy":
            total = contacts[f"force_{axis}_N"].sum()
            assert total == pytest.approx(whole[f"force_{axis}_N"], rel=1e-12)
        lever = contacts[["x_m", "y_m"]].to_numpy() - shape[["x_m", "y_m"]].to_numpy()[0]
        force = contacts[["force_x_N", "force_y_N"]].to_numpy()
        moment = (lever[:, 0] * force[:, 1] - lever[:, 1] * force[:, 0]).sum()
        assert shape["moment_Nm"][0] == pytest.approx(moment, rel=1e-9)
        # the first interval's curvature carries the moment at its middle
        h = shape["s_m"][1]
        inertia = np.interp(h / 2, [0, RUBBER.finger.length], RUBBER.finger.thickness) ** 3
        carried = bending * inertia * (shape["psi_rad"][1] - shape["psi_rad"][0]) / h
        assert carried == pytest.approx(shape["moment_Nm"][:2].mean(), rel=1e-3)


def test_beyond_the_last_contact_the_finger_is_straight(rubber: fastncm.Curve) -> None:
    row = 30
    shape, last = rubber.shape(row), rubber.frame()["contact_to_m"].iloc[row]
    beyond = shape[shape["s_m"] > last + 1e-9]
    assert np.ptp(beyond["psi_rad"]) < 1e-14
    assert abs(beyond["gamma_rad"].iloc[1:]).max() < 1e-14
    assert abs(beyond["moment_Nm"]).max() < 1e-12
    # and the shear angle falls from its largest value to that within the contact (Fig. 7)
    assert shape["gamma_rad"].max() > 0.1


def test_shapes_follow_from_their_angles(rubber: fastncm.Curve) -> None:
    shape = rubber.shape(12)
    base = np.radians(126) - np.radians(48) * 12 / 59
    assert shape["psi_rad"][0] == pytest.approx(base, abs=1e-12)
    assert (shape["x_m"][0], shape["y_m"][0]) == pytest.approx(
        (0.0254 * np.cos(base), 0.0254 * np.sin(base))
    )
    steps = np.hypot(np.diff(shape["x_m"]), np.diff(shape["y_m"]))
    np.testing.assert_allclose(steps, RUBBER.finger.length / 90, rtol=1e-12)
    assert shape["s_m"].iloc[-1] == pytest.approx(0.1524)


def test_the_work_is_the_energy_stored(rubber: fastncm.Curve) -> None:
    """Without friction; the sum over 60 rows is good to the square of their distance."""
    energy = rubber.frame()["energy_J"]
    change = energy.iloc[-1] - energy.iloc[0]
    assert rubber.insertion_work_J == pytest.approx(change, rel=5e-3)
    fine = fastncm.solve(RUBBER.replace({"path.steps": 240}))
    assert fine.insertion_work_J == pytest.approx(change, rel=1e-3)


def test_the_peak_is_located(rubber: fastncm.Curve) -> None:
    frame = rubber.frame()
    assert rubber.peak.insertion_force_N >= frame["insertion_force_N"].max()
    largest = frame["insertion_force_N"].argmax()
    around = frame["position"].iloc[[largest - 1, largest + 1]]
    way = np.linspace(*around, 401)
    dense = fastncm.solve(
        RUBBER, positions=np.concatenate([frame["position"].iloc[: largest - 1], way])
    ).frame()
    dense = dense.iloc[largest - 1 :]
    assert rubber.peak.insertion_force_N == pytest.approx(
        dense["insertion_force_N"].max(), rel=1e-5
    )
    assert rubber.peak.insertion_force_N >= dense["insertion_force_N"].max() * (1 - 1e-9)


def test_without_friction_the_way_back_is_the_way_in(rubber: fastncm.Curve) -> None:
    """What resists withdrawal is what pushed the target along on its way in."""
    both = fastncm.solve(RUBBER.replace({"path.withdraw": True}))
    assert both.peak == rubber.peak
    assert both.insertion_work_J == rubber.insertion_work_J
    back = fastncm.solve(RUBBER, positions=rubber.frame()["position"][::-1].to_numpy())
    frame = back.frame()
    least = frame["insertion_force_N"].argmin()
    way = np.linspace(*frame["position"].iloc[[least - 1, least + 1]], 201)
    dense = fastncm.solve(
        RUBBER, positions=np.concatenate([frame["position"].iloc[:least], way])
    ).frame()
    pushing = -dense["insertion_force_N"].iloc[least:].min()
    assert both.retention.insertion_force_N == pytest.approx(pushing, rel=1e-5)
    assert np.isnan(rubber.retention.insertion_force_N)


def test_touch_and_peak_of_a_wall() -> None:
    """The tip's right corner of the undeformed finger touches the wall first."""
    curve = fastncm.solve(RUBBER.replace(PLANE))
    events = curve.events()
    assert list(events["event"]) == ["touch"]
    tip = (0.0254 + 0.1524) * math.cos(1.3) + 0.0085 * math.sin(1.3)
    assert events["position"][0] == pytest.approx(tip, abs=1e-9)
    assert curve.frame()["status"].iloc[0] == "no_contact"
    assert curve.peak.position == 0.0225  # the force only grows: its end is the peak
    last = curve.frame()["insertion_force_N"].iloc[-1]
    assert curve.peak.insertion_force_N == pytest.approx(last, rel=1e-10)
    assert events["insertion_force_N"][0] < 1e-4 * curve.peak.insertion_force_N


def test_a_grazing_contact_has_the_force_of_a_spring() -> None:
    """The deeper the wall, the larger the force, in proportion to it as long as both are small."""
    tip = (0.0254 + 0.1524) * math.cos(1.3) + 0.0085 * math.sin(1.3)
    depth = np.array([1e-11, 1e-9, 1e-8, 1e-7, 1e-6])
    frame = fastncm.solve(RUBBER.replace(PLANE), positions=tip - depth).frame()
    assert (frame["status"] == "converged").all()
    stiffness = frame["insertion_force_N"] / depth
    np.testing.assert_allclose(stiffness, stiffness.iloc[3], rtol=1e-4)
    assert (frame["contacts"] == 1).all()
    np.testing.assert_allclose(frame["contact_s_m"], RUBBER.finger.length, rtol=1e-13)
    assert frame["error_estimate"].is_monotonic_decreasing


def test_a_path_may_start_at_the_touch() -> None:
    wall = fastncm.solve(RUBBER.replace(PLANE | {"path.start": "touch", "path.steps": 10}))
    tip = (0.0254 + 0.1524) * math.cos(1.3) + 0.0085 * math.sin(1.3)
    frame = wall.frame()
    assert frame["position"].iloc[0] == pytest.approx(tip, abs=1e-12)
    assert (frame["status"].iloc[1:] == "converged").all()
    assert (frame["insertion_force_N"].iloc[1:] > 0).all()
    turning = fastncm.solve(RUBBER.replace({"path.start": "touch"}))
    assert turning.peak.insertion_force_N >= turning.frame()["insertion_force_N"].max() > 0.0


def test_never_touching_is_a_result() -> None:
    curve = fastncm.solve(RUBBER.replace({"path.y": 0.5}))
    assert curve.status == "no_contact"
    assert curve.peak.insertion_force_N == 0.0
    assert len(curve.contacts(0)) == 0
    assert curve.insertion_work_J == 0.0


def test_a_target_that_cannot_be_cleared_says_how_far_it_overlaps() -> None:
    """The base is pushed into the wall: the clamp's right corner lies beyond it."""
    corner = 0.0254 * math.cos(1.3) + 0.015 * math.sin(1.3)
    curve = fastncm.solve(RUBBER.replace(PLANE), positions=[0.03, corner - 0.002])
    assert list(curve.frame()["status"]) == ["converged", "infeasible"]
    assert curve.status == "infeasible"
    assert "overlap is 0.002 m" in curve.advice
    assert np.isnan(curve.peak.insertion_force_N)
    assert curve.frame()["force_x_N"].isna().tolist() == [False, True]


def test_few_intervals_are_said_to_be_few() -> None:
    curve = fastncm.solve(RUBBER.replace({"solver.intervals": 8}))
    assert curve.frame()["error_estimate"].max() > 0.05
    assert "solver.intervals" in curve.advice
    assert fastncm.solve(RUBBER).advice == ""


def test_the_moment_rule_turns_the_force_of_a_single_contact() -> None:
    """(14)-(17): the same base moment as without friction, on the cone; rows that touch at several
    nodes are refused."""
    mu = 0.3
    wall = RUBBER.replace(PLANE | {"friction.model": "recovered"})
    positions = [0.05, 0.045, 0.04, 0.03]
    plain = fastncm.solve(wall, positions=positions).frame()
    curve = fastncm.solve(wall.replace({"friction.mu": mu}), positions=positions)
    frame = curve.frame()
    assert curve.contacts(0)["force_y_N"].tolist() == [frame["force_y_N"][0]]
    assert len(curve.contacts(3)) == 0
    assert list(frame["status"]) == ["converged"] * 3 + ["no_equilibrium"]
    assert "single contact point" in frame["advice"][3]
    clamp = 0.0254 * np.array([math.cos(1.3), math.sin(1.3)])
    for row in range(3):
        moments = []
        for table in (plain, frame):
            lever = table[["contact_x_m", "contact_y_m"]].to_numpy()[row] - clamp
            force = table[["force_x_N", "force_y_N"]].to_numpy()[row]
            moments.append(lever[0] * force[1] - lever[1] * force[0])
        assert moments[1] == pytest.approx(moments[0], rel=1e-12)
        # the wall moves along its normal: no sliding sense but the finger's, t = (0, -1) or (0, 1)
        assert abs(frame["force_y_N"][row]) == pytest.approx(mu * -frame["force_x_N"][row])
        assert frame["friction_force_N"][row] == pytest.approx(mu * frame["normal_force_N"][row])
        assert frame["insertion_force_N"][row] == pytest.approx(-frame["force_x_N"][row])


@pytest.mark.parametrize("positions", [[], "ab", [[2.0]], [2.0, float("nan")], [None]])
def test_bad_positions_are_refused(positions: object) -> None:
    with pytest.raises(fastncm.SceneError, match="positions"):
        fastncm.solve(RUBBER, positions=positions)  # type: ignore[arg-type]


def test_rows_that_are_not_there(rubber: fastncm.Curve) -> None:
    with pytest.raises(IndexError, match="rows 0 to 59"):
        rubber.shape(60)
    assert rubber.shape(-1).equals(rubber.shape(59))
