"""A result over each axis of a study whose cases are no grid: one point per case."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from fastncm.plot.style import label, new_figure, sequence_colours, shown

COLUMNS = 3
"""Charts side by side."""


def scatter_figure(frame: pd.DataFrame, column: str, axes: Sequence[str]) -> Figure:
    """`column` over each of the axes, side by side.

    frame: one row per case; cases without a value have no point.
    """
    columns = min(len(axes), COLUMNS)
    rows = -(-len(axes) // columns)
    figure, charts = new_figure(3.2 * columns + 0.6, 3.0 * rows, rows, columns)
    colour = sequence_colours(1)[0]
    for ax, name in zip(charts.flat, axes, strict=False):
        ax.plot(shown(name, frame[name]), shown(column, frame[column]), ".", ms=3, color=colour)
        ax.set_xlabel(label(name))
    for ax in charts.flat[len(axes) :]:
        ax.set_visible(False)
    for ax in charts[:, 0]:
        ax.set_ylabel(label(column))
    return figure
