"""Deformed fingers at chosen positions of the target (Lan & Lee 2008, Figs. 13, 14)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Polygon

from fastncm.curve import Curve
from fastncm.plot.outlines import finger_outline, jaw_outline, target_outline
from fastncm.plot.style import GREY, MARK, empty_figure, open_frame, shown, subtitle

FINGER = "#7fa8c9"
TARGET = "0.86"
TARGET_HEIGHT = 0.2  # what is shown of the target above path.y, in finger lengths at most
ARROW = 0.25  # length of the longest contact force, in finger lengths


def shapes_figure(curve: Curve, rows: Sequence[int]) -> Figure:
    """Snapshots at the given rows, two in a line."""
    lines = -(-len(rows) // 2)
    figure = empty_figure(8.0, lines * height_of_line(curve, rows, 4.0))
    draw_shapes(figure, curve, rows)
    return figure


def height_of_line(curve: Curve, rows: Sequence[int], width: float) -> float:
    """Height in inches that a snapshot `width` inches wide needs, with its labels."""
    (left, right), (bottom, top) = _window(curve, rows)
    return 0.7 + (width - 0.6) * (top - bottom) / (right - left)


def draw_shapes(figure: Figure | SubFigure, curve: Curve, rows: Sequence[int]) -> None:
    """Snapshots, two in a line, in one window and with the forces to one scale."""
    axes = figure.subplots(-(-len(rows) // 2), 2, squeeze=False, sharex=True, sharey=True)
    frame = curve.frame().iloc[list(rows)]
    largest = np.nanmax(np.hypot(frame["force_x_N"], frame["force_y_N"]), initial=0.0)
    scale = ARROW * curve.scene.finger.length / largest if largest > 0 else 0.0
    window = _window(curve, rows)
    for ax, row in zip(axes.flat, rows, strict=False):
        open_frame(ax)
        ax.set(xlim=window[0], ylim=window[1], aspect="equal")
        draw_shape(ax, curve, row, scale)
    for ax in axes.flat[len(rows) :]:
        ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel("y / mm")
    for ax in axes[-1]:
        ax.set_xlabel("x / mm")


def draw_shape(ax: Axes, curve: Curve, row: int, force_scale: float) -> None:
    """Finger, jaw, target and contact forces at one row of a curve; axes in mm.

    force_scale: length of an arrow in m per N.
    """
    scene = curve.scene
    shape = curve.shape(row)
    result = curve.frame().iloc[row]
    target = target_outline(scene, result["position"], reach=2 * scene.finger.length)
    ax.add_patch(Polygon(1e3 * target, facecolor=TARGET, edgecolor=GREY, linewidth=0.8))
    for outline in (finger_outline(scene, shape), jaw_outline(scene, shape)):
        ax.add_patch(Polygon(1e3 * outline, facecolor=FINGER, edgecolor="black", linewidth=0.6))
    clamp = 1e3 * scene.finger.length * np.array([-0.1, 0.1])
    ax.plot([0, 0], clamp, color="black", linewidth=2)
    for contact in curve.contacts(row).itertuples():
        point = np.array([contact.x_m, contact.y_m])
        force = force_scale * np.array([contact.force_x_N, contact.force_y_N])
        ax.annotate(
            "",
            xy=tuple(1e3 * (point + force)),
            xytext=tuple(1e3 * point),
            arrowprops={"arrowstyle": "-|>", "color": MARK, "linewidth": 1.2, "shrinkA": 0},
        )
    at = f"target at {shown('position', result['position']):.2f} mm"
    force_N = round(result["insertion_force_N"], 3) + 0.0  # no -0.000
    subtitle(ax, f"{at}, insertion force {force_N:.3f} N")


def _window(curve: Curve, rows: Sequence[int]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits in mm that hold the finger at all rows, and the target's near part."""
    scene = curve.scene
    shapes = [curve.shape(row) for row in rows]
    points = np.concatenate(
        [outline(scene, shape) for shape in shapes for outline in (finger_outline, jaw_outline)]
    )
    margin = 0.08 * scene.finger.length
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    shown_of_target = min(scene.target.radius or np.inf, TARGET_HEIGHT * scene.finger.length)
    target_top = scene.path.y + shown_of_target + margin
    low, high = 1e3 * low, 1e3 * np.maximum(high, [0.0, target_top])
    return (low[0], high[0]), (low[1], high[1])
