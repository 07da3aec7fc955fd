"""First touch of the undeformed finger: known by geometry, and by shifting outlines until they
meet."""

import math

import numpy as np
import pytest

from fastncm.plot.outlines import target_outline
from fastncm.scene import load_scene, tabulate
from fastncm.surface_touch import first_touches

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
