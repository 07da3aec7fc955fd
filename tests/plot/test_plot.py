"""Pictures: what they show, checked on the figures' own data rather than on pixels."""

import matplotlib
import numpy as np
import pytest

from fastncm.curve import solve
from fastncm.plot import plot_curve, plot_run
from fastncm.plot.chart import by_importance, chosen, line_chart, map_chart
from fastncm.plot.curves import PALE, curves_figure, draw_curve, line_through_events, ways
from fastncm.plot.outlines import contour, finger_outline, jaw_outline, target_outline
from fastncm.plot.run import snapshot_rows
from fastncm.plot.shapes import shapes_figure
from fastncm.plot.style import label, new_figure, shown, value_label
from fastncm.scene import load_scene
from fastncm.sweeping import Report, Study, load, sweep

CIRCLE = load_scene("snapfit-circle")
CORNER = load_scene("snapfit-corner")
PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def curves():
    return {scene.name: solve(scene) for scene in (CIRCLE, CORNER)}


@pytest.fixture(scope="module")
def charted(tmp_path_factory):
    axes = {
        "friction.mu": [0.0, 0.2, 0.4],
        "finger.thickness": {"linspace": [0.0022, 0.0042, 5]},
        "jaw.height": {"linspace": [0.0079, 0.0099, 3]},
    }
    study = Study(CIRCLE, axes, report=Report("peak_force_N", "max", {"max_strain": 0.015}))
    return sweep(study, tmp_path_factory.mktemp("charted") / "out", jobs=1)


def test_axis_labels_carry_page_units():
    assert label("finger.thickness") == "thickness w / mm"
    assert label("peak_force_N") == "peak insertion force / N"
    assert label("friction.mu") == "friction coefficient μ"
    assert shown("jaw.lead_angle", np.pi / 6) == pytest.approx(30)
    assert value_label("jaw.height", 0.0089) == "8.9 mm"
    assert value_label("finger.thickness", (0.03, 0.017)) == "(30, 17) mm"
    assert value_label("model.shear", True) == "model.shear = True"
    assert value_label("model.section", "psi") == "model.section = psi"


def test_chosen_indices_are_evenly_spaced_where_possible():
    assert chosen(3, 5) == [0, 1, 2]
    assert chosen(21, 5) == [0, 5, 10, 15, 20]
    assert chosen(9, 7) == [0, 2, 4, 6, 8]
    assert chosen(8, 5) == [0, 2, 4, 5, 7]
    assert chosen(1, 5) == [0]


def test_thickness_comes_first_and_friction_last():
    axes = ["friction.mu", "jaw.height", "finger.thickness"]
    assert by_importance(axes) == ["finger.thickness", "jaw.height", "friction.mu"]


def test_the_force_line_passes_through_the_located_peak(curves):
    for curve in curves.values():
        position, force = line_through_events(curve)
        assert (np.diff(position) <= 0).all()
        assert np.nanmax(force) == pytest.approx(curve.peak.insertion_force_N, rel=1e-12)
        assert position[np.nanargmax(force)] == pytest.approx(curve.peak.position, rel=1e-12)


def test_a_path_in_and_out_is_drawn_in_its_order():
    """Two ways, each with positions in one sense and with its own peak; the second one pale."""
    curve = solve(CIRCLE.replace({"friction.mu": 0.3, "path.withdraw": True}))
    position, force = line_through_events(curve)
    there, back = ways(position)
    assert (np.diff(position[there]) <= 0).all()
    assert (np.diff(position[back]) >= 0).all()
    assert force[there].max() == pytest.approx(curve.peak.insertion_force_N, rel=1e-12)
    assert force[back][1:].max() == pytest.approx(curve.retention.insertion_force_N, rel=1e-12)
    figure, axes = new_figure(4, 3)
    draw_curve(axes[0, 0], curve)
    assert [line.get_alpha() for line in axes[0, 0].lines[:2]] == [1.0, PALE]
    titles = [ax.get_title(loc="left") for ax in shapes_figure(curve, snapshot_rows(curve)).axes]
    assert sum("target back at" in title for title in titles) == 3


def test_failed_rows_get_no_snapshot():
    """Friction locks: a place that is not reached has no shape."""
    curve = solve(CIRCLE.replace({"friction.mu": 2.5, "path.withdraw": True}))
    status = curve.frame()["status"]
    assert (status == "no_equilibrium").any()
    assert status.iloc[snapshot_rows(curve)].isin(["converged", "no_contact"]).all()


def test_curves_are_in_millimetres_and_named(curves):
    figure = curves_figure({"straight": curves["snapfit-circle"]}, "jaw", "everything else")
    ax = figure.axes[0]
    assert ax.xaxis_inverted()
    line = ax.lines[0]
    assert line.get_xdata()[0] == pytest.approx(78.162, abs=0.01)
    assert max(line.get_ydata()) == pytest.approx(5.817, rel=1e-3)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["straight"]
    assert ax.get_title(loc="left") == "everything else"


