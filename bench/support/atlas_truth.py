"""How far the atlas's answers are from the truth: every row that says "converged".

The truth for jaws is shooting from the claimed answer (`tests/shooting_many.py`), where one sliding
contact is claimed: it finds the exact equilibrium next to it, and none where there is none. Several
contacts, contacts that stick, and those for which a thin end makes shooting too sensitive to close
are compared with the same scene with other modes, twice: where these two differ (with friction
there may be two equilibria at one position), no truth is known beyond their difference. For direct
contact the truth is the same scene with up to eight times as many intervals.
"""

import extremes
import numpy as np
import pandas as pd
import shooting_many

from support import atlas_runs

Array = np.ndarray

JUDGED = ("kind", "index", "row", "status", "contacts", "friction.mu", "taper", "tip_angle_rad",
          "iterations", "kkt_residual", "error_estimate", "error", "rounding", "found",
          "judge")  # fmt: skip
"""error: of the contact force, relative; rounding: what the truth itself may be wrong by; found:
whether there is a truth; judge: what it is."""
FORCE = ["force_x_N", "force_y_N"]
ORDERS = (32, 24, 20)
"""Modes of the scenes that an answer is compared with: the first two that are not its own."""
TIMES = (8, 5, 3)
"""As many intervals; the next where a row has no answer with the first."""
MOST_INTERVALS = 1_440
"""Of a truth; scenes with as many or more have none."""
PATH_POINTS = 90
ROUNDING = 1e-14
"""Finger lengths to which any place is known: a force is as little known as what it moves."""
OTHER_BRANCH = "another branch"
OTHER_FORCE, OTHER_TURN = 0.1, 0.1
"""Relative difference of the force, and rad of the tip, that make two branches of two answers."""


