"""Design charts: a result over the axes of a study (Lan & Lee 2008, Fig. 16)."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fastncm.plot.style import (
    MARK,
    label,
    legend,
    new_figure,
    sequence_colours,
    shown,
    subtitle,
    title,
    value_label,
)

LINES = 7
"""Lines in a chart at most: more cannot be told apart."""
LEVELS = 10


def chosen(n: int, most: int) -> list[int]:
    """At most `most` indices out of n with both ends, equally spaced where that is possible."""
    for count in range(min(n, most), 2, -1):
        if (n - 1) % (count - 1) == 0:
            return list(range(0, n, (n - 1) // (count - 1)))
    return sorted({round(i) for i in np.linspace(0, n - 1, min(n, most))})


def line_chart(frame: pd.DataFrame, column: str, x: str, lines: str | None, held: str) -> Figure:
    """`column` over axis `x`, one line for each value of axis `lines`.

    frame: one row per case, sorted by `x` within each line; not converged rows are gaps.
    held: the other axes in words.
    """
    figure, axes = new_figure(6.4, 4.2)
    ax = axes[0, 0]
    values = [None] if lines is None else list(frame[lines].drop_duplicates())
    for value, colour in zip(values, sequence_colours(len(values)), strict=True):
        rows = frame if lines is None else frame[frame[lines] == value]
        ax.plot(
            shown(x, rows[x]),
            shown(column, rows[column].where(rows["status"] == "converged")),
            color=colour,
            linewidth=1.4,
            label=None if lines is None else value_label(lines, value),
        )
    ax.set_xlabel(label(x))
    ax.set_ylabel(label(column))
    subtitle(ax, held)
    if lines is not None:
        legend(ax, title(lines))
    return figure


def map_chart(
    frame: pd.DataFrame, column: str, x: str, y: str, limits: Mapping[str, float], held: str
) -> Figure:
    """Contours of `column` over two axes; designs beyond a limit are hatched.

    frame: one row per case, the full grid over `x` and `y`. held: the other axes in words.
    """
    figure, axes = new_figure(6.4, 4.6)
    ax = axes[0, 0]
    wide = frame.where(frame["status"] == "converged")
    field = _grid(frame, wide[column], x, y)
    across, up = shown(x, field.columns), shown(y, field.index)
    height = shown(column, field.to_numpy())
    filled = ax.contourf(across, up, height, levels=LEVELS, cmap="viridis")
    figure.colorbar(filled, ax=ax, label=label(column))
    notes = [held] if held else []
    for name, limit in limits.items():
        beyond = _grid(frame, wide[name], x, y).to_numpy() - limit
        if (beyond > 0).any():
            notes.append(f"hatched: {title(name)} above {limit:g}")
            ax.contourf(across, up, beyond, levels=[0, np.inf], colors="none", hatches=["///"])
            ax.contour(across, up, beyond, levels=[0], colors=[MARK])
    subtitle(ax, "; ".join(notes))
    ax.set_xlabel(label(x))
    ax.set_ylabel(label(y))
    return figure


def _grid(frame: pd.DataFrame, values: pd.Series, x: str, y: str) -> pd.DataFrame:
    """Values as a table, rows along `y`, columns along `x`."""
    table = pd.DataFrame({"x": frame[x], "y": frame[y], "value": values})
    return table.pivot_table(index="y", columns="x", values="value", dropna=False)


def by_importance(axes: Sequence[str]) -> list[str]:
    """Axes in the order of a chart: thickness across if there is one, friction last."""
    return sorted(axes, key=lambda name: (name != "finger.thickness", name == "friction.mu"))
