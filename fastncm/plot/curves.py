"""Insertion force over the target's position (Lan & Lee 2008, Figs. 11, 12, 15)."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fastncm.curve import Curve, Peak
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

#: Opacity of what belongs to the way out.
PALE = 0.4


def draw_curve(ax: Axes, curve: Curve, colour: object = "black", name: str | None = None) -> None:
    """One force curve, with its located peaks, in and out, as points of the line."""
    position, force = line_through_events(curve)
    draw_ways(ax, curve, position, force, color=colour, label=name, linewidth=1.4)
    unit = position_name(curve.scene)
    for peak, _ in located_peaks(curve).values():
        ax.plot(
            shown(unit, peak.position), peak.insertion_force_N, "o", color=colour, markersize=3.5
        )


def draw_ways(
    ax: Axes, curve: Curve, position: np.ndarray, values: np.ndarray, **style: object
) -> None:
    """Values over positions in m or rad along the path; the way out again is pale."""
    name = style.pop("label", None)
    x = shown(position_name(curve.scene), position)
    for back, way in enumerate(ways(position)):
        pale = PALE if back % 2 else 1.0
        ax.plot(x[way], values[way], label=None if back else name, alpha=pale, **style)  # type: ignore[arg-type]


def ways(position: np.ndarray) -> list[slice]:
    """The stretches of a path between the places where it turns back, which are in both."""
    sense = np.sign(np.diff(position))
    moves = np.flatnonzero(sense)
    turns = moves[1:][sense[moves[1:]] != sense[moves[:-1]]]
    edges = [0, *turns.tolist(), len(position) - 1]
    return [slice(first, last + 1) for first, last in pairwise(edges)]


def is_on_way_back(curve: Curve, row: int) -> bool:
    """Whether the path has turned back before a row (and not once more)."""
    position = curve.frame()["position"].to_numpy()
    return bool(sum(way.stop - 1 < row for way in ways(position)) % 2)


def located_peaks(curve: Curve) -> dict[str, tuple[Peak, int]]:
    """The largest insertion force and, on a way out, the largest that resists it, where known, each
    with the last row before it."""
    position = curve.frame()["position"].to_numpy()
    found = {}
    for (name, peak), way in zip(
        {"peak": curve.peak, "retention": curve.retention}.items(), ways(position), strict=False
    ):
        if np.isfinite(peak.position):
            sense = np.sign(position[way.stop - 1] - position[way.start])
            passed = int((sense * position[way] <= sense * peak.position).sum())
            found[name] = peak, way.start + max(0, passed - 1)
    return found


def line_through_events(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    """Positions in m or rad and insertion forces in N along the path: samples, located peaks and
    events.

    A peak is a kink, and the force may jump: a grid of positions misses both.
    """
    names = ["position", "insertion_force_N"]
    samples, events = curve.frame()[names].to_numpy(), curve.events()
    peaks = list(located_peaks(curve).values())
    extra = [*(peak for peak, _ in peaks), *events[names].to_numpy().tolist()]
    behind = [*(row for _, row in peaks), *events["interval"].tolist()]
    points = np.concatenate([samples, np.reshape(extra, (-1, 2))])
    row = np.concatenate([np.arange(len(samples)), np.array(behind, dtype=np.int64)])
    sense = np.sign(np.diff(samples[:, 0], append=samples[-1, 0]))
    ahead = np.where(np.arange(len(points)) < len(samples), -np.inf, sense[row] * points[:, 0])
    position, force = points[np.lexsort((ahead, row))].T
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
    """Positions of the target, or angles of the base, in the sense of the path's first way."""
    position = curve.frame()["position"].to_numpy()
    first, *others = ways(position)
    if position[first.start] >= position[first.stop - 1]:
        ax.invert_xaxis()
    senses = "to the right; pale: back" if others else "insertion to the right"
    ax.set_xlabel(f"{label(position_name(curve.scene))}   ({senses})")


def mark_peak(ax: Axes, curve: Curve) -> None:
    """The located peaks in words: above the line, and of two the lower one below it."""
    ax.margins(y=0.15)
    name = position_name(curve.scene)
    unit = "°" if curve.scene.position_unit == "rad" else " mm"
    peaks = located_peaks(curve)
    heights = [peak.insertion_force_N for peak, _ in peaks.values()]
    for word, (peak, _) in peaks.items():
        below = len(heights) > 1 and peak.insertion_force_N == min(heights)
        place = float(shown(name, peak.position))
        early = ax.transLimits.transform((place, 0.0))[0] < 0.5  # no room on its left
        ax.annotate(
            f"{word} {peak.insertion_force_N:.4f} N at {place:.4f}{unit}",
            (place, peak.insertion_force_N),
            xytext=(8 if early else -8, -2 if below else 2),
            textcoords="offset points",
            ha="left" if early else "right",
            va="top" if below else "bottom",
            color=MARK,
            fontsize=9,
            bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0.0, "pad": 0.5},
        )
