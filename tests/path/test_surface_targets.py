"""Targets of other shapes and forms of the constraints against each other and beam theory."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from surfaces import RUBBER, Solved, lowered_surface, solved_surface

pytestmark = pytest.mark.compiled
ANGLES = np.radians([120.0, 102.0, 84.0])
LENGTH, OFFSET = RUBBER.finger.length, RUBBER.finger.offset
THICK = 0.01
TILT = 0.05


def relative_error(solved: Solved, truth: Solved) -> float:
    assert solved.converged.all()
    return float(
        (
            np.linalg.norm(solved.force - truth.force, axis=1) / np.linalg.norm(truth.force, axis=1)
        ).max()
    )


def test_points_of_the_target_converge_to_points_of_the_finger() -> None:
    """(10b) becomes (10a) with M; what is left is the discretisation of the axis."""
    truth = solved_surface({"solver.intervals": 1440}, ANGLES)
    form = {"solver.contact": "points-on-target"}
    errors = [
        relative_error(
            solved_surface(form | {"solver.intervals": n, "solver.points": m}, ANGLES), truth
        )
        for n, m in ((90, 150), (360, 600), (1440, 2400))
    ]
    assert errors[1] < 0.4 * errors[0]  # of first order: four times as many points, a quarter
    assert errors[2] < 0.4 * errors[1]


@pytest.mark.parametrize("contact", ["closest", "points-on-finger"])
def test_a_many_sided_polygon_becomes_the_ellipse(contact: str) -> None:
    a, b = RUBBER.target.semi_axes
    fine = {"solver.intervals": 360, "solver.contact": contact}
    truth = solved_surface({"solver.intervals": 1440}, ANGLES)
    errors = []
    for sides in (30, 120, 480, 1920):
        t = 2.0 * np.pi * np.arange(sides) / sides
        vertices = np.column_stack([a * np.cos(t), b * np.sin(t)]).tolist()
        target = {"target.shape": "polygon", "target.vertices": vertices}
        errors.append(relative_error(solved_surface(fine | target, ANGLES), truth))
    assert errors[2] < 2e-3
    assert errors[2] < 0.05 * errors[0]
    assert errors[3] < errors[2]


def test_which_corners_are_contact_points() -> None:
    """Those that the finger's nodes would not see: of few sides all, of a fine outline none, of a
    fillet that is shorter than an interval all."""

    def corners(vertices: np.ndarray) -> int:
        target = {"target.shape": "polygon", "target.vertices": vertices.tolist()}
        return lowered_surface(target).problem.points.shape[1]

    def outline(sides: int) -> np.ndarray:
        t = 2.0 * np.pi * np.arange(sides) / sides
        return 0.07 * np.column_stack([np.cos(t), np.sin(t)])

    assert [corners(outline(sides)) for sides in (4, 60, 2000)] == [4, 60, 0]
    quarter = np.linspace(0.0, 0.5 * np.pi, 6)
    t = np.concatenate([quarter + 0.5 * np.pi * k for k in range(4)])
    middles = np.repeat([[0.05, 0.05], [-0.05, 0.05], [-0.05, -0.05], [0.05, -0.05]], 6, axis=0)
    assert corners(middles + 0.0005 * np.column_stack([np.cos(t), np.sin(t)])) == 24


def test_sharp_ends_are_on_the_ellipse_and_blunt_ones_are_not_needed() -> None:
    """Where the radius of curvature, (a b)^2 / (b^2 cos^2 + a^2 sin^2)^1.5 at the end of a, is
    below an interval, and nowhere where it is not; a last one on each side is more than half an
    interval away, where nodes touch."""
    finger = RUBBER.finger.length

    def points(a: float, b: float) -> np.ndarray:
        return lowered_surface({"target.semi_axes": [a, b]}).problem.points[0] * finger

    interval = finger / RUBBER.solver.intervals
    assert len(points(0.07, 0.05)) == 0
    for a, b in ((0.07, 0.002), (0.002, 0.07), (0.0008, 0.001)):
        found = points(a, b)
        np.testing.assert_allclose((found / [a, b]) ** 2 @ [1.0, 1.0], 1.0, rtol=1e-12)
        ends = [[a, 0.0], [-a, 0.0]] if a > b else [[0.0, b], [0.0, -b]]
        for end in ends:
            assert np.hypot(*(found - end).T).min() < 1e-12
        normal = found / [a * a, b * b]
        radius = (a * b) ** 2 * np.hypot(*normal.T) ** 3
        assert radius.min() < interval
        apart = np.hypot(*np.diff(found[: len(found) // 2], axis=0).T)
        assert apart[1:-1].max() < 0.5 * interval
        assert apart[[0, -1]].max() < 0.61 * interval


def test_a_circle_is_an_ellipse_with_equal_axes() -> None:
    circle = solved_surface({"target.shape": "circle", "target.radius": 0.07}, ANGLES)
    ellipse = solved_surface({"target.semi_axes": [0.07, 0.07 * (1.0 + 1e-9)]}, ANGLES)
    np.testing.assert_allclose(circle.force, ellipse.force, rtol=1e-6)


def test_a_turned_ellipse_is_the_one_with_swapped_axes() -> None:
    a, b = RUBBER.target.semi_axes
    upright = solved_surface({}, ANGLES)
    turned = solved_surface({"target.semi_axes": [b, a], "target.tilt": math.pi / 2}, ANGLES)
    np.testing.assert_allclose(turned.force, upright.force, rtol=1e-9)


def plane_under_the_tip(deflection: float, more: dict | None = None) -> Solved:
    """A finger along x, a plane that rises by TILT under its right side, `deflection` (m) above the
    undeformed tip's corner."""
    changes = {
        "finger.thickness": THICK,
        "target.shape": "half-plane",
        "target.tilt": TILT,
        "path.kind": "translation",
        "path.angle": 0.0,
        "path.start": OFFSET + LENGTH,
        "path.stop": OFFSET,
        "path.y": -THICK / 2 + deflection / math.cos(TILT),
        "solver.intervals": 200,
    }
    return solved_surface(changes | (more or {}), [OFFSET + LENGTH])


