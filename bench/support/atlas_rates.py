"""How many scenes have no answer though there is one, from samples, with confidence limits."""

import numpy as np
import pandas as pd
from scipy.stats import beta

from support.atlas_failures import NOT_TRIED

CONFIDENCE = 0.95
STRATUM = ["kind", "cause", "rubs"]


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


def existing(table: pd.DataFrame, tried: pd.DataFrame) -> pd.DataFrame:
    """For each cause, with friction and without: the failed rows; those tried again; those that
    the package itself solves with other settings; those of the rest that others were asked for and
    for which they know an equilibrium; and how many of 10,000 scenes that stands for, with limits.

    Samples were drawn of each kind and cause; each row stands for as many as there are of those.
    """
    failed = table[table["cause"] != ""].assign(rubs=table["friction.mu"] > 0.0)
    size = failed.groupby(STRATUM).size()
    tried = tried.assign(
        rubs=tried["friction.mu"] > 0.0,
        ours=tried["solved_by"].str.contains("=", regex=False),
        asked=~tried["solved_by"].str.contains("=", regex=False)
        & (tried["solved_by"] != NOT_TRIED),
    )
    tried["theirs"] = tried["asked"] & (tried["solved_by"] != "")
    rows = []
    for (rubs, cause), part in tried.groupby(["rubs", "cause"]):
        strata = pd.MultiIndex.from_frame(part[STRATUM])
        taken = part.groupby(STRATUM).agg(tried=("ours", "size"), asked=("asked", "sum"),
                                          ours=("ours", "sum"))  # fmt: skip
        weight = (size / taken["tried"]).reindex(strata).to_numpy()
        more = ((taken["tried"] - taken["ours"]) / taken["asked"]).reindex(strata).to_numpy()
        asked = part["asked"].to_numpy()
        number = int((failed["cause"].eq(cause) & failed["rubs"].eq(rubs)).sum())
        ours = _rate(part["ours"].to_numpy(), weight)
        left = float(weight[~part["ours"]].sum() / weight.sum())
        theirs = _rate(part["theirs"].to_numpy()[asked], (weight * more)[asked])
        unit = 1e4 * number / len(table)
        named = part.assign(rank=2 * part["ours"] + part["theirs"])
        named = named.sort_values("rank", ascending=False, kind="stable")
        rows.append(
            {
                "cause": cause,
                "friction": "μ > 0" if rubs else "μ = 0",
                "failed": number,
                "tried": len(part),
                "ours": int(part["ours"].sum()),
                "asked": int(asked.sum()),
                "theirs": int(part["theirs"].sum()),
                **dict(zip(("rate_ours", "low_ours", "high_ours"), unit * ours, strict=True)),
                **dict(zip(("rate_theirs", "low_theirs", "high_theirs"), unit * left * theirs,
                           strict=True)),
                "named": ", ".join((named["kind"] + " " + named["index"].astype(str))[:4]),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def _rate(hits: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The weighted share of hits (n,) and its limits (3,)."""
    if not len(hits):
        return np.zeros(3)
    share = float(weight[hits].sum() / weight.sum())
    size = float(weight.sum() ** 2 / (weight**2).sum())
    return np.array([share, *clopper_pearson(share, size)])
