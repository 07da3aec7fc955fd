"""The atlas's scenes by what is extreme about them: each range and each hard case by its name."""

from collections.abc import Callable

import extremes
import numpy as np
import pandas as pd

from support import atlas_verdicts

Columns = extremes.Columns
Choice = Callable[[Columns, Columns, pd.DataFrame], np.ndarray]
"""Which scenes (BLOCK,) have a feature, by their columns, by what else is known of them
(`extremes.drawn_jaws`), and by the deepest row of each."""


def _slenderness(columns: Columns) -> np.ndarray:
    return columns["finger.thickness"].max(axis=1) / columns["finger.length"]


def _taper(columns: Columns) -> np.ndarray:
    return columns["finger.thickness"][:, 1] / columns["finger.thickness"][:, 0]


def _modes(columns: Columns, *orders: int) -> np.ndarray:
    return np.isin(columns["solver.order"].astype(str), [str(order) for order in orders])


def _corners(columns: Columns) -> np.ndarray:
    return np.array([len(corners) for corners in columns["target.vertices"]])


BOTH: dict[str, Choice] = {
    "E below 1 Pa": lambda c, d, r: c["finger.young"] < 1.0,
    "E above 1e12 Pa": lambda c, d, r: c["finger.young"] > 1e12,
    "L below 10 µm": lambda c, d, r: c["finger.length"] < 1e-5,
    "L above 100 m": lambda c, d, r: c["finger.length"] > 1e2,
    "w/L below 1e-4": lambda c, d, r: _slenderness(c) < 1e-4,
    "w/L above 0.2": lambda c, d, r: _slenderness(c) > 0.2,
    "tip thinner than a 100th of the clamp": lambda c, d, r: _taper(c) < 1e-2,
    "tip thicker than 100 times the clamp": lambda c, d, r: _taper(c) > 1e2,
    "grazing: depth below 1e-6 L": lambda c, d, r: d["depth"] < 1e-6,
    "one jump, deeper than 0.1 L": lambda c, d, r: (c["path.steps"] == 2) & (d["depth"] > 0.1),
    "gap of 0 (1e-5 L) at the start": lambda c, d, r: d["gap"] < 1e-5,
    "gap of more than 100 L at the start": lambda c, d, r: d["gap"] > 1e2,
    "tip turned by 90° to 150°": lambda c, d, r: _turned(r, d, 90.0, 150.0),
    "tip turned by more than 150°": lambda c, d, r: _turned(r, d, 150.0, np.inf),
}
JAWS: dict[str, Choice] = BOTH | {
    "order 2 or 3": lambda c, d, r: _modes(c, 2, 3),
    "order 20 or 32": lambda c, d, r: _modes(c, 20, 32),
    "jaw's corner met head-on (to 1e-6)": lambda c, d, r: d["from_corner"] < 1e-6,
    "corner on corner: two pairs, one constraint": lambda c, d, r: (
        (d["from_corner"] < 1e-10) & ("target.radius" not in c)
    ),
    "several contacts": lambda c, d, r: r["contacts"].to_numpy() > 1,
    "μ from 0.8 of what locks to locking": lambda c, d, r: (
        (d["of_locking"] > 0.8) & (d["of_locking"] <= 1.0)
    ),
    "μ above what locks": lambda c, d, r: d["of_locking"] > 1.0,
}
SIDES: dict[str, Choice] = BOTH | {
    "N of 4 or 7": lambda c, d, r: c["solver.intervals"].astype(int) < 10,
    "N of 2,000 or 10,000": lambda c, d, r: c["solver.intervals"].astype(int) >= 2000,
    "tip met head-on (place 0.98 to 1.02 L)": lambda c, d, r: np.abs(d["place"] - 1.0) < 0.02,
    "slender ellipse, 1 to 30 and more": lambda c, d, r: (
        np.ptp(np.log(np.array(c["target.semi_axes"], dtype=float)), axis=1) > np.log(30.0)
        if "target.semi_axes" in c
        else np.zeros(len(c["path.steps"]), dtype=bool)
    ),
    "corners of a triangle or square": lambda c, d, r: (
        _corners(c) < 5 if "target.vertices" in c else np.zeros(len(c["path.steps"]), dtype=bool)
    ),
    "nearly dependent: half of the nodes touch": lambda c, d, r: (
        r["contacts"].to_numpy() >= 0.5 * c["solver.intervals"].astype(int)
    ),
    "nearly dependent: points on the target": lambda c, d, r: (
        c["solver.contact"] == "points-on-target"
    ),
    "printed section ψ + γ": lambda c, d, r: c["model.section"] == "psi+gamma",
    "μ above 0.5": lambda c, d, r: c["friction.mu"] > 0.5,
}


def _turned(rows: pd.DataFrame, drawn: Columns, low: float, high: float) -> np.ndarray:
    """Whether the tip has turned from the undeformed finger by more than low and up to high
    degrees."""
    turn = np.degrees(np.abs(rows["tip_angle_rad"].to_numpy(dtype=float) - drawn.get("base", 0.0)))
    return (turn > low) & (turn <= high)


def tally(table: pd.DataFrame, judged: pd.DataFrame) -> pd.DataFrame:
    """For each feature the scenes of the bulk (one row each), those that end without an answer, and
    of those that were judged the rows that are wrong."""
    side = table["kind"].iat[0] in extremes.SIDE_KINDS
    choices = SIDES if side else JAWS
    draw = extremes.drawn_sides if side else extremes.drawn_jaws
    wrong = pd.concat([atlas_verdicts.wrong_in_silence(judged), atlas_verdicts.unanswered(judged)])
    has: dict[str, list[pd.DataFrame]] = {name: [] for name in choices}
    for (kind, block), rows in table.groupby(["kind", table["index"] // extremes.BLOCK]):
        rows = rows.sort_values("index")
        columns, drawn = draw(str(kind), int(block))
        case = rows["index"].to_numpy() % extremes.BLOCK
        columns = {name: column[case] for name, column in columns.items()}
        drawn = {name: column[case] for name, column in drawn.items()}
        for name, choice in choices.items():
            has[name].append(rows[np.asarray(choice(columns, drawn, rows), dtype=bool)])
    found = []
    for name, parts in has.items():
        some = pd.concat(parts)
        failed, rubs = some["cause"] != "", some["friction.mu"] > 0.0
        mine = pd.MultiIndex.from_frame(some[["kind", "index"]])
        found.append(
            {
                "feature": name,
                "scenes": len(some),
                "converged": int((some["status"] == "converged").sum()),
                "no_contact": int((some["status"] == "no_contact").sum()),
                "failed_smooth": int((failed & ~rubs).sum()),
                "failed_rubbing": int((failed & rubs).sum()),
                "judged": int(_among(judged[judged["found"]], mine)),
                "wrong": int(_among(wrong, mine)),
                "overlaps": int(some["overlaps"].sum()),
            }
        )
    return pd.DataFrame(found)


def _among(rows: pd.DataFrame, scenes: pd.MultiIndex) -> int:
    return int(pd.MultiIndex.from_frame(rows[["kind", "index"]]).isin(scenes).sum())
