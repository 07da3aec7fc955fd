"""The profiles' picture and tables, from the study's rows."""

import math

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from support import RESULTS, markdown_table
from support.performance import profile

from fastncm.plot.style import empty_figure, open_frame, save
from profiles_parts.ladders import ACCURACIES

COLOURS = {
    "fastncm": "#1b2a49",
    "SLSQP": "#4c8eda",
    "trust-constr": "#8e6bbf",
    "IPOPT": "#1e7d3c",
    "root": "#c2458f",
    "solve_bvp": "#d98e04",
    "paper": "#c0392b",
}


def times(table: pd.DataFrame, start: str, accuracy: float) -> pd.DataFrame:
    """Seconds (scenes, solvers) of the cheapest setting that is accurate enough; inf: none is."""
    rows = table[table["start"] == start]
    seconds = rows["seconds"].where(rows["error"] <= accuracy, math.inf)
    wide = rows.assign(seconds=seconds).pivot_table(
        index="scene", columns="solver", values="seconds", aggfunc="min"
    )
    return wide[[name for name in COLOURS if name in wide.columns]]


def side_by_side(table: pd.DataFrame, together: pd.DataFrame) -> pd.DataFrame:
    """The table with fastncm's rows replaced by those of the scenes solved together."""
    others = table[table["solver"] != "fastncm"]
    return pd.concat([others, together.assign(solver="fastncm")], ignore_index=True)


def picture(table: pd.DataFrame, together: pd.DataFrame, positions: int) -> None:
    """results/profiles.png; `positions` of a warm path."""
    figure = empty_figure(9.5, 9.4)
    axes = figure.subplots(3, 2, sharex=True, sharey=True)
    rows = {
        "one position, cold": (table, "cold"),
        f"{positions} positions, warm": (table, "warm"),
        f"{positions} positions, warm, fastncm side by side": (
            side_by_side(table, together),
            "warm",
        ),
    }
    for row, (what, (runs_of, start)) in zip(axes, rows.items(), strict=True):
        for ax, accuracy in zip(row, ACCURACIES, strict=True):
            draw(ax, times(runs_of, start, accuracy))
            ax.set_title(f"{what}, force to {accuracy:.0e}", fontsize=10, loc="left")
    for ax in axes[:, 0]:
        ax.set_ylabel("share of the scenes solved")
    for ax in axes[-1]:
        ax.set_xlabel("within this many times the time of the fastest")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower right")
    save(figure, RESULTS / "profiles.png")


def draw(ax: Axes, wide: pd.DataFrame) -> None:
    """The profiles of a table of times (scenes, solvers)."""
    open_frame(ax)
    ratios, shares = profile(wide.to_numpy().T)
    for solver, ratio, share in zip(wide.columns, ratios, shares, strict=True):
        kept = np.isfinite(ratio)
        label = "the paper's algorithm" if solver == "paper" else solver
        at, height = np.append(ratio[kept], 1e6), np.append(share[kept], kept.mean())
        ax.step(at, height, where="post", color=COLOURS[solver], lw=1.5, label=label)
    ax.set_xscale("log")
    ax.set_xlim(0.9, 1e4)
    ax.set_ylim(0.0, 1.03)


def summary(table: pd.DataFrame, start: str, accuracy: float) -> str:
    """A line for each solver: solved, fastest, median time."""
    wide = times(table, start, accuracy)
    lines = []
    for solver in wide.columns:
        seconds = wide[solver]
        solved = np.isfinite(seconds)
        fastest = (seconds <= wide.min(axis=1)) & solved
        both = solved & np.isfinite(wide["fastncm"])
        ratio = (seconds[both] / wide["fastncm"][both]).median() if both.any() else math.nan
        last = table[(table["start"] == start) & (table["solver"] == solver)]
        last = last.groupby("scene").last()
        silent = int((last["converged"] & (last["error"] > accuracy)).sum())
        lines.append([solver, f"{solved.sum()}", f"{silent}", f"{fastest.sum()}",
                      "-" if not solved.any() else f"{1e6 * seconds[solved].median():.0f}",
                      "-" if math.isnan(ratio) else f"{ratio:.3g}"])  # fmt: skip
    head = [f"{start}, {accuracy:.0e}", "solved", "converged, not accurate", "fastest",
            "median µs a task", "times fastncm's"]  # fmt: skip
    return markdown_table(head, lines)


def together_text(together: pd.DataFrame) -> str:
    """fastncm with all scenes at once."""
    lines = []
    for (rtol, start), rows in together.groupby(["step", "start"], sort=False):
        counts = [f"{(rows['error'] <= accuracy).sum()}" for accuracy in (*ACCURACIES, rtol)]
        lines.append([f"{rtol:.0e}", start, f"{1e6 * rows['seconds'].mean():.3g}", *counts])
    head = ["rtol", "start", "µs a scene", *(f"to {a:.0e}" for a in ACCURACIES), "to rtol"]
    return "The same scenes by fastncm side by side:\n\n" + markdown_table(head, lines)
