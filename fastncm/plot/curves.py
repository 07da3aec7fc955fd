"""Insertion force over the target's position (Lan & Lee 2008, Figs. 11, 12, 15)."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fastncm.curve import Curve
from fastncm.plot.style import (
    MARK,
    label,
    legend,
    new_figure,
    position_name,
    sequence_colours,
    shown,
    subtitle,
)


def draw_curve(ax: Axes, curve: Curve, colour: object = "black", name: str | None = None) -> None:
    """One force curve, with its located peak as a point of the line."""
    position, force = line_through_events(curve)
    unit = position_name(curve.scene)
    ax.plot(shown(unit, position), force, color=colour, label=name, linewidth=1.4)
    if np.isfinite(curve.peak.position):
        ax.plot(
            shown(unit, curve.peak.position),
            curve.peak.insertion_force_N,
            "o",
            color=colour,
            markersize=3.5,
        )


def line_through_events(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    """Positions in m or rad and insertion forces in N along the path: samples, peak and located
    events.

    The peak is a kink, and the force may jump: a grid of positions misses both.
    """
    names = ["position", "insertion_force_N"]
    samples, events = curve.frame()[names].to_numpy(), curve.events()[names].to_numpy()
    points = np.concatenate([samples, [curve.peak], events])
    sense = 1.0 if samples[0, 0] < samples[-1, 0] else -1.0
    position, force = points[np.argsort(sense * points[:, 0], kind="stable")].T
    return position, force


def curves_figure(curves: Mapping[str, Curve], varied: str, held: str) -> Figure:
    """Force curves of several cases, by legend entry; dots mark the located peaks.

    varied, held: the axis that differs and the others, in words.
    """
    figure, axes = new_figure(6.4, 4.0)
    ax = axes[0, 0]
    for (name, curve), colour in zip(curves.items(), sequence_colours(len(curves)), strict=True):
        draw_curve(ax, curve, colour, name)
    label_force_axes(ax, next(iter(curves.values())))
    legend(ax, varied)
    subtitle(ax, held)
    return figure


def label_force_axes(ax: Axes, curve: Curve) -> None:
    """The insertion force over the position; insertion runs to the right."""
    label_positions(ax, curve)
    ax.set_ylabel(label("insertion_force_N"))
    ax.axhline(0.0, color="0.85", linewidth=0.8, zorder=0)


def label_positions(ax: Axes, curve: Curve) -> None:
    """Positions of the target, or angles of the base, in the sense of the path."""
    position = curve.frame()["position"]
    if position.iloc[0] >= position.iloc[-1]:
        ax.invert_xaxis()
    ax.set_xlabel(f"{label(position_name(curve.scene))}   (insertion to the right)")


def mark_peak(ax: Axes, curve: Curve) -> None:
    """The located peak in words, in the space above the line."""
    ax.margins(y=0.15)
    peak = curve.peak
    if np.isfinite(peak.position):
        place = float(shown(position_name(curve.scene), peak.position))
        unit = "°" if curve.scene.position_unit == "rad" else " mm"
        early = ax.transLimits.transform((place, 0.0))[0] < 0.5  # no room on its left
        ax.annotate(
            f"peak {peak.insertion_force_N:.4f} N at {place:.4f}{unit}",
            (place, peak.insertion_force_N),
            xytext=(8 if early else -8, 2),
            textcoords="offset points",
            ha="left" if early else "right",
            va="bottom",
            color=MARK,
            fontsize=9,
        )
