"""Positions that are not solved: the reason in the row against geometry and finer nodes."""

import extremes
import numpy as np
import pandas as pd
import pytest
from surfaces import RUBBER

import fastncm
from fastncm.sqp import status

pytestmark = pytest.mark.compiled

#: More iterations than this no row takes, solved or not: of each of a few ways to it `_MOST`.
SANE = 5000


def solved(kind: str, index: int, **changes: object) -> pd.DataFrame:
    """The curve of a random scene with changes of the solver."""
    more = {f"{'path' if name == 'steps' else 'solver'}.{name}": v for name, v in changes.items()}
    return fastncm.solve(RUBBER.replace(extremes.one(kind, index) | more)).frame()


def says(frame: pd.DataFrame, row: int, number: int) -> bool:
    """Whether the row has the word and the advice of a status number."""
    found = frame.iloc[row]
    same: bool = found["status"] == status.WORDS[number]
    return same and status.ADVICE[number] in found["advice"]


def covers_clamp(kind: str, index: int, row: int) -> bool:
    """Whether the polygon covers the clamp's right corner between the rows `row` - 1 and `row`."""
    scene = extremes.one(kind, index)
    path = np.linspace(scene["path.start"], scene["path.stop"], scene["path.steps"])
    angle, half = scene["path.angle"], 0.5 * scene["finger.thickness"][0]
    along = np.array([np.cos(angle), np.sin(angle)])
    clamp = scene["finger.offset"] * along + half * np.array([along[1], -along[0]])
    corners = np.array(scene["target.vertices"])
    edges = np.roll(corners, -1, axis=0) - corners
    for x in np.linspace(path[row - 1], path[row], 5001):
        seen = clamp - [x, scene["path.y"]] - corners
        if (edges[:, 0] * seen[:, 1] - edges[:, 1] * seen[:, 0] >= 0.0).all():
            return True
    return False


@pytest.mark.parametrize("index", [49, 111])
def test_a_target_that_has_come_through_the_clamp(index: int) -> None:
    """From one row to the next, and further on."""
    frame = solved("polygon", index)
    assert covers_clamp("polygon", index, len(frame) - 1)
    assert says(frame, len(frame) - 1, status.THROUGH_CLAMP)


@pytest.mark.parametrize(("kind", "index"), [("ellipse", 163), ("circle", 69)])
def test_nodes_too_far_apart_for_a_contact_next_to_the_clamp(kind: str, index: int) -> None:
    """With eight times as many intervals there is an answer."""
    frame = solved(kind, index)
    intervals = extremes.one(kind, index)["solver.intervals"]
    last = len(frame) - 1
    assert says(frame, last, status.TOO_COARSE)
    fine = solved(kind, index, intervals=8 * intervals)
    assert fine["status"].iloc[last] == "converged"


def test_a_finger_that_slips_off_the_target() -> None:
    """The branch ends at the same place whatever the path's steps and the intervals are."""
    places = []
    for changes in ({"steps": 60}, {"steps": 60, "intervals": 180}, {"steps": 97}):
        frame = solved("polygon", 179, **changes)
        ends = np.flatnonzero(frame["status"] == "no_equilibrium")
        assert says(frame, ends[0], status.BRANCH_ENDS)
        assert frame["status"].iloc[ends[0] - 1] == "converged"
        places.append(frame["position"].iloc[[ends[0] - 1, ends[0]]].to_numpy())
    before, after = np.array(places).T
    assert (np.max(after) < np.min(before)).all()


@pytest.mark.parametrize(("kind", "index"), [("ellipse", 192), ("circle", 69), ("polygon", 6)])
def test_a_row_gives_up(kind: str, index: int) -> None:
    frame = solved(kind, index)
    assert (frame["iterations"] < SANE).all()
    assert frame["status"].isin(["max_iterations", "no_equilibrium"]).any()
