"""Scenes that have no answer though there is one, kept as test cases: tests/unsolved.csv.

Each run judges what the file lists anew: what has an answer by now leaves it, what still has none
stays, with its cause of today. The default tests take a few of each kind.
"""

from zlib import crc32

import pandas as pd

from support import ROOT, atlas_causes, atlas_runs, atlas_truth, atlas_verdicts
from support.atlas_rates import ELSEWHERE, MISSING, verdicts
from support.atlas_store import Piece, extremes

FILE = ROOT / "tests" / "unsolved.csv"
COLUMNS = ["kind", "index", "cause", "known"]
MOST = 6
"""New ones of a kind and cause in one run."""
UNSOLVED, TRUE, WRONG = "still without an answer", "solved, and true", "wrong in silence"
KNOWN = {
    MISSING: "the branch from first touch goes on: SLSQP in small steps",
    ELSEWHERE: "behind a snap: SLSQP in small steps",
}


def pieces(kinds: tuple[str, ...], tried: pd.DataFrame) -> list[Piece]:
    """What the file lists of these kinds, and what is new, to be judged."""
    both = pd.concat([pd.read_csv(FILE), new_cases(tried)]).drop_duplicates(["kind", "index"])
    parts = [(kind, both[both["kind"] == kind]) for kind in kinds]
    return [
        Piece(f"listed-{kind}-{crc32(part.to_csv().encode()):x}", again, (kind, part))
        for kind, part in parts
        if len(part)
    ]


def new_cases(tried: pd.DataFrame) -> pd.DataFrame:
    """Scenes without friction that have no answer though there is one, of what was tried."""
    new = tried.assign(verdict=verdicts(tried))[tried["friction.mu"].eq(0.0)]
    new = new[new["verdict"].isin(KNOWN)]
    by_settings = new["solved_by"].str.contains("=", regex=False)
    new = new.assign(known=new["solved_by"].where(by_settings, new["verdict"].map(KNOWN)))
    return new.groupby(["kind", "cause"], sort=False).head(MOST)[COLUMNS]


def again(kind: str, listed: pd.DataFrame) -> pd.DataFrame:
    """Scenes of a kind with what has become of each, and its cause of today (if unsolved)."""
    rows = atlas_runs.chosen(kind, listed["index"].to_numpy())
    last = atlas_causes.described(kind, atlas_runs.last_rows(rows)).set_index("index")
    wrong = set(wrong_rows(kind, rows)["index"])
    found = listed.set_index("index")
    found["cause"] = last["cause"].where(last["cause"] != "", found["cause"])
    found["now"] = last["cause"].ne("").map({True: UNSOLVED, False: TRUE})
    found.loc[list(wrong), "now"] = WRONG
    return found.reset_index()[[*COLUMNS, "now"]]


def wrong_rows(kind: str, rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of scenes of a kind that are wrong in silence."""
    touching = (rows["status"] == "converged") & (rows["contacts"] > 0)
    found = [rows[:0]]
    for block, part in rows[touching].groupby(rows["index"] // extremes.BLOCK):
        part = part.reset_index(drop=True)
        if kind in extremes.JAW_KINDS:
            judged = atlas_truth.by_order(atlas_truth.shoot(kind, int(block), part))
        else:
            judged = atlas_truth.refine(part)
        found.append(atlas_verdicts.wrong_in_silence(judged))
    return pd.concat(found)


def keep(listed: pd.DataFrame) -> None:
    """Write the file: what is still without an answer. Those with rows wrong in silence are no test
    cases but defects, named in the report."""
    kept = listed[listed["now"] == UNSOLVED][COLUMNS].sort_values(["kind", "index"])
    kept.to_csv(FILE, index=False)
    print(f"{FILE.name}: {len(kept)} scenes")