def jaws(kind: str, first: int, count: int) -> pd.DataFrame:
    """Every converged row of `count` scenes of jaws from `first` on, with the columns JUDGED and
    the order."""
    table = _part(kind, first, count)
    table = table[(table["status"] == "converged") & (table["contacts"] > 0)]
    table = table.reset_index(drop=True)
    judged = by_order(shoot(kind, first // extremes.BLOCK, table))
    return judged[[*JUDGED, "solver.order"]]


def sides(kind: str, first: int, count: int) -> pd.DataFrame:
    """The same for direct contact, with the intervals."""
    table = _part(kind, first, count)
    solved = table[(table["status"] == "converged") & (table["contacts"] > 0)]
    return refine(solved.reset_index(drop=True))[[*JUDGED, "solver.intervals"]]


def _part(kind: str, first: int, count: int) -> pd.DataFrame:
    """All rows of some scenes of a block."""
    return atlas_runs.chosen(kind, np.arange(first, first + count))


def shoot(kind: str, block: int, table: pd.DataFrame) -> pd.DataFrame:
    """Rows of scenes of one block, with the true normal force by shooting for those that are
    converged on one sliding contact.

    Adds error, rounding (relative; what rounding may do to any answer, known for contacts that
    stick, too), found (whether shooting closed from the claimed answer) and judge.
    """
    single = (table["status"] == "converged") & (table["contacts"] == 1)
    single &= table["normal_force_N"] > 0.0
    part = table[single].reset_index(drop=True)
    rows = part["index"].to_numpy() - block * extremes.BLOCK
    columns = extremes.jaw_block(kind, block)
    claim, unit = claim_of(part, columns, rows), shooting_many.force_unit(columns, rows)
    fingers = shooting_many.fingers(columns, rows, part["position"].to_numpy())
    truth = shooting_many.exact(fingers, claim, part["friction.mu"].to_numpy())
    table = table.assign(error=np.nan, rounding=0.0, found=False, judge="")
    scale = np.where(truth.normal == 0.0, np.nan, np.abs(truth.normal))
    table.loc[single, "error"] = np.abs(part["normal_force_N"].to_numpy() / unit / scale - 1.0)
    table.loc[single, "rounding"] = np.nan_to_num(truth.rounding / scale)
    table.loc[single, "found"] = truth.found & (part["sticking"] == 0).to_numpy()
    return table.assign(judge=np.where(table["found"], "shooting", ""))


def claim_of(table: pd.DataFrame, columns: extremes.Columns, rows: Array) -> shooting_many.Claim:
    """What the rows of a table (n) of answers say, for the scenes `rows` (n,) of `columns`."""
    unit, length = shooting_many.force_unit(columns, rows), columns["finger.length"][rows]
    return shooting_many.Claim(
        table[FORCE].to_numpy() / unit[:, None],
        table[["contact_x_m", "contact_y_m"]].to_numpy() / length[:, None],
        np.column_stack(
            [table["tip_x_m"] / length, table["tip_y_m"] / length, table["tip_angle_rad"]]
        ),
    )


def by_order(shot: pd.DataFrame) -> pd.DataFrame:
    """The rows of `shoot`, those without a truth compared with the same scenes with other modes."""
    left = ~shot["found"]
    if not left.any():
        return shot
    part = shot[left].drop_duplicates("index")
    own = part["solver.order"].to_numpy()
    finer, again = (_with_modes(part, own == str(ORDERS[k]), k) for k in (0, 1))
    length = shot["length"]
    moved = np.hypot(shot["tip_x_m"] / length - 1.0, shot["tip_y_m"] / length)
    shot.loc[left, "rounding"] += ROUNDING / np.maximum(moved[left], ROUNDING)
    shot = _judged(shot, left, finer, "other modes", 10.0)
    return _doubted(shot, left & shot["found"], finer, again)


def _with_modes(part: pd.DataFrame, own: Array, k: int) -> pd.DataFrame:
    """Scenes (n) with the ORDERS number `k`, or, where that or the one before is their `own` (n,),
    the next."""
    before = part["solver.order"].isin([str(one) for one in ORDERS[:k]]).to_numpy()
    changes = {"solver.order": np.where(own | before, ORDERS[k + 1], ORDERS[k])}
    return atlas_runs.chosen(str(part["kind"].iat[0]), part["index"].to_numpy(), changes)


def _doubted(
    table: pd.DataFrame, rows: pd.Series, truth: pd.DataFrame, again: pd.DataFrame
) -> pd.DataFrame:
    """The table with what the truth of the `rows` differs by from a second one, where that is
    known, added to `rounding`; without a truth where the two are other equilibria."""
    key = pd.MultiIndex.from_frame(table.loc[rows, ["index", "row"]])
    one, other = (
        found[found["status"] == "converged"]
        .set_index(["index", "row"])[[*FORCE, "error_estimate"]]
        .reindex(key)
        .to_numpy(float)
        for found in (truth, again)
    )
    off = np.hypot(*(one - other)[:, :2].T) / np.hypot(*one[:, :2].T)
    at = table.index[rows]
    table.loc[at, "rounding"] += np.nan_to_num(off)
    elsewhere = at[off > np.maximum(OTHER_FORCE, 10.0 * (one + other)[:, 2])]
    table.loc[elsewhere, "judge"], table.loc[elsewhere, "found"] = OTHER_BRANCH, False
    return table


def refine(table: pd.DataFrame) -> pd.DataFrame:
    """Converged rows of direct contact of one kind against the same scenes with more intervals."""
    coarse = table["solver.intervals"].astype(int)
    table = table[coarse < MOST_INTERVALS].assign(error=np.nan, rounding=0.0, found=False, judge="")
    for times in TIMES:
        part = table[~table["found"]].drop_duplicates("index")
        if part.empty:
            break
        finer = np.minimum(times * part["solver.intervals"].astype(int), MOST_INTERVALS).to_numpy()
        changes = {"solver.intervals": finer, "solver.points": PATH_POINTS * times}
        rows = atlas_runs.chosen(str(part["kind"].iat[0]), part["index"].to_numpy(), changes)
        table = _judged(table, ~table["found"], rows, "finer", 1.0)
    table["rounding"] += 1e-9
    return table


def _judged(
    table: pd.DataFrame, left: pd.Series, truth: pd.DataFrame, judge: str, times: float
) -> pd.DataFrame:
    """The table with the rows `left` compared with the same rows of other solves, where these have
    converged. The truth is known to `times` its estimate, which is added to `rounding`. Rows whose
    truth has another shape and another force stay without one."""
    good = truth[truth["status"] == "converged"].set_index(["index", "row"])
    part = table[left]
    same = good.reindex(pd.MultiIndex.from_frame(part[["index", "row"]]))
    off = part[FORCE].to_numpy(float) - same[FORCE].to_numpy(float)
    error = np.hypot(*off.T) / np.hypot(*same[FORCE].to_numpy(float).T)
    turn = part["tip_angle_rad"].to_numpy(float) - same["tip_angle_rad"].to_numpy(float)
    other = (error > OTHER_FORCE) & (np.abs(turn) > OTHER_TURN)
    known = np.isfinite(error) & ~other
    at = part.index[known]
    table.loc[part.index[other], "judge"] = OTHER_BRANCH
    table.loc[at, "error"], table.loc[at, "found"] = error[known], True
    table.loc[at, "rounding"] += times * same["error_estimate"].to_numpy(float)[known]
    table.loc[at, "judge"] = judge
    return table