@pytest.mark.parametrize("shear", [False, True])
def test_tip_on_a_plane_bends_like_a_cantilever(shear: bool) -> None:
    """w = P L^3 / 3 E I + P L / kappa G A, and the couple of P about the tip's axis."""
    solved = plane_under_the_tip(1e-7, {"model.shear": shear})
    finger, c, s = RUBBER.finger, math.cos(TILT), math.sin(TILT)
    inertia, area = finger.width * THICK**3 / 12, finger.width * THICK
    stiffness = finger.young * inertia
    kappa = (5 + 5 * finger.poisson) / (6 + 5 * finger.poisson)
    give = LENGTH**3 / 3 / stiffness + shear * LENGTH / (kappa * finger.shear_modulus * area)
    couple = -s * THICK / 2  # per unit of the force on the plane's normal
    move = c * give + couple * LENGTH**2 / 2 / stiffness
    turn = c * LENGTH**2 / 2 / stiffness + couple * LENGTH / stiffness
    expected = 1e-7 / (c * move - s * THICK / 2 * turn)
    assert solved.contacts[0] == 1
    assert solved.s_from[0] == 1.0
    force = solved.newtons[0] @ [-s, c]
    assert force == pytest.approx(expected, rel=2e-5)
    assert solved.newtons[0] @ [c, s] == pytest.approx(0.0, abs=1e-12 * force)


def test_tip_on_a_plane_is_an_elastica() -> None:
    """Large deflection, without thickness in the contact: SciPy's boundary value problem."""
    deflection = 0.004
    solved = plane_under_the_tip(
        deflection,
        {"model.shear": False, "model.surface": "axis", "path.y": deflection / math.cos(TILT)},
    )
    normal = np.array([-math.sin(TILT), math.cos(TILT)])
    aim = normal @ [1.0, deflection / math.cos(TILT) / LENGTH]

    def slope(_: np.ndarray, z: np.ndarray, p: np.ndarray) -> np.ndarray:
        psi, moment = z[0], z[1]
        return np.vstack(
            [
                moment,
                -p[0] * (np.cos(psi) * normal[1] - np.sin(psi) * normal[0]),
                np.cos(psi),
                np.sin(psi),
            ]
        )

    def ends(at: np.ndarray, to: np.ndarray, _: np.ndarray) -> np.ndarray:
        return np.array([at[0], at[2], at[3], to[1], normal @ to[2:] - aim])

    s = np.linspace(0.0, 1.0, 41)
    start = np.vstack([0.0 * s, 0.1 * (1.0 - s), s, 0.0 * s])
    found = solve_bvp(slope, ends, s, start, p=[0.1], tol=1e-10, max_nodes=10_000)
    assert found.success
    assert solved.contacts[0] == 1
    assert solved.force[0] @ normal == pytest.approx(found.p[0], rel=5e-5)
    assert solved.tip_angle[0] == pytest.approx(found.y[0, -1], rel=5e-5)
