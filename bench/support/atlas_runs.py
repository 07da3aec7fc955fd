"""The atlas's runs: random scenes in bulk, one row for each position of each."""

from collections.abc import Mapping

import extremes
import numpy as np
import pandas as pd

import fastncm
from fastncm.cases import solve_chunk

NOTED = ("friction.mu", "solver.order", "model.shear", "path.steps")
NOTED_SIDE = (
    "friction.mu",
    "solver.intervals",
    "model.shear",
    "model.section",
    "model.surface",
    "solver.contact",
    "path.kind",
    "path.steps",
)


def scenes(kind: str, block: int, count: int) -> extremes.Columns:
    """The columns of `count` scenes from the beginning of a block on (and into the blocks after
    it)."""
    draw = extremes.side_block if kind in extremes.SIDE_KINDS else extremes.jaw_block
    blocks = [draw(kind, block + i) for i in range(-(-count // extremes.BLOCK))]
    joined = {name: np.concatenate([one[name] for one in blocks]) for name in blocks[0]}
    return extremes.first(joined, count)


def chosen(
    kind: str, indices: np.ndarray, changes: Mapping[str, object] | None = None
) -> pd.DataFrame:
    """`solved` for some scenes (n,) of a kind, with other settings, each the same for all or an
    array (n,)."""
    draw = extremes.side_block if kind in extremes.SIDE_KINDS else extremes.jaw_block
    parts = []
    for block in np.unique(indices // extremes.BLOCK):
        here = np.flatnonzero(indices // extremes.BLOCK == block)
        rows = indices[here] - block * extremes.BLOCK
        columns = {name: column[rows] for name, column in draw(kind, int(block)).items()}
        for name, value in (changes or {}).items():
            each = value[here] if isinstance(value, np.ndarray) else np.full(len(rows), value)
            columns[name] = each.astype(object)
        table = solved(kind, columns)
        parts.append(table.assign(index=indices[here][table["index"]]))
    return pd.concat(parts, ignore_index=True)


def last_rows(table: pd.DataFrame) -> pd.DataFrame:
    """The deepest position of each scene."""
    return table.groupby("index").tail(1).reset_index(drop=True)


def solved(kind: str, columns: extremes.Columns) -> pd.DataFrame:
    """One row for each position of each scene of a table, with the columns of `Curve.frame`, the
    scene's index in the table, the row's number on its path and what the heat maps need.

    A scene for which the package raises an exception is one row with the status "exception"; its
    advice says which.
    """
    count = len(columns["finger.length"])
    try:
        return run_columns(kind, columns)
    except Exception as error:
        if count == 1:
            return _raised(kind, columns, error)
    half = count // 2
    parts = [
        solved(kind, {name: column[part] for name, column in columns.items()})
        for part in (slice(half), slice(half, count))
    ]
    parts[1]["index"] += half
    return pd.concat(parts, ignore_index=True)


def run_columns(kind: str, columns: extremes.Columns) -> pd.DataFrame:
    """`solved`, for scenes that raise no exception."""
    side = kind in extremes.SIDE_KINDS
    scene = fastncm.load_scene(extremes.base_scene(kind))
    everything = (np.arange(len(columns["finger.length"])), columns)
    found = []
    for rows, part in extremes.parts(columns) if side else [everything]:
        if not len(rows):
            continue
        result = solve_chunk(scene.replace(extremes.row(part, 0)), part, curves=True)
        assert result.curves is not None
        table = pd.DataFrame(result.curves)
        case = table.pop("case").to_numpy()
        table["index"] = rows[case]
        thickness, length = part["finger.thickness"], part["finger.length"]
        table["taper"] = (thickness[:, 1] / thickness[:, 0])[case]
        table["slenderness"] = (thickness[:, 0] / length)[case]
        table["length"] = length[case]
        for name in NOTED_SIDE if side else NOTED:
            column = part[name][case]
            table[name] = column.astype(str) if column.dtype == object else column
        table["advice"] = result.cases["advice"][case]
        found.append(table)
    table = pd.concat(found, ignore_index=True)
    table["row"] = table.groupby("index").cumcount()
    table.insert(0, "kind", kind)
    return table


def _raised(kind: str, columns: extremes.Columns, error: Exception) -> pd.DataFrame:
    names = NOTED_SIDE if kind in extremes.SIDE_KINDS else NOTED
    row: dict[str, object] = {name: str(columns[name][0]) for name in names}
    row |= {"kind": kind, "index": 0, "row": 0, "status": "exception", "contacts": 0}
    row |= {"friction.mu": columns["friction.mu"][0], "path.steps": columns["path.steps"][0]}
    row |= dict.fromkeys(("taper", "tip_angle_rad", "kkt_residual", "error_estimate"), np.nan)
    row |= {"iterations": 0, "advice": f"{type(error).__name__}: {error}"}
    return pd.DataFrame([row])
