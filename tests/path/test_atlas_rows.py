"""Rows of the atlas of extreme scenes (`extremes`) that once had no answer, each with its cause and
an expectation from elsewhere."""

import extremes
import numpy as np
import pandas as pd
import pytest
import shooting_many

import fastncm
from fastncm.cases import solve_chunk

pytestmark = pytest.mark.compiled

FORCE = ["force_x_N", "force_y_N"]


def solve(kind: str, index: int, **changes: object) -> fastncm.Curve:
    scene = fastncm.load_scene(extremes.base_scene(kind))
    return fastncm.solve(scene.replace(extremes.one(kind, index) | changes))


def exact_force(kind: str, index: int, row: pd.Series) -> tuple[np.ndarray, float]:
    """The force (2,), N, of the exact equilibrium next to a claimed one, and what rounding may do
    to it (relative)."""
    block, place = divmod(index, extremes.BLOCK)
    columns, case = extremes.jaw_block(kind, block), np.array([place])
    unit, length = (
        float(values[0])
        for values in (
            shooting_many.force_unit(columns, case),
            columns["finger.length"][case],
        )
    )
    claim = shooting_many.Claim(
        row[FORCE].to_numpy(float)[None] / unit,
        row[["contact_x_m", "contact_y_m"]].to_numpy(float)[None] / length,
        np.array([[row["tip_x_m"] / length, row["tip_y_m"] / length, row["tip_angle_rad"]]]),
    )
    fingers = shooting_many.fingers(columns, case, np.array([row["position"]]))
    truth = shooting_many.exact(fingers, claim, np.zeros(1))
    assert truth.found.all()
    return truth.force[0] * unit, float(truth.rounding[0] / truth.normal[0])


@pytest.mark.parametrize(
    ("kind", "index"),
    [
        # the block's far corner slides over the part of the arc that falls towards a
        ("corner-convex", 146),
        ("corner-concave", 94),
        # corner a slips off the block; the SQP left the branch before
        ("corner-straight", 166),
        ("corner-concave", 11),
        # contact ends and begins again on the way to a position
        ("circle-concave", 14),
        # solved, but measured at another pair: an estimate of 2
        ("corner-straight", 37),
        # the jaw has passed the block's corner with corner b nearest to it and corner a inside
        ("corner-convex", 245),
        ("corner-convex", 421),
        ("corner-convex", 619),
        # an arc that bulges beyond b, whose lower end the block's corner is next to: "no_contact"
        ("corner-convex", 14481),
        ("corner-convex", 15717),
        # the finger snaps to a shape that the solver found from bent fingers only
        ("circle-concave", 274),
        ("circle-concave", 890),
        ("corner-concave", 61),
        ("corner-concave", 379),
        ("corner-concave", 778),
        # at a limit point the steps of the SQP wound the finger up
        ("circle-concave", 7620),
        ("circle-concave", 9334),
        ("corner-straight", 12408),
    ],
)
def test_a_row_with_one_contact(kind: str, index: int) -> None:
    row = solve(kind, index).frame().iloc[-1]
    assert row["status"] == "converged"
    assert row["contacts"] == 1
    truth, rounding = exact_force(kind, index, row)
    error = np.hypot(*(row[FORCE].to_numpy(float) - truth))
    assert error <= (10.0 * row["error_estimate"] + rounding) * np.hypot(*truth)
    assert row["error_estimate"] < 1e-5


@pytest.mark.parametrize(
    ("kind", "index", "pose"),
    [
        ("circle-straight", 986, (0.73925, -0.41270, 0.01446)),
        ("circle-straight", 8067, (0.77949, -0.28853, -0.02180)),
        ("circle-concave", 331, (0.83267, -0.19373, -0.02712)),
    ],
)
def test_a_row_that_needs_more_modes_than_those_before(
    kind: str, index: int, pose: tuple[float, float, float]
) -> None:
    """The only other row has no contact, and with the first order the branch ended before. pose:
    the tip's, of 24 links that SLSQP follows from first touch (bench/support/atlas_slsqp.py)."""
    row = solve(kind, index).frame().iloc[-1]
    length = extremes.one(kind, index)["finger.length"]
    assert row["status"] == "converged"
    assert row[["tip_x_m", "tip_y_m"]].to_numpy(float) / length == pytest.approx(pose[:2], abs=5e-3)
    assert row["tip_angle_rad"] == pytest.approx(pose[2], abs=5e-3)


@pytest.mark.parametrize("index", [142, 347])
def test_the_estimate_covers_the_friction_of_a_contact_that_sticks(index: int) -> None:
    """The friction force is then an unknown of its own: against more modes, it was off by 160 times
    the estimate; ten times is what the atlas allows."""
    frames = [solve("corner-concave", index, **{"solver.order": o}).frame() for o in (3, 4, 24)]
    sticks = frames[-1]["sticking"] > 0
    assert sticks.sum() >= 2
    truth = frames[-1].loc[sticks, FORCE].to_numpy()
    for frame in frames[:-1]:
        off = frame.loc[sticks, FORCE].to_numpy() - truth
        error = np.hypot(*off.T) / np.hypot(*truth.T)
        assert (error <= 10.0 * frame.loc[sticks, "error_estimate"].to_numpy()).all()


