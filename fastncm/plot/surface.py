"""Pictures of direct contact: force over the position, psi and gamma along the finger, snapshots
(Lan & Lee 2008, Figs. 5, 7 to 9)."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fastncm.curve import Curve, solve
from fastncm.errors import FastNcmError
from fastncm.plot.curves import (
    draw_curve,
    draw_ways,
    is_on_way_back,
    label_force_axes,
    label_positions,
    mark_peak,
)
from fastncm.plot.shapes import draw_shapes, height_of_shapes, solved_rows
from fastncm.plot.style import (
    GREY,
    empty_figure,
    legend_above,
    new_figure,
    open_frame,
    position_name,
    save,
    sequence_colours,
    shown,
    subtitle,
)

SNAPSHOTS = 4
MODELS: dict[str, dict[str, object]] = {
    "no shear": {"model.shear": False},
    "1D model": {"model.surface": "axis"},
}
"""What the paper's Fig. 8 compares the full model with."""
COMPONENTS = {"force_x_N": "#4c8eda", "force_y_N": "#c0392b"}


def surface_figure(curve: Curve) -> Figure:
    """One curve in direct contact: forces, angles along the finger, snapshots."""
    rows = spread_rows(curve)
    heights = [3.0, 2.8, height_of_shapes(curve, rows, 9.0)]
    figure = empty_figure(9.0, sum(heights) + 0.3)
    top, middle, below = np.ravel(
        figure.subfigures(3, 1, squeeze=False, height_ratios=heights, hspace=0.03)
    )
    left, right = top.subplots(1, 2)
    draw_models(left, curve)
    draw_insertion(right, curve)
    for ax, field in zip(middle.subplots(1, 2), ("psi_rad", "gamma_rad"), strict=True):
        draw_field(ax, curve, rows, field)
    draw_shapes(below, curve, rows)
    if curve.scene.assumed:
        figure.supxlabel(f"assumed: {curve.scene.assumed}", fontsize=7, color="0.35")
    return figure


def surface_pictures(curve: Curve, out: Path) -> list[Path]:
    """The pictures of direct contact that a study's folder gets beside the others."""
    forces, (axes,) = new_figure(9.0, 3.4, columns=2)
    draw_models(axes[0], curve)
    draw_insertion(axes[1], curve)
    angles, (axes,) = new_figure(9.0, 3.2, columns=2)
    for ax, field in zip(axes, ("psi_rad", "gamma_rad"), strict=True):
        draw_field(ax, curve, spread_rows(curve), field)
    return [save(forces, out / "models.png"), save(angles, out / "angles.png")]


def spread_rows(curve: Curve) -> list[int]:
    """Rows worth a snapshot: the first and the last that are solved, and some in between."""
    rows = solved_rows(curve)
    return sorted({int(rows[round(place)]) for place in np.linspace(0, len(rows) - 1, SNAPSHOTS)})


def draw_models(ax: Axes, curve: Curve) -> None:
    """The contact force over the position: as solved, without shear, without thickness."""
    open_frame(ax)
    draw_force(ax, curve, "as solved", color="black", linewidth=1.6)
    styles = ((0, (5, 2)), (0, (1, 1.5)))
    for (name, other), style in zip(other_models(curve).items(), styles, strict=False):
        draw_force(ax, other, name, color=GREY, linestyle=style, linewidth=1.4)
    label_positions(ax, curve)
    ax.set_ylabel("contact force / N")
    ax.set_ylim(bottom=0.0)
    legend_above(ax)


def other_models(curve: Curve) -> Mapping[str, Curve]:
    """The same path by the models that the scene does not use, as far as they can be solved."""
    scene, positions = curve.scene, curve.frame()["position"].to_numpy()
    curves = {}
    for name, changes in MODELS.items():
        try:
            other = scene.replace(changes)
        except FastNcmError:  # a model that goes without what the scene needs
            continue
        if other != scene:
            curves[name] = solve(other, positions)
    return curves


def draw_force(ax: Axes, curve: Curve, name: str, **style: object) -> None:
    """Magnitude of the total force on the finger over the position."""
    frame = curve.frame()
    force = np.hypot(*frame[["force_x_N", "force_y_N"]].to_numpy().T)
    draw_ways(ax, curve, frame["position"].to_numpy(), force, label=name, **style)


def draw_insertion(ax: Axes, curve: Curve) -> None:
    """The insertion force with its peak, and the components of the force on the finger."""
    open_frame(ax)
    frame = curve.frame()
    position = frame["position"].to_numpy()
    for column, colour in COMPONENTS.items():
        style = {"color": colour, "linewidth": 1.2, "label": f"on the finger, {column[6]}"}
        draw_ways(ax, curve, position, frame[column].to_numpy(), **style)
    draw_curve(ax, curve, name="insertion")
    label_force_axes(ax, curve)
    ax.set_ylabel("force / N")
    mark_peak(ax, curve)
    legend_above(ax)


def draw_field(ax: Axes, curve: Curve, rows: Sequence[int], field: str) -> None:
    """psi (against the base) or gamma in degrees along the finger; dots where it touches."""
    open_frame(ax)
    for row, colour in zip(rows, sequence_colours(len(rows)), strict=True):
        shape, contacts = curve.shape(row), curve.contacts(row)
        angle = shape[field] - (shape[field].iloc[0] if field == "psi_rad" else 0.0)
        degrees = np.degrees(angle)
        place = float(shown(position_name(curve.scene), curve.frame()["position"].iloc[row]))
        unit = "°" if curve.scene.position_unit == "rad" else " mm"
        unit += " back" if is_on_way_back(curve, row) else ""
        s = 1e3 * shape["s_m"]
        ax.plot(s, degrees, color=colour, linewidth=1.3, label=f"{place:.4g}{unit}")
        touching = 1e3 * contacts["s_m"]
        ax.plot(touching, np.interp(touching, s, degrees), ".", color=colour, markersize=4)
    words = {"psi_rad": "bending rotation ψ - ψ(0) / °", "gamma_rad": "shear angle γ / °"}
    ax.set_xlabel("s / mm")
    ax.set_ylabel(words[field])
    if field == "psi_rad":
        legend_above(ax)
    else:
        subtitle(ax, "dots: touching nodes")
