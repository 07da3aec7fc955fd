"""First touch of the undeformed finger: known by geometry, and by shifting outlines until they
meet."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import fastncm
from fastncm.direct.lowering import lower_surface
from fastncm.direct.touch import first_touches
from fastncm.plot.outlines import target_outline
from fastncm.scene import load_scene, tabulate

FINGER = load_scene("rubber-ellipse").replace(
    {
        "path.kind": "translation",
        "path.angle": math.pi / 2,
        "path.start": "touch",
        "path.stop": -0.05,
        "finger.thickness": 0.02,
    }
)
"""A finger of uniform thickness that stands upright; its right side is at x = 0.01."""


def touch(changes):
    (group,) = tabulate(FINGER.replace(changes), {})
    return first_touches(group)[0]


def test_a_circle_beside_the_finger():
    """A node stands at the height of the centre."""
    circle = {"target.shape": "circle", "target.radius": 0.03, "path.y": 0.0254 + 0.0762}
    assert touch(circle) == pytest.approx(0.04, abs=1e-15)
    # without thickness the axis touches
    assert touch(circle | {"model.surface": "axis"}) == pytest.approx(0.03, abs=1e-15)


def test_a_circle_above_the_tip_touches_its_corner():
    tip = 0.0254 + 0.1524
    circle = {"target.shape": "circle", "target.radius": 0.03, "path.y": tip + 0.018}
    assert touch(circle) == pytest.approx(0.01 + 0.024, abs=1e-15)
    left = circle | {"finger.side": "left"}  # the tip's other corner
    assert touch(left) == pytest.approx(0.01 + 0.024, abs=1e-15)


def test_a_wall():
    wall = {"target.shape": "half-plane", "target.tilt": math.pi / 2}
    assert touch(wall) == pytest.approx(0.01, abs=1e-15)
    # tilted by 0.1 it leans over: the tip's corner touches first
    leaning = touch(wall | {"target.tilt": math.pi / 2 + 0.1})
    height = 0.0254 + 0.1524 - FINGER.path.y
    assert leaning == pytest.approx(0.01 + math.tan(0.1) * height, abs=1e-15)


def test_a_polygons_corner_touches_between_nodes():
    diamond = [[-0.02, 0.0], [0.0, -0.02], [0.02, 0.0], [0.0, 0.02]]
    changes = {"target.shape": "polygon", "target.vertices": diamond, "path.y": 0.1}
    assert touch(changes | {"solver.intervals": 7}) == pytest.approx(0.03, abs=1e-15)


def test_where_nothing_touches_the_path_starts_a_length_before_its_end():
    assert touch({"path.y": 0.5}) == pytest.approx(-0.05 + 0.1524)
    late = {"target.shape": "circle", "target.radius": 0.01, "path.stop": 0.05}
    assert touch(late) == pytest.approx(0.05 + 0.1524)


@pytest.mark.parametrize(
    "changes",
    [
        {"target.tilt": 0.4},
        {"target.tilt": -0.7, "path.y": 0.2, "path.angle": 1.2},
        {"finger.thickness": [0.03, 0.01], "path.angle": 1.9, "path.y": 0.15},
        {
            "target.shape": "polygon",
            "target.vertices": [[0, 0], [0.03, -0.02], [0.05, 0.03]],
            "path.angle": 1.4,
        },
    ],
)
def test_just_before_nothing_overlaps_and_just_after_something_does(changes):
    scene = FINGER.replace(changes | {"solver.intervals": 2000})
    (group,) = tabulate(scene, {})
    position = first_touches(group)[0]
    assert not overlaps(scene, position + 1e-5)
    assert overlaps(scene, position - 1e-4)


FOOT, HALF = 0.0254 + 0.0762, 0.01
TURNING = {
    "path.kind": "rotation",
    "path.start": "touch",
    "path.stop": 1.0,
    "path.x": 0.0,
    "path.speed_ratio": 0.0,
    "finger.thickness": 2.0 * HALF,
}


def turned_touch(changes):
    scene = load_scene("rubber-ellipse").replace(TURNING | changes)
    lowered = lower_surface(tabulate(scene, {})[0])
    assert lowered.positions[0, -1] == scene.path.stop
    return lowered.positions[0, 0]


@pytest.mark.compiled
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_turning_finger_touches_a_circle(side):
    """The side is a tangent, at a node: the axis passes the centre at the sum of the radius and
    half the thickness."""
    radius = 0.03
    far = math.hypot(FOOT, radius + HALF)
    aside = math.asin((radius + HALF) / far)
    up = 1.0 if side == "right" else -1.0
    circle = {"target.shape": "circle", "target.radius": radius, "path.y": far}
    stop = 0.5 * math.pi - 0.3 * up
    found = turned_touch(circle | {"finger.side": side, "path.stop": stop})
    assert found == pytest.approx(0.5 * math.pi + up * aside, abs=1e-9)
    # from behind it, too
    beyond = 0.5 * math.pi - 1.5 * up
    found = turned_touch(circle | {"finger.side": side, "path.stop": beyond})
    assert found == pytest.approx(0.5 * math.pi + up * aside, abs=1e-9)


@pytest.mark.compiled
@pytest.mark.parametrize("speed", [0.0, -0.0323, 0.05])
def test_a_turning_finger_touches_with_its_tip_or_a_corner(speed):
    """Of targets that move meanwhile, Lan & Lee 2008, eq. (18)."""
    tip, radius = 0.0254 + 0.1524, 0.03

    def centre(base):
        return np.array([speed * (base - 0.5 * math.pi), tip + 0.02])

    def circle_gap(base):
        along = np.array([math.cos(base), math.sin(base)])
        corner = tip * along + HALF * np.array([along[1], -along[0]])
        return np.linalg.norm(corner - centre(base)) - radius

    circle = {"target.shape": "circle", "target.radius": radius, "path.y": tip + 0.02}
    found = turned_touch(circle | {"path.speed_ratio": speed, "path.stop": 1.5})
    assert found == pytest.approx(brentq(circle_gap, 1.6, 2.2, xtol=1e-13), abs=1e-9)

    def corner_gap(base):
        x, y = speed * (base - 0.5 * math.pi) + 0.01, 0.11
        return (math.cos(base) * y - math.sin(base) * x) + HALF

    # its left side lies against the right side of the finger: the corner's distance from the axis
    diamond = [[0.01, 0.0], [0.03, -0.02], [0.05, 0.0], [0.03, 0.02]]
    changes = {"target.shape": "polygon", "target.vertices": diamond, "path.y": 0.11}
    found = turned_touch(changes | {"path.speed_ratio": speed, "path.stop": 1.3})
    assert found == pytest.approx(brentq(corner_gap, 1.3, 2.0, xtol=1e-13), abs=1e-9)


@pytest.mark.compiled
def test_where_a_turning_finger_never_touches_it_starts_a_radian_before():
    far = {"target.shape": "circle", "target.radius": 0.01, "path.y": 0.5}
    assert turned_touch(far) == pytest.approx(2.0)
    assert turned_touch(far | {"finger.side": "left"}) == pytest.approx(0.0)


@pytest.mark.compiled
def test_a_sweep_from_first_touch():
    """Each case from its own; scaling the scene leaves it."""
    lengths = np.array([0.06731, 0.07])
    group = tabulate(
        load_scene("rubber-ellipse").replace({"path.start": "touch"}),
        {"path.y": lengths + 0.05},
    )[0]
    lowered = lower_surface(group)
    start = lowered.positions[lowered.problem_of, 0]
    assert start[0] != start[1]
    for y, found in zip(lengths + 0.05, start, strict=True):
        alone = load_scene("rubber-ellipse").replace({"path.start": "touch", "path.y": y})
        assert fastncm.solve(alone).frame()["position"][0] == pytest.approx(found, abs=1e-12)


def overlaps(scene, position):
    """Whether points of the finger's right side lie in the target, or the other way round."""
    s = np.linspace(0.0, scene.finger.length, 4001)
    half = np.interp(s, *np.transpose(scene.finger.stations)) / 2
    angle = scene.path.angle
    axis = (scene.finger.offset + s)[:, None] * [np.cos(angle), np.sin(angle)]
    right = half[:, None] * [np.sin(angle), -np.cos(angle)]
    finger = np.concatenate([axis + right, (axis - right)[::-1]])
    target = target_outline(scene, position, reach=1.0)
    return inside(finger, target) or inside(target, finger)


def inside(points, outline):
    """Whether any of the points lies within a closed polygon."""
    x, y = points.T
    start, end = outline, np.roll(outline, -1, axis=0)
    crossed = (start[:, 1] > y[:, None]) != (end[:, 1] > y[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
        at = start[:, 0] + slope * (y[:, None] - start[:, 1])
    return bool(((crossed & (x[:, None] < at)).sum(axis=1) % 2).any())
