"""How many scenes have no answer though there is one, from samples, with confidence limits."""

import numpy as np
import pandas as pd
from scipy.stats import beta

from support.atlas_failures import CLEAR_CAUSES, SHOOTING
from support.atlas_follow import BEHIND, ENDS, REACHED, UNKNOWN

CONFIDENCE = 0.95
STRATUM = ["kind", "cause", "rubs"]
MISSING, ELSEWHERE, NOTHING, UNDECIDED = "missing", "elsewhere", "nothing", "undecided"
"""Verdicts: the path from the first touch leads to an answer; there is one behind a snap or, with
friction, on a branch that may be another; none was found; the judge gave up."""
ALL = "all"


def clopper_pearson(share: float, size: float) -> tuple[float, float]:
    """Limits of a proportion that was `share` of a sample of `size`, which need not be whole: of a
    weighted sample it is the effective one (Korn and Graubard 1998)."""
    tail, hits = 0.5 * (1.0 - CONFIDENCE), share * size
    low = beta.ppf(tail, hits, size - hits + 1.0) if hits > 0.0 else 0.0
    high = beta.ppf(1.0 - tail, hits + 1.0, size - hits) if hits < size else 1.0
    return float(low), float(high)


def upper(hits: int, size: int) -> float:
    """The upper limit of a proportion, of 10,000."""
    return 1e4 * clopper_pearson(hits / max(size, 1), size)[1] if size else 1e4


def limits(rate: float, low: float, high: float) -> str:
    """A rate with its limits, in words."""
    return f"{rate:.2g} ({low:.2g} to {high:.2g})"


def verdicts(tried: pd.DataFrame) -> pd.Series:
    """What each row that was tried again shows; empty: without friction, and not followed.

    What the package itself solves in smaller steps is missing, unless the finger snaps first.
    """
    ours = tried["solved_by"].str.contains("=", regex=False)
    said = tried["followed"].replace({ENDS: NOTHING, UNKNOWN: UNDECIDED, BEHIND: ELSEWHERE,
                                      REACHED: MISSING})  # fmt: skip
    sure = tried["friction.mu"].gt(0.0) | tried["cause"].isin(CLEAR_CAUSES)
    said = said.mask(sure, NOTHING).mask(tried["solved_by"] == SHOOTING, ELSEWHERE)
    return said.mask(ours & said.isin([NOTHING, UNDECIDED]), MISSING)


def existing(table: pd.DataFrame, tried: pd.DataFrame) -> pd.DataFrame:
    """For each cause, with friction and without, and for all together: the failed rows, those
    judged, how many of these have which verdict, and how many of 10,000 scenes those that are
    missing and those that are elsewhere stand for, with limits.

    Samples were drawn of each kind and cause; each row stands for as many as there are of those.
    """
    failed = table[table["cause"] != ""].assign(rubs=table["friction.mu"] > 0.0)
    judged = tried.assign(rubs=tried["friction.mu"] > 0.0, verdict=verdicts(tried))
    judged = judged[judged["verdict"] != ""]
    size = failed.groupby(STRATUM).size() / judged.groupby(STRATUM).size()
    weight = size.reindex(pd.MultiIndex.from_frame(judged[STRATUM])).to_numpy()
    judged = judged.assign(weight=weight)
    rows = []
    for rubs in (False, True):
        causes = sorted(judged.loc[judged["rubs"] == rubs, "cause"].unique())
        for cause in [*causes, ALL]:
            known = judged[judged["rubs"].eq(rubs) & (judged["cause"].eq(cause) | (cause == ALL))]
            these = failed["rubs"].eq(rubs) & (failed["cause"].eq(cause) | (cause == ALL))
            if len(known):
                rows.append(_line(cause, rubs, known, int(these.sum()), len(table)))
    return pd.DataFrame(rows)


def _line(
    cause: str, rubs: bool, known: pd.DataFrame, failed: int, scenes: int
) -> dict[str, object]:
    said = known["verdict"].to_numpy()
    line = {"cause": cause, "friction": "μ > 0" if rubs else "μ = 0", "failed": failed,
            "judged": len(known)}  # fmt: skip
    for verdict in (MISSING, ELSEWHERE, NOTHING, UNDECIDED):
        line[verdict] = int((said == verdict).sum())
        share = _rate(said == verdict, known["weight"].to_numpy())
        line[f"of_{verdict}"] = 1e4 * failed / scenes * share
    order = {MISSING: 0, ELSEWHERE: 1, UNDECIDED: 2, NOTHING: 3}
    named = known.iloc[np.argsort([order[one] for one in said], kind="stable")[:4]]
    return line | {"named": ", ".join(named["kind"] + " " + named["index"].astype(str))}


def _rate(hits: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The weighted share of hits (n,) and its limits (3,)."""
    share = float(weight[hits].sum() / weight.sum())
    size = float(weight.sum() ** 2 / (weight**2).sum())
    return np.array([share, *clopper_pearson(share, size)])
