"""Deformed fingers at chosen positions of the target (Lan & Lee 2008, Figs. 5, 13, 14)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Polygon

from fastncm.curve import Curve
from fastncm.plot.curves import is_on_way_back
from fastncm.plot.outlines import finger_outline, jaw_outline, target_outline
from fastncm.plot.style import (
    GREY,
    MARK,
    empty_figure,
    open_frame,
    position_name,
    shown,
    subtitle,
)
from fastncm.sweeping.read import GOOD_STATUS

FINGER = "#7fa8c9"
TARGET = "0.86"
TARGET_HEIGHT = 0.2  # what is shown of a jaw's target above path.y, in finger lengths at most
TARGET_MARGIN = 0.3  # what is shown of a target around a finger in direct contact, likewise
ARROW = 0.25  # length of the longest contact force, in finger lengths
HATCH = 0.1  # half the width of the clamp's line, in finger lengths


def solved_rows(curve: Curve) -> np.ndarray:
    """The rows that there are shapes of; all, where none is solved."""
    solved = np.flatnonzero(curve.frame()["status"].isin(GOOD_STATUS))
    return solved if len(solved) else np.arange(len(curve))


def shapes_figure(curve: Curve, rows: Sequence[int]) -> Figure:
    """Snapshots at the given rows."""
    figure = empty_figure(8.0, height_of_shapes(curve, rows, 8.0))
    draw_shapes(figure, curve, rows)
    return figure


def height_of_shapes(curve: Curve, rows: Sequence[int], width: float) -> float:
    """Height in inches that the snapshots need on `width` inches, with their labels."""
    (left, right), (bottom, top) = _window(curve, rows)
    columns = _columns(curve, rows)
    lines = -(-len(rows) // columns)
    return lines * (0.7 + (width / columns - 0.6) * (top - bottom) / (right - left))


def draw_shapes(figure: Figure | SubFigure, curve: Curve, rows: Sequence[int]) -> None:
    """Snapshots in one window and with the forces to one scale."""
    columns = _columns(curve, rows)
    axes = figure.subplots(
        -(-len(rows) // columns), columns, squeeze=False, sharex=True, sharey=True
    )
    largest = max((_largest_arrow(curve, row) for row in rows), default=0.0)
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
    outlines = [finger_outline(scene, shape)]
    if scene.jaw is not None:
        outlines.append(jaw_outline(scene, shape))
    for outline in outlines:
        ax.add_patch(Polygon(1e3 * outline, facecolor=FINGER, edgecolor="black", linewidth=0.6))
    _draw_clamp(ax, curve, result["position"])
    _draw_forces(ax, curve, row, force_scale)
    subtitle(ax, _title(curve, row, result))


def _title(curve: Curve, row: int, result: object) -> str:
    """Where the snapshot is on the path, and the force there."""
    unit, back = position_name(curve.scene), is_on_way_back(curve, row)
    at = f"{shown(unit, result['position']):.2f}"  # type: ignore[index]
    where = f"target {'back ' if back else ''}at {at} mm"
    if unit == "base_angle":
        where = f"φ = {at}°{' on the way back' if back else ''}"
    if result["status"] not in GOOD_STATUS:  # type: ignore[index]
        return f"{where}, {result['status']}"  # type: ignore[index]
    if curve.scene.jaw is None:
        force = np.hypot(result["force_x_N"], result["force_y_N"])  # type: ignore[index]
        return f"{where}\ncontact force {force:.4g} N"
    force_N = round(result["insertion_force_N"], 3) + 0.0  # type: ignore[index]  # no -0.000
    return f"{where}, insertion force {force_N:.3f} N"


def _draw_clamp(ax: Axes, curve: Curve, position: float) -> None:
    """The base as a line across the clamp, and the arm from its pivot."""
    finger, angle = curve.scene.finger, curve.scene.pose(position).base_angle
    along = np.array([np.cos(angle), np.sin(angle)])
    across = HATCH * finger.length * np.array([-along[1], along[0]])
    clamp = finger.offset * along
    ax.plot(*(1e3 * np.array([clamp - across, clamp + across])).T, color="black", linewidth=2)
    if finger.offset:
        ax.plot(*(1e3 * np.array([[0.0, 0.0], clamp])).T, color="black", linewidth=1)
        ax.plot(0, 0, "o", color="black", markersize=3)


def _draw_forces(ax: Axes, curve: Curve, row: int, scale: float) -> None:
    """One contact is an arrow that begins at its point; several are lines that end there, as the
    load that they are."""
    contacts = curve.contacts(row)
    points = 1e3 * contacts[["x_m", "y_m"]].to_numpy()
    forces = 1e3 * scale * contacts[["force_x_N", "force_y_N"]].to_numpy()
    if curve.scene.jaw is None:
        lines = np.stack([points - forces, points], axis=1)
        ax.add_collection(LineCollection(list(lines), colors=[MARK], linewidths=0.8))
        ax.plot(*(points - forces).T, color=MARK, linewidth=0.8)
        return
    for point, force in zip(points, forces, strict=True):
        ax.annotate(
            "",
            xy=tuple(point + force),
            xytext=tuple(point),
            arrowprops={"arrowstyle": "-|>", "color": MARK, "linewidth": 1.2, "shrinkA": 0},
        )


def _largest_arrow(curve: Curve, row: int) -> float:
    """The largest force at a contact point of a row, in N."""
    contacts = curve.contacts(row)
    forces = np.hypot(*contacts[["force_x_N", "force_y_N"]].to_numpy().T)
    return float(np.nanmax(forces, initial=0.0))


def _columns(curve: Curve, rows: Sequence[int]) -> int:
    """Snapshots in a line: two, or four where they are narrow."""
    (left, right), (bottom, top) = _window(curve, rows)
    return 2 if top - bottom < 1.3 * (right - left) else 4


def _window(curve: Curve, rows: Sequence[int]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits in mm that hold the finger at all rows, and the target's near part."""
    scene = curve.scene
    shapes = [curve.shape(row) for row in rows]
    points = np.concatenate(
        [outline(scene, shape) for shape in shapes for outline in (finger_outline, jaw_outline)]
    )
    margin = 0.08 * scene.finger.length
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    if scene.jaw is None:
        near = TARGET_MARGIN * scene.finger.length
        positions = curve.frame()["position"].iloc[list(rows)]
        targets = np.concatenate([target_outline(scene, x, scene.finger.length) for x in positions])
        wide = np.stack([targets.min(axis=0) - margin, targets.max(axis=0) + margin])
        low = np.minimum(low, np.maximum(wide[0], low - near))
        high = np.maximum(high, np.minimum(wide[1], high + near))
        low, high = np.minimum(low, -margin), np.maximum(high, margin)  # the pivot
        return (1e3 * low[0], 1e3 * high[0]), (1e3 * low[1], 1e3 * high[1])
    shown_of_target = min(scene.target.radius or np.inf, TARGET_HEIGHT * scene.finger.length)
    target_top = scene.path.y + shown_of_target + margin
    farthest = curve.frame()["position"].iloc[list(rows)].max() + (scene.target.radius or 0.0)
    low, high = 1e3 * low, 1e3 * np.maximum(high, [farthest + margin, target_top])
    return (low[0], high[0]), (low[1], high[1])
