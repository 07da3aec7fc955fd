"""Derivatives along the path with friction, against difference quotients, and the slip's."""

from collections.abc import Callable

import numpy as np
import pytest
from entrance import entrance
from jaws import TARGET_Y, jaw_row, target_row
from scipy.optimize import brentq
from tracing import CIRCLE, CORNER, solved_path

from fastncm.kernels import constants as c
from fastncm.kernels import gap
from fastncm.path import rows
from fastncm.path import slip as slip_module

contact_slip = entrance(slip_module.contact_slip)
feature_gap = entrance(gap.feature_gap)
POSITIONS = {
    CIRCLE: [0.0738, 0.0688, 0.0640, 0.0620, 0.0605],
    CORNER: [0.0725, 0.0672, 0.0600, 0.0575],
}
SHEAR = {"model.shear": True, "finger.thickness": [0.0040, 0.0030]}


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize("changes", [{}, SHEAR])
def test_rates_are_slopes_along_the_path(scene: str, changes: dict[str, object]) -> None:
    step = 3e-6
    for position in POSITIONS[scene]:
        around = [position + step, position, position - step]
        solved = solved_path(scene, 8, {"friction.mu": 0.4, **changes}, positions=around)
        assert solved.converged.all()
        ahead, here, behind = solved.trace.rows[0, :3]
        run = ahead[rows.POSITION] - behind[rows.POSITION]
        for value, rate in (
            (rows.FORCE, rows.FORCE_RATE),
            (rows.RUB, rows.RUB_RATE),
            (rows.NORMAL_X, rows.NORMAL_X_RATE),
            (rows.CONTACT_X, rows.CONTACT_X_RATE),
            (rows.CONTACT_Y, rows.CONTACT_Y_RATE),
        ):
            slope = (ahead[value] - behind[value]) / run
            assert here[rate] == pytest.approx(slope, rel=1e-5, abs=1e-6)


FACE = (np.cos(1.1), np.sin(1.1))
SEGMENT = jaw_row((0.0, 0.18), (0.33, 0.03), face=FACE)
CONVEX = jaw_row((0.0, 0.18), (0.33, 0.03), 0.8, face=FACE)
CONTACTS = [
    (SEGMENT, 0.15, c.ON_EDGE),
    (CONVEX, 0.15, c.ON_EDGE),
    (CONVEX, 0.0, c.ON_EDGE),
    (SEGMENT, 0.15, c.ON_A),
    (SEGMENT, 0.15, c.ON_B),
    (SEGMENT, 0.15, c.ON_RETURN),
    (SEGMENT, 0.0, c.FAR_EDGE),
    (CONVEX, 0.0, c.FAR_EDGE),
    (SEGMENT, 0.0, c.FAR_RETURN),
    (SEGMENT, 0.0, c.A_UNDERSIDE),
    (SEGMENT, 0.0, c.A_FACE),
    (SEGMENT, 0.0, c.A_BACK),
    (CONVEX, 0.0, c.ARC_UNDERSIDE),
]


def closed(distance: Callable[[float], float]) -> float:
    """The first place from below at which the gap is closed."""
    places = np.linspace(-1.0, 2.0, 301)
    values = np.array([distance(x) for x in places])
    first = int(np.flatnonzero(values[:-1] * values[1:] < 0.0)[0])
    return float(brentq(distance, places[first], places[first + 1], xtol=1e-15))


@pytest.mark.parametrize(("jaw", "radius", "feature"), CONTACTS)
def test_slip_is_the_way_of_the_targets_surface_along_the_jaw(
    jaw: np.ndarray, radius: float, feature: int
) -> None:
    """Along every motion of the tip that keeps the contact the slip changes by minus the motion of
    the jaw's material along the tangent."""
    target = target_row(radius, 0.1)

    def at(x: float, y: float, psi: float) -> np.ndarray:
        found = feature_gap(feature, jaw, target, 0, 1.2, x, y, np.cos(psi), np.sin(psi))
        return np.array(found)

    psi = -0.1
    along_x = feature in (c.A_FACE, c.A_BACK, c.ON_RETURN, c.FAR_RETURN)
    tip = 0.95 if feature == c.ON_B else 1.1
    start = closed(
        lambda x: at(x, TARGET_Y - 0.1, psi)[c.GAP] if along_x else at(tip, x, psi)[c.GAP]
    )
    start = np.array([start, TARGET_Y - 0.1, psi] if along_x else [tip, start, psi])
    here = at(*start)
    nx, ny = here[c.GX], here[c.GY]
    arm = here[[c.PX, c.PY]] - start[:2]
    tangent = np.array([-ny, nx, arm[0] * nx + arm[1] * ny])
    normal = here[[c.GX, c.GY, c.GP]]
    step = 1e-5
    for direction in np.eye(3):
        way = direction - normal * (normal @ direction) / (normal @ normal)
        slips = []
        for sign in (-1.0, 1.0):
            pose = start + sign * step * way
            for _ in range(3):  # back onto the contact
                found = at(*pose)
                gradient = found[[c.GX, c.GY, c.GP]]
                pose = pose - found[c.GAP] * gradient / (gradient @ gradient)
            slips.append(contact_slip(jaw, target, 0, at(*pose), 1.2, *pose))
        slope = (slips[1] - slips[0]) / (2.0 * step)
        assert slope == pytest.approx(-tangent @ way, abs=1e-8)
