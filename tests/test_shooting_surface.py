"""Direct contact against shooting on the continuum, and that against IPOPT on many intervals."""

import math
from functools import lru_cache

import numpy as np
import pandas as pd
import pytest
import shooting_surface
from shooting_surface import Finger, Touch

import fastncm

SCENE = fastncm.load_scene("rubber-ellipse")
DEGREES = np.arange(126.0, 77.0, -6.0)
BETWEEN = 4
"""Steps from one to the next."""
FIRST = np.array([6.0, -66.0, 3.8, 0.076, 0.085])
"""N, Nm and m at 126 degrees."""


@lru_cache
def along_the_path(mu: float) -> list[Touch]:
    """Each angle from the three before; friction grows at the first angle."""
    start = FIRST
    for share in np.linspace(0.0, 1.0, 6):
        start = exact(-share * mu, DEGREES[0], start).unknowns
    found: list[Touch] = []
    for degrees in np.linspace(DEGREES[0], DEGREES[-1], (len(DEGREES) - 1) * BETWEEN + 1):
        found.append(exact(-mu, degrees, start))
        before = [one.unknowns for one in found[-3:]]
        start = before[-1]
        if len(before) == 3:
            start = 3.0 * (before[2] - before[1]) + before[0]
    return found[::BETWEEN]


def exact(mu: float, degrees: float, start: np.ndarray) -> Touch:
    pose = SCENE.pose(math.radians(degrees))
    centre = np.array([pose.target_x, pose.target_y])
    return shooting_surface.solve(Finger(mu=mu), math.radians(degrees), centre, start)


def test_ipopt_converges_to_it() -> None:
    """On N = 90, 180, 360 intervals, by a program that shares nothing with either."""
    from support import DATA

    found = dict(zip(DEGREES, along_the_path(0.0), strict=True))
    table = pd.read_csv(DATA / "ipopt_rubber_ellipse.csv")
    errors = []
    for case in ("N = 90", "N = 360"):
        rows = table[table["case"] == case]
        theirs = rows[["force_x_N", "force_y_N"]].to_numpy()
        ours = np.array([found[round(d)].force for d in np.degrees(rows["position"])])
        errors.append((np.hypot(*(theirs - ours).T) / np.hypot(*ours.T)).max())
    assert errors[0] < 5e-3
    assert errors[1] < errors[0] / 8.0


@pytest.mark.compiled
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_the_package_converges_to_it(mu: float) -> None:
    truth = np.array([one.force for one in along_the_path(mu)])
    errors = []
    for intervals in (90, 720, 5760):
        scene = SCENE.replace({"solver.intervals": intervals, "friction.mu": mu})
        frame = fastncm.solve(scene, positions=np.radians(DEGREES)).frame()
        assert (frame["status"] == "converged").all()
        forces = frame[["force_x_N", "force_y_N"]].to_numpy()
        error = np.hypot(*(forces - truth).T) / np.hypot(*truth.T)
        assert (error <= 10.0 * frame["error_estimate"]).all()
        errors.append(error.max())
    assert errors[0] < 1e-2
    assert errors[1] < errors[0] / 20.0
    assert errors[2] < 2e-6


@pytest.mark.compiled
def test_where_it_touches() -> None:
    touch = along_the_path(0.0)
    scene = SCENE.replace({"solver.intervals": 1440})
    frame = fastncm.solve(scene, positions=np.radians(DEGREES)).frame()
    ends = np.array([one.s for one in touch])
    np.testing.assert_allclose(frame["contact_from_m"], ends[:, 0], atol=2 * 0.1524 / 1440)
    np.testing.assert_allclose(frame["contact_to_m"], ends[:, 1], atol=2 * 0.1524 / 1440)
    assert min(one.pressure for one in touch) > 0.0
