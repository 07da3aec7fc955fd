"""Never wrong in silence: random extreme scenes whose converged rows once were far beyond their
estimates.

The truth is the same scene with eight times as many intervals. A true error above ten times the
estimate is wrong; where the finger could not be followed along the path, the advice must say so.
"""

import extremes
import numpy as np
import pandas as pd
import pytest

import fastncm

pytestmark = pytest.mark.compiled
WRONG, FINER = 10.0, 8
TOLD = "could not be followed"
COLUMNS = ["force_x_N", "force_y_N"]


def solved(kind: str, index: int, **changes: object) -> pd.DataFrame:
    made = extremes.one(kind, index) | {name.replace("_", "."): v for name, v in changes.items()}
    return fastncm.solve(fastncm.load_scene(extremes.base_scene(kind)).replace(made)).frame()


@pytest.mark.parametrize(
    ("kind", "index"),
    [
        pytest.param("polygon", 10, id="a node in the edges beside the corner that touches"),
        pytest.param("polygon", 81, id="a slender corner between two nodes"),
        pytest.param("polygon", 99, id="edges behind the side"),
        pytest.param("polygon", 198, id="one jump onto a needle, with friction"),
        pytest.param("polygon", 35, id="friction whose history is lost"),
        pytest.param("polygon", 1, id="a corner against the printed section"),
        pytest.param("ellipse", 38, id="the end of a needle, with friction"),
        pytest.param("ellipse", 155, id="the end of a needle"),
        pytest.param("ellipse", 298, id="where a sharp end becomes a flank"),
        pytest.param("ellipse", 62, id="sticking that began somewhere between two rows"),
        pytest.param("ellipse", 200, id="sliding that turned in one long move"),
        pytest.param("ellipse", 2091, id="a needle's flank, in one long move with friction"),
        pytest.param("ellipse", 2127, id="a small target that slides next to nothing"),
        pytest.param("circle", 24, id="a limit point ahead, behind which lies another branch"),
        pytest.param("polygon", 2060, id="a needle through the finger between two nodes"),
        pytest.param("polygon", 2212, id="nodes about a corner at the end of an edge"),
    ],
)
def test_no_row_is_far_beyond_its_estimate(kind: str, index: int) -> None:
    intervals = FINER * int(extremes.one(kind, index)["solver.intervals"])
    rows, truth = solved(kind, index), solved(kind, index, solver_intervals=intervals)
    both = (rows["status"] == "converged") & (truth["status"] == "converged")
    assert both.any()
    rows, truth = rows[both], truth[both]
    off = np.hypot(*(rows[COLUMNS] - truth[COLUMNS]).to_numpy().T)
    error = off / np.hypot(*truth[COLUMNS].to_numpy().T)
    wrong = error > WRONG * rows["error_estimate"] + truth["error_estimate"] + 1e-9
    assert rows["advice"][wrong].str.contains(TOLD).all()


def test_a_finger_that_could_not_be_followed_says_so() -> None:
    """It snaps on its way, and its friction may be any within the cone there: the estimate covers
    that, and the advice stays while contact lasts."""
    rows = solved("ellipse", 62)
    assert (rows["status"] == "converged").all()
    told = rows["advice"].str.contains(TOLD).to_numpy()
    first = int(told.argmax())
    assert first > 0
    assert told[first:].all()
    assert rows["error_estimate"][first] > 2.0 * extremes.one("ellipse", 62)["friction.mu"]


def test_rows_along_a_common_path_are_followed() -> None:
    scene = fastncm.load_scene("rubber-ellipse").replace({"friction.mu": 0.3})
    assert not fastncm.solve(scene).frame()["advice"].str.contains(TOLD).any()


def deepest_node(kind: str, index: int) -> float:
    """How deep the straight finger's nodes lie in the target at the path's end, from the scene
    alone: in finger lengths for a plane, else by the ellipse's equation."""
    scene = fastncm.load_scene(extremes.base_scene(kind)).replace(extremes.one(kind, index))
    where, finger, target = scene.pose(scene.path.stop), scene.finger, scene.target
    along = np.array([np.cos(where.base_angle), np.sin(where.base_angle)])
    s = np.linspace(0.0, finger.length, scene.solver.intervals + 1)[1:]
    half = 0.5 * np.interp(s, *np.transpose(finger.stations)) * (scene.model.surface == "side")
    half *= 1.0 if finger.side == "right" else -1.0
    side = (finger.offset + s)[:, None] * along + half[:, None] * [along[1], -along[0]]
    seen = side - [where.target_x, where.target_y]
    cos, sin = np.cos(target.tilt), np.sin(target.tilt)
    u, v = seen @ [cos, sin], seen @ [-sin, cos]
    if kind == "half-plane":
        return float(-v.min() / finger.length)
    a, b = target.semi_axes
    return float((1.0 - (u / a) ** 2 - (v / b) ** 2).max())


OVERLAPS = {
    "ellipse": "680 2393 3206 3411 3609 9276 11393 13652 13734 14349 16551 19627 23037 24793",
    "half-plane": "4695 22617",
}
"""Where a sharp end becomes a flank, and tips much thicker than the clamp that the base turns into
a plane."""


@pytest.mark.parametrize(
    ("kind", "index"),
    [(kind, int(index)) for kind, some in OVERLAPS.items() for index in some.split()],
)
def test_a_target_in_the_straight_finger_touches_it(kind: str, index: int) -> None:
    assert deepest_node(kind, index) > 1e-5
    row = solved(kind, index).iloc[-1]
    assert row["status"] == "converged"
    assert row["normal_force_N"] > 0.0


def test_contact_between_two_nodes_is_told() -> None:
    """A circle in the middle between two nodes, so shallow that neither touches: its sagitta over
    an interval is h^2 / (8 R)."""
    h, radius, half = 0.01, 0.03, 0.005
    scene = fastncm.load_scene("rubber-ellipse").replace(
        {
            "path.kind": "translation",
            "path.angle": 0.0,
            "path.start": 1.0,
            "path.stop": 0.0254 + 5.5 * h,
            "path.y": 0.0,
            "finger.length": 16 * h,
            "finger.thickness": 2.0 * half,
            "solver.intervals": 16,
            "target.shape": "circle",
            "target.radius": radius,
        }
    )
    sagitta = h**2 / (8.0 * radius)
    for share, told in ((1.05, False), (0.5, True), (-0.05, False)):
        depth = (1.0 - share) * sagitta
        down = {"path.y": -half - radius + depth}
        row = fastncm.solve(scene.replace(down), positions=[0.0254 + 5.5 * h]).frame().iloc[0]
        assert ("between two nodes" in row["advice"]) == told
        if told:
            assert f"{depth:.3g}"[:4] in row["advice"]
        assert row["status"] == ("converged" if depth > sagitta else "no_contact")


def test_thin_targets_do_not_pass_through_the_finger() -> None:
    """An ellipse that is thinner than a move of the target, with the nodes closer than its ends are
    sharp: the same rows with so few nodes that its ends are contact points."""
    few = solved("ellipse", 3)
    many = solved("ellipse", 3, solver_intervals=128)
    assert list(many["status"]) == list(few["status"])
    assert (many["status"][1:] == "converged").all()
    np.testing.assert_allclose(many["energy_J"], few["energy_J"], rtol=5e-3, atol=1e-20)