def test_a_neighbour_changes_nothing() -> None:
    """The lane beside a contact that sticks tried another assumption: the row had the friction
    force of the position before, and a KKT residual of 0.65."""
    kind = "circle-straight"
    both = {name: column[[262, 694]] for name, column in extremes.jaw_block(kind, 0).items()}
    same = ("solver.order", "solver.rtol", "path.steps", "model.shear")
    both |= {name: both[name][[1, 1]] for name in same}  # so that they are solved side by side
    scene = fastncm.load_scene(extremes.base_scene(kind)).replace(extremes.row(both, 0))
    curves = solve_chunk(scene, both, curves=True).curves
    assert curves is not None
    together = pd.DataFrame(curves)
    for case in (0, 1):
        alone = fastncm.solve(scene.replace(extremes.row(both, case))).frame()
        beside = together[together["case"] == case].reset_index(drop=True)
        assert (beside["status"] == alone["status"]).all()
        solved = alone["status"] == "converged"
        assert (beside.loc[solved, "kkt_residual"] < 1e-3).all()
        for name in ("normal_force_N", "friction_force_N"):
            expected = alone.loc[solved, name].to_numpy()
            np.testing.assert_allclose(beside.loc[solved, name], expected, rtol=1e-6)


def test_an_edge_that_comes_off_the_face() -> None:
    """The first touch is 1e-9 from corner b: a kink that no step is short enough for. The last rows
    have two contacts, the same with more modes."""
    row = solve("corner-straight", 136).frame().iloc[-1]
    other = solve("corner-straight", 136, **{"solver.order": 24}).frame().iloc[-1]
    for one in (row, other):
        assert (one["status"], one["contacts"]) == ("converged", 2)
    assert row["normal_force_N"] == pytest.approx(other["normal_force_N"], rel=1e-8)
    assert row["tip_angle_rad"] == pytest.approx(other["tip_angle_rad"], rel=1e-8)


def test_a_block_in_a_cup() -> None:
    """Corner a on the face and corner b on the underside: three pairs close one after the other.
    Four modes for a tip of a 500th of the clamp's thickness: what more modes say is only near."""
    frame = solve("corner-concave", 101).frame()
    assert frame["status"].isin(["converged", "no_contact"]).all()


def test_two_contacts_behind_a_snap() -> None:
    """The steep edge of a concave jaw slips off the block's corner: nothing was found behind it.
    What more modes say is near where the estimate says so."""
    row = solve("corner-concave", 536).frame().iloc[-1]
    other = solve("corner-concave", 536, **{"solver.order": 24}).frame().iloc[-1]
    assert (row["status"], other["status"]) == ("converged", "converged")
    off = row["normal_force_N"] / other["normal_force_N"] - 1.0
    assert abs(off) < 10.0 * (row["error_estimate"] + other["error_estimate"])


@pytest.mark.parametrize(
    ("kind", "index"), [("circle-concave", 297), ("circle-concave", 863), ("corner-convex", 775)]
)
def test_the_advice_says_where_a_branch_ends(kind: str, index: int) -> None:
    """Nothing is found behind the end: more positions, as the advice said, find nothing either, and
    end in the same place."""
    places = []
    for steps in (2, 40):
        curve = solve(kind, index, **{"path.steps": steps})
        frame = curve.frame()
        assert "more positions" not in curve.advice
        places.append(float(curve.advice.split("ends at")[1].split()[0]))
        assert frame["position"].iloc[-1] < places[-1] < frame["position"].iloc[0]
    assert places[1] == pytest.approx(places[0], rel=1e-6)


@pytest.mark.parametrize("index", [64, 863, 933])
def test_a_circle_goes_round_a_horn(index: int) -> None:
    """The branch ends where the circle, on corner b, touches the concave arc's tangent there: from
    then on it would cross the arc from below, where the jaw has no surface."""
    kind = "circle-concave"
    scene = extremes.one(kind, index)
    place = float(solve(kind, index).advice.split("ends at")[1].split()[0])
    frame = fastncm.solve(
        fastncm.load_scene(extremes.base_scene(kind)).replace(scene),
        positions=[place + 1.0 * scene["target.radius"], place * (1.0 + 1e-8)],
    ).frame()
    row = frame.iloc[-1]
    assert (row["status"], row["contacts"]) == ("converged", 1)
    a, b = np.array(scene["jaw.a"]), np.array(scene["jaw.b"])
    chord = np.hypot(*(b - a))
    half = np.arcsin(min(0.5 * chord / scene["jaw.radius"], 1.0))
    turn = half + row["tip_angle_rad"]
    along = (b - a) / chord
    tangent = np.array(
        [
            np.cos(turn) * along[0] - np.sin(turn) * along[1],
            np.sin(turn) * along[0] + np.cos(turn) * along[1],
        ]
    )
    centre = np.array([row["position"], scene["path.y"]])
    contact = row[["contact_x_m", "contact_y_m"]].to_numpy(float)
    assert np.hypot(*(centre - contact)) == pytest.approx(scene["target.radius"], rel=1e-9)
    assert abs(tangent @ (centre - contact)) < 1e-5 * scene["target.radius"]


@pytest.mark.parametrize(("kind", "index"), [("corner-straight", 146)])
def test_a_taut_finger_is_infeasible(kind: str, index: int) -> None:
    """Two modes cannot make the finger shorter: the last force before is far above what moved it
    there."""
    frame = solve(kind, index).frame()
    assert frame["status"].iloc[-1] == "infeasible"


@pytest.mark.parametrize("index", [71, 102, 157, 227, 317, 385, 426, 472, 526, 9153, 15606])
def test_a_short_block_across_a_cup_is_no_free_finger(index: int) -> None:
    """In one long move the block comes to lie across the arc's middle, which `bench/atlas.py` finds
    inside the block; the rows said "no_contact"."""
    frame = solve("corner-concave", index).frame()
    last = frame.iloc[-1]
    assert last["status"] in ("max_iterations", "infeasible", "no_equilibrium")
    assert np.isnan(last["normal_force_N"])
