"""The pictures that suit a study: force curves along each axis, deformed shapes, design charts."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fastncm.curve import Curve, solve
from fastncm.errors import SweepError
from fastncm.plot.chart import LINES, by_importance, chosen, line_chart, map_chart
from fastncm.plot.curves import (
    curves_figure,
    draw_curve,
    label_force_axes,
    located_peaks,
    mark_peak,
)
from fastncm.plot.scatter import scatter_figure
from fastncm.plot.shapes import draw_shapes, height_of_shapes, shapes_figure, solved_rows
from fastncm.plot.style import empty_figure, open_frame, save, title, value_label
from fastncm.plot.surface import surface_figure, surface_pictures
from fastncm.scene import Scene
from fastncm.sweeping.grid import Grid
from fastncm.sweeping.read import load, read_study
from fastncm.sweeping.samples import Samples
from fastncm.sweeping.storage import Storage
from fastncm.sweeping.study import Study

CURVES = 6
"""Force curves in one picture at most."""
SNAPSHOTS = 4
POINTS = 5000
"""Points in a scatter chart at most."""


def plot_run(out: str | os.PathLike[str]) -> list[Path]:
    """Draw the pictures of a sweep into its folder and return their paths.

    Each picture varies one or two axes and holds the others at their middle values. The charts show
    the table; curves and shapes of the few cases in a picture are solved again.
    """
    storage = Storage(out)
    if storage.local is None:
        raise SweepError(f"{out}: pictures are drawn into local folders only")
    out = storage.local
    study = read_study(storage)
    if isinstance(study.cases, Grid):
        pictures = _grid_pictures(study, study.cases, out)
        middle = int(study.cases.case_ids({})[0])
    else:
        pictures = _scatter(study, study.cases, out)
        middle = _median_case(study, out)
    curve = solve(_scene(study, middle))
    pictures.append(save(shapes_figure(curve, snapshot_rows(curve)), out / "shapes.png"))
    if curve.scene.jaw is None:
        pictures += surface_pictures(curve, out)
    return pictures


def plot_curve(curve: Curve, file: str | os.PathLike[str]) -> Path:
    """Draw one curve: the force, its located peak, and snapshots of the finger."""
    if curve.scene.jaw is None:
        return save(surface_figure(curve), Path(file))
    rows = snapshot_rows(curve)
    heights = [2.8, height_of_shapes(curve, rows, 8.0)]
    figure = empty_figure(8.0, sum(heights))
    top, below = np.ravel(figure.subfigures(2, 1, squeeze=False, height_ratios=heights))
    ax = top.subplots()
    open_frame(ax)
    draw_curve(ax, curve)
    label_force_axes(ax, curve)
    mark_peak(ax, curve)
    draw_shapes(below, curve, rows)
    return save(figure, Path(file))


def snapshot_rows(curve: Curve) -> list[int]:
    """Rows worth a picture: spread along the path as far as it is solved, and the last before each
    located peak."""
    rows = solved_rows(curve)
    rows = rows[np.linspace(0, len(rows) - 1, SNAPSHOTS + 1).round().astype(int)[1:]]
    for _, before in located_peaks(curve).values():
        rows[np.argmin(np.abs(rows - before))] = before
    return sorted(set(rows.tolist()))


def _grid_pictures(study: Study, grid: Grid, out: Path) -> list[Path]:
    """Charts over the axes of a grid, and force curves along each."""
    pictures = _charts(study, grid, out)
    for name, values in grid.axes.items():
        cases = grid.case_ids({name: chosen(len(values), CURVES)})
        curves = {value_label(name, _value(study, name, i)): solve(_scene(study, i)) for i in cases}
        figure = curves_figure(curves, title(name), _held(study, grid, [name]))
        pictures.append(save(figure, out / f"curves_{name.replace('.', '_')}.png"))
    return pictures


def _charts(study: Study, grid: Grid, out: Path) -> list[Path]:
    """Lines and, over two numeric axes, a map of the column that the study reports."""
    numeric = [name for name, values in grid.axes.items() if values.dtype != object]
    axes = by_importance([name for name in numeric if len(grid.axes[name]) > 1])
    if not axes:
        return []
    x, *others = axes
    y = next(iter(others), None)
    column = study.report.column
    held = _held(study, grid, axes[:2])
    sizes = {name: len(grid.axes[name]) for name in axes[:2]}
    picked = {x: range(sizes[x])} | ({y: chosen(sizes[y], LINES)} if y else {})
    rows = load(out, case_ids=grid.case_ids(picked)).sort_values(x, kind="stable")
    pictures = [save(line_chart(rows, column, x, y, held), out / "design_chart.png")]
    if y is not None:
        rows = load(out, case_ids=grid.case_ids({name: range(n) for name, n in sizes.items()}))
        figure = map_chart(rows, column, x, y, study.report.limits, held)
        pictures.append(save(figure, out / "design_map.png"))
    return pictures


def _scatter(study: Study, samples: Samples, out: Path) -> list[Path]:
    """The column that the study reports over each numeric axis, one point per case."""
    column = study.report.column
    axes = [name for name, values in samples.axes.items() if values.dtype != object]
    if not axes:
        return []
    shown = np.unique(np.linspace(0, samples.size - 1, POINTS).round().astype(int))
    rows = load(out, case_ids=shown, columns=[*axes, column])
    return [save(scatter_figure(rows, column, axes), out / "design_scatter.png")]


def _median_case(study: Study, out: Path) -> int:
    """The case whose reported value is the middle one; the first where none has a value."""
    rows = load(out, columns=["case_id", study.report.column]).dropna()
    ranked = rows.sort_values(study.report.column, kind="stable")["case_id"]
    return int(ranked.iloc[len(ranked) // 2]) if len(ranked) else 0


def _held(study: Study, grid: Grid, varied: Sequence[str]) -> str:
    """The axes that a picture does not vary, at their middle values, in words."""
    middle = grid.case_ids({})[0]
    return ", ".join(
        f"{title(name)} {value_label(name, _value(study, name, middle))}"
        for name in grid.axes
        if name not in varied
    )


def _scene(study: Study, case_id: int) -> Scene:
    """The scene of one case."""
    return study.scene.replace({name: _value(study, name, case_id) for name in study.cases.axes})


def _value(study: Study, name: str, case_id: int) -> object:
    value = study.cases.columns(np.array([case_id]))[name][0]
    return value.item() if isinstance(value, np.generic) else value
