"""Pictures of the study: forces and differences over the path, error over time."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from support import RESULTS, ROOT

from fastncm.plot.style import empty_figure, legend, open_frame, save

from .cases import SMALL
from .errors import finest, largest, with_differences

COLOURS = {0.0: "#1b2a49", 0.2: "#1e7d3c", 0.4: "#c0392b"}
MARKERS = {"snapfit-circle": "o", "snapfit-corner": "s", SMALL: "^"}

KINDS = "beam", "CalculiX", "recovered"
"""The columns of the legend."""


def draw(forces: pd.DataFrame, runs: pd.DataFrame) -> None:
    """Both pictures."""
    over_the_path(finest(forces))
    over_time(forces, runs)


def over_the_path(forces: pd.DataFrame) -> None:
    """Forces of the finest meshes and of the beam, and their differences."""
    figure = empty_figure(11.0, 5.6)
    scenes = list(dict.fromkeys(forces["scene"]))
    axes = figure.subplots(2, len(scenes), height_ratios=[2.0, 1.2], sharex="col", squeeze=False)
    for column, scene in enumerate(scenes):
        rows = with_differences(forces[forces["scene"] == scene])
        _forces(axes[0, column], scene, rows)
        _differences(axes[1, column], scene, rows)
    axes[0, 0].set_ylabel("force on the finger / N")
    axes[1, 0].set_ylabel("beam against CalculiX / %")
    drawn = dict(zip(*reversed(axes[0, 0].get_legend_handles_labels()), strict=True))
    labels = [name for kind in KINDS for name in drawn if name.startswith(kind)]
    handles = [drawn[name] for name in labels]
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    print(f"\n{save(figure, RESULTS / 'calculix_forces.png').relative_to(ROOT)}")


def _forces(ax: Axes, scene: str, rows: pd.DataFrame) -> None:
    open_frame(ax)
    ax.set_title(scene, fontsize=10, loc="left")
    for mu, some in rows.groupby("mu"):
        x, colour = _axis(scene, some), COLOURS[float(mu)]
        ax.plot(x, _size(some, "equilibrium"), color=colour, lw=1.2, label=f"beam, μ = {mu:g}")
        if mu > 0.0:
            label = f"recovered, μ = {mu:g}"
            ax.plot(x, _size(some, "recovered"), ":", color=colour, lw=1.2, label=label)
        ax.plot(
            x, _size(some, "fem"), "o", mfc="white", mec=colour, ms=4.5,
            label=f"CalculiX, μ = {mu:g}",
        )  # fmt: skip


def _differences(ax: Axes, scene: str, rows: pd.DataFrame) -> None:
    open_frame(ax)
    ax.axhline(0.0, color="0.7", lw=0.8)
    for mu, some in rows.groupby("mu"):
        x, colour = _axis(scene, some), COLOURS[float(mu)]
        ax.plot(x, some["equilibrium_size_%"], "o-", color=colour, ms=3, lw=0.8)
        if mu > 0.0:
            ax.plot(x, some["recovered_size_%"], "o:", color=colour, ms=3, lw=0.8)
    if scene.startswith("rubber"):
        ax.set_xlabel("direction of the base φ / °")
        return
    ax.invert_xaxis()
    ax.set_xlabel("target position / mm")


def over_time(forces: pd.DataFrame, runs: pd.DataFrame) -> None:
    """Error of the force against the reference over the time of a curve."""
    figure = empty_figure(6.4, 3.8)
    ax = figure.subplots()
    open_frame(ax)
    by = ["scene", "mesh", "mu"]
    table = largest(forces, by).merge(runs, on=by).dropna(subset="reference_%")
    for (scene, mu), rows in table.groupby(["scene", "mu"], sort=False):
        style = {"marker": MARKERS[scene], "color": COLOURS[float(mu)], "ms": 5, "lw": 0.8}
        ax.loglog(rows["fem_s"], rows["reference_%"], label=f"{scene}, μ = {mu:g}", **style)
        beam = _beam_error(forces, scene, mu)
        for seconds in ("beam_s", "beam_in_sweep_s"):
            ax.loglog(rows[seconds].min(), beam, mfc="white", **style)
    ax.set_xlabel("CPU time of a curve / s")
    ax.set_ylabel("largest error of the force / %")
    ax.set_title("filled: CalculiX; open: fastncm alone and in a sweep", fontsize=9, loc="left")
    legend(ax, "")
    print(f"\n{save(figure, RESULTS / 'calculix_time.png').relative_to(ROOT)}")


def _beam_error(forces: pd.DataFrame, scene: str, mu: float) -> float:
    """Largest difference of the beam from the reference, in % of the reference's force."""
    rows = forces[(forces["scene"] == scene) & (forces["mu"] == mu)]
    x, y = rows["reference_x_N"], rows["reference_y_N"]
    off = np.hypot(rows["equilibrium_x_N"] - x, rows["equilibrium_y_N"] - y)
    return float(100 * (off / np.hypot(x, y)).max())


def _axis(scene: str, rows: pd.DataFrame) -> np.ndarray:
    """Positions in degrees or mm."""
    position = rows["position"].to_numpy()
    return np.degrees(position) if scene.startswith("rubber") else 1e3 * position


def _size(rows: pd.DataFrame, name: str) -> np.ndarray:
    """Magnitude of a force, N."""
    return np.hypot(rows[f"{name}_x_N"], rows[f"{name}_y_N"])
