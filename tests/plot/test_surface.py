"""Pictures of direct contact, checked on the figures' own data."""

import math

import numpy as np
import pytest

from fastncm.curve import solve
from fastncm.plot import plot_curve, plot_run
from fastncm.plot.outlines import finger_outline, target_outline
from fastncm.plot.shapes import shapes_figure
from fastncm.plot.style import new_figure
from fastncm.plot.surface import draw_field, draw_models, spread_rows, surface_figure
from fastncm.scene import load_scene
from fastncm.sweeping import Study, sweep

RUBBER = load_scene("rubber-ellipse").replace({"path.steps": 13})
PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def curve():
    return solve(RUBBER)


def distance(point, outline):
    """Distance of a point from a closed polygon's line."""
    start, end = outline, np.roll(outline, -1, axis=0)
    along = end - start
    t = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return np.min(np.linalg.norm(start + t[:, None] * along - point, axis=1))


def test_outlines_touch_where_the_solver_says_they_touch(curve):
    """The drawn side meets the drawn ellipse: two independent ways to the same contact."""
    for row in (0, 6, 12):
        contacts = curve.contacts(row)
        assert len(contacts) > 0
        finger = finger_outline(RUBBER, curve.shape(row))
        target = target_outline(RUBBER, curve.frame()["position"].iloc[row], reach=0.1)
        for contact in contacts.itertuples():
            point = np.array([contact.x_m, contact.y_m])
            assert distance(point, finger) < 1e-6
            assert distance(point, target) < 5e-5  # of a polygon with 180 corners


@pytest.mark.parametrize(
    ("changes", "inside", "outside"),
    [
        ({"target.shape": "half-plane", "target.tilt": math.pi / 2}, (0.1, 0.0), (-0.1, 0.0)),
        ({"target.shape": "half-plane"}, (0.0, -0.1), (0.0, 0.1)),
        ({"target.tilt": math.pi / 2}, (0.0, 0.09), (0.09, 0.0)),
        (
            {"target.shape": "polygon", "target.vertices": [[0, 0], [0.1, 0], [0.1, 0.1]]},
            (0.09, 0.01),
            (0.01, 0.09),
        ),
    ],
)
def test_targets_lie_where_the_scene_says(changes, inside, outside):
    scene = RUBBER.replace(changes)
    pose = scene.pose(2.0)
    outline = target_outline(scene, 2.0, reach=0.2) - [pose.target_x, pose.target_y]
    assert winds_around(inside, outline)
    assert not winds_around(outside, outline)


def winds_around(point, outline):
    """Whether a closed polygon goes once around the point."""
    ray = outline - point
    angles = np.unwrap(np.arctan2(*np.vstack([ray, ray[:1]]).T[::-1]))
    return abs(angles[-1] - angles[0]) > np.pi


def test_models_are_drawn_over_degrees(curve):
    _, axes = new_figure(4, 3)
    draw_models(axes[0, 0], curve)
    lines = axes[0, 0].lines
    assert [line.get_label() for line in lines] == ["as solved", "no shear", "1D model"]
    np.testing.assert_allclose(lines[0].get_xdata()[[0, -1]], [126, 78])
    frame = curve.frame()
    np.testing.assert_allclose(
        lines[0].get_ydata(), np.hypot(frame["force_x_N"], frame["force_y_N"])
    )
    assert axes[0, 0].xaxis_inverted()
    # without shear the finger is stiffer, without thickness it is touched further out and less
    assert lines[1].get_ydata().max() > lines[0].get_ydata().max() > lines[2].get_ydata().max()


def test_the_shear_angle_falls_to_zero_at_the_contact(curve):
    _, axes = new_figure(4, 3)
    draw_field(axes[0, 0], curve, [6], "gamma_rad")
    line, dots = axes[0, 0].lines
    frame = curve.frame()
    beyond = line.get_xdata() > 1e3 * frame["contact_to_m"].iloc[6] + 2
    assert abs(line.get_ydata()[beyond]).max() < 1e-6
    assert line.get_ydata().max() > 5  # degrees
    assert len(dots.get_xdata()) == frame["contacts"].iloc[6]


def test_snapshots_say_where_and_how_much(curve):
    rows = spread_rows(curve)
    assert rows == [0, 4, 8, 12]
    titles = [ax.get_title(loc="left") for ax in shapes_figure(curve, rows).axes]
    assert titles[0].startswith("φ = 126.00°\ncontact force")
    assert len(titles) == 4


def test_a_curve_and_what_is_assumed_are_drawn(curve, tmp_path):
    assert plot_curve(curve, tmp_path / "curve.png").read_bytes().startswith(PNG)
    assert "semi-axes" in surface_figure(curve).get_supxlabel()


def test_a_wall_and_no_contact_can_be_drawn(tmp_path):
    wall = {
        "target.shape": "half-plane",
        "target.tilt": math.pi / 2,
        "path.kind": "translation",
        "path.angle": 1.3,
        "path.start": 0.06,
        "path.stop": 0.03,
        "model.shear": False,
    }
    for changes in (wall, {"path.y": 0.5}):
        picture = plot_curve(solve(RUBBER.replace(changes)), tmp_path / "picture.png")
        assert picture.read_bytes().startswith(PNG)


def test_a_run_gets_the_pictures_of_direct_contact(tmp_path):
    axes = {"path.y": [0.12, 0.12065], "finger.young": [4.8e6, 6e6]}
    run = sweep(Study(RUBBER, axes), tmp_path / "out", jobs=1)
    names = {picture.name for picture in plot_run(run.out)}
    assert {"models.png", "angles.png", "shapes.png", "curves_path_y.png"} <= names
