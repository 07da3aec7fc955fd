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
    sequence_colours,
    shown,
    subtitle,
)


def draw_curve(ax: Axes, curve: Curve, colour: object = "black", name: str | None = None) -> None:
    """One force curve, with its located peak as a point of the line."""
    position, force = line_through_events(curve)
    ax.plot(shown("position", position), force, color=colour, label=name, linewidth=1.4)
    if np.isfinite(curve.peak.position):
        ax.plot(
            shown("position", curve.peak.position),
            curve.peak.insertion_force_N,
            "o",
            color=colour,
            markersize=3.5,
        )


def line_through_events(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    """Positions in m and insertion forces in N along the path: samples, peak and located events.

    The peak is a kink, and the force may jump: a grid of positions misses both.
    """
    names = ["position", "insertion_force_N"]
    samples, events = curve.frame()[names].to_numpy(), curve.events()[names].to_numpy()
    points = np.concatenate([samples, [curve.peak], events])
    position, force = points[np.argsort(-points[:, 0], kind="stable")].T
    return position, force


def curves_figure(curves: Mapping[str, Curve], varied: str, held: str) -> Figure:
    """Force curves of several cases, by legend entry; dots mark the located peaks.

    varied, held: the axis that differs and the others, in words.
    """
    figure, axes = new_figure(6.4, 4.0)
    ax = axes[0, 0]
    for (name, curve), colour in zip(curves.items(), sequence_colours(len(curves)), strict=True):
        draw_curve(ax, curve, colour, name)
    label_force_axes(ax)
    legend(ax, varied)
    subtitle(ax, held)
    return figure


def label_force_axes(ax: Axes) -> None:
    """The target moves towards -x: insertion runs to the right."""
    ax.invert_xaxis()
    ax.set_xlabel(f"{label('position')}   (insertion to the right)")
    ax.set_ylabel(label("insertion_force_N"))
    ax.axhline(0.0, color="0.85", linewidth=0.8, zorder=0)


def mark_peak(ax: Axes, curve: Curve) -> None:
    """The located peak in words, in the space above the line."""
    ax.margins(y=0.15)
    peak = curve.peak
    if np.isfinite(peak.position):
        ax.annotate(
            f"peak {peak.insertion_force_N:.4f} N at {shown('position', peak.position):.4f} mm",
            (float(shown("position", peak.position)), peak.insertion_force_N),
            xytext=(-8, 2),
            textcoords="offset points",
            ha="right",
            va="bottom",
            color=MARK,
            fontsize=9,
        )