@pytest.mark.parametrize("convex", [True, False])
def test_an_arc_has_its_radius_and_bulges_to_its_side(convex):
    jaw = CORNER.replace({"jaw.convex": convex}).jaw
    points = contour(jaw)
    np.testing.assert_allclose(points[[0, -1]], [jaw.a, jaw.b], atol=1e-15)
    chord = np.subtract(jaw.b, jaw.a)
    left = np.array([-chord[1], chord[0]])
    side = (points[1:-1] - jaw.a) @ left
    assert (side > 0).all() if convex else (side < 0).all()
    first, middle, last = points[0], points[len(points) // 2], points[-1]
    sides = [np.linalg.norm(p - q) for p, q in ((first, middle), (middle, last), (last, first))]
    twice_area = abs(np.cross([*(middle - first), 0], [*(last - first), 0])[2])
    assert np.prod(sides) / (2 * twice_area) == pytest.approx(jaw.radius, rel=1e-9)


def test_outlines_touch_where_the_solver_says_they_touch(curves):
    """The drawn jaw meets the drawn target: two independent ways to the same contact."""
    for curve in curves.values():
        scene = curve.scene
        for row in snapshot_rows(curve):
            contacts = curve.contacts(row)
            shape = curve.shape(row)
            position = curve.frame()["position"].iloc[row]
            for contact in contacts.itertuples():
                point = np.array([contact.x_m, contact.y_m])
                jaw = jaw_outline(scene, shape)
                target = target_outline(scene, position, reach=0.1)
                assert distance(point, jaw) < 2e-5
                assert distance(point, target) < 2e-5


def distance(point, outline):
    """Distance of a point from a closed polygon's line."""
    start, end = outline, np.roll(outline, -1, axis=0)
    along = end - start
    t = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return np.min(np.linalg.norm(start + t[:, None] * along - point, axis=1))


def test_the_finger_is_as_thick_as_it_is():
    scene = CIRCLE.replace({"finger.thickness": [0.004, 0.002]})
    shape = solve(scene).shape(20)
    outline = finger_outline(scene, shape)
    upper, lower = np.split(outline, 2)
    thickness = np.linalg.norm(upper - lower[::-1], axis=1)
    np.testing.assert_allclose(thickness[[0, -1]], [0.004, 0.002], rtol=1e-12)


def test_snapshots_include_the_moment_before_the_peak(curves):
    for curve in curves.values():
        position = curve.frame()["position"].to_numpy()
        rows = snapshot_rows(curve)
        before = position[position >= curve.peak.position].min()
        assert before in position[rows]
        assert len(rows) == 4
        figure = shapes_figure(curve, rows)
        titles = [ax.get_title(loc="left") for ax in figure.axes]
        assert all("target at" in title and title.endswith("N") for title in titles)


def test_the_chart_has_one_line_per_height(charted):
    frame = load(charted.out).query("`friction.mu` == 0.0")
    figure = line_chart(frame, "peak_force_N", "finger.thickness", "jaw.height", "μ 0")
    ax = figure.axes[0]
    assert len(ax.lines) == 3
    for line, (_, rows) in zip(ax.lines, frame.groupby("jaw.height"), strict=True):
        np.testing.assert_allclose(line.get_xdata(), 1e3 * rows["finger.thickness"])
        np.testing.assert_array_equal(line.get_ydata(), rows["peak_force_N"])


def test_failed_designs_are_gaps(charted):
    frame = load(charted.out).query("`friction.mu` == 0.0 and `jaw.height` == 0.0079").copy()
    frame.loc[frame.index[2], "status"] = "max_iterations"
    line = line_chart(frame, "peak_force_N", "finger.thickness", None, "").axes[0].lines[0]
    assert np.isnan(line.get_ydata()).tolist() == [False, False, True, False, False]


def test_the_map_says_what_is_hatched(charted):
    frame = load(charted.out).query("`friction.mu` == 0.0")
    arguments = (frame, "peak_force_N", "finger.thickness", "jaw.height")
    middle = frame["max_strain"].median()
    title = map_chart(*arguments, {"max_strain": middle}, "μ 0").axes[0].get_title(loc="left")
    assert title == f"μ 0; hatched: largest strain above {middle:g}"
    assert map_chart(*arguments, {"max_strain": 1.0}, "").axes[0].get_title(loc="left") == ""


def test_a_run_gets_the_pictures_of_its_axes(charted):
    pictures = plot_run(charted.out)
    assert {picture.name for picture in pictures} == {
        "design_chart.png",
        "design_map.png",
        "curves_friction_mu.png",
        "curves_finger_thickness.png",
        "curves_jaw_height.png",
        "shapes.png",
    }
    assert all(picture.read_bytes().startswith(PNG) for picture in pictures)


def test_axes_without_numbers_get_curves_but_no_chart(tmp_path):
    study = Study(CORNER, {"jaw.convex": [True, False], "path.y": [0.0026]})
    pictures = plot_run(sweep(study, tmp_path / "out", jobs=1).out)
    assert [picture.name for picture in pictures] == [
        "curves_jaw_convex.png",
        "curves_path_y.png",
        "shapes.png",
    ]


def test_a_curve_without_contact_can_be_drawn(tmp_path):
    curve = solve(CIRCLE.replace({"path.y": 0.03}))
    assert plot_curve(curve, tmp_path / "nothing.png").read_bytes().startswith(PNG)


def test_a_curve_is_drawn_without_global_state(curves, tmp_path):
    before = matplotlib.get_backend()
    file = plot_curve(curves["snapfit-circle"], tmp_path / "curve.png")
    assert file.read_bytes().startswith(PNG)
    assert matplotlib.get_backend() == before
