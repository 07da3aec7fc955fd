"""The atlas's runs: random scenes in bulk, and what is true of them by other means."""

import extremes
import numpy as np
import pandas as pd
import shooting_many

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
SOLVED = ("converged", "no_contact")


def run_block(kind: str, block: int, count: int = extremes.BLOCK) -> pd.DataFrame:
    """`run_columns` of `count` scenes from the beginning of a block on (and into the blocks after
    it)."""
    table = run_columns(kind, scenes(kind, block, count))
    table["index"] += block * extremes.BLOCK
    return table


def run_columns(kind: str, columns: extremes.Columns) -> pd.DataFrame:
    """One row for each position of each scene of a table, with the columns of `Curve.frame`, the
    scene's index in the table and what the heat maps need of it."""
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
    table.insert(0, "kind", kind)
    return table


def scenes(kind: str, block: int, count: int) -> extremes.Columns:
    """The columns of `count` scenes from the beginning of a block on."""
    draw = extremes.side_block if kind in extremes.SIDE_KINDS else extremes.jaw_block
    blocks = [draw(kind, block + i) for i in range(-(-count // extremes.BLOCK))]
    joined = {name: np.concatenate([one[name] for one in blocks]) for name in blocks[0]}
    return extremes.first(joined, count)


def last_rows(table: pd.DataFrame) -> pd.DataFrame:
    """The deepest position of each scene."""
    return table.groupby("index").tail(1).reset_index(drop=True)


def shoot(kind: str, block: int, table: pd.DataFrame) -> pd.DataFrame:
    """The rows that are converged on one sliding contact, with the true normal force by shooting.

    Adds true_force (EI/L^2), error and rounding (relative; what rounding may do to any answer) and
    found (whether shooting closed from the claimed answer).
    """
    chosen = (table["status"] == "converged") & (table["contacts"] == 1)
    chosen &= (table["sticking"] == 0) & (table["normal_force_N"] > 0.0)
    table = table[chosen].reset_index(drop=True)
    rows = table["index"].to_numpy() - block * extremes.BLOCK
    columns = extremes.jaw_block(kind, block)
    claim, unit = claim_of(table, columns, rows), shooting_many.force_unit(columns, rows)
    fingers = shooting_many.fingers(columns, rows, table["position"].to_numpy())
    truth = shooting_many.exact(fingers, claim, table["friction.mu"].to_numpy())
    return table.assign(
        true_force=truth.normal,
        error=np.abs(table["normal_force_N"] / unit / truth.normal - 1.0),
        rounding=truth.rounding / np.where(truth.normal == 0.0, np.nan, np.abs(truth.normal)),
        found=truth.found,
    )


def claim_of(
    table: pd.DataFrame, columns: extremes.Columns, rows: np.ndarray
) -> shooting_many.Claim:
    """What the rows of a table (n) of answers say, for the scenes `rows` (n,) of `columns`."""
    unit, length = shooting_many.force_unit(columns, rows), columns["finger.length"][rows]
    return shooting_many.Claim(
        table[["force_x_N", "force_y_N"]].to_numpy() / unit[:, None],
        table[["contact_x_m", "contact_y_m"]].to_numpy() / length[:, None],
        np.column_stack(
            [table["tip_x_m"] / length, table["tip_y_m"] / length, table["tip_angle_rad"]]
        ),
    )


def judge_by_order(shot: pd.DataFrame) -> pd.DataFrame:
    """The true errors of `shoot`, those that shooting does not close by the same scene with other
    modes: a thin end makes shooting from the tip sensitive beyond double precision."""
    shot = shot.assign(judge=np.where(shot["found"], "shooting", ""))
    for i in np.flatnonzero(~shot["found"]):
        kind, index = shot.at[i, "kind"], int(shot.at[i, "index"])
        other = 32 if shot.at[i, "solver.order"] != "32" else 24
        finer = solve_again(kind, index, {"solver.order": other}).iloc[-1]
        if finer["status"] == "converged":
            error = abs(shot.at[i, "normal_force_N"] / finer["normal_force_N"] - 1.0)
            shot.loc[i, ["found", "error", "judge"]] = True, error, f"order {other}"
            shot.loc[i, "rounding"] = 10.0 * finer["error_estimate"]
    return shot


def solve_again(kind: str, index: int, changes: dict[str, object]) -> pd.DataFrame:
    """A scene's path once more, with other settings of the solver."""
    made = extremes.one(kind, index) | changes
    return fastncm.solve(fastncm.load_scene(extremes.base_scene(kind)).replace(made)).frame()


def refine(table: pd.DataFrame, times: int = 8) -> pd.DataFrame:
    """Error of the converged rows of direct contact against the same scenes with more intervals:
    columns index, error, finer_estimate, rounding, found."""
    found = []
    for _, row in table[table["status"] == "converged"].iterrows():
        intervals = min(times * int(row["solver.intervals"]), 10_000)
        if intervals == int(row["solver.intervals"]):
            continue
        changes = {"solver.intervals": intervals, "solver.points": 90 * times}
        finer = solve_again(row["kind"], int(row["index"]), changes).iloc[-1]
        if finer["status"] != "converged":
            found.append({"index": row["index"], "found": False})
            continue
        force, truth = (
            np.array([one["force_x_N"], one["force_y_N"]], dtype=float) for one in (row, finer)
        )
        found.append(
            {
                "index": row["index"],
                "error": np.hypot(*(force - truth)) / np.hypot(*truth),
                "finer_estimate": finer["error_estimate"],
                "rounding": 1e-9 + finer["error_estimate"],  # so well is the truth known
                "found": True,
            }
        )
    return pd.DataFrame(found, columns=["index", "error", "finer_estimate", "rounding", "found"])
