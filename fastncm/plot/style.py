"""Figures without global state, and how quantities are named and scaled on their axes."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fastncm.columns import CASE_UNITS, CURVE_UNITS
from fastncm.scene import Scene, unit_of
from fastncm.scene.kinds import is_number

DOTS_PER_INCH = 150
GREY = "0.55"
MARK = "#c0392b"  # the peak, the contact force
DISPLAY = {"m": (1e3, "mm"), "rad": (180 / np.pi, "°"), "Pa": (1e-6, "MPa"), "J": (1e3, "mJ")}
"""SI unit -> (factor, unit on the page)."""
WORDS = {
    "finger.thickness": "thickness w",
    "finger.length": "finger length L",
    "finger.width": "width b",
    "finger.young": "Young's modulus E",
    "friction.mu": "friction coefficient μ",
    "jaw.height": "jaw height H",
    "jaw.length": "jaw length",
    "jaw.lead_angle": "lead angle",
    "jaw.radius": "jaw radius",
    "jaw.return_angle": "return angle",
    "target.radius": "target radius R",
    "target.length": "length of the block",
    "peak_force_N": "peak insertion force",
    "peak_position": "position of the peak",
    "max_strain": "largest strain",
    "insertion_work_J": "insertion work",
    "retention_force_N": "peak retention force",
    "withdrawal_work_J": "withdrawal work",
    "hysteresis_J": "hysteresis",
    "insertion_force_N": "insertion force",
    "position": "target position",
    "base_angle": "direction of the base φ",
    "finger.offset": "distance of the clamp from the pivot",
    "finger.poisson": "Poisson's ratio ν",
    "finger.shear_modulus": "shear modulus G",
    "path.y": "height of the target y",
    "path.x": "x of the target at φ = 90°",
    "path.speed_ratio": "speed ratio of the target",
    "path.angle": "direction of the base",
    "target.semi_axes": "semi-axes",
    "target.tilt": "tilt of the target",
    "solver.intervals": "intervals N",
}
RESULT_UNITS = CASE_UNITS | CURVE_UNITS | {"base_angle": "rad"}


def position_name(scene: Scene) -> str:
    """What a scene's positions are: "position", of the target, or "base_angle"."""
    return "base_angle" if scene.position_unit == "rad" else "position"


def new_figure(
    width: float, height: float, rows: int = 1, columns: int = 1
) -> tuple[Figure, np.ndarray]:
    """A figure of width × height inches and its axes, shape (rows, columns)."""
    figure = empty_figure(width, height)
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax in axes.flat:
        open_frame(ax)
    return figure, axes


def empty_figure(width: float, height: float) -> Figure:
    """A figure of width × height inches."""
    figure = Figure(figsize=(width, height), layout="constrained", dpi=DOTS_PER_INCH)
    FigureCanvasAgg(figure)
    return figure


def open_frame(ax: Axes) -> None:
    """Only the two spines that carry numbers."""
    ax.spines[["top", "right"]].set_visible(False)


def save(figure: Figure, file: Path) -> Path:
    """Write the figure as PNG (or what the suffix says) and return the path."""
    figure.savefig(file)
    return file


def shown(name: str, values: object) -> np.ndarray:
    """SI values of a quantity in the unit of the page."""
    return np.asarray(values, dtype=float) * _display(name)[0]


def label(name: str) -> str:
    """Axis label: the quantity in words and its unit on the page."""
    unit = _display(name)[1]
    return f"{title(name)}{f' / {unit}' if unit else ''}"


def title(name: str) -> str:
    """The quantity in words, without a unit."""
    return WORDS.get(name, name)


def value_label(name: str, value: object) -> str:
    """One value of a quantity for a legend, with its unit."""
    numbers = value if isinstance(value, tuple | list) else (value,)
    if not all(map(is_number, numbers)):
        return f"{name} = {value}"
    words = ", ".join(f"{number:.4g}" for number in np.ravel(shown(name, numbers)))
    unit = _display(name)[1]
    gap = "" if unit == "°" else " "
    return f"{words if len(numbers) == 1 else f'({words})'}{gap}{unit}".strip()


def sequence_colours(n: int) -> Sequence[tuple[float, float, float, float]]:
    """n colours of one ordered family, dark to light."""
    return [matplotlib.colormaps["viridis"](x) for x in np.linspace(0.0, 0.85, n)]


def subtitle(ax: Axes, text: str) -> None:
    """What the reader must know beside the axes, small, above them."""
    ax.set_title(text, fontsize=9, loc="left", color="0.35")


def legend(ax: Axes, heading: str) -> None:
    """A legend without a box."""
    ax.legend(title=heading, frameon=False, fontsize=8, title_fontsize=8)


def legend_above(ax: Axes) -> None:
    """A legend in one line above the axes, where no curve runs."""
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=4,
        frameon=False,
        fontsize=8,
        columnspacing=1.2,
        handlelength=1.6,
        borderaxespad=0.2,
    )


def _display(name: str) -> tuple[float, str]:
    unit = RESULT_UNITS.get(name) or (unit_of(name) if "." in name else "1")
    return DISPLAY.get(unit, (1.0, "" if unit == "1" else unit))
