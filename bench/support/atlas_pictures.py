"""The atlas's heat maps."""

from collections.abc import Callable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from fastncm.plot.style import empty_figure, save
from support import RESULTS

ORDERS = ("2", "3", "4", "6", "8", "12", "20", "32", "auto")
TAPERS = np.geomspace(1e-3, 1e3, 13)
TURNS = np.array([0.0, 0.1, 1.0, 3.0, 10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, 360.0])
INTERVALS = (4, 7, 16, 45, 90, 180, 360, 2000, 10_000)
FLOOR = 1e-16


def draw_jaws(table: pd.DataFrame, judged: pd.DataFrame) -> None:
    """Share without an answer, true error, and its estimate over it, over order, taper and turn."""
    figure = empty_figure(10.5, 7.0)
    axes = figure.subplots(2, 3)
    table = table.assign(failed=table["cause"] != "", order=table["solver.order"].astype(str))
    shot = judged[judged["found"] & (judged["rounding"] < 1e-6)]
    shot = shot.assign(
        log_error=np.log10(np.maximum(shot["error"], FLOOR)),
        effect=shot["error_estimate"] / np.maximum(shot["error"], FLOOR),
        turn=np.degrees(shot["tip_angle_rad"].abs()),
        order=shot["solver.order"].astype(str),
    )
    taper = _edges("tip over clamp thickness", TAPERS, True)
    turn = _edges("turn of the tip / °", TURNS, False)
    smooth, rubs = table[table["friction.mu"] == 0.0], table[table["friction.mu"] > 0.0]
    share = {"norm": Normalize(0.0, 0.2), "cmap": "Reds"}
    by_taper = ("taper", *taper)
    heat(figure, axes[0, 0], smooth, "failed", by_taper, "mean", "no answer, μ = 0", **share)
    heat(
        figure,
        axes[0, 1],
        rubs,
        "failed",
        by_taper,
        "mean",
        "no answer (it may lock), μ > 0",
        norm=Normalize(0.0, 0.6),
        cmap="Reds",
    )
    size = {"norm": Normalize(-14.0, 0.0), "cmap": "viridis"}
    heat(
        figure,
        axes[0, 2],
        shot,
        "log_error",
        by_taper,
        "median",
        "log10 true error, median",
        **size,
    )
    by_turn = ("turn", *turn)
    heat(
        figure, axes[1, 0], shot, "log_error", by_turn, "median", "log10 true error, median", **size
    )
    ratio = {"norm": LogNorm(0.1, 1e3), "cmap": "RdBu"}
    heat(figure, axes[1, 1], shot, "effect", by_turn, "median", "estimate / error, median", **ratio)
    fair = shot[(shot["error"] > 10.0 * shot["rounding"]) & (shot["error"] > 1e-13)]
    heat(figure, axes[1, 2], fair, "effect", by_turn, "min",
         "estimate / error, least (above rounding)", **ratio)  # fmt: skip
    save(figure, RESULTS / "atlas_jaws.png")


def draw_sides(table: pd.DataFrame, judged: pd.DataFrame) -> None:
    """Share without an answer over N and taper, and the error against finer intervals."""
    figure = empty_figure(10.5, 3.6)
    axes = figure.subplots(1, 3)
    table = table.assign(failed=table["cause"] != "", order=table["solver.intervals"].astype(str))
    known = judged[judged["found"]]
    known = known.assign(
        order=known["solver.intervals"].astype(str),
        log_error=np.log10(np.maximum(known["error"], FLOOR)),
        effect=known["error_estimate"] / np.maximum(known["error"], FLOOR),
    )
    taper = ("taper", *_edges("tip over clamp thickness", TAPERS[::2], True))
    names = tuple(map(str, INTERVALS))
    share = {"norm": Normalize(0.0, 0.5), "cmap": "Reds", "columns": names, "label": "N"}
    heat(figure, axes[0], table, "failed", taper, "mean", "no answer", **share)
    rest = {"columns": names, "label": "N"}
    heat(figure, axes[1], known, "log_error", taper, "median", "log10 error, median",
         norm=Normalize(-8.0, 0.0), cmap="viridis", **rest)  # fmt: skip
    fair = known[known["error"] > 10.0 * known["rounding"]]
    heat(figure, axes[2], fair, "effect", taper, "min", "estimate / error, least (truth is known)",
         norm=LogNorm(0.1, 1e3), cmap="RdBu", **rest)  # fmt: skip
    save(figure, RESULTS / "atlas_sides.png")


def draw_grid(table: pd.DataFrame) -> None:
    """True errors on the grids."""
    names = list(table["grid"].unique())
    figure = empty_figure(13.0, 6.6)
    axes = figure.subplots(2, 4).ravel()
    for ax, name in zip(axes, names, strict=False):
        part = table[table["grid"] == name]
        error = np.log10(np.maximum(part["error"].where(part["status"] == "converged"), FLOOR))
        cells = part.assign(z=error).pivot_table(index="y", columns="x", values="z", dropna=False)
        shown = ax.imshow(cells, origin="lower", aspect="auto", vmin=-14, vmax=0, cmap="viridis")
        across, up = ([_short(one) for one in ticks] for ticks in (cells.columns, cells.index))
        ax.set_xticks(range(len(across)), across, rotation=90, fontsize=7)
        ax.set_yticks(range(len(up)), up, fontsize=7)
        ax.set_title(name, fontsize=8)
        figure.colorbar(shown, ax=ax, label="log10 error")
    for ax in axes[len(names) :]:
        ax.axis("off")
    save(figure, RESULTS / "atlas_grid.png")


def _short(value: float) -> str:
    """A number that fits a tick."""
    return f"{value:.3g}" if 0.01 <= value <= 1e4 else f"{value:.0e}"


def heat(
    figure: Figure,
    ax: Axes,
    table: pd.DataFrame,
    value: str,
    rows: tuple[str, str, np.ndarray, Callable[[float], str]],
    how: str,
    title: str,
    *,
    norm: Normalize,
    cmap: str,
    columns: tuple[str, ...] = ORDERS,
    label: str = "order",
) -> None:
    """A map of `how` of a column over the order (or N) and bins of another column."""
    name, said, edges, text = rows
    bins = pd.cut(table[name], edges, labels=False, include_lowest=True)
    cells = np.full((len(edges) - 1, len(columns)), np.nan)
    for (row, column), values in table.groupby([bins, "order"])[value]:
        if column in columns and len(values) >= 3:
            cells[int(row), columns.index(column)] = values.agg(how)
    ax.set_facecolor("0.9")
    shown = ax.imshow(cells, origin="lower", aspect="auto", norm=norm, cmap=cmap)
    ax.set_xticks(range(len(columns)), columns, fontsize=7, rotation=45)
    ax.set_yticks(np.arange(len(edges)) - 0.5, [text(edge) for edge in edges], fontsize=7)
    ax.set_xlabel(label)
    ax.set_ylabel(said)
    ax.set_title(title, fontsize=9)
    figure.colorbar(shown, ax=ax)


def _edges(
    said: str, edges: np.ndarray, powers: bool
) -> tuple[str, np.ndarray, Callable[[float], str]]:
    return said, edges, (lambda edge: f"{edge:.1g}") if powers else (lambda edge: f"{edge:g}")
